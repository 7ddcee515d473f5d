//! Renders `results/gate.md`.

use std::fmt::Write;

use super::Study;
use super::shapes::{Held, Shapes};
use super::simulated::Row;

const MADE: &str =
    "\n## Method\n\nMade by `cargo run --release --example studies -- gate`; all digits are in `gate.json`.\n";

/// Text with the minimum and maximum of a share over rows.
fn range<'a>(rows: impl Iterator<Item = &'a Row>, of: fn(&Row) -> f64) -> String {
    let (low, high) = rows.map(of).fold((1.0, 0.0), |(low, high), share: f64| (share.min(low), share.max(high)));
    format!("{:.1} to {:.1} %", 100.0 * low, 100.0 * high)
}

pub(crate) fn render(study: &Study) -> String {
    let s = &study.simulated;
    let with = |clips: usize| s.rows.iter().filter(move |row| row.clips == clips && row.seeds == 10);
    let mut page = format!(
        "# Reliability of the regression gate\n\n\
         On simulated runs, the intervals cover the true difference in {} of the cases (nominal 95 %), and a tracker that is worse by exactly \
         the margin passes in {} (nominal 2.5 %). An unchanged tracker passes in {} with ten seeds of each of six clips, and in {} with \
         ten seeds of one clip; otherwise the answer is mostly inconclusive. If only one side varies and some runs lose the body, no rule \
         is reliable (below).\n\n",
        range(s.rows.iter(), |row| row.covered),
        range(s.rows.iter(), |row| row.at_margin_passes),
        range(with(6), |row| row.null_passes),
        range(with(1), |row| row.null_passes),
    );
    write!(
        page,
        "## Simulated runs\n\n\
         Runs with a known true difference. The seeds have errors with a standard deviation of {} mm; every run has {} frames with a \
         standard deviation of {} mm about the error of its seed, with a correlation of {} between successive frames. The margin is {} mm. Each \
         row has {} repetitions, so a share of 5 % is known to within one point. *Paired*: both sides have the same seeds; the \
         number is the correlation of the errors of a seed between the sides.\n\n\
         | clips x seeds | sides | interval covers the difference | no difference: fails at margin 0 | fails | passes | \
         worse by the margin: fails | passes | worse by twice the margin: fails | passes | t test over frames alarms |\n\
         |---|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n",
        s.seed_sd_mm, s.frames, s.frame_sd_mm, s.frame_correlation, s.margin_mm, s.repetitions
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
        "\nA test over frames gives false alarms for most pairs of equal trackers, because frames are correlated; \
        therefore the unit is the run. Cases that neither pass nor fail are inconclusive.\n",
    );
    page.push_str(&needed_seeds_section(s));
    if let Some(shapes) = &study.shapes {
        page.push_str(&shapes_section(shapes));
    }
    let Some(real) = &study.real else { return page + MADE };
    write!(
        page,
        "\n## Real runs\n\nThe default scenario with the clips {} and `{}`. There are {} repetitions, each with {} \
        separate seeds for the baseline, gated at {} of `humaneva_mm`. The wrong limbs are a defect of the tracker: \
        the set is the same, but the tracker's body is not. Verdicts are those of the whole gate (budget, coverage, \
        lost tracks, metrics of the truth). The interval for ten unpaired seeds was a bootstrap in these runs; Welch's, \
        which the gate now uses, differs little if errors are not skewed.\n\n\
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
        "\nThe tracker has the actor's own body, so wrong limbs are certain to be worse. Fewer particles need not \
        harm a refined filter: a change is a regression only if the mean of *worse by* is above the margin. If runs \
        vary much between seeds, as those of the printed filter do, ten seeds leave most questions open; the gate \
        says INCONCLUSIVE, and how many seeds would decide.\n",
    );
    page + MADE
}

/// Normal quantiles: 97.5 % for the interval's end, 80 % for the power.
const END: f64 = 1.960;
const POWER: f64 = 0.842;

