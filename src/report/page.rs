//! The page of a run.

use serde::Serialize;

use crate::evaluation::{Direction, METRICS, Metric, SeedRun, Unit, find_metric};

use super::contact_sheet::{SheetPicture, cells, seconds, worst_cell};
use super::displayed::{between, describe_interval, number, symbol};
use super::drawing::encoded;
use super::figures::{Figure, figures, per_frame};
use super::html::{in_page, render_page};
use super::input::{FactGroup, worst_frames};
use super::metric_groups::{GROUPS, MetricGroup, aliases};
use super::page_tables::{BreakdownTable, CameraRow, breakdown_tables, camera_rows};
use super::playback::playback_data;
use super::plots::hex;
use super::verdict::{Verdict, verdict};
use super::{Playback, ReportError, ReportInput, Sheet, SheetFrame, Shown, base64, cell, overlay, typical_run};

const TEMPLATE: &str = include_str!("page.html");
const SCRIPT: &str = concat!(include_str!("page.js"), include_str!("playback.js"));

/// The headline metrics.
const HEADLINES: [&str; 7] =
    ["humaneva_mm", "lost_limb", "pa_mpjpe_mm", "body_orientation_deg", "silhouette_iou", "track_loss", "coverage"];

#[derive(Serialize)]
struct RunPage<'a> {
    script: &'static str,
    title: &'a str,
    tracker: &'a str,
    matched: bool,
    seeds: usize,
    hint: Option<&'a str>,
    verdict: Verdict,
    headlines: Vec<Headline>,
    /// The data for the script, as JSON escaped for a page.
    playback: Option<String>,
    sheet: Option<SheetOnPage<'a>>,
    figures: Vec<Figure>,
    search_figures: Vec<Figure>,
    cameras: Vec<CameraRow<'a>>,
    /// Whether the estimate has poses, whose silhouettes can be compared.
    cameras_have_poses: bool,
    breakdown: Vec<BreakdownTable<'a>>,
    metrics: Vec<GroupOnPage>,
    absent: Vec<AbsentRow<'a>>,
    has_frozen: bool,
    any_worse: bool,
    interval: &'a str,
    worst: Vec<WorstRow<'a>>,
    worst_have_overlap: bool,
    worst_have_gap: bool,
    facts: &'a [FactGroup],
    this_run: &'a [(String, String)],
}

#[derive(Serialize)]
struct GroupOnPage {
    title: &'static str,
    about: &'static str,
    rows: Vec<MetricRow>,
    of_truth: Vec<MetricRow>,
}

#[derive(Serialize)]
struct Headline {
    value: String,
    unit: &'static str,
    /// The interval, or the reason why there is none.
    interval: String,
    title: &'static str,
    meaning: &'static str,
    worse: bool,
}

#[derive(Serialize)]
struct MetricRow {
    title: &'static str,
    name: &'static str,
    unit: &'static str,
    better: &'static str,
    meaning: &'static str,
    protocol: String,
    mean: String,
    interval: Option<String>,
    /// The rule of the interval, or the reason why there is none.
    rule: String,
    median: Option<String>,
    p90: Option<String>,
    max: Option<String>,
    coverage: String,
    frozen: Option<String>,
    /// Other names of the same values.
    also: Vec<&'static str>,
    /// Worse than a tracker that never moves.
    worse: bool,
}

#[derive(Serialize)]
struct AbsentRow<'a> {
    title: &'static str,
    name: &'static str,
    needs: &'a str,
}

#[derive(Serialize)]
struct WorstRow<'a> {
    seed: u64,
    frame: usize,
    time: String,
    error: String,
    overlap: Option<String>,
    gap: Option<String>,
    /// This seed in the camera with the lowest overlap.
    picture: Option<SheetCell<'a>>,
}

#[derive(Serialize)]
struct SheetOnPage<'a> {
    /// Whether any frame has a silhouette of the estimate.
    outlined: bool,
    /// Whether its pictures show the cameras' images.
    on_images: bool,
    colours: SheetColours,
    columns: Vec<SheetColumn<'a>>,
}

#[derive(Serialize)]
struct SheetColours {
    both: String,
    only_observed: String,
    only_estimated: String,
    /// Empty without props.
    props: String,
    truth: String,
    estimate: String,
}

#[derive(Serialize)]
struct SheetColumn<'a> {
    seed: u64,
    frame: usize,
    time: String,
    error: Option<String>,
    worst: bool,
    cells: Vec<SheetCell<'a>>,
}

