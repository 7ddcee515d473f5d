//! A reference that knows the truth: descends from the true pose of every frame, so that its error is that of the
//! minimum of the energy nearest to the truth, without any search.

use super::tracker_factory::TrackerFactory;
use super::tracking::track_with;
use crate::benchmark_set::BlindSet;
use crate::body::{Motion, Pose};
use crate::common::{ExperimentError, Progress};
use crate::measure::Tracked;
use crate::motion_model::{Diffusion, DiffusionSettings};
use crate::observation::Observation;
use crate::scenario::{AnnealedParticleFilterSettings, SearchSettings, TrackerSettings};
use crate::tracker::{Estimate, Likelihood, RefinementSettings, SilhouetteLikelihood, TrackError, Tracker, descend};

/// The likelihood of a tracker that compares silhouettes, and the motion model of its descent.
pub(crate) struct Descent {
    pub(crate) model: Diffusion,
    pub(crate) likelihood: SilhouetteLikelihood,
    iterations: usize,
}

impl Descent {
    /// The descent of a tracker on a set; `None` for trackers that do not compare silhouettes.
    ///
    /// # Errors
    /// [`ExperimentError`] if the set's cameras or training are unusable.
    pub(crate) fn new(
        set: &BlindSet,
        settings: &TrackerSettings,
        progress: &dyn Progress,
    ) -> Result<Option<Self>, ExperimentError> {
        let Some(SearchSettings { likelihood, plausibility, refinement, .. }) = settings.kind().search else {
            return Ok(None);
        };
        let body = &set.start.body;
        let scale = match settings {
            TrackerSettings::AnnealedParticleFilter(filter) => filter.proposal_scale,
            _ => AnnealedParticleFilterSettings::default().proposal_scale,
        };
        let factory = TrackerFactory { set, truth: None, progress };
        let model = factory.diffusion(body, &DiffusionSettings { scale, ..DiffusionSettings::default() })?;
        let mut likelihood = SilhouetteLikelihood::new(body.clone(), &set.rig, likelihood)?.with_descent();
        if let Some(plausibility) = plausibility {
            likelihood = likelihood.with_plausibility(plausibility)?;
        }
        let iterations = refinement.unwrap_or(RefinementSettings::default()).iterations;
        Ok(Some(Self { model, likelihood, iterations }))
    }
}

/// Descends from the true pose of each frame.
struct TruthDescent {
    descent: Descent,
    poses: Vec<Pose>,
}

impl Tracker for TruthDescent {
    fn name(&self) -> &str {
        "descent_from_truth"
    }

    fn start(&mut self, _start: &Pose) {}

    fn track(&mut self, observation: &Observation) -> Result<Estimate, TrackError> {
        let frame = observation.frame;
        let Descent { model, likelihood, iterations } = &mut self.descent;
        likelihood.prepare(observation)?;
        let truth = self.poses.get(frame).ok_or(TrackError::NotStarted { frame })?;
        let mut scratch = likelihood.scratch();
        let descended = descend(model, likelihood, truth, truth, (*iterations, 1.0), &mut scratch);
        let tried = [truth, &descended].map(|pose| likelihood.energy_unrejected(pose, &mut scratch));
        let (pose, energy) = if tried[1] < tried[0] { (descended, tried[1]) } else { (truth.clone(), tried[0]) };
        Ok(Estimate { energy: Some(energy), evaluations: 2, ..Estimate::without_search(frame, pose) })
    }
}

/// Descends from the truth in every frame of a set, with the likelihood of a tracker; `None` for trackers that do not
/// compare silhouettes. `truth` has one pose of the tracker's body per frame.
///
/// # Errors
/// As for tracking.
pub(crate) fn track_from_truth(
    set: &BlindSet,
    truth: &Motion,
    settings: &TrackerSettings,
    progress: &dyn Progress,
) -> Result<Option<Tracked>, ExperimentError> {
    let Some(descent) = Descent::new(set, settings, progress)? else { return Ok(None) };
    let mut trackers = Some(TruthDescent { descent, poses: truth.poses.clone() });
    let tracked = track_with(set, &[0], progress, |_| {
        let tracker = trackers.take().ok_or(ExperimentError::OracleNeedsTruth)?;
        Ok(Box::new(tracker))
    })?;
    Ok(Some(tracked))
}
