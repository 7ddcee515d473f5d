//! Builds trackers from the settings of scenarios.

use super::calibrating::{self, Beginning};
use super::nearest_training_pose::NearestTrainingPose;
use super::oracle::Oracle;
use crate::common::{ExperimentError, Progress, Stage};
use crate::scenario::{AnnealedParticleFilterSettings, EvidenceSource, LearnedMotion, SearchSettings, TrackerSettings};
use crate::train::Models;
use skiagraph_core::body::{Humanoid, Motion};
use skiagraph_core::body::{Prediction, ProposalScales};
use skiagraph_set::{BlindSet, Training};
use skiagraph_track::motion_model::{Diffusion, DiffusionSettings};
use skiagraph_track::tracker::{
    AnnealedParticleFilter, BodyCalibration, CombinedLikelihood, Frozen, KeypointLikelihood, KeypointTracker,
    Partition, Refinement, SilhouetteLikelihood, Tracker,
};

pub(super) struct TrackerFactory<'a> {
    pub(super) set: &'a BlindSet,
    /// One pose of the tracker's body per frame; only for reference trackers.
    pub(super) truth: Option<&'a Motion>,
    pub(super) progress: &'a dyn Progress,
}

impl TrackerFactory<'_> {
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

    /// Calibrates the body with each of the trackers, which have started with the given body. Returns nothing if the
    /// set does not request it, or the tracker cannot calibrate.
    pub(super) fn calibrate(
        &self,
        settings: &TrackerSettings,
        trackers: &mut [Box<dyn Tracker>],
        seeds: &[u64],
    ) -> Result<Vec<BodyCalibration>, ExperimentError> {
        if self.set.start.calibrate.is_nothing() {
            return Ok(Vec::new());
        }
        let Some(filter) = calibrating::calibrated(settings) else { return Ok(Vec::new()) };
        let likelihood = filter.search().likelihood;
        let BlindSet { rig, frame_count, frames_per_second, .. } = self.set;
        let frames = calibrating::tracked_frames(rig.cameras.len(), *frame_count, *frames_per_second);
        self.progress.begin(Stage::Calibrate, frames * seeds.len());
        let mut calibrations = Vec::with_capacity(seeds.len());
        for (tracker, seed) in trackers.iter_mut().zip(seeds) {
            let found = calibrating::calibrate_body(self.set, likelihood, tracker.as_mut(), self.progress)?;
            self.progress.note(&format!("calibration, seed {seed}: {}", found.report.describe()));
            calibrations.push(found);
        }
        Ok(calibrations)
    }

    pub(super) fn build(
        &self,
        settings: &TrackerSettings,
        models: &mut Models,
        beginning: &Beginning,
        seed: u64,
    ) -> Result<Box<dyn Tracker>, ExperimentError> {
        let truth = || self.truth.ok_or(ExperimentError::OracleNeedsTruth);
        match settings {
            TrackerSettings::AnnealedParticleFilter(s) => self.annealed(s, beginning, seed),
            TrackerSettings::Gpdm(s) => self.latent(&s.learned(), &s.search(), models, seed),
            TrackerSettings::SwitchingGpdm(s) => self.latent(&s.learned(), &s.search(), models, seed),
            TrackerSettings::GpdmGraph(s) => self.latent(&s.learned(), &s.search(), models, seed),
            TrackerSettings::Keypoints(settings) => {
                let found = self.set.keypoints.as_ref().ok_or(ExperimentError::NoKeypoints)?;
                if self.set.rig.cameras.len() < 2 {
                    return Err(ExperimentError::KeypointsOfOneCamera);
                }
                Ok(Box::new(KeypointTracker::new(beginning.body.clone(), &self.set.rig, found.layout, *settings)))
            }
            TrackerSettings::Frozen(_) => Ok(Box::new(Frozen::default())),
            TrackerSettings::NearestTrainingPose(_) => match &self.set.start.training {
                Training::Motions(t) => Ok(Box::new(NearestTrainingPose::new(&beginning.body, &t.motions, truth()?))),
                Training::Spread(_) => Err(ExperimentError::NoTraining),
            },
            TrackerSettings::Program(program) => Err(ExperimentError::Program {
                command: program.command.clone(),
                what: "is another program and cannot track in this one".to_owned(),
                errors: Vec::new(),
            }),
            TrackerSettings::Oracle(s) => Ok(Box::new(Oracle::new(truth()?.poses.clone(), s.clone(), seed))),
        }
    }

    fn annealed(
        &self,
        settings: &AnnealedParticleFilterSettings,
        beginning: &Beginning,
        seed: u64,
    ) -> Result<Box<dyn Tracker>, ExperimentError> {
        let (body, training, search) = (&beginning.body, &self.set.start.training, settings.search());
        let diffusion = DiffusionSettings { prediction: settings.prediction, scale: settings.proposal_scale };
        let model = self.diffusion(body, &diffusion)?;
        let likelihood = self.likelihood(settings, beginning)?;
        let refinement = search.refinement.map(|settings| {
            let seen = training.motions().iter().flat_map(|motion| motion.poses.iter().cloned()).collect();
            Refinement::new(settings, body, seen, seed)
        });
        let refinement = refinement.transpose()?;
        let mut filter = AnnealedParticleFilter::new(search.filter, model, likelihood, seed)?;
        if settings.partitioned {
            filter = filter.with_partition(Partition::of_body(body))?;
        }
        if let Some(refinement) = refinement {
            filter = filter.with_refinement(refinement)?;
        }
        Ok(Box::new(filter))
    }

    pub(super) fn diffusion(
        &self,
        body: &Humanoid,
        settings: &DiffusionSettings,
    ) -> Result<Diffusion, ExperimentError> {
        let scales = match (&self.set.start.training, settings.prediction) {
            (Training::Motions(t), prediction) => ProposalScales::from_motions(body, &t.motions, prediction)?,
            (Training::Spread(t), Prediction::None) => ProposalScales::from_root_mean_squares(&t.change),
            (Training::Spread(t), Prediction::ConstantVelocity) => {
                ProposalScales::from_root_mean_squares(&t.change_of_change)
            }
        };
        Ok(Diffusion::new(body.clone(), &scales, settings)?)
    }

    fn likelihood(
        &self,
        settings: &AnnealedParticleFilterSettings,
        beginning: &Beginning,
    ) -> Result<CombinedLikelihood, ExperimentError> {
        let (body, rig, cameras) = (&beginning.body, &self.set.rig, &beginning.cameras);
        let keypoints = || {
            let layout = self.set.keypoints.as_ref().ok_or(ExperimentError::NoKeypoints)?.layout;
            let own = KeypointLikelihood::new(body.clone(), rig, layout, settings.keypoints)?;
            Ok::<_, ExperimentError>(own.with_corrected_cameras(cameras))
        };
        if settings.evidence == EvidenceSource::Keypoints {
            return Ok(CombinedLikelihood::Keypoints(keypoints()?));
        }
        let search = settings.search();
        let mut silhouettes =
            SilhouetteLikelihood::new(body.clone(), rig, search.likelihood)?.with_corrected_cameras(cameras);
        if search.refinement.is_some() {
            silhouettes = silhouettes.with_descent();
        }
        if beginning.is_calibrated {
            silhouettes = silhouettes.with_light_extremities();
        }
        if let Some(plausibility) = search.plausibility {
            silhouettes = silhouettes.with_plausibility(plausibility)?;
        }
        Ok(match settings.evidence {
            EvidenceSource::Both => CombinedLikelihood::Both(silhouettes, keypoints()?),
            _ => CombinedLikelihood::Silhouettes(silhouettes),
        })
    }

    fn latent(
        &self,
        learned: &LearnedMotion<'_>,
        search: &SearchSettings,
        models: &mut Models,
        seed: u64,
    ) -> Result<Box<dyn Tracker>, ExperimentError> {
        let body = &self.set.start.body;
        let mut model = models.latent(learned, self.set, self.truth, self.progress)?;
        let mut likelihood = SilhouetteLikelihood::new(body.clone(), &self.set.rig, search.likelihood)?;
        if search.refinement.is_some() {
            (model, likelihood) = (model.with_descent(), likelihood.with_descent());
        }
        let mut filter = AnnealedParticleFilter::new(search.filter, model, likelihood, seed)?;
        if let Some(settings) = search.refinement {
            filter = filter.with_refinement(Refinement::new(settings, body, Vec::new(), seed)?)?;
        }
        Ok(Box::new(filter))
    }
}