#[derive(Serialize)]
struct SheetCell<'a> {
    camera: &'a str,
    /// Alternative text.
    alt: String,
    overlap: Option<String>,
    png: String,
}

/// The whole page: self-contained HTML with inline style, script, plots and pictures.
///
/// # Errors
/// [`ReportError`] without a run, if a sheet's frames do not fit its cameras, or if a plot or picture cannot be drawn.
pub fn render(input: &ReportInput<'_>) -> Result<String, ReportError> {
    let runs: Vec<SeedRun<'_>> = input.runs.iter().map(|run| run.run).collect();
    let typical = typical_run(&runs).map(|index| &input.runs[index]).ok_or(ReportError::NoRun)?;
    let verdict = verdict(input);
    let worse = |name: &str| verdict.worse_than_frozen.iter().any(|worse| worse == name);
    let worst = worst_rows(input, &runs)?;
    let (search_figures, figures) = figures(input, typical)?.into_iter().partition(|figure| figure.about_search);
    let page = RunPage {
        script: SCRIPT,
        title: input.title,
        tracker: input.tracker,
        matched: input.matched,
        seeds: input.runs.len(),
        hint: input.hint,
        headlines: HEADLINES.iter().filter_map(|name| headline(input, name, worse(name))).collect(),
        sheet: input.sheet.map(|sheet| sheet_on_page(&runs, sheet)).transpose()?,
        playback: playback(input)?,
        figures,
        search_figures,
        cameras: camera_rows(input.summary),
        cameras_have_poses: input.summary.per_camera.iter().any(|camera| camera.overlap.is_some()),
        breakdown: breakdown_tables(&input.summary.breakdown),
        metrics: GROUPS
            .iter()
            .map(|group| group_on_page(input, group, &worse))
            .filter(|g| !g.rows.is_empty())
            .collect(),
        absent: METRICS.iter().filter_map(|metric| absent_row(input, metric)).collect(),
        has_frozen: input.frozen.is_some(),
        any_worse: !verdict.worse_than_frozen.is_empty(),
        interval: &input.summary.interval,
        worst_have_overlap: worst.iter().any(|row| row.overlap.is_some()),
        worst_have_gap: worst.iter().any(|row| row.gap.is_some()),
        worst,
        facts: input.facts,
        this_run: input.this_run,
        verdict,
    };
    render_page(TEMPLATE, &page)
}

fn headline(input: &ReportInput<'_>, name: &str, worse: bool) -> Option<Headline> {
    let (metric, definition) = (input.summary.metrics.get(name)?, find_metric(name)?);
    let (value, unit) = (number(metric.mean, metric.unit), symbol(metric.unit));
    let (title, meaning) = (definition.title, definition.meaning);
    Some(Headline { value, unit, interval: describe_interval(metric), title, meaning, worse })
}

/// The data of the frames, as JSON.
fn playback(input: &ReportInput<'_>) -> Result<Option<String>, ReportError> {
    let Some(sheet) = input.sheet.filter(|_| !input.playbacks.is_empty()) else { return Ok(None) };
    let of_seed = |playback: &Playback| {
        let shown = input.runs.iter().find(|run| run.run.seed == playback.seed);
        let errors = shown.map_or(&[][..], |run| per_frame(run.run.evaluation, "humaneva_mm"));
        playback_data(playback, (sheet.rig, sheet.frames_per_second), Some(errors))
    };
    in_page(&input.playbacks.iter().map(of_seed).collect::<Result<Vec<_>, _>>()?).map(Some)
}

fn group_on_page(input: &ReportInput<'_>, group: &MetricGroup, worse: &impl Fn(&str) -> bool) -> GroupOnPage {
    let aliases = aliases(input.summary);
    let row = |name: &&str| {
        let (metric, is_alias) = (find_metric(name)?, aliases.iter().any(|(_, alias)| alias == name));
        let mut row = metric_row(input, metric, worse(name)).filter(|_| !is_alias)?;
        row.also = aliases.iter().filter(|(shown, _)| shown == name).map(|(_, alias)| *alias).collect();
        Some(row)
    };
    GroupOnPage {
        title: group.title,
        about: group.about,
        rows: group.metrics.iter().filter_map(row).collect(),
        of_truth: group.of_truth.iter().filter_map(row).collect(),
    }
}

