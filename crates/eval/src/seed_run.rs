//! Runs and means over them.

use std::collections::BTreeMap;

use super::Evaluation;
use super::student::mean_of_means;

/// One run: a clip tracked with a seed.
#[derive(Clone, Copy, Debug)]
pub struct SeedRun<'a> {
    /// Name of the clip.
    pub clip: &'a str,
    /// The seed.
    pub seed: u64,
    /// The measurements.
    pub evaluation: &'a Evaluation,
}

/// Mean over clips of each clip's mean over the runs that have a value.
pub(super) fn mean_over_clips(runs: &[SeedRun<'_>], value: impl Fn(&SeedRun<'_>) -> Option<f64>) -> Option<f64> {
    mean_of_means(&by_clip(runs, &runs.iter().map(value).collect::<Vec<_>>()))
}

/// The values of the runs that have one, clip by clip.
pub(super) fn by_clip(runs: &[SeedRun<'_>], per_run: &[Option<f64>]) -> Vec<Vec<f64>> {
    let mut clips: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    for (run, value) in runs.iter().zip(per_run) {
        clips.entry(run.clip).or_default().extend(value);
    }
    clips.into_values().filter(|values| !values.is_empty()).collect()
}
