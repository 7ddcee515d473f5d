//! `skiagraph check-tracker`: whether a tracker does as well in scenes that are the same in another form.

use std::path::Path;

use serde::Serialize;

use super::metamorphic::{Relation, exact_set};
use super::tracking::track;
use crate::benchmark_set::BenchmarkSet;
use crate::common::{ExperimentError, Progress, scenario_error};
use crate::evaluation::{
    ClipValues, Difference, Evaluation, GateVerdict, IntervalUnit, Margin, Unit, difference, equivalence, mean,
};
use crate::measure::Measures;
use crate::prepare::PreparedScene;
use crate::scenario::{ScenarioFile, TrackerSettings};
use crate::train::Models;

/// The metric that is compared.
const METRIC: &str = "humaneva_mm";
/// Greatest difference of the shares of frames with an estimate.
const MOST_LOST: f64 = 0.02;

/// What a check of a tracker found: `check-tracker --json`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TrackerCheck {
    /// `skiagraph.tracker_check/1`.
    pub schema: String,
    /// Name of the scenario.
    pub scenario: String,
    /// The tracker.
    pub tracker: String,
    /// Number of seeds.
    pub seeds: usize,
    /// Greatest difference that does not matter, mm.
    pub margin_mm: f64,
    /// Mean error in the original scene, mm.
    pub error_mm: f64,
    /// Mean share of the frames of the original scene with an estimate.
    pub coverage: f64,
    /// The worst verdict.
    pub verdict: GateVerdict,
    /// One per relation.
    pub relations: Vec<RelationCheck>,
}

/// One relation.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RelationCheck {
    /// The relation.
    pub relation: Relation,
    /// Whether the error is the same within the margin.
    pub verdict: GateVerdict,
    /// The error in the changed scene minus that in the original, mm.
    pub difference: Option<Difference>,
    /// Why the numbers do not decide.
    pub reason: Option<String>,
}

/// Tracks a scenario and its other forms with every seed, and compares the errors: equivalence by two one-sided tests
/// over seeds.
///
/// # Errors
/// [`ExperimentError`] if the scene cannot be made or changed, the tracker fails, or the margin does not fit.
pub fn check_tracker(
    file: &ScenarioFile,
    mocap_directory: Option<&Path>,
    settings: &TrackerSettings,
    seeds: &[u64],
    margin: Margin,
    progress: &dyn Progress,
) -> Result<TrackerCheck, ExperimentError> {
    let scene = PreparedScene::new(file, mocap_directory)?;
    if !(file.scenario.prop.is_empty() && file.scenario.distractor.is_empty() && scene.rig.is_still()) {
        let detail = "expected a scene of one body and static cameras, without props and distractors".to_owned();
        return Err(scenario_error(file, "rig", detail));
    }
    let needed = |what: &str| ExperimentError::Argument { argument: "--tracker or --exec", detail: what.to_owned() };
    let base = errors(&exact_set(file, &scene)?, None, settings, seeds, progress)?;
    let known: Vec<f64> = base.iter().map(|seed| seed.error_mm).collect();
    let error_mm = mean(&known).ok_or_else(|| {
        needed("it has no estimate that could be measured; skiagraph track SET shows why, with --exec also --dry-run")
    })?;
    let margin_mm = margin
        .resolve(METRIC, Unit::Millimetre, error_mm)
        .map_err(|error| ExperimentError::Argument { argument: "--margin", detail: error.to_string() })?;
    let mut relations = Vec::new();
    for relation in Relation::ALL {
        progress.set_status(relation.describe());
        let set = exact_set(file, &relation.applied(file, mocap_directory, &scene)?)?;
        let repeated = relation.repeated_frame(scene.ground_truth.frames.len());
        let found = errors(&set, repeated, settings, seeds, progress)?;
        relations.push(judged(relation, &base, &found, margin_mm));
    }
    let verdict = relations.iter().map(|check| check.verdict).max().unwrap_or(GateVerdict::Pass);
    Ok(TrackerCheck {
        schema: "skiagraph.tracker_check/1".to_owned(),
        scenario: file.scenario.name.clone(),
        tracker: settings.name().to_owned(),
        seeds: seeds.len(),
        margin_mm,
        error_mm,
        coverage: base.iter().map(|seed| seed.coverage).sum::<f64>() / base.len() as f64,
        verdict,
        relations,
    })
}