fn metric_row(input: &ReportInput<'_>, metric: &Metric, worse: bool) -> Option<MetricRow> {
    let summary = input.summary.metrics.get(metric.name)?;
    let show = |value: f64| number(value, metric.unit);
    Some(MetricRow {
        title: metric.title,
        name: metric.name,
        unit: symbol(metric.unit),
        better: match metric.direction {
            Direction::LowerIsBetter => "lower is better",
            Direction::HigherIsBetter => "higher is better",
            Direction::Neither => "a diagnosis",
        },
        meaning: metric.meaning,
        protocol: summary.protocol.clone(),
        mean: show(summary.mean),
        interval: summary.ci95.map(|ends| between(ends.low, ends.high, metric.unit)),
        rule: summary.interval.clone(),
        median: summary.spread.map(|spread| show(spread.median)),
        p90: summary.spread.map(|spread| show(spread.p90)),
        max: summary.spread.map(|spread| show(spread.max)),
        coverage: coverage(summary.coverage),
        frozen: input.frozen.and_then(|frozen| frozen.metrics.get(metric.name)).map(|value| show(value.mean)),
        also: Vec::new(),
        worse,
    })
}

fn absent_row<'a>(input: &ReportInput<'a>, metric: &Metric) -> Option<AbsentRow<'a>> {
    let needs = input.summary.absent.get(metric.name)?;
    Some(AbsentRow { title: metric.title, name: metric.name, needs })
}

/// A share as a percentage, rounded down: 100 means exactly all.
fn coverage(share: f64) -> String {
    format!("{:.1}", (1000.0 * share).floor() / 10.0)
}

/// Number of worst frames to list.
const WORST: usize = 10;

fn worst_rows<'a>(input: &ReportInput<'a>, runs: &[SeedRun<'_>]) -> Result<Vec<WorstRow<'a>>, ReportError> {
    worst_frames(runs, WORST).into_iter().map(|worst| worst_row(input, runs, worst)).collect()
}

fn worst_row<'a>(input: &ReportInput<'a>, runs: &[SeedRun<'_>], worst: Shown) -> Result<WorstRow<'a>, ReportError> {
    let SeedRun { seed, evaluation, .. } = runs[worst.run];
    let frame = worst.frame;
    let at = |metric: &str, unit| Some(number(per_frame(evaluation, metric).get(frame).copied().flatten()?, unit));
    Ok(WorstRow {
        seed,
        frame,
        time: format!("{:.2} s", frame as f64 / evaluation.frames_per_second),
        error: at("humaneva_mm", Unit::Millimetre).unwrap_or_default(),
        overlap: at("silhouette_iou", Unit::Fraction),
        gap: at("energy_gap", Unit::Energy),
        picture: input.sheet.map(|sheet| picture_of(sheet, seed, frame)).transpose()?.flatten(),
    })
}

/// The view of a worst frame with the lowest overlap, of the same seed.
fn picture_of<'a>(sheet: &'a Sheet<'a>, seed: u64, frame: usize) -> Result<Option<SheetCell<'a>>, ReportError> {
    let is_it = |shown: &&SheetFrame| (shown.seed, shown.frame) == (seed, frame);
    let Some(shown) = sheet.worst.iter().find(is_it) else { return Ok(None) };
    let Some((camera, view)) = worst_cell(sheet, shown)? else { return Ok(None) };
    sheet_cell(&sheet.rig.cameras[camera].name, shown, &view).map(Some)
}

fn sheet_cell<'a>(camera: &'a str, frame: &SheetFrame, view: &SheetPicture) -> Result<SheetCell<'a>, ReportError> {
    let overlap = view.overlap.map(|overlap| format!("{:.0} %", 100.0 * overlap));
    let findings = overlap.iter().map(|overlap| format!(", silhouettes overlap by {overlap}"));
    let findings = findings.chain(frame.error_mm().map(|error| format!(", mean marker error {error:.0} mm")));
    let findings: String = findings.collect();
    let alt = format!("{camera}, seed {}, frame {}: silhouettes and skeletons{findings}", frame.seed, frame.frame);
    Ok(SheetCell { camera, alt, overlap, png: base64::encode(&encoded(&view.picture)?) })
}

