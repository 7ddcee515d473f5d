//! Renders `results/search.md`.

use std::collections::BTreeMap;

use serde::Serialize;
use skiagraph::evaluation::{ValueRange, mean_interval};

use super::condition::Condition;
use super::units::{BODIES, Ledger, Outcome, mean};
use super::{CALIBRATED, MAX_FRAMES, PAPER, REFINED, STRESS_FRAMES, STRESSED, takes};

/// `[take][method]`.
pub(crate) type Takes = BTreeMap<String, BTreeMap<String, Outcome>>;

#[derive(Default, Serialize)]
pub(crate) struct Results {
    /// `[bodies]`.
    pub(crate) clean: BTreeMap<String, Takes>,
    /// `[condition]`.
    pub(crate) stress: BTreeMap<String, Takes>,
    /// Takes on which settings were chosen, in small images.
    pub(crate) tuning: Vec<TuningRow>,
}

/// A take on which settings were chosen, with one kind of bodies and one method.
#[derive(Serialize)]
pub(crate) struct TuningRow {
    take: String,
    bodies: String,
    method: String,
    size: String,
    outcome: Outcome,
}

/// Outcomes of the tuning takes with the default settings and clean views.
pub(crate) fn tuning_rows(ledger: &Ledger) -> Vec<TuningRow> {
    let row = |(key, outcome): (Vec<&str>, &Outcome)| match key.as_slice() {
        [take, bodies, condition, method, "", _, _, size] if *condition == Condition::Clean.name() => {
            let [take, bodies, method, size] = [take, bodies, method, size].map(|part| (*part).to_owned());
            Some(TuningRow { take, bodies, method, size, outcome: outcome.clone() })
        }
        _ => None,
    };
    ledger.entries().filter_map(row).collect()
}

impl Results {
    pub(crate) fn add(&mut self, condition: Condition, bodies: &str, take: &str, method: &str, mut outcome: Outcome) {
        outcome.metrics.retain(|name, _| KEPT.contains(&name.as_str()));
        let (group, name) = match condition {
            Condition::Clean => (&mut self.clean, bodies),
            _ => (&mut self.stress, condition.name()),
        };
        let takes = group.entry(name.to_owned()).or_default();
        takes.entry(take.to_owned()).or_default().insert(method.to_owned(), outcome);
    }
}

/// Metrics in `search.json` besides the error, the lost frames and the energy gap.
const KEPT: [&str; 9] = [
    "body_orientation_deg",
    "boundary_f",
    "crps_mm",
    "ellipsoid50",
    "ellipsoid90",
    "mpjpe_root_mm",
    "pa_mpjpe_mm",
    "silhouette_iou",
    "velocity_error_mm_per_s",
];

/// Mean over takes of the mean error over seeds.
fn average(takes: &Takes, method: &str) -> Option<f64> {
    let all: Vec<f64> = takes.values().filter_map(|o| o.get(method)).map(|o| mean(&o.humaneva_mm)).collect();
    (!all.is_empty()).then(|| mean(&all))
}

/// The errors of a kind of bodies, by method.
fn averages(results: &Results, bodies: &str) -> String {
    let of = |method: &str| results.clean.get(bodies).and_then(|takes| average(takes, method));
    let names = [PAPER, REFINED, CALIBRATED].map(|method| method.name).into_iter();
    names.filter_map(|method| Some(format!("{method} {:.1} mm", of(method)?))).collect::<Vec<_>>().join(", ")
}

/// Text with the minimum and maximum, with this many digits.
fn range(values: &[f64], digits: usize) -> String {
    let (low, high) = (values.iter().copied().reduce(f64::min), values.iter().copied().reduce(f64::max));
    format!("{:.digits$} to {:.digits$}", low.unwrap_or(f64::NAN), high.unwrap_or(f64::NAN))
}

