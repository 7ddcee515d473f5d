//! A reference that knows the truth: descends from the true pose of every frame, so that its error is that of the
//! minimum of the energy nearest to the truth, without any search.

use super::calibrating::Beginning;
use super::tracker_factory::TrackerFactory;
use crate::common::{ExperimentError, Progress, Stage, advance};
use crate::scenario::{AnnealedParticleFilterSettings, EvidenceSource, SearchSettings, TrackerSettings};
use skiagraph_core::body::{Motion, Pose};
use skiagraph_core::observation::Observation;
use skiagraph_core::parallel;
use skiagraph_set::BlindSet;
use skiagraph_track::motion_model::{Diffusion, DiffusionSettings};
use skiagraph_track::tracker::{DescentSteps, Likelihood, RefinementSettings, SilhouetteLikelihood, descend};

/// The likelihood of a tracker that compares silhouettes, and the motion model of its descent.
pub(crate) struct Descent {
    pub(crate) model: Diffusion,
    pub(crate) likelihood: SilhouetteLikelihood,
    iterations: usize,
}

impl Descent {
    /// The descent of a tracker on a set, with the body and the cameras that it begins with; `None` for trackers that
    /// do not compare silhouettes.
    pub(crate) fn new(
        set: &BlindSet,
        settings: &TrackerSettings,
        beginning: &Beginning,
        progress: &dyn Progress,
    ) -> Result<Option<Self>, ExperimentError> {
        let Some(SearchSettings { likelihood, plausibility, refinement, .. }) = silhouette_search(settings) else {
            return Ok(None);
        };
        let body = &beginning.body;
        let scale = match settings {
            TrackerSettings::AnnealedParticleFilter(filter) => filter.proposal_scale,
            _ => AnnealedParticleFilterSettings::default().proposal_scale,
        };
        let factory = TrackerFactory { set, truth: None, progress };
        let model = factory.diffusion(body, &DiffusionSettings { scale, ..DiffusionSettings::default() })?;
        let mut likelihood = SilhouetteLikelihood::new(body.clone(), &set.rig, likelihood)?
            .with_corrected_cameras(&beginning.cameras)
            .with_descent();
        if beginning.is_calibrated {
            likelihood = likelihood.with_light_extremities();
        }
        if let Some(plausibility) = plausibility {
            likelihood = likelihood.with_plausibility(plausibility)?;
        }
        let iterations = refinement.unwrap_or(RefinementSettings::default()).iterations;
        Ok(Some(Self { model, likelihood, iterations }))
    }

    /// Descends from a pose; returns the pose of lower energy.
    fn descend(&mut self, observation: &Observation, start: &Pose) -> Result<Pose, ExperimentError> {
        let Self { model, likelihood, iterations } = self;
        likelihood.prepare(observation)?;
        let mut scratch = likelihood.scratch();
        let reached = descend(model, likelihood, start, start, DescentSteps::exact(*iterations, 1.0), &mut scratch);
        let [before, after] = [start, &reached].map(|pose| likelihood.energy_unrejected(pose, &mut scratch));
        Ok(if after < before { reached } else { start.clone() })
    }
}

/// The search of a tracker that compares silhouettes and nothing else.
fn silhouette_search(settings: &TrackerSettings) -> Option<SearchSettings> {
    match settings {
        TrackerSettings::AnnealedParticleFilter(filter) if filter.evidence != EvidenceSource::Silhouettes => None,
        _ => settings.kind().search,
    }
}

/// Frames that one thread descends with the same likelihood.
const CHUNK: usize = 16;

/// The poses that descents from the truth reach in every frame of a set, with the likelihood of a tracker; `None` for
/// trackers that do not compare silhouettes. `truth` has one pose of the tracker's body per frame. No energy is above
/// that of the truth.
pub(crate) fn descend_from_truth(
    set: &BlindSet,
    truth: &Motion,
    settings: &TrackerSettings,
    progress: &dyn Progress,
) -> Result<Option<Vec<Pose>>, ExperimentError> {
    if silhouette_search(settings).is_none() {
        return Ok(None);
    }
    progress.begin(Stage::Track, truth.poses.len());
    let chunk = |number: usize| -> Result<Vec<Pose>, ExperimentError> {
        let Some(mut descent) = Descent::new(set, settings, &Beginning::from_set(set), progress)? else {
            return Ok(Vec::new());
        };
        let first = number * CHUNK;
        let poses = truth.poses.iter().enumerate().skip(first).take(CHUNK);
        poses
            .map(|(frame, truth)| {
                advance(progress)?;
                descent.descend(&set.observation(frame)?, truth)
            })
            .collect()
    };
    let chunks = parallel::map(truth.poses.len().div_ceil(CHUNK), chunk);
    Ok(Some(chunks.into_iter().collect::<Result<Vec<_>, _>>()?.concat()))
}
