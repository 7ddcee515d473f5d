//! `results/gate.md`.

use std::fmt::Write;

use super::Study;
use super::shapes::{Held, Shapes};

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
    page.push_str(&what_seeds_decide(s));
    if let Some(shapes) = &study.shapes {
        page.push_str(&of_shapes(shapes));
    }
    let Some(real) = &study.real else { return page };
    write!(
        page,
        "\n## Real runs\n\nThe default scenario with the clips {} and `{}`: {} repetitions, each with {} seeds of its own for \
         the baseline, gated at {} of `humaneva_mm`. The wrong limbs are a defect of the tracker: the set is the same, its body is not. \
         Verdicts are of the whole gate (budget, coverage, lost tracks, metrics of the truth). They were made when the interval of ten \
         seeds of other numbers was a bootstrap; it is Welch's now, which differs little where errors are not skewed.\n\n\
         | tracker | change | PASS | FAIL | INCONCLUSIVE | worse by, mm: mean (least to greatest) | error, mm |\n\
         |---|---|--:|--:|--:|--:|--:|\n",
        real.clips.join(", "),
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
    page.push_str(
        "\nThe tracker has the actor's own body, so wrong limbs are worse for certain. Fewer particles need not harm a \
         refined filter: a change is a regression only where the mean of *worse by* is above the margin. Where runs differ \
         much from seed to seed, as those of the printed filter do, ten seeds leave most questions open, and the gate says \
         INCONCLUSIVE and how many seeds would settle it.\n",
    );
    page
}

/// Normal quantiles: 97.5 % for the interval's end, 80 % for the power.
const END: f64 = 1.960;
const POWER: f64 = 0.842;

/// The arithmetic of power: what these rows must show, and how many seeds a question needs.
fn what_seeds_decide(s: &super::simulated::Simulated) -> String {
    let frames = s.frames as f64;
    // the variance of a mean of correlated frames
    let of_frames = s.frame_sd_mm.powi(2) * (1.0 + s.frame_correlation) / (1.0 - s.frame_correlation) / frames;
    let run = (s.seed_sd_mm.powi(2) + of_frames).sqrt();
    let needed = |sd: f64| (2.0 * (END + POWER).powi(2) * sd.powi(2) / s.margin_mm.powi(2)).ceil();
    // Student's t of 18 degrees of freedom: 2.101 and 0.862
    let bearable = s.margin_mm / ((2.101 + 0.862) * (2.0_f64 / 10.0).sqrt());
    let seen = (2.101 + 0.862) * run * (2.0_f64 / 10.0).sqrt();
    format!(
        "\n## How many seeds a question needs\n\nA run's mean has a standard deviation of sqrt({}^2 + {of_frames:.2}) = {run:.2} mm here: the seed's own \
         and that of the mean of {} correlated frames. Two sides of n runs each (clips x seeds) have a difference with the standard error \
         {run:.2} sqrt(2 / n) mm. A tracker that is worse by twice the margin fails in 80 % of the cases if the margin, {} mm, is at least \
         ({END} + {POWER}) standard errors, so for\n\n    n >= 2 ({END} + {POWER})^2 {run:.2}^2 / {}^2 = {:.0} runs a side\n\n\
         which is 6 clips x 9 seeds, as the rows of 6 x 10 seeds show. **Ten seeds of one clip cannot give a power of 80 % at this noise**, by \
         arithmetic and not for want of a better test: they do so for runs with a standard deviation of at most {bearable:.1} mm, and at this noise \
         they find in 80 % of the cases what is worse by {seen:.1} mm more than the margin. With only the seeds' own noise of {} mm one clip needs \
         {:.0} seeds. Seeds that pair, with errors of their own correlated by 0.5, need {:.0} runs a side. The gate says INCONCLUSIVE in between, and how many seeds \
         would settle it.\n",
        s.seed_sd_mm,
        s.frames,
        s.margin_mm,
        s.margin_mm,
        needed(run),
        s.seed_sd_mm,
        needed(s.seed_sd_mm),
        needed((0.5 * s.seed_sd_mm.powi(2) + of_frames).sqrt()),
    )
}

fn percent(share: f64) -> String {
    format!("{:.1} %", 100.0 * share)
}

