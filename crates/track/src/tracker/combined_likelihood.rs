//! The energy of a pose from silhouettes, from keypoints, or from both.

use super::keypoint_likelihood::KeypointScratch;
use super::{KeypointLikelihood, Likelihood, LikelihoodScratch, SilhouetteLikelihood, TrackError};
use crate::motion_model::NormalEquations;
use skiagraph_core::body::Pose;
use skiagraph_core::observation::Observation;

/// Silhouettes, keypoints, or both. The energy of both is that of the silhouettes plus that of the keypoints times
/// its weight.
#[derive(Debug)]
#[expect(clippy::large_enum_variant, reason = "one per tracker")]
pub enum CombinedLikelihood {
    /// Silhouettes alone.
    Silhouettes(SilhouetteLikelihood),
    /// Keypoints alone.
    Keypoints(KeypointLikelihood),
    /// Silhouettes and keypoints.
    Both(SilhouetteLikelihood, KeypointLikelihood),
}

/// Scratch buffers of one thread; `None` for the evidence that is not used.
pub struct CombinedScratch {
    silhouettes: Option<LikelihoodScratch>,
    keypoints: Option<KeypointScratch>,
}

impl CombinedLikelihood {
    fn silhouettes(&self) -> Option<&SilhouetteLikelihood> {
        match self {
            Self::Silhouettes(silhouettes) | Self::Both(silhouettes, _) => Some(silhouettes),
            Self::Keypoints(_) => None,
        }
    }

    fn keypoints(&self) -> Option<&KeypointLikelihood> {
        match self {
            Self::Keypoints(keypoints) | Self::Both(_, keypoints) => Some(keypoints),
            Self::Silhouettes(_) => None,
        }
    }
}

impl Likelihood for CombinedLikelihood {
    type Scratch = CombinedScratch;

    fn scratch(&self) -> CombinedScratch {
        CombinedScratch {
            silhouettes: self.silhouettes().map(Likelihood::scratch),
            keypoints: self.keypoints().map(Likelihood::scratch),
        }
    }

    fn prepare(&mut self, observation: &Observation) -> Result<(), TrackError> {
        match self {
            Self::Silhouettes(silhouettes) => silhouettes.prepare(observation),
            Self::Keypoints(keypoints) => keypoints.prepare(observation),
            Self::Both(silhouettes, keypoints) => {
                silhouettes.prepare(observation)?;
                keypoints.prepare(observation)
            }
        }
    }

    fn start(&mut self, start: &Pose) {
        if let Self::Silhouettes(silhouettes) | Self::Both(silhouettes, _) = self {
            silhouettes.start(start);
        }
    }

    /// With silhouettes, the offsets between the detector's and the body's points are learned: silhouettes place the
    /// body without the detector.
    fn learn(&mut self, estimate: &Pose) {
        match self {
            Self::Silhouettes(silhouettes) => silhouettes.learn(estimate),
            Self::Both(silhouettes, keypoints) => {
                silhouettes.learn(estimate);
                keypoints.learn_offsets(estimate);
            }
            Self::Keypoints(_) => {}
        }
    }

    fn energy(&self, pose: &Pose, scratch: &mut CombinedScratch) -> f64 {
        let mut energy = 0.0;
        self.energies(&[pose], std::slice::from_mut(&mut energy), scratch);
        energy
    }

    fn energies(&self, poses: &[&Pose], energies: &mut [f64], scratch: &mut CombinedScratch) {
        energies.fill(0.0);
        let silhouettes = self.silhouettes().zip(scratch.silhouettes.as_mut());
        let keypoints = self.keypoints().zip(scratch.keypoints.as_mut());
        if let Some((silhouettes, scratch)) = silhouettes {
            silhouettes.energies(poses, energies, scratch);
        }
        if let Some((keypoints, buffers)) = keypoints {
            for (pose, energy) in poses.iter().zip(energies).filter(|(_, energy)| energy.is_finite()) {
                *energy += keypoints.weight() * keypoints.energy(pose, buffers);
            }
        }
    }

    fn energy_unrejected(&self, pose: &Pose, scratch: &mut CombinedScratch) -> f64 {
        let silhouettes = self.silhouettes().zip(scratch.silhouettes.as_mut());
        let keypoints = self.keypoints().zip(scratch.keypoints.as_mut());
        let silhouettes = silhouettes.map_or(0.0, |(own, scratch)| own.energy_unrejected(pose, scratch));
        keypoints.map_or(silhouettes, |(own, buffers)| silhouettes + own.weight() * own.energy(pose, buffers))
    }

    fn believe(&mut self) -> bool {
        match self {
            Self::Silhouettes(own) | Self::Both(own, _) => own.believe(),
            Self::Keypoints(_) => false,
        }
    }

    fn descends(&self) -> bool {
        self.silhouettes().is_none_or(Likelihood::descends)
    }

    fn linearise(&self, pose: &Pose, width: f64, scratch: &mut CombinedScratch) -> Option<NormalEquations> {
        let silhouettes = self.silhouettes().zip(scratch.silhouettes.as_mut());
        let keypoints = self.keypoints().zip(scratch.keypoints.as_mut());
        match (silhouettes, keypoints) {
            (Some((own, scratch)), None) => own.linearise(pose, width, scratch),
            (None, Some((own, buffers))) => own.linearise(pose, width, buffers),
            (Some((silhouettes, scratch)), Some((keypoints, buffers))) => {
                Some(silhouettes.linearise(pose, width, scratch)?.with(keypoints.linearise(pose, width, buffers)?))
            }
            (None, None) => None,
        }
    }

    fn agreement(&self, pose: &Pose, width: f64, scratch: &mut CombinedScratch) -> Option<f64> {
        self.silhouettes()?.agreement(pose, width, scratch.silhouettes.as_mut()?)
    }

    /// 0 with keypoints: they may contradict a pose whose outlines agree.
    fn views(&self) -> usize {
        if let Self::Silhouettes(silhouettes) = self { silhouettes.views() } else { 0 }
    }
}
