//! Several runs in one table: means over clips and seeds, with intervals.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};

use super::breakdown_summary::{BreakdownSummary, summarise_cameras, summarise_groups};
use super::seed_run::{SeedRun, by_clip};
use super::statistics::standard_deviation;
use super::student::mean_of_means;
use super::{
    EvaluationError, FrameSpread, Interval, LostStretch, MetricValue, PerCameraError, Unit, ValueRange, find_metric,
    interval_words, mean, mean_interval,
};
use skiagraph_core::body::LANDMARKS;

/// Clip and seed of a run.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct RunKey {
    /// Name of the clip.
    pub clip: String,
    /// The seed.
    pub seed: u64,
}

/// All metrics over all runs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Summary {
    /// The runs, in the order of every `per_run`.
    pub runs: Vec<RunKey>,
    /// Describes how the intervals were computed, or why there are none.
    pub interval: String,
    /// By [`super::Metric::name`].
    pub metrics: BTreeMap<String, MetricSummary>,
    /// The inputs that each metric absent from all runs needs, by metric name.
    #[serde(default)]
    pub absent: BTreeMap<String, String>,
    /// Mean error of every marker, in the order of [`skiagraph_core::body::LANDMARKS`], millimetres.
    pub per_joint: Vec<JointSummary>,
    /// The longest run of frames, over all runs, in which a marker is lost throughout; absent if none is long enough.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub longest_lost: Option<LostStretchOfRun>,
    /// Mean error by group of markers: gait phase, speed, number of cameras that see them.
    #[serde(default)]
    pub breakdown: Vec<BreakdownSummary>,
    /// Errors by camera: means over clips of each clip's mean over seeds.
    #[serde(default)]
    pub per_camera: Vec<PerCameraError>,
}

/// The longest run of frames with a lost marker, and the run that contains it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LostStretchOfRun {
    /// The run.
    #[serde(flatten)]
    pub run: RunKey,
    /// The stretch.
    #[serde(flatten)]
    pub stretch: LostStretch,
}

/// One metric over all runs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct MetricSummary {
    /// Unit of all values.
    pub unit: Unit,
    /// Mean over clips of each clip's mean over seeds, over the runs that have the metric.
    pub mean: f64,
    /// Spread over frames; absent for a metric of the whole sequence. `std`, `median`, `p90`: of the frames of a run,
    /// averaged over runs. `max`: of all frames of all runs.
    #[serde(flatten)]
    pub spread: Option<FrameSpread>,
    /// 95 % interval of the mean; `None` for fewer than three runs, if a clip has one seed, and if all runs are equal.
    pub ci95: Option<Interval>,
    /// How the interval was made, or why there is none.
    pub interval: String,
    /// Standard deviation of the runs' means; absent for a single run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub std_between_runs: Option<f64>,
    /// Share of the truth's markers that the estimates of all runs have; means of errors leave out the others.
    pub coverage: f64,
    /// Mean of every run, in the order of [`Summary::runs`]; `None` where a run lacks the metric.
    pub per_run: Vec<Option<f64>>,
    /// Joint set, alignment, mask rule, frames and rate.
    pub protocol: String,
}

/// Error of one marker over all runs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JointSummary {
    /// [`skiagraph_core::body::Landmark::name`].
    pub joint: String,
    /// Mean distance from the truth over clips of each clip's mean over seeds, millimetres.
    pub mean_mm: f64,
    /// 95 % interval of that mean.
    pub ci95: Option<Interval>,
    /// Share of the scored frames of all runs in which it was compared.
    pub coverage: f64,
    /// Mean distance of every run, in the order of [`Summary::runs`]; `None` where a run lacks the marker.
    #[serde(default)]
    pub per_run: Vec<Option<f64>>,
}

