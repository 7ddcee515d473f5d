//! `results/gate.md`.

use std::fmt::Write;

use super::Study;

pub(crate) fn render(study: &Study) -> String {
    let mut page = String::from("# How far the regression gate can be trusted\n\n");
    let s = &study.simulated;
    write!(
        page,
        "Made by `cargo run --release --example studies -- gate`; all digits are in `gate.json`.\n\n## Simulated runs\n\nRuns whose true \
         difference is known: every seed has an error of its own (standard deviation {} mm), every run {} frames with \
         {} mm about it, correlated from frame to frame by {}. {} repetitions a row, so a share of 5 % is known to within \
         a point. *Paired*: both sides have the same seeds; their own errors are correlated by the number behind it. The \
         margin is {} mm.\n\n\
         | clips x seeds | sides | interval holds the difference | no difference: fails at margin 0 | fails | passes | \
         worse by the margin: fails | passes | worse by twice the margin: fails | passes | t test over frames alarms |\n\
         |---|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n",
        s.seed_sd_mm, s.frames, s.frame_sd_mm, s.frame_correlation, s.repetitions, s.margin_mm
    )
    .ok();
    for row in &s.rows {
        let sides = if row.paired { format!("paired, {}", row.between_sides) } else { "other seeds".to_owned() };
        let shares = [
            row.covered,
            row.null_fails_at_0,
            row.null_fails_at_margin,
            row.null_passes,
            row.at_margin_fails,
            row.at_margin_passes,
            row.twice_fails,
            row.twice_passes,
            row.frames_test_alarms,
        ];
        let shares = shares.map(|share| format!("{:.1} %", 100.0 * share)).join(" | ");
        writeln!(page, "| {} x {} | {sides} | {shares} |", row.clips, row.seeds).ok();
    }
    page.push_str(
        "\nA test over frames, which are correlated, alarms at most pairs of equal trackers: hence the unit is the run. What \
         neither passes nor fails is inconclusive.\n",
    );
    let Some(real) = &study.real else { return page };
    write!(
        page,
        "\n## Real runs\n\nThe default scenario with `{}`: {} repetitions, each with {} seeds of its own for the baseline, \
         gated at {} of `humaneva_mm`. The wrong limbs are a defect of the tracker: the set is the same, its body is not. \
         Verdicts are of the whole gate (budget, coverage, lost tracks, metrics of the truth).\n\n\
         | tracker | change | PASS | FAIL | INCONCLUSIVE | worse by, mm: mean (least to greatest) | error, mm |\n\
         |---|---|--:|--:|--:|--:|--:|\n",
        real.overrides.join(" "),
        real.repetitions,
        real.seeds,
        real.margin
    )
    .ok();
    for row in &real.rows {
        let count = |verdict: &str| row.verdicts.iter().filter(|(found, _)| found == verdict).count();
        let worse: Vec<f64> = row.verdicts.iter().map(|(_, worse)| *worse).collect();
        let mean = worse.iter().sum::<f64>() / worse.len() as f64;
        let (least, greatest) =
            worse.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), w| (low.min(*w), high.max(*w)));
        writeln!(
            page,
            "| {} | {} | {} | {} | {} | {mean:.1} ({least:.1} to {greatest:.1}) | {:.1} |",
            row.tracker,
            row.change,
            count("PASS"),
            count("FAIL"),
            count("INCONCLUSIVE"),
            row.mean_error_mm
        )
        .ok();
    }
    page
}