fn sheet_on_page<'a>(runs: &[SeedRun<'_>], sheet: &'a Sheet<'a>) -> Result<SheetOnPage<'a>, ReportError> {
    let worst = worst_frames(runs, 1).first().map(|worst| (runs[worst.run].seed, worst.frame));
    let mut columns = Vec::new();
    for (frame, views) in sheet.frames.iter().zip(cells(sheet)?) {
        let mut shown = Vec::new();
        for (view, camera) in views.iter().zip(&sheet.rig.cameras) {
            shown.push(sheet_cell(&camera.name, frame, view)?);
        }
        columns.push(SheetColumn {
            seed: frame.seed,
            frame: frame.frame,
            time: format!("{:.2} s", seconds(sheet, frame)),
            error: frame.error_mm().map(|error| format!("{error:.0} mm")),
            worst: worst == Some((frame.seed, frame.frame)),
            cells: shown,
        });
    }
    let colours = SheetColours {
        both: hex(cell::BOTH),
        only_observed: hex(cell::ONLY_OBSERVED),
        only_estimated: hex(cell::ONLY_ESTIMATED),
        props: if sheet.props.is_empty() { String::new() } else { hex(cell::PROP) },
        truth: hex(overlay::Whose::Truth.colour()),
        estimate: hex(overlay::Whose::Estimate.colour()),
    };
    let outlined = sheet.frames.iter().any(|frame| frame.estimated.is_some());
    let on_images = sheet.frames.iter().any(|frame| !frame.images.is_empty());
    Ok(SheetOnPage { outlined, on_images, colours, columns })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::fixture::{Story, with_input};

    fn page(story: &Story) -> String {
        with_input(story, |input| render(input).unwrap())
    }

    /// Set `SKIAGRAPH_REPORT_PAGE` to a path to look at the page in a browser.
    #[test]
    fn a_page_shows_everything_and_needs_no_network() {
        let html =
            page(&Story { seeds: 5, title: "Walk <& talk>", shown: &[1, 24, 48, 72, 96, 120], ..Story::default() });
        if let Some(path) = std::env::var_os("SKIAGRAPH_REPORT_PAGE") {
            std::fs::write(path, &html).unwrap();
        }
        assert!(html.starts_with("<!doctype html>") && html.trim_end().ends_with("</html>"));
        assert!(html.contains("Walk &lt;&amp; talk&gt;") && !html.contains("Walk <&"));
        assert_eq!(
            html.matches("data:image/png;base64,").count(),
            7 * 4 + 10,
            "six frames and the worst in four cameras, ten more of the worst in one each"
        );
        let outside = html.replace("http://www.w3.org/2000/svg", "");
        for reference in ["http:", "https:", "src=\"/", "@import", "<link"] {
            assert!(!outside.contains(reference), "the page refers to {reference}");
        }
        for heading in ["Error over time", "Error per joint", "Effective sample size", "Worst frames"] {
            assert!(html.contains(heading), "{heading}");
        }
        assert!(html.contains("frame 0 (the start pose) left out"), "protocols are on the page");
    }

    #[test]
    fn every_metric_has_its_sentence_below_its_name() {
        let story = Story { seeds: 3, ..Story::default() };
        with_input(&story, |input| {
            let html = render(input).unwrap();
            let shown_elsewhere: Vec<&str> = aliases(input.summary).into_iter().map(|(_, alias)| alias).collect();
            for name in input.summary.metrics.keys().filter(|name| !shown_elsewhere.contains(&name.as_str())) {
                let meaning = find_metric(name).unwrap().meaning.replace('\'', "&#x27;");
                assert!(html.contains(&format!("<small class=\"meaning\">{meaning}</small>")), "{name}: {meaning}");
            }
        });
    }

    #[test]
    fn one_seed_without_pictures_can_be_reported() {
        let html = page(&Story { layers: 0, energies: false, frozen: false, shown: &[], ..Story::default() });
        assert!(html.contains("1 seed: no interval") && !html.contains("data:image/png"));
    }

    #[test]
    fn every_one_of_the_worst_frames_has_the_picture_of_its_own_seed() {
        let seeds = with_input(&Story { seeds: 3, lost_from: Some(60), shown: &[1], ..Story::default() }, |input| {
            let runs: Vec<SeedRun<'_>> = input.runs.iter().map(|run| run.run).collect();
            let rows = worst_rows(input, &runs).unwrap();
            assert_eq!(rows.len(), 10);
            for row in &rows {
                let sheet = input.sheet.unwrap();
                let own = sheet.worst.iter().find(|f| (f.seed, f.frame) == (row.seed, row.frame)).unwrap();
                let (camera, view) = worst_cell(sheet, own).unwrap().unwrap();
                let picture = row.picture.as_ref().unwrap();
                assert_eq!(picture.png, base64::encode(&encoded(&view.picture).unwrap()));
                assert_eq!(picture.camera, sheet.rig.cameras[camera].name);
                assert_eq!(row.error, number(own.error_mm().unwrap(), Unit::Millimetre), "picture and error agree");
            }
            rows.iter().map(|row| row.seed).collect::<std::collections::BTreeSet<u64>>()
        });
        assert_eq!(seeds.len(), 3, "all seeds are lost alike: {seeds:?}");
    }

    #[test]
    fn the_page_has_the_grade_its_limits_and_metrics_worse_than_never_moving() {
        let html = page(&Story { seeds: 2, lost_from: Some(60), ..Story::default() });
        for words in ["at most 50 mm", "at most 100 mm", "at most 150 mm", "2 seeds: no interval", "Grade limited by"] {
            assert!(html.contains(words), "{words}");
        }
        assert!(html.contains("class=\"worse\""), "half of the clip a metre away is worse than standing still");
        assert!(!page(&Story { frozen: false, ..Story::default() }).contains("class=\"worse\""));
    }

    #[test]
    fn lines_that_need_energies_are_absent_without_them_and_no_value_reads_none() {
        let without = page(&Story { energies: false, layers: 0, shown: &[1], ..Story::default() });
        for words in ["Energy gap</th>", "class=\"cause\""] {
            assert!(!without.contains(words), "{words}");
        }
        let visible: String = without.split("<script").map(|part| part.rsplit("</script>").next().unwrap()).collect();
        for words in ["None", "null", "undefined"] {
            assert!(!visible.contains(words), "{words}");
        }
        let with = page(&Story { shown: &[1], ..Story::default() });
        assert!(with.contains("Energy gap</th>") && with.contains("class=\"cause\""));
    }

    #[test]
    fn the_slider_has_the_seed_of_the_worst_frame() {
        let (worst, seeds) = with_input(&Story { seeds: 5, shown: &[1, 60], ..Story::default() }, |input| {
            let runs: Vec<SeedRun<'_>> = input.runs.iter().map(|run| run.run).collect();
            let data: serde_json::Value = serde_json::from_str(&playback(input).unwrap().unwrap()).unwrap();
            let seeds = data.as_array().unwrap().iter().map(|one| one["seed"].as_u64().unwrap()).collect::<Vec<_>>();
            (runs[worst_frames(&runs, 1)[0].run].seed, seeds)
        });
        assert!(seeds.len() <= 2 && seeds.contains(&worst), "{worst}: {seeds:?}");
    }

    #[test]
    fn every_table_of_every_page_is_in_a_scrollable_box() {
        for template in [
            TEMPLATE,
            include_str!("comparison.html"),
            include_str!("difference_page.html"),
            include_str!("model_page.html"),
            include_str!("body_page.html"),
            include_str!("chart_page.html"),
            include_str!("../sweep/page/page.html"),
        ] {
            for before in template.match_indices("<table").map(|(at, _)| &template[..at]) {
                let inside = before.rfind("class=\"scroll\"").is_some_and(|at| !before[at..].contains("</div>"));
                assert!(inside, "{}", &before[before.len().saturating_sub(200)..]);
            }
        }
    }

    #[test]
    fn the_share_of_frames_with_a_lost_limb_follows_the_mean_error() {
        let html = page(&Story { wrist_lost_from: Some(80), ..Story::default() });
        assert!(html.contains("How often any marker is more than 150 mm off"));
        let rows = html.split("class=\"metrics\"").nth(1).unwrap();
        let [error, lost] =
            ["HumanEva 3-D error", "Frames with a marker over 150 mm off"].map(|t| rows.find(t).unwrap());
        assert!(error < lost && !rows[error..lost].contains("PCK"), "the row below");
    }

    #[test]
    fn a_metric_of_the_whole_clip_has_a_mean_and_no_spread() {
        let row = with_input(&Story::default(), |input| {
            metric_row(input, crate::evaluation::find_metric("lag_ms").unwrap(), false)
        });
        let row = row.unwrap();
        assert_eq!((row.median, row.p90, row.max), (None, None, None));
    }

    #[test]
    fn a_report_without_runs_is_an_error() {
        let nothing = with_input(&Story::default(), |input| render(&ReportInput { runs: &[], ..*input }).is_err());
        assert!(nothing);
    }

    #[test]
    fn a_matched_body_is_said_on_the_page() {
        assert!(page(&Story { matched: true, ..Story::default() }).contains("Matched body"));
        assert!(!page(&Story { matched: false, ..Story::default() }).contains("Matched body"));
    }
}
