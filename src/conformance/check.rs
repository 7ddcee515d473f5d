//! `skiagraph check-tracker`: whether a tracker does as well in scenes that are the same in another form.

use std::path::Path;

use serde::Serialize;

use super::relations::{Relation, exact_set};
use crate::common::{ExperimentError, Progress};
use crate::measure::Measures;
use crate::prepare::PreparedScene;
use crate::scenario::{KeyError, ScenarioFile, TrackerSettings};
use crate::tracking::track::track;
use crate::train::Models;
use skiagraph_eval::{
    ClipValues, Difference, Evaluation, GateVerdict, IntervalUnit, Margin, Unit, difference, equivalence, mean,
};
use skiagraph_set::BenchmarkSet;

const METRIC: &str = "humaneva_mm";
/// Greatest difference of the shares of frames with an estimate.
const MOST_LOST: f64 = 0.02;
/// Least share of the frames with an estimate for a run to be judged.
const LEAST_ESTIMATED: f64 = 0.9;

/// What a check of a tracker found: `check-tracker --json`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TrackerCheck {
    /// `skiagraph.tracker_check/1`.
    pub schema: String,
    pub scenario: String,
    pub tracker: String,
    pub seeds: usize,
    /// Greatest difference that does not matter, mm.
    pub margin_mm: f64,
    /// Mean error in the original scene, mm.
    pub error_mm: f64,
    /// Mean error of a tracker that never moves in the original scene, mm.
    pub frozen_mm: Option<f64>,
    /// Mean share of the frames of the original scene with an estimate.
    pub coverage: f64,
    /// The worst verdict; inconclusive if nothing is judged.
    pub verdict: GateVerdict,
    /// Why nothing is judged: a run of the original scene is not whole.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub not_judged: Option<String>,
    /// One per relation; empty if nothing is judged.
    pub relations: Vec<RelationCheck>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RelationCheck {
    pub relation: Relation,
    /// Whether the error is the same within the margin.
    pub verdict: GateVerdict,
    /// Mean share of the frames of the changed scene with an estimate.
    pub coverage: Option<f64>,
    /// The error in the changed scene minus that in the original, mm.
    pub difference: Option<Difference>,
    /// Why the numbers do not decide.
    pub reason: Option<String>,
}

/// Tracks a scenario and its other forms with every seed, and compares the errors: equivalence by two one-sided tests
/// over seeds.
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
        let detail = "expected a scene of one body and static cameras, without props and distractors";
        return Err(file.located(&KeyError::new("rig", detail)).into());
    }
    let needed = |what: &str| ExperimentError::Argument { argument: "--tracker or --exec", detail: what.to_owned() };
    let base = errors(&exact_set(&file.scenario, &scene)?, None, settings, seeds, progress)?;
    let error_mm = mean(&base.seeds.iter().filter_map(|seed| seed.error_mm).collect::<Vec<_>>()).ok_or_else(|| {
        needed("it has no estimate that could be measured; skiagraph track SET shows why, with --exec also --dry-run")
    })?;
    let margin_mm = margin
        .resolve(METRIC, Unit::Millimetre, error_mm)
        .map_err(|error| ExperimentError::Argument { argument: "--margin", detail: error.to_string() })?;
    let mut relations = Vec::new();
    let not_judged = base.not_whole();
    for relation in Relation::ALL.into_iter().filter(|_| not_judged.is_none()) {
        progress.set_status(relation.describe());
        let set = exact_set(&file.scenario, &relation.applied(file, mocap_directory, &scene)?)?;
        let repeated = relation.repeated_frame(scene.ground_truth.frames.len());
        let found = errors(&set, repeated, settings, seeds, progress)?;
        relations.push(judged(relation, &base, &found, margin_mm));
    }
    let verdict = relations.iter().map(|check| check.verdict).max().unwrap_or(GateVerdict::Inconclusive);
    Ok(TrackerCheck {
        schema: "skiagraph.tracker_check/1".to_owned(),
        scenario: file.scenario.name.clone(),
        tracker: settings.name().to_owned(),
        seeds: seeds.len(),
        margin_mm,
        error_mm,
        frozen_mm: base.frozen_mm,
        coverage: base.coverage(),
        verdict,
        not_judged,
        relations,
    })
}

struct SceneErrors {
    seeds: Vec<SeedError>,
    frozen_mm: Option<f64>,
    /// Number of frames, of all seeds, that a program did not answer.
    failed: usize,
}

struct SeedError {
    seed: u64,
    error_mm: Option<f64>,
    /// Share of the markers with an estimate.
    coverage: f64,
    lost: f64,
}