fn found(results: &Results) -> String {
    let stress = |method: &str| {
        let all: Vec<f64> = results.stress.values().filter_map(|takes| average(takes, method)).collect();
        range(&all, 1)
    };
    let outcomes = results.clean.values().flat_map(|takes| takes.values()).filter_map(|of| of.get(REFINED.name));
    let inside: Vec<f64> = outcomes.filter_map(|o| Some(100.0 * mean(o.metrics.get("ellipsoid90")?))).collect();
    format!(
        "# Annealed particle filter with refinement and calibration\n\n\
         Mean HumanEva error over the takes, four clean views:\n\n\
         - matched bodies: {}\n\
         - `actor` against a mismatched `tracker25`: {}\n\
         - `actor` against a mismatched `tracker40`: {}\n\n\
         Under stress, with matched bodies, the error is {} mm with refinement and {} mm with the paper's algorithm (range over conditions). The \
         covariances of the refined estimate are too small: its 90 % ellipsoids contain {} % of the markers (range over takes and \
         bodies).\n",
        averages(results, BODIES[0].0),
        averages(results, BODIES[1].0),
        averages(results, BODIES[2].0),
        stress(REFINED.name),
        stress(PAPER.name),
        range(&inside, 0),
    )
}

pub(crate) fn page(results: &Results, seeds: u32, commit: &str) -> String {
    let listed: Vec<String> = takes::REPORTED.iter().map(takes::Take::describe).collect();
    let mut text = found(results)
        + "\nTables: HumanEva error in mm, mean over seeds, with the 95 % interval over seeds below. *Paper* is Algorithm 1 as printed, \
           200 particles x 5 layers (`paper = true`). *Refined* is the default: 60 x 5, then descent on outlines and a search for lost limbs. \
           *Calibrated* is the same with `tracker_body.calibrate = true`. *Floor* is the error of the truth refitted to the tracker's body, \
           before and after calibration. The energy gap is that of the truth (refitted) minus that of the estimate. *Kept* counts the \
           seeds whose calibrated body was kept. *Ellipsoids* are those of the estimate's covariances, and should contain 50 and 90 % of \
           the markers. `-` was not measured.\n";
    for (name, words) in [
        (BODIES[0].0, "Matched: actor and tracker are the same `tracker25`"),
        (BODIES[1].0, "Mismatch: `actor` against `tracker25` with the standard mismatch"),
        (BODIES[2].0, "Mismatch: `actor` against `tracker40` with the standard mismatch"),
    ] {
        let Some(takes) = results.clean.get(name) else { continue };
        text += &format!("\n## {words}\n\n{}", clean_table(takes));
    }
    if !results.stress.is_empty() {
        text += &format!(
            "\n## Under stress\n\nMatched bodies, the first {STRESS_FRAMES} frames of {}. Error in mm, mean over takes and seeds, with the \
             interval over seeds. *Worse* lists takes on which refined is significantly worse than paper (95 % interval of the paired \
             difference).\n\n{}",
            STRESSED.join(", "),
            stress_table(&results.stress)
        );
    }
    if !results.tuning.is_empty() {
        text += &format!(
            "\n## Takes on which settings were chosen\n\nNot representative; made with `SKIAGRAPH_TUNE=`. The gate compares energies in the \
             frames of the calibration, with the given and the calibrated body.\n\n{}",
            tuning_table(&results.tuning)
        );
    }
    text += TRIED;
    text += &missing(results);
    text + &format!(
        "\n## Method\n\n\
         Four clean views of 640 x 480 at 60 Hz, {seeds} seeds, at most {MAX_FRAMES} frames of a take. Proposals were learned from other \
         frames of the take, or from another take of the subject. Settings were chosen on 16_15, 35_02, 02_01, 14_24, 16_57, 16_03 and \
         14_27, never on these takes. Frames of the files, counted from 1, at 120 Hz: {}.\n\n\
         Made by `SKIAGRAPH_SEEDS={seeds} SKIAGRAPH_MOCAP=DIR cargo run --release --example studies -- search`, with commit {commit}; all digits, for every seed, \
         are in `search.json`.\n",
        listed.join("; ")
    )
}

const TRIED: &str = "
## How dense outlines are compared

Error in mm of `actor` against a mismatched and calibrated `tracker40`, mean of six tuning takes (16_15, 35_02, 02_01, 14_24, 16_57, 16_03), one seed (3 and 4: two), so without intervals, \
640 x 480. Lengths are 1/240 of the image height.

| along outlines | joints' standard deviation in calibration | mm |
|---|---|---:|
| samples 2 lengths apart, observed points 3 (before) | 10 mm | 5.81 |
| 3 and 4 | 10 mm | 6.33 |
| 1 and 1.5 | 10 mm | 5.39 |
| 0.5 and 0.75 | 10 mm | 5.47 |
| 1 and 1.5 | 20 mm | 5.70 |
| 1 and 1.5 | 5 mm | 5.23 |
| **1 and 1.5 in calibration and in the last steps of a descent, before 2 and 3; limbs 2 and 3** | **5 mm** | 5.41 |

