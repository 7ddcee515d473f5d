//! Energies of true and estimated poses, frame by frame.

use super::SearchRecord;
use super::tracked::Tracked;
use crate::prepare::retargeting::refit;
use skiagraph_core::body::{Humanoid, Markers, Motion, Pose};
use skiagraph_core::camera::CameraRig;
use skiagraph_core::observation::Observation;
use skiagraph_set::{BenchmarkSet, BlindSet};
use skiagraph_track::motion_model::SettingError;
use skiagraph_track::tracker::{
    CameraCorrection, Likelihood, PlausibilitySettings, SilhouetteLikelihood, SilhouetteSettings, TrackError,
};

/// The energies that a tracker recorded; empty for trackers without a likelihood.
pub(super) fn recorded_energies(records: &[SearchRecord]) -> Vec<Option<f64>> {
    if records.iter().all(|r| r.energy.is_none()) { Vec::new() } else { records.iter().map(|r| r.energy).collect() }
}

/// The truth refitted to a calibrated body.
pub(super) fn refitted(body: &Humanoid, set: &BenchmarkSet) -> Motion {
    let truth = &set.truth.ground_truth;
    let markers: Vec<Markers> = truth.frames.iter().map(|frame| frame.markers).collect();
    refit(body, &markers, truth.frames_per_second)
}

/// Energies to compute, frame by frame: of the truth by the tracker's own likelihood, or of a program's poses.
#[derive(Default)]
pub(super) struct AskedEnergies {
    settings: SilhouetteSettings,
    plausibility: Option<PlausibilitySettings>,
    /// The body and the corrections of the cameras of each likelihood.
    bodies: Vec<(Humanoid, Vec<CameraCorrection>)>,
    /// The likelihood of each motion, and its poses.
    motions: Vec<(usize, Vec<Option<Pose>>)>,
    /// The motion that is the truth of each seed.
    truths: Vec<usize>,
    /// The motion that is the estimate of each seed, for programs.
    estimates: Vec<usize>,
}

impl AskedEnergies {
    /// Those of a run. The truth is refitted to the body that each seed used, as given or as calibrated, and seen by
    /// the cameras as the seed corrected them. The likelihood of another program is unknown, so the default one judges
    /// its poses and the truth. Nothing is asked of trackers without a likelihood and of estimates without poses.
    pub(super) fn new(set: &BenchmarkSet, tracked: &Tracked) -> Self {
        let (given, sequences) = (&set.blind.start.body, &tracked.estimates.sequences);
        let mut asked = Self::default();
        let Some(record) = &tracked.record else {
            if sequences.iter().any(|sequence| sequence.poses().is_some()) {
                asked.bodies.push((given.clone(), Vec::new()));
                let truth = set.truth.refitted.clone().unwrap_or_else(|| refitted(given, set));
                asked.motions.push((0, truth.poses.into_iter().map(Some).collect()));
                asked.truths = vec![0; sequences.len()];
                for sequence in sequences {
                    asked.estimates.push(asked.motions.len());
                    let frames = if sequence.poses().is_some() { 0..set.blind.frame_count } else { 0..0 };
                    asked.motions.push((0, frames.map(|frame| sequence.pose(frame).cloned()).collect()));
                }
            }
            return asked;
        };
        let Some(search) = record.tracker.kind().search else { return asked };
        (asked.settings, asked.plausibility) = (search.likelihood, search.plausibility);
        let mut of_given = None;
        for seed in 0..sequences.len() {
            let own = tracked.estimates.bodies.get(seed);
            let motion = match (own, of_given, &set.truth.refitted) {
                (None, Some(known), _) => known,
                (None, None, None) => continue,
                (own, _, given_truth) => {
                    let cameras = own.and(record.calibration.get(seed)).map(|report| report.cameras.clone());
                    let truth = own.map(|body| refitted(body, set)).or(given_truth.clone());
                    let poses = truth.map_or_else(Vec::new, |truth| truth.poses);
                    asked.motions.push((asked.bodies.len(), poses.into_iter().map(Some).collect()));
                    asked.bodies.push((own.unwrap_or(given).clone(), cameras.unwrap_or_default()));
                    asked.motions.len() - 1
                }
            };
            if own.is_none() {
                of_given = Some(motion);
            }
            asked.truths.push(motion);
        }
        asked
    }

    /// The likelihood of every body, not yet prepared for a frame.
    pub(super) fn likelihoods(&self, rig: &CameraRig) -> Result<Vec<SilhouetteLikelihood>, SettingError> {
        let one = |(body, cameras): &(Humanoid, Vec<CameraCorrection>)| {
            let likelihood =
                SilhouetteLikelihood::new(body.clone(), rig, self.settings)?.with_corrected_cameras(cameras);
            match self.plausibility {
                Some(plausibility) => likelihood.with_plausibility(plausibility),
                None => Ok(likelihood),
            }
        };
        self.bodies.iter().map(one).collect()
    }

    /// The energy of every motion in a frame; the images are prepared once.
    pub(super) fn of_frame(
        &self,
        likelihoods: &mut [SilhouetteLikelihood],
        observation: &Observation,
        frame: usize,
    ) -> Result<Vec<Option<f64>>, TrackError> {
        let mut energies = vec![None; self.motions.len()];
        for index in 0..likelihoods.len() {
            let (before, from) = likelihoods.split_at_mut(index);
            match before.last_mut() {
                None => from[0].prepare(observation)?,
                Some(seen) => from[0].prepare_from(seen, observation)?,
            }
            let mut scratch = from[0].scratch();
            for (energy, (likelihood, poses)) in energies.iter_mut().zip(&self.motions) {
                if let Some(Some(pose)) = poses.get(frame).filter(|_| *likelihood == index) {
                    *energy = Some(from[0].energy_unrejected(pose, &mut scratch));
                }
            }
        }
        Ok(energies)
    }

    /// The energy of the truth of each seed and frame.
    pub(super) fn of_truth(&self, seed: usize, frames: &[Vec<Option<f64>>]) -> Vec<Option<f64>> {
        self.of_motion(self.truths.get(seed), frames)
    }

    /// The energy of a program's estimates, by seed and frame.
    pub(super) fn of_program(&self, seed: usize, frames: &[Vec<Option<f64>>]) -> Vec<Option<f64>> {
        self.of_motion(self.estimates.get(seed), frames)
    }

    /// The energies of one motion; empty without its poses.
    fn of_motion(&self, motion: Option<&usize>, frames: &[Vec<Option<f64>>]) -> Vec<Option<f64>> {
        let motion = motion.filter(|motion| !self.motions[**motion].1.is_empty());
        motion.map(|motion| frames.iter().map(|energies| energies[*motion]).collect()).unwrap_or_default()
    }
}

/// Removes the energies of frames in which no camera took an image: there is nothing to compare.
pub(super) fn clear_without_images(energies: &mut [Option<f64>], set: &BlindSet) {
    let is_blind = |frame: usize| (0..set.rig.cameras.len()).all(|camera| !set.has_image(camera, frame));
    energies.iter_mut().enumerate().filter(|(frame, _)| is_blind(*frame)).for_each(|(_, energy)| *energy = None);
}