/// The section on statistical power and the number of seeds needed.
fn needed_seeds_section(s: &super::simulated::Simulated) -> String {
    let frames = s.frames as f64;
    // the variance of a mean of correlated frames
    let of_frames = s.frame_sd_mm.powi(2) * (1.0 + s.frame_correlation) / (1.0 - s.frame_correlation) / frames;
    let run = (s.seed_sd_mm.powi(2) + of_frames).sqrt();
    let needed = |sd: f64| (2.0 * (END + POWER).powi(2) * sd.powi(2) / s.margin_mm.powi(2)).ceil();
    // Student's t of 18 degrees of freedom: 2.101 and 0.862
    let max_sd = s.margin_mm / ((2.101 + 0.862) * (2.0_f64 / 10.0).sqrt());
    let detectable = (2.101 + 0.862) * run * (2.0_f64 / 10.0).sqrt();
    format!(
        "\n## How many seeds a question needs\n\n\
        Here, the mean of a run has a standard deviation of sqrt({}^2 + {of_frames:.2}) = {run:.2} mm: that of the \
        seed and that of the mean of {} correlated frames. The difference of two sides with n runs each (clips x \
        seeds) has a standard error of {run:.2} sqrt(2 / n) mm. A tracker that is worse by twice the margin fails in \
        80 % of the cases if the margin, {} mm, is at least ({END} + {POWER}) standard errors, that is for\n\n    n \
        >= 2 ({END} + {POWER})^2 {run:.2}^2 / {}^2 = {:.0} runs a side\n\n\
        which is 6 clips x 9 seeds, in agreement with the rows of 6 x 10 seeds. **Ten seeds of one clip cannot give \
        a power of 80 % at this noise**, whatever the test. They reach it if runs have a standard deviation of at most \
        {max_sd:.1} mm or, at this noise, if the tracker is worse by the margin plus {detectable:.1} mm. With only the seeds' noise of {} mm, one clip needs {:.0} seeds. Paired seeds, with a \
        correlation of 0.5, need {:.0} runs a side. In between, the gate says INCONCLUSIVE, and how many more seeds \
        would decide.\n",
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

/// The sections on skewed errors and mixtures, on pairs, and on clips.
fn shapes_section(shapes: &Shapes) -> String {
    let mut page = format!(
        "\n## Errors that are not normal\n\n\
        Both sides have errors of the same distribution; either the means are equal, or the run is worse by exactly \
        the margin. Each row has {} repetitions (bootstraps {}). *Covered*: intervals that cover the true difference \
        (nominal 95 %). *Passes*: a run that is worse by exactly the margin passes (nominal 2.5 %). *Fails*: it \
        fails (nominal 2.5 %). *p*: two-sided p values below 5 % with equal sides. Normal: mean 40, standard \
        deviation 4. Log-normal: median 40, 0.5. Exponential: mean 40. One in ten lost: log-normal about 40 (0.1), \
        one in ten about 300 (0.3).\n\n\
        | errors | seeds | sides | covered | passes | fails | p |\n\
        |---|--:|---|--:|--:|--:|--:|\n",
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
        "\nStudent's t for pairs and Welch's t for other seeds, at any number of seeds: at least {} covered, at most \
        {} wrong passes. They equal SciPy's `ttest_rel` and `ttest_ind(equal_var=False)`. Interval and p value \
        belong to the same test: {} of the intervals contradict their p value.\n\n\
        Student's t and rules that were not chosen, on the same pairs (covered, passes):\n\n| errors | seeds | Student's t | BCa | Johnson's t | studentised bootstrap |\n\
        |---|--:|--:|--:|--:|--:|\n",
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
        "\n### If only one side varies\n\n\
        The baseline is a known number (a tracker without random numbers), so the difference is as skewed as the \
        run's errors. **No rule is reliable here**: if one run in ten is lost, 59 % of samples of five runs contain \
        no lost run, and nothing in them indicates that others are lost. The gate passes such a run. To see at least \
        one lost run with a probability of 97.5 % takes 35 runs, ln 0.025 / ln 0.9. The line *lost_tracks* of the \
        gate gives the range of rates that are compatible with its runs. Skewed errors without lost tracks need more \
        seeds, or draws on both sides. Covered, passes:\n\n\
        | errors | seeds | Student's t | BCa | Johnson's t | studentised bootstrap |\n\
        |---|--:|--:|--:|--:|--:|\n",
    );
    for row in one_sided {
        writeln!(page, "| {} | {} | {} |", row.shape, row.seeds, rules(row).join(" | ")).ok();
    }
    page.push_str(
        "\n## Partly shared seeds\n\n\
        The comparison is paired if three or more seeds are shared, and at least half of those of the side with more \
        seeds. The table has the false alarms of a test at 5 % with normal errors, whose seeds are correlated \
        between the sides, and for comparison those of the narrower of both intervals:\n\n\
        | seeds of both sides | shared | correlation | comparison | false alarms | the narrower of both |\n\
        |---|--:|--:|---|--:|--:|\n",
    );
    for row in &shapes.pairing {
        let how = if row.paired { "paired" } else { "unpaired" };
        let [alarms, narrower] = [row.alarms, row.narrower_alarms].map(percent);
        let (base, other) = (row.base, row.other);
        writeln!(page, "| {base}, {other} | {} | {} | {how} | {alarms} | {narrower} |", row.shared, row.between_sides)
            .ok();
    }
    page.push_str(
        "\nIf shared, correlated seeds are not paired, the test is conservative.\n\n\
        ## Generalisation from few clips to other motions\n\n\
        Two trackers are equal on average over all motions. Their difference has a standard deviation of 3 mm between \
        motions and of 1 mm between seeds of a motion. The table shows how often a test at 5 % claims a difference \
        over all motions, with intervals over seeds within the clips and with intervals over clips:\n\n\
        | clips x seeds | over seeds | over clips |\n\
        |---|--:|--:|\n",
    );
    for row in &shapes.clips {
        let over_clips = row.over_clips.map_or_else(|| "none".to_owned(), percent);
        writeln!(page, "| {} x {} | {} | {over_clips} |", row.clips, row.seeds, percent(row.over_seeds)).ok();
    }
    page.push_str(
        "\nIntervals over seeds are correct for the clips tested, on which the trackers do differ, but say nothing \
        about other clips. Therefore `compare` uses clips as its unit if there are at least three. The gate guards \
        the clips of its baseline, and uses clips only on request or if seeds do not vary. Both name the unit of \
        their intervals.\n",
    );
    page
}