/// Skewed errors and mixtures, pairs, and clips.
fn of_shapes(shapes: &Shapes) -> String {
    let mut page = format!(
        "\n## Errors that are not normal\n\nBoth sides have errors of one shape and one mean, or the run is worse by exactly the margin: \
         {} repetitions a row, {} of the bootstraps. *Covered*: intervals that hold the true difference (nominal 95 %). *Passes*: what is \
         worse by exactly the margin passes (nominal 2.5 %). *Fails*: it fails (nominal 2.5 %). *p*: two-sided p values below 5 % of equal \
         sides. Normal: mean 40, standard deviation 4. Log-normal: median 40, 0.5. Exponential: mean 40. One in ten lost: log-normal about \
         40 (0.1), one in ten about 300 (0.3).\n\n\
         | errors | seeds | sides | covered | passes | fails | p |\n|---|--:|---|--:|--:|--:|--:|\n",
        shapes.repetitions, shapes.resampled
    );
    let (one_sided, both): (Vec<_>, Vec<_>) = shapes.rows.iter().partition(|row| row.sides == "one side varies");
    let held = |held: &Held| [held.covered, held.wrong_passes, held.wrong_fails].map(percent).join(" | ");
    for row in &both {
        let p = percent(row.p_below_5_percent);
        writeln!(page, "| {} | {} | {} | {} | {p} |", row.shape, row.seeds, row.sides, held(&row.now)).ok();
    }
    let worst = both.iter().map(|row| row.now.wrong_passes).fold(0.0, f64::max);
    let least = both.iter().map(|row| row.now.covered).fold(1.0, f64::min);
    let contradictions = shapes.rows.iter().map(|row| row.contradictions).fold(0.0, f64::max);
    write!(
        page,
        "\nStudent's t of the pairs and Welch's t of other seeds, at any number of seeds: at least {} covered, at most {} wrong passes. \
         They are SciPy's `ttest_rel` and `ttest_ind(equal_var=False)`, interval and p value of one test: {} of the intervals contradict \
         their p value.\n\n\
         Rules that were not chosen, on the same pairs (covered, passes). The BCa bootstrap is what was used from ten seeds on:\n\n\
         | errors | seeds | Student's t | BCa | Johnson's t | studentised bootstrap |\n|---|--:|--:|--:|--:|--:|\n",
        percent(least),
        percent(worst),
        percent(contradictions)
    )
    .ok();
    let short = |held: &Held| format!("{}, {}", percent(held.covered), percent(held.wrong_passes));
    let rules = |row: &super::shapes::ShapeRow| {
        [Some(row.now), row.bca, row.johnson, row.studentised].map(|held| held.as_ref().map(short).unwrap_or_default())
    };
    for row in both.iter().filter(|row| row.sides == "paired") {
        writeln!(page, "| {} | {} | {} |", row.shape, row.seeds, rules(row).join(" | ")).ok();
    }
    page.push_str(
        "\n### Where one side alone varies\n\nThe base is a known number (a tracker without random numbers), so the difference is as skewed \
         as the run's errors. **No rule holds here**: of five runs of which one in ten is lost, 59 % show no lost one, and nothing in them \
         says that others are. A gate passes such a run. To see one lost run of one in ten with 97.5 % takes 35 runs, ln 0.025 / ln 0.9; \
         the line *lost_tracks* of the gate gives the range of the rate that its runs leave open. Skewed errors without lost tracks need \
         more seeds, or draws on both sides. Covered, passes:\n\n\
         | errors | seeds | Student's t | BCa | Johnson's t | studentised bootstrap |\n|---|--:|--:|--:|--:|--:|\n",
    );
    for row in one_sided {
        writeln!(page, "| {} | {} | {} |", row.shape, row.seeds, rules(row).join(" | ")).ok();
    }
    page.push_str(
        "\n## Seeds that are shared in part\n\nPaired or not is decided by the number of shared seeds alone: three or more, and half or more \
         of those of the side with more. False alarms at 5 % with normal errors, whose seeds are correlated between the sides; beside it \
         those of the narrower interval of both, which was used before:\n\n\
         | seeds of both sides | shared | correlation | compared | false alarms | the narrower of both |\n|---|--:|--:|---|--:|--:|\n",
    );
    for row in &shapes.pairing {
        let how = if row.paired { "paired" } else { "unpaired" };
        let [alarms, narrower] = [row.alarms, row.narrower_alarms].map(percent);
        let (base, other) = (row.base, row.other);
        writeln!(page, "| {base}, {other} | {} | {} | {how} | {alarms} | {narrower} |", row.shared, row.between_sides)
            .ok();
    }
    page.push_str(
        "\nSeeds that are shared but not paired make a test too careful, where they are correlated.\n\n\
         ## What seeds of few clips say about motions\n\nTwo trackers are equal over all motions, and differ by 3 mm (standard deviation) from \
         motion to motion; seeds of a motion by 1 mm. False alarms about all motions at 5 %, of intervals over seeds within the clips and \
         over clips:\n\n\
         | clips x seeds | over seeds | over clips |\n|---|--:|--:|\n",
    );
    for row in &shapes.clips {
        let over_clips = row.over_clips.map_or_else(|| "none".to_owned(), percent);
        writeln!(page, "| {} x {} | {} | {over_clips} |", row.clips, row.seeds, percent(row.over_seeds)).ok();
    }
    page.push_str(
        "\nIntervals over seeds are right about these clips, on which the trackers do differ, and say nothing about others. Hence compare \
         takes clips as its unit from three on, the gate, which guards the clips of its baseline, only where it is told to or seeds do not \
         vary, and both say over what their intervals run.\n",
    );
    page
}