The kept one takes as long as before (17 ms a frame of one thread, 18 before), the row above it a third more. With 3 and 4 before the last steps, a pose \
that is off by 0.1 rad in every angle is no longer recovered in images of 320 x 240.
## Tried on the tuning takes, not kept

* Six more descent steps of narrow width from the result, accepted whatever the energy: mismatch 16.9 to 16.3 mm, calibrated 13.7 to 13.5, matched 1.2 to 1.3 (seven takes, one \
  seed, 640 x 480).
* 40 steps of the calibration in place of 16: 13.2 to 13.1 mm (16_15, 02_01 and 14_24).
";

/// Planned measurements without results.
fn missing(results: &Results) -> String {
    let mut lacking = Vec::new();
    for (condition, bodies, method) in super::plan() {
        let found = match condition {
            Condition::Clean => results.clean.get(bodies),
            _ => results.stress.get(condition.name()),
        };
        let is_known =
            |take: &str| found.and_then(|takes| takes.get(take)).is_some_and(|o| o.contains_key(method.name));
        let cases = super::cases(condition, bodies);
        let not: Vec<&str> = cases.iter().map(|case| case.take.name).filter(|take| !is_known(take)).collect();
        if !not.is_empty() {
            let which = if not.len() == cases.len() { "all takes".to_owned() } else { not.join(", ") };
            lacking.push(format!("- {}, {bodies}, {}: {which}", method.name, condition.name()));
        }
    }
    if lacking.is_empty() { String::new() } else { format!("\n## Not measured yet\n\n{}\n", lacking.join("\n")) }
}

fn clean_table(takes: &Takes) -> String {
    let mut text = String::from(
        "| take | paper, mm | refined, mm | calibrated, mm | floor, before and after | gap, refined and calibrated | frames far off, \
         paper, refined, calibrated | within 50 %, 90 % ellipsoid, refined | the same, calibrated | kept |\n|---|---|---|---|---|---|---|---|---|---|\n",
    );
    let methods = [PAPER, REFINED, CALIBRATED].map(|method| method.name);
    let of = |take: &str, method: &str| takes.get(take).and_then(|outcomes| outcomes.get(method));
    let number = |value: Option<f64>, digits: usize| value.map_or("-".to_owned(), |v| format!("{v:.digits$}"));
    for take in takes::REPORTED.iter().map(|take| take.name).filter(|take| takes.contains_key(*take)) {
        let outcomes = methods.map(|method| of(take, method));
        let errors =
            outcomes.map(|o| o.map_or("-".to_owned(), |o| with_interval(std::slice::from_ref(&o.humaneva_mm))));
        let lost = outcomes.map(|o| o.map_or("-".to_owned(), |o| format!("{:.1} %", 100.0 * mean(&o.lost))));
        let kept = outcomes[2].map_or("-".to_owned(), |o| format!("{} of {}", count(&o.kept), o.kept.len()));
        text += &format!(
            "| {take} | {} | {} | {} | {}, {} | {}, {} | {} | {} | {} | {kept} |\n",
            errors[0],
            errors[1],
            errors[2],
            number(outcomes[1].map(|o| o.floor_mm), 1),
            number(outcomes[2].map(|o| o.floor_mm), 1),
            number(outcomes[1].map(|o| mean(&o.energy_gap)), 3),
            number(outcomes[2].map(|o| mean(&o.energy_gap)), 3),
            lost.join(", "),
            inside(outcomes[1]),
            inside(outcomes[2]),
        );
    }
    // only takes that every method has, so that the means are over the same takes
    let known: Vec<&str> =
        methods.into_iter().filter(|method| takes.values().any(|o| o.contains_key(*method))).collect();
    let common: Vec<_> = takes.iter().filter(|(_, o)| known.iter().all(|method| o.contains_key(*method))).collect();
    let mut means = methods.map(|_| "-".to_owned());
    for (place, method) in means.iter_mut().zip(methods) {
        if known.contains(&method) && !common.is_empty() {
            let all: Vec<Vec<f64>> = common.iter().map(|(_, o)| o[method].humaneva_mm.clone()).collect();
            *place = format!("**{}**", with_interval(&all));
        }
    }
    text + &format!("| mean of {} takes | {} | | | | | | |\n", common.len(), means.join(" | "))
}

