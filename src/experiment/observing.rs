//! What the cameras saw, as the scenario's `[observation]` wants it.

use crate::camera::CameraRig;
use crate::observation::{CorruptedObserver, Observation, ObservationSettings, Observer, SilhouetteSource};
use crate::scene::GroundTruth;

/// Sees any frame of the truth, from any thread.
pub(super) enum Observing<'a> {
    /// Exactly.
    Exact(Box<Observer<'a>>),
    /// With corrupted masks.
    Corrupted(Box<CorruptedObserver<'a>>),
}

impl<'a> Observing<'a> {
    /// Through the true cameras.
    pub(super) fn new(truth: &'a GroundTruth, rig: &CameraRig, settings: &ObservationSettings) -> Self {
        match settings.silhouette {
            SilhouetteSource::Exact => Self::Exact(Box::new(Observer::new(truth, rig))),
            SilhouetteSource::Corrupted => {
                let seed = u64::from(settings.seed);
                Self::Corrupted(Box::new(CorruptedObserver::new(truth, rig, settings.corruption, seed)))
            }
        }
    }

    /// The observation of one frame, which the truth must have.
    pub(super) fn observe(&self, frame: usize) -> Observation {
        match self {
            Self::Exact(observer) => observer.observe(frame),
            Self::Corrupted(observer) => observer.observe(frame),
        }
    }
}