impl SceneErrors {
    fn coverage(&self) -> f64 {
        mean(&self.seeds.iter().map(|seed| seed.coverage).collect::<Vec<_>>()).unwrap_or_default()
    }

    /// Why the error says nothing: a tracker that dies in every scene after the same few frames is as good in all of
    /// them.
    fn not_whole(&self) -> Option<String> {
        if self.failed > 0 {
            return Some(format!("no whole run: the program did not answer in {} frames of all seeds", self.failed));
        }
        let lost = self.seeds.iter().find(|seed| seed.lost > 1.0 - LEAST_ESTIMATED)?;
        Some(format!("no whole run: seed {} has no estimate in {:.0} % of the frames", lost.seed, 100.0 * lost.lost))
    }
}

/// The errors of all seeds. A tracker may call the frame `repeated` lost: it shows nothing new.
fn errors(
    set: &BenchmarkSet,
    repeated: Option<usize>,
    settings: &TrackerSettings,
    seeds: &[u64],
    progress: &dyn Progress,
) -> Result<SceneErrors, ExperimentError> {
    let truth = if settings.kind().needs_truth { set.truth.refitted.as_ref() } else { None };
    let tracked = track(&set.blind, settings, seeds, truth, &mut Models::default(), progress)?;
    let measures = Measures::new(set, &tracked, progress)?;
    let error = |seed: &crate::measure::SeedMeasures| SeedError {
        seed: seed.seed,
        error_mm: seed.evaluation.metrics.get(METRIC).map(|error| error.mean),
        coverage: mean_but_one(&seed.evaluation, "coverage", repeated).unwrap_or_default(),
        lost: mean_but_one(&seed.evaluation, "lost_frames", repeated).unwrap_or_default(),
    };
    let failed = tracked.program.as_ref().map_or(0, |program| program.answers.failed);
    let frozen_mm = measures.frozen.metrics.get(METRIC).map(|error| error.mean);
    Ok(SceneErrors { seeds: measures.seeds.iter().map(error).collect(), frozen_mm, failed })
}

fn mean_but_one(evaluation: &Evaluation, metric: &str, left_out: Option<usize>) -> Option<f64> {
    let per_frame = &evaluation.metrics.get(metric)?.per_frame;
    let counted = per_frame.iter().enumerate().filter(|(frame, _)| Some(*frame) != left_out);
    mean(&counted.filter_map(|(_, share)| *share).collect::<Vec<_>>())
}

fn judged(relation: Relation, base: &SceneErrors, other: &SceneErrors, margin_mm: f64) -> RelationCheck {
    let coverage = other.coverage();
    let check =
        |verdict, difference, reason| RelationCheck { relation, verdict, coverage: Some(coverage), difference, reason };
    // without the frames that it loses, a tracker would look better
    if (base.coverage() - coverage).abs() > MOST_LOST {
        return check(GateVerdict::Fail, None, Some("the coverage of the original is another".to_owned()));
    }
    if let Some(reason) = other.not_whole() {
        return check(GateVerdict::Inconclusive, None, Some(reason));
    }
    let values =
        |scene: &SceneErrors| scene.seeds.iter().filter_map(|seed| Some((seed.seed, seed.error_mm?))).collect();
    let values = ClipValues { base: values(base), other: values(other) };
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
        let scene = |errors: &[f64], coverage| {
            let seed = |(seed, error): (u64, &f64)| SeedError { seed, error_mm: Some(*error), coverage, lost: 0.0 };
            SceneErrors { seeds: (0..).zip(errors).map(seed).collect(), frozen_mm: None, failed: 0 }
        };
        let base = scene(&[30.0, 31.0, 30.5], 1.0);
        let one = judged(Relation::Turned, &scene(&[30.0], 1.0), &scene(&[90.0], 1.0), 5.0);
        assert_eq!((one.verdict, one.reason.as_deref()), (GateVerdict::Inconclusive, Some("too few seeds")));
        assert_eq!(judged(Relation::Turned, &base, &base, 5.0).verdict, GateVerdict::Pass);
        assert_eq!(judged(Relation::Turned, &base, &scene(&[20.0; 3], 0.5), 5.0).verdict, GateVerdict::Fail);
        let dead = SceneErrors { failed: 1, ..scene(&[30.0, 31.0, 30.5], 1.0) };
        assert_eq!(judged(Relation::Turned, &base, &dead, 5.0).verdict, GateVerdict::Inconclusive);
    }
}