/// Shares of the markers within the ellipsoids that should contain 50 and 90 %.
fn inside(outcome: Option<&Outcome>) -> String {
    let share = |name: &str| outcome.and_then(|o| Some(format!("{:.0}", 100.0 * mean(o.metrics.get(name)?))));
    match (share("ellipsoid50"), share("ellipsoid90")) {
        (Some(half), Some(most)) => format!("{half} %, {most} %"),
        _ => "-".to_owned(),
    }
}

fn tuning_table(rows: &[TuningRow]) -> String {
    let mut text = String::from(
        "| take | bodies | calibration | pictures | seeds | error, mm | floor, mm | gate: energies | kept |\n|---|---|---|---|---|---|---|---|---|\n",
    );
    for TuningRow { take, bodies, method, size, outcome } in rows {
        let gate =
            outcome.gate.first().map_or("-".to_owned(), |[_, _, before, after]| format!("{before:.4}, {after:.4}"));
        let calibrates = if method == CALIBRATED.name { "yes" } else { "no" };
        text += &format!(
            "| {take} | {bodies} | {calibrates} | {size} | {} | {:.1} | {:.1} | {gate} | {} |\n",
            outcome.humaneva_mm.len(),
            mean(&outcome.humaneva_mm),
            outcome.floor_mm,
            count(&outcome.kept)
        );
    }
    text
}

fn count(kept: &[bool]) -> usize {
    kept.iter().filter(|kept| **kept).count()
}

fn stress_table(stress: &BTreeMap<String, Takes>) -> String {
    let mut text = String::from(
        "| condition | takes | paper, mm | refined, mm | refined, each take | worse |\n|---|---|---|---|---|---|\n",
    );
    for condition in Condition::STRESS {
        let Some(takes) = stress.get(condition.name()) else { continue };
        let both: Vec<&BTreeMap<String, Outcome>> = takes
            .values()
            .filter(|o| [PAPER.name, REFINED.name].iter().all(|method| o.contains_key(*method)))
            .collect();
        // methods are compared on the takes that both have tracked
        let compared: Vec<_> = if both.is_empty() { takes.values().collect() } else { both.clone() };
        let errors = |method: &str| -> Vec<Vec<f64>> {
            compared.iter().filter_map(|o| Some(o.get(method)?.humaneva_mm.clone())).collect()
        };
        let (refined, paper) = (errors(REFINED.name), errors(PAPER.name));
        let each: Vec<String> = takes
            .iter()
            .filter_map(|(take, o)| Some(format!("{take} {:.1}", mean(&o.get(REFINED.name)?.humaneva_mm))))
            .collect();
        let worse: Vec<&str> = takes
            .iter()
            .filter(|(_, o)| o.get(PAPER.name).zip(o.get(REFINED.name)).is_some_and(|(p, r)| is_worse(p, r)))
            .map(|(take, _)| take.as_str())
            .collect();
        let worse = match (both.is_empty(), worse.is_empty()) {
            (true, _) => "-".to_owned(),
            (false, true) => format!("none of {}", both.len()),
            (false, false) => worse.join(", "),
        };
        let cell = |errors: &[Vec<f64>]| if errors.is_empty() { "-".to_owned() } else { with_interval(errors) };
        text += &format!(
            "| {} | {} | {} | **{}** | {} | {worse} |\n",
            condition.name(),
            refined.len(),
            cell(&paper),
            cell(&refined),
            each.join(", ")
        );
    }
    text
}

fn is_worse(paper: &Outcome, refined: &Outcome) -> bool {
    let differences: Vec<f64> = refined.humaneva_mm.iter().zip(&paper.humaneva_mm).map(|(r, p)| r - p).collect();
    let interval = mean_interval(&[differences], ValueRange::Any);
    interval.is_some_and(|(interval, _)| interval.low > 0.0)
}

fn with_interval(clips: &[Vec<f64>]) -> String {
    let middle = mean(&clips.iter().map(|clip| mean(clip)).collect::<Vec<_>>());
    match mean_interval(clips, ValueRange::NonNegative) {
        Some((interval, _)) => format!("{middle:.1} <br> {:.1} to {:.1}", interval.low, interval.high),
        None => format!("{middle:.1}"),
    }
}
