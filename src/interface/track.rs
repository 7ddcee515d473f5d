//! Trackers on benchmark sets.

use super::begin_saved;
use crate::artefacts::Destination;
use crate::common::{ExperimentError, NoProgress};
use crate::measure::Tracked;
use crate::scenario::TrackerSettings;
use crate::tracking::{self, track::track_with};
use crate::train::Models;
use skiagraph_set::{BlindSet, Estimates};
use skiagraph_track::tracker::Tracker;

/// Runs a tracker on a set, once per seed. It is given cameras, observations, its body and the start pose, never the
/// truth.
///
/// The tracker is a function that makes a [`Tracker`] of your own for a seed, or the [`TrackerSettings`] of a built-in
/// one. [`measure`](fn@crate::measure) compares the result with the truth; [`Tracked::save`] writes it to disk.
///
/// ```
/// use skiagraph_core::body::Pose;
/// use skiagraph_core::observation::Observation;
/// use skiagraph_track::tracker::{Estimate, TrackError, Tracker};
/// use skiagraph::{ScenarioFile, TrackerSettings, measure, render, track};
///
/// /// Answers the start pose for every frame.
/// struct Still(Pose);
///
/// impl Tracker for Still {
///     fn name(&self) -> &str {
///         "still"
///     }
///
///     fn start(&mut self, start: &Pose) {
///         self.0 = start.clone();
///     }
///
///     fn track(&mut self, observation: &Observation) -> Result<Estimate, TrackError> {
///         Ok(Estimate::without_search(observation.frame, self.0.clone()))
///     }
/// }
///
/// let scenario = ScenarioFile::open("scenarios/smoke/matched.toml".as_ref(), &["last_frame=4".to_owned()])?;
/// let (set, _notes) = render(&scenario, None)?;
/// let start = &set.blind.start.pose;
/// let own = track(&set.blind, |_seed: u64| Ok(Still(start.clone())), &[0])?;
/// let built_in = track(&set.blind, &TrackerSettings::named("frozen")?, &[0])?;
/// let error = |tracked| measure(&set, tracked).map(|measured| measured.summary.metrics["humaneva_mm"].mean);
/// assert_eq!(error(&own)?, error(&built_in)?);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`ExperimentError`] if an observation cannot be read, or the tracker cannot be made or fails. Built-in trackers that
/// need the truth, such as `oracle`, are refused.
pub fn track(set: &BlindSet, tracker: impl TrackerSource, seeds: &[u64]) -> Result<Tracked, ExperimentError> {
    tracker.track(set, seeds)
}

/// What [`track`] can run: a function from a seed to a tracker of your own, or the settings of a built-in tracker.
pub trait TrackerSource {
    /// Runs one tracker per seed on a set.
    fn track(self, set: &BlindSet, seeds: &[u64]) -> Result<Tracked, ExperimentError>;
}

impl<T: Tracker + 'static, F: FnMut(u64) -> Result<T, ExperimentError>> TrackerSource for F {
    fn track(mut self, set: &BlindSet, seeds: &[u64]) -> Result<Tracked, ExperimentError> {
        track_with(set, seeds, &NoProgress, |seed| Ok(Box::new(self(seed)?)))
    }
}

impl TrackerSource for &TrackerSettings {
    fn track(self, set: &BlindSet, seeds: &[u64]) -> Result<Tracked, ExperimentError> {
        tracking::track(set, self, seeds, None, &mut Models::default(), &NoProgress)
    }
}

impl Tracked {
    /// Writes the run to a folder, as `skiagraph track` does; `skiagraph evaluate` can measure it.
    ///
    /// # Errors
    /// [`ExperimentError`] if it cannot be written, or if something is there already and [`Destination::force`] is not
    /// set. With it, what is there is moved aside to `NAME~`.
    pub fn save(&self, set: &BlindSet, to: Destination<'_>) -> Result<(), ExperimentError> {
        let directory = begin_saved(to)?;
        directory.write_all(&self.files(set)?)?;
        Ok(directory.finish()?)
    }
}

impl From<Estimates> for Tracked {
    /// Estimates of a tracker of which nothing else is known.
    fn from(estimates: Estimates) -> Self {
        Self::from_estimates(estimates)
    }
}
