//! Trackers from the settings of scenarios.

use super::calibrating::{self, Beginning};
use super::nearest_training_pose::NearestTrainingPose;
use super::oracle::Oracle;
use super::progress::{Progress, Stage};
use super::{ExperimentError, Models};
use crate::benchmark_set::{BlindSet, Training};
use crate::body::Motion;
use crate::motion_model::{Diffusion, MotionModel, MotionModelError, Prediction, ProposalScales};
use crate::scenario::{AnnealedParticleFilterSettings, LatentKind, LatentTrackerSettings, TrackerSettings};
use crate::tracker::{
    AnnealedParticleFilter, BodyCalibration, Frozen, Likelihood, Partition, PlausibleLikelihood, Refinement,
    SilhouetteLikelihood, Tracker,
};

/// What a tracker may be built from.
pub(super) struct TrackerFactory<'a> {
    pub(super) set: &'a BlindSet,
    /// One pose of the tracker's body a frame: for oracles alone.
    pub(super) truth: Option<&'a Motion>,
    pub(super) progress: &'a dyn Progress,
}

impl TrackerFactory<'_> {
    /// A tracker that has started.
    pub(super) fn begin(
        &self,
        settings: &TrackerSettings,
        models: &mut Models,
        beginning: &Beginning,
        seed: u64,
    ) -> Result<Box<dyn Tracker>, ExperimentError> {
        let mut tracker = self.build(settings, models, beginning, seed)?;
        tracker.start(&beginning.pose);
        Ok(tracker)
    }

    /// Calibrates the body with each of the trackers, which have started with the body as given; nothing where that is
    /// not asked for, or the tracker keeps its body.
    pub(super) fn calibrate(
        &self,
        settings: &TrackerSettings,
        trackers: &mut [Box<dyn Tracker>],
        seeds: &[u64],
    ) -> Result<Vec<BodyCalibration>, ExperimentError> {
        if !self.set.start.calibrate {
            return Ok(Vec::new());
        }
        let TrackerSettings::AnnealedParticleFilter(filter) = settings else {
            let name = settings.name();
            self.progress.note(&format!(
                "tracker_body.calibrate: {name} keeps the body as it is; annealed_particle_filter calibrates it"
            ));
            return Ok(Vec::new());
        };
        let frames = calibrating::frames(self.set).last().map_or(0, |last| last + 1);
        self.progress.begin(Stage::Calibrate, frames * seeds.len());
        let mut calibrations = Vec::with_capacity(seeds.len());
        for (tracker, seed) in trackers.iter_mut().zip(seeds) {
            let found = calibrating::calibrated(self.set, filter.likelihood(), tracker.as_mut(), self.progress)?;
            self.progress.note(&format!("calibration, seed {seed}: {}", found.report.in_words()));
            calibrations.push(found);
        }
        Ok(calibrations)
    }

    /// Builds a tracker from its settings.
    pub(super) fn build(
        &self,
        settings: &TrackerSettings,
        models: &mut Models,
        beginning: &Beginning,
        seed: u64,
    ) -> Result<Box<dyn Tracker>, ExperimentError> {
        let (body, training) = (&beginning.body, &self.set.start.training);
        let truth = || self.truth.ok_or(ExperimentError::OracleNeedsTruth);
        Ok(match settings {
            TrackerSettings::AnnealedParticleFilter(s) => {
                let scales = match (training, s.prediction) {
                    (Training::Motions(t), prediction) => {
                        ProposalScales::from_motions(body, &t.motions, prediction).map_err(MotionModelError::from)?
                    }
                    (Training::Spread(t), Prediction::None) => ProposalScales::from_root_mean_squares(&t.change),
                    (Training::Spread(t), Prediction::ConstantVelocity) => {
                        ProposalScales::from_root_mean_squares(&t.change_of_change)
                    }
                };
                let model = Diffusion::new(body.clone(), &scales, &s.diffusion())?;
                let mut likelihood = SilhouetteLikelihood::new(body.clone(), &self.set.rig, s.likelihood())?;
                if s.refinement().is_some() {
                    likelihood = likelihood.with_descent();
                }
                if beginning.is_calibrated {
                    likelihood = likelihood.with_light_extremities();
                }
                let seen = || training.motions().iter().flat_map(|motion| motion.poses.iter().cloned()).collect();
                let refinement =
                    s.refinement().map(|settings| Refinement::new(settings, body, seen(), seed)).transpose()?;
                match s.plausibility {
                    None => filter(s, model, likelihood, seed, refinement)?,
                    Some(plausibility) => {
                        let likelihood = PlausibleLikelihood::new(likelihood, plausibility)?;
                        filter(s, model, likelihood, seed, refinement)?
                    }
                }
            }
            TrackerSettings::Gpdm(s) => self.latent(s, models, seed)?,
            TrackerSettings::SwitchingGpdm(s) => self.latent(s, models, seed)?,
            TrackerSettings::GpdmGraph(s) => self.latent(s, models, seed)?,
            TrackerSettings::Frozen(_) => Box::new(Frozen::default()),
            TrackerSettings::NearestTrainingPose(_) => match training {
                Training::Motions(t) => Box::new(NearestTrainingPose::new(body, &t.motions, truth()?)),
                Training::Spread(_) => return Err(ExperimentError::NoTraining),
            },
            TrackerSettings::Oracle(s) => Box::new(Oracle::new(truth()?.poses.clone(), s.clone(), seed)),
        })
    }

    fn latent<T: LatentKind>(
        &self,
        settings: &LatentTrackerSettings<T>,
        models: &mut Models,
        seed: u64,
    ) -> Result<Box<dyn Tracker>, ExperimentError> {
        let model = models.latent(settings, self.set, self.truth, self.progress)?;
        let body = &self.set.start.body;
        let likelihood = SilhouetteLikelihood::new(body.clone(), &self.set.rig, settings.likelihood())?;
        match settings.refinement() {
            None => Ok(Box::new(AnnealedParticleFilter::new(settings.filter(), model, likelihood, seed)?)),
            Some(refinement) => {
                let refinement = Refinement::new(refinement, body, Vec::new(), seed)?;
                let (model, likelihood) = (model.with_descent(), likelihood.with_descent());
                let filter = AnnealedParticleFilter::new(settings.filter(), model, likelihood, seed)?;
                Ok(Box::new(filter.with_refinement(refinement)?))
            }
        }
    }
}

/// A filter, in parts and with refinement where that is asked for.
fn filter<L: Likelihood + 'static>(
    settings: &AnnealedParticleFilterSettings,
    model: Diffusion,
    likelihood: L,
    seed: u64,
    refinement: Option<Refinement>,
) -> Result<Box<dyn Tracker>, ExperimentError> {
    let partition = settings.partitioned.then(|| Partition::of_body(model.body()));
    let mut filter = AnnealedParticleFilter::new(settings.filter(), model, likelihood, seed)?;
    if let Some(partition) = partition {
        filter = filter.with_partition(partition)?;
    }
    Ok(match refinement {
        None => Box::new(filter),
        Some(refinement) => Box::new(filter.with_refinement(refinement)?),
    })
}
