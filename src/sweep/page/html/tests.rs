use serde_json::json;

use super::*;
use crate::evaluation::find_metric;
use crate::sweep::summary::SweepSummary;

/// Three particle counts by two numbers of layers; more of either is better.
pub(in super::super) fn grid() -> SweepPageInput {
    let mut settings = Vec::new();
    for (p, particles) in [50, 100, 200].into_iter().enumerate() {
        for (l, layers) in [1, 5].into_iter().enumerate() {
            let value = 90.0 - 20.0 * p as f64 - 15.0 * l as f64;
            let index = settings.len() * 3;
            let cell = |seed: usize| CellSummary {
                index: index + seed,
                cell: index.to_string(),
                seed: seed as u64,
                status: Some(if value > 80.0 && seed == 0 { Status::Diverged } else { Status::Ok }),
                report: seed == 1,
                report_folder: index.to_string(),
                ..CellSummary::default()
            };
            let serde_json::Value::Object(axes) = json!({ "layers": layers, "particles": particles }) else {
                unreachable!("an object")
            };
            settings.push(SettingSummary {
                axes,
                labels: vec![layers.to_string(), particles.to_string()],
                values: [value - 1.0, value, value + 1.0].map(Some).to_vec(),
                mean: Some(value),
                evaluations_per_frame: Some(f64::from(particles * layers)),
                processor_ms_per_frame: Some(0.1 * f64::from(particles * layers)),
                frozen: Some(200.0),
                diverged: usize::from(value > 80.0),
                cells: (0..3).map(cell).collect(),
                ..SettingSummary::default()
            });
        }
    }
    let axes = vec!["layers".to_owned(), "particles".to_owned()];
    SweepPageInput {
        draws: false,
        summary: SweepSummary {
            remarks: Vec::new(),
            schema: "skiagraph.sweep_summary/1",
            name: "planted".to_owned(),
            objective: "humaneva_mm".to_owned(),
            axes: axes.clone(),
            seeds: vec![0, 1, 2],
            cells: 18,
            missing: 0,
            settings,
        },
        axes,
        every: None,
        over: Vec::new(),
        description: "Errors that are known.".to_owned(),
        objective: find_metric("humaneva_mm").unwrap(),
        within: 5.0,
        command: "skiagraph sweep".to_owned(),
        facts: vec![("version".to_owned(), "0".to_owned())],
    }
}

#[test]
fn the_page_has_choice_map_curve_effects_failures_and_links() {
    let page = sweep_page(&grid()).unwrap();
    for words in [
        "the best is layers=5 particles=200 (35",
        "likelihood evaluations a frame",
        "Pareto front",
        "<td class=\"map\"",
        "layers x particles",
        "reports/0/report.html",
        "particles = 50",
        "diverged",
    ] {
        assert!(page.contains(words), "no {words:?}");
    }
    assert!(!page.contains("http://") || page.contains("www.w3.org"), "no network");
}

#[test]
fn a_sweep_of_programs_has_no_empty_plots_of_cost() {
    assert!(sweep_page(&grid()).unwrap().contains("<h2>Error against cost</h2>"));
    let mut of_programs = grid();
    for setting in &mut of_programs.summary.settings {
        (setting.evaluations_per_frame, setting.processor_ms_per_frame) = (None, None);
    }
    assert!(!sweep_page(&of_programs).unwrap().contains("Error against cost"));
}

#[test]
fn a_sweep_with_two_seeds_has_ranges_and_no_intervals() {
    let mut two = grid();
    two.summary.seeds.truncate(2);
    for setting in &mut two.summary.settings {
        setting.values.truncate(2);
        setting.mean = crate::evaluation::mean(&setting.present());
    }
    let page = sweep_page(&two).unwrap();
    assert!(!page.contains("95 % interval") && !page.contains("Welch"), "{page}");
    for words in ["34.0 to 35.0 over 2 seeds", "2 seeds give a range but no interval", "range over seeds"] {
        assert!(page.contains(words), "no {words:?}");
    }
    let text = crate::sweep::page::sweep_markdown(&two);
    assert!(!text.contains("95 % interval") && !text.contains("Welch"), "{text}");
    assert!(text.contains("34.0 to 35.0 over 2 seeds") && text.contains("| range over seeds |"), "{text}");
}

#[test]
fn the_page_of_very_many_settings_says_what_it_shows_and_stays_small() {
    let mut many = grid();
    many.axes = vec!["particles".to_owned()];
    many.summary.axes = many.axes.clone();
    let one = many.settings()[0].clone();
    let setting = |at: usize| SettingSummary {
        axes: serde_json::Map::from_iter([("particles".to_owned(), json!(at))]),
        labels: vec![at.to_string()],
        mean: Some(30.0 + at as f64),
        evaluations_per_frame: Some(1.0 + at as f64),
        cells: one.cells.iter().cycle().take(30).cloned().collect(),
        ..one.clone()
    };
    many.summary.settings = (0..20_000).map(setting).collect();
    let page = sweep_page(&many).unwrap();
    assert!(page.len() < 4_000_000, "{} bytes", page.len());
    for words in ["the 1000 best, then the 1000 worst, of 20000", "2000 of 20000 settings", "and 20 more", "runs.csv"] {
        assert!(page.contains(words), "no {words:?}");
    }
    let small = sweep_page(&grid()).unwrap();
    assert!(!small.contains("runs.csv") && !small.contains("evenly from the best"), "all is shown");
}

#[test]
fn an_averaged_axis_has_effects_but_is_not_chosen() {
    let mut averaged = grid();
    let of_clip = |clip: &str, more: f64| -> Vec<SettingSummary> {
        let one = |p: &SettingSummary| SettingSummary {
            labels: [vec![clip.to_owned()], p.labels.clone()].concat(),
            mean: p.mean.map(|mean| mean + more),
            ..p.clone()
        };
        averaged.settings().iter().map(one).collect()
    };
    let settings = [of_clip("walk", -40.0), of_clip("run", 40.0)].concat();
    let axes = ["clip", "layers", "particles"].map(str::to_owned).to_vec();
    averaged.every = Some(SweepSummary { axes, settings, ..averaged.summary.clone() });
    averaged.over = vec!["clip".to_owned()];
    let page = sweep_page(&averaged).unwrap();
    for words in ["means over all values of clip", "the best is layers=5 particles=200 (35", "80.0 mm", "clip = run"] {
        assert!(page.contains(words), "no {words:?}");
    }
}

#[test]
fn a_sweep_of_one_setting_and_one_without_a_result_have_pages() {
    let mut one = grid();
    one.summary.settings.truncate(1);
    one.summary.settings[0].values.truncate(1);
    assert!(sweep_page(&one).unwrap().contains("One seed cannot tell"));
    let labels = vec!["1".to_owned(), "50".to_owned()];
    one.summary.settings[0] = SettingSummary { labels, ..SettingSummary::default() };
    sweep_page(&one).unwrap();
    one.summary.settings.clear();
    assert!(sweep_page(&one).is_err());
}