/// Summarises runs. The unit of intervals is clip x seed, never the frame ([`super::mean_interval`]).
///
/// # Errors
/// [`EvaluationError::NoRun`] without a run.
pub fn summarise(runs: &[SeedRun<'_>]) -> Result<Summary, EvaluationError> {
    let first = runs.first().ok_or(EvaluationError::NoRun)?.evaluation;
    let lacking =
        first.absent.iter().filter(|(name, _)| runs.iter().all(|run| run.evaluation.absent.contains_key(*name)));
    let absent = lacking.map(|(name, needs)| (name.clone(), needs.clone())).collect();
    let names: BTreeSet<&String> = runs.iter().flat_map(|run| run.evaluation.metrics.keys()).collect();
    let metrics = names.into_iter().filter_map(|name| Some((name.clone(), metric_summary(runs, name)?))).collect();
    Ok(Summary {
        runs: runs.iter().map(|run| RunKey { clip: run.clip.to_owned(), seed: run.seed }).collect(),
        interval: interval_words::of_summary(runs),
        metrics,
        absent,
        per_joint: LANDMARKS.iter().filter_map(|landmark| joint_summary(runs, landmark.name())).collect(),
        longest_lost: longest_lost(runs),
        breakdown: summarise_groups(runs),
        per_camera: summarise_cameras(runs),
    })
}

fn metric_summary(runs: &[SeedRun<'_>], name: &str) -> Option<MetricSummary> {
    let values: Vec<_> = runs.iter().map(|run| run.evaluation.metrics.get(name)).collect();
    let per_run: Vec<Option<f64>> = values.iter().map(|value| value.map(|v| v.mean)).collect();
    let present: Vec<_> = values.into_iter().flatten().collect();
    let clips = by_clip(runs, &per_run);
    let interval = mean_interval(&clips, find_metric(name).map_or(ValueRange::Any, super::Metric::value_range));
    let means: Vec<f64> = per_run.iter().flatten().copied().collect();
    Some(MetricSummary {
        unit: present.first()?.unit,
        mean: mean_of_means(&clips)?,
        spread: mean_spread(&present),
        ci95: interval.map(|(ends, _)| ends),
        interval: interval_words::of_metric(&clips, runs.len(), interval.map(|(_, rule)| rule)),
        std_between_runs: standard_deviation(&means),
        coverage: mean(&runs.iter().map(|run| run.evaluation.coverage).collect::<Vec<_>>())?,
        per_run,
        protocol: present.first()?.protocol.clone(),
    })
}

/// `max` of all frames, the others averaged over runs; `None` for a metric of whole sequences.
fn mean_spread(values: &[&MetricValue]) -> Option<FrameSpread> {
    let spreads: Vec<FrameSpread> = values.iter().filter_map(|value| value.spread).collect();
    let of_runs = |part: fn(&FrameSpread) -> f64| mean(&spreads.iter().map(part).collect::<Vec<_>>());
    Some(FrameSpread {
        std: mean(&spreads.iter().filter_map(|spread| spread.std).collect::<Vec<_>>()),
        median: of_runs(|s| s.median)?,
        p90: of_runs(|s| s.p90)?,
        max: spreads.iter().map(|s| s.max).max_by(f64::total_cmp)?,
    })
}

fn joint_summary(runs: &[SeedRun<'_>], joint: &str) -> Option<JointSummary> {
    let of_run = |run: &SeedRun<'_>| Some(run.evaluation.per_joint.iter().find(|j| j.joint == joint)?.mean);
    let per_run: Vec<Option<f64>> = runs.iter().map(of_run).collect();
    let clips = by_clip(runs, &per_run);
    let ci95 = mean_interval(&clips, ValueRange::NonNegative).map(|(ends, _)| ends);
    let share = |run: &SeedRun<'_>| {
        let compared = run.evaluation.per_joint.iter().find(|j| j.joint == joint).map_or(0, |j| j.frames);
        compared as f64 / (run.evaluation.frames - run.evaluation.first_scored).max(1) as f64
    };
    let coverage = mean(&runs.iter().map(share).collect::<Vec<_>>())?;
    Some(JointSummary { joint: joint.to_owned(), mean_mm: mean_of_means(&clips)?, ci95, coverage, per_run })
}

/// The longest lost stretch of all runs; of equal ones the first.
fn longest_lost(runs: &[SeedRun<'_>]) -> Option<LostStretchOfRun> {
    let stretches = runs.iter().filter_map(|run| Some((run, run.evaluation.longest_lost.as_ref()?)));
    let (run, stretch) = stretches.reduce(|one, other| if other.1.frames() > one.1.frames() { other } else { one })?;
    let run = RunKey { clip: run.clip.to_owned(), seed: run.seed };
    Some(LostStretchOfRun { run, stretch: stretch.clone() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Evaluation;
    use crate::test_figure::{evaluate_markers, standing, translated};
    use nalgebra::Vector3;

    fn off_by(millimetres: f64) -> Evaluation {
        let truth = vec![standing(); 3];
        let moved: Vec<_> = truth.iter().map(|m| translated(m, Vector3::new(0.001 * millimetres, 0.0, 0.0))).collect();
        evaluate_markers(&truth, &moved)
    }

    /// Of one clip, with seeds from 0 on.
    fn summary_of(evaluations: &[Evaluation]) -> Summary {
        let runs = evaluations.iter().zip(0..).map(|(evaluation, seed)| SeedRun { clip: "walk", seed, evaluation });
        summarise(&runs.collect::<Vec<_>>()).unwrap()
    }

    #[test]
    fn clips_have_equal_weight_and_seeds_within_them() {
        let [a, b, c] = [10.0, 20.0, 60.0].map(off_by);
        let run = |clip, seed, evaluation| SeedRun { clip, seed, evaluation };
        let summary = summarise(&[run("walk", 0, &a), run("walk", 1, &b), run("jump", 0, &c)]).unwrap();
        let humaneva = &summary.metrics["humaneva_mm"];
        assert!((humaneva.mean - (15.0 + 60.0) / 2.0).abs() < 1e-9);
        assert!((humaneva.spread.unwrap().max - 60.0).abs() < 1e-9);
        assert_eq!(humaneva.ci95, None, "the clip jump has one seed");
        assert_eq!(humaneva.interval, "a clip with 1 seed: no interval");
        assert!(summary.interval.starts_with("A clip with 1 seed: no interval"), "{}", summary.interval);
        assert_eq!(humaneva.per_run.len(), 3);
        assert!((summary.per_joint[0].mean_mm - 37.5).abs() < 1e-9);
    }

    #[test]
    fn several_seeds_give_an_interval_that_contains_the_mean() {
        let evaluations = [28.0, 30.0, 29.0, 33.0, 31.0].map(off_by);
        let summary = summary_of(&evaluations);
        let Interval { low, high } = summary.metrics["humaneva_mm"].ci95.unwrap();
        assert!(low < 30.2 && 30.2 < high);
        assert_eq!(summary, summary_of(&evaluations));
        let text = serde_json::to_string(&summary).unwrap();
        assert!(text.contains(&format!("\"ci95\":[{low},{high}]")));
        assert_eq!(serde_json::from_str::<Summary>(&text).unwrap(), summary);
    }

    #[test]
    fn a_lost_run_has_no_error_and_lowers_the_coverage() {
        let truth = vec![standing(); 3];
        let mut half = truth.clone();
        half[2] = [None; 15];
        let both = [vec![[None; 15]; 3], half].map(|estimate| evaluate_markers(&truth, &estimate));
        let summary = summary_of(&both);
        let error = &summary.metrics["humaneva_mm"];
        assert_eq!((error.mean, error.coverage, error.per_run.clone()), (0.0, 0.25, vec![None, Some(0.0)]));
        assert_eq!(summary.metrics["lost_frames"].mean, 0.75);
        assert_eq!(
            error.protocol, both[1].metrics["humaneva_mm"].protocol,
            "what is measured does not depend on coverage"
        );
        assert!(summary.absent.contains_key("lag_ms") && !summary.absent.contains_key("humaneva_mm"));
        assert_eq!((summary.per_joint.len(), summary.per_joint[0].coverage), (15, 0.25));
    }

    #[test]
    fn two_seeds_have_no_interval_and_the_reason_is_given() {
        let all = [28.0, 30.0, 29.0].map(off_by);
        let of_two = summary_of(&all[..2]);
        assert_eq!(of_two.metrics["humaneva_mm"].ci95, None);
        assert_eq!(of_two.metrics["humaneva_mm"].interval, "2 seeds: no interval");
        assert!(of_two.interval.starts_with("2 seeds: no interval"), "{}", of_two.interval);
        let of_three = summary_of(&all);
        assert!(of_three.metrics["humaneva_mm"].ci95.is_some());
        assert_eq!(of_three.metrics["humaneva_mm"].interval, "Student's t on log errors over 3 seeds");
        assert_eq!(of_three.metrics["auc150"].interval, "Student's t over 3 seeds");
        assert_eq!(of_three.metrics["pck150"].interval, "3 seeds: all equal");
        assert_eq!(of_three.metrics["pck150"].ci95, None);
    }

    #[test]
    fn copies_are_one_observation() {
        let copies = summary_of(&[28.0; 3].map(off_by));
        assert!(copies.interval.starts_with("3 seeds with bit-identical estimates"), "{}", copies.interval);
        assert!(copies.interval.contains("observation.seed=2") && copies.metrics["humaneva_mm"].ci95.is_none());
    }

    #[test]
    fn a_metric_that_some_seeds_lack_states_the_number_of_seeds() {
        let mut all = [28.0, 30.0, 29.0, 31.0].map(off_by);
        all[0].metrics.remove("humaneva_mm");
        let summary = summary_of(&all);
        assert_eq!(summary.metrics["humaneva_mm"].interval, "Student's t on log errors over 3 of 4 seeds");
        assert!((summary.metrics["humaneva_mm"].mean - 30.0).abs() < 1e-9);
    }

    #[test]
    fn no_run_is_an_error() {
        assert_eq!(summarise(&[]).unwrap_err(), EvaluationError::NoRun);
    }
}