/// A seed with an estimate.
struct SeedError {
    seed: u64,
    /// Mean error, mm.
    error_mm: f64,
    /// Share of the frames with an estimate.
    coverage: f64,
}

/// The errors of all seeds with an estimate. A tracker may call the frame `repeated` lost: it shows nothing new.
fn errors(
    set: &BenchmarkSet,
    repeated: Option<usize>,
    settings: &TrackerSettings,
    seeds: &[u64],
    progress: &dyn Progress,
) -> Result<Vec<SeedError>, ExperimentError> {
    let truth = if settings.kind().needs_truth { set.truth.refitted.as_ref() } else { None };
    let tracked = track(&set.blind, settings, seeds, truth, &mut Models::default(), progress)?;
    let measures = Measures::new(set, &tracked, progress)?;
    let error = |seed: &crate::measure::SeedMeasures| {
        let error_mm = seed.evaluation.metrics.get(METRIC)?.mean;
        Some(SeedError { seed: seed.seed, error_mm, coverage: coverage(&seed.evaluation, repeated) })
    };
    Ok(measures.seeds.iter().filter_map(error).collect())
}

/// Share of the true markers in all frames but one that have an estimate.
fn coverage(evaluation: &Evaluation, left_out: Option<usize>) -> f64 {
    let per_frame = evaluation.metrics.get("coverage").map_or(&[][..], |coverage| &coverage.per_frame);
    let counted = per_frame.iter().enumerate().filter(|(frame, _)| Some(*frame) != left_out);
    mean(&counted.filter_map(|(_, share)| *share).collect::<Vec<_>>()).unwrap_or(1.0)
}

fn judged(relation: Relation, base: &[SeedError], other: &[SeedError], margin_mm: f64) -> RelationCheck {
    let check = |verdict, difference, reason| RelationCheck { relation, verdict, difference, reason };
    if other.len() < base.len() {
        let reason = format!("{} of {} seeds have an estimate", other.len(), base.len());
        return check(GateVerdict::Fail, None, Some(reason));
    }
    // without the frames that it loses, a tracker would look better
    let [known, found] = [base, other].map(|seeds| mean(&seeds.iter().map(|seed| seed.coverage).collect::<Vec<_>>()));
    if let (Some(known), Some(found)) = (known, found)
        && (known - found).abs() > MOST_LOST
    {
        let reason =
            format!("estimates in {:.0} % of the frames, {:.0} % in the original", 100.0 * found, 100.0 * known);
        return check(GateVerdict::Fail, None, Some(reason));
    }
    let [base, other] = [base, other].map(|seeds| seeds.iter().map(|seed| (seed.seed, seed.error_mm)).collect());
    let values = ClipValues { base, other };
    // a seed draws other numbers in another scene, so the runs are not paired
    match difference(&[values], false, IntervalUnit::Seeds) {
        Some(found) => {
            let verdict = equivalence(&found, margin_mm);
            let reason =
                (verdict == GateVerdict::Inconclusive && found.ci95.is_none()).then(|| "too few seeds".to_owned());
            check(verdict, Some(found), reason)
        }
        None => check(GateVerdict::Inconclusive, None, Some("nothing to compare".to_owned())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn missing_estimates_fail_and_one_seed_decides_nothing() {
        let seed = |seed, error_mm| SeedError { seed, error_mm, coverage: 1.0 };
        let base = [seed(0, 30.0), seed(1, 31.0), seed(2, 30.5)];
        assert_eq!(judged(Relation::Turned, &base, &base[..1], 5.0).verdict, GateVerdict::Fail);
        let one = judged(Relation::Turned, &base[..1], &[seed(0, 90.0)], 5.0);
        assert_eq!((one.verdict, one.reason.as_deref()), (GateVerdict::Inconclusive, Some("too few seeds")));
        assert_eq!(judged(Relation::Turned, &base, &base, 5.0).verdict, GateVerdict::Pass);
        let lost = [0, 1, 2].map(|number| SeedError { coverage: 0.5, ..seed(number, 20.0) });
        let found = judged(Relation::Turned, &base, &lost, 5.0);
        assert!(found.verdict == GateVerdict::Fail && found.reason.unwrap().contains("50 % of the frames"));
    }
}
