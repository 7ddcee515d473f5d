use super::*;
use crate::fixture::{Story, with_input};

fn page(story: &Story) -> String {
    with_input(story, |input| render(input).unwrap())
}

#[test]
fn a_page_shows_everything_and_needs_no_network() {
    let html = page(&Story { seeds: 5, title: "Walk <& talk>", shown: &[1, 24, 48, 72, 96, 120], ..Story::default() });
    assert!(html.starts_with("<!doctype html>") && html.trim_end().ends_with("</html>"));
    assert!(html.contains("Walk &lt;&amp; talk&gt;") && !html.contains("Walk <&"));
    assert_eq!(html.matches("data:image/png;base64,").count(), 1, "the contact sheet");
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
fn the_page_has_the_grade_its_limits_and_metrics_worse_than_never_moving() {
    let html = page(&Story { seeds: 2, lost_from: Some(60), ..Story::default() });
    for words in ["at most 50.0 mm", "at most 100.0 mm", "2 seeds: no interval", "Grade poor: "] {
        assert!(html.contains(words), "{words}");
    }
    assert!(html.contains("class=\"worse\""), "half of the clip a metre away is worse than standing still");
    let bare = page(&Story { layers: 0, energies: false, frozen: false, ..Story::default() });
    assert!(bare.contains("1 seed: no interval") && !bare.contains("data:image/png"), "one seed without pictures");
    assert!(!bare.contains("class=\"worse\""));
}

#[test]
fn lines_that_need_energies_are_absent_without_them_and_no_value_reads_none() {
    let without = page(&Story { energies: false, layers: 0, shown: &[1], ..Story::default() });
    for words in ["Energy gap</th>", "Better fit to the images"] {
        assert!(!without.contains(words), "{words}");
    }
    let visible: String = without.split("<script").map(|part| part.rsplit("</script>").next().unwrap()).collect();
    for words in ["None", "null", "undefined"] {
        assert!(!visible.contains(words), "{words}");
    }
    let with = page(&Story { shown: &[1], ..Story::default() });
    assert!(with.contains("Energy gap</th>") && with.contains("Better fit to the images"));
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
        include_str!("../difference_page.html"),
        include_str!("../../../../src/bound/bound.html"),
        include_str!("../../../../src/sweep/page/page.html"),
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
    let [error, lost] = ["HumanEva 3-D error", "Frames with a marker over 150 mm off"].map(|t| rows.find(t).unwrap());
    assert!(error < lost && !rows[error..lost].contains("PCK"), "the row below");
}

#[test]
fn a_report_without_runs_is_an_error() {
    let nothing = with_input(&Story::default(), |input| render(&ReportInput { runs: &[], ..*input }).is_err());
    assert!(nothing);
}

#[test]
fn matched_body_is_marked() {
    assert!(page(&Story { matched: true, ..Story::default() }).contains("optimistic bound"));
    assert!(!page(&Story { matched: false, ..Story::default() }).contains("optimistic bound"));
}
