//! What the cameras saw, as the scenario's `[observation]` wants it.

use super::{ExperimentError, memory};
use crate::camera::TimedRig;
use crate::observation::{
    CorruptedObserver, Observation, ObservationSettings, Observer, SegmentedObserver, SilhouetteSource,
};
use crate::scene::GroundTruth;

/// Sees any frame of the truth, from any thread.
pub(super) enum Observing<'a> {
    /// Exactly.
    Exact(Box<Observer<'a>>),
    /// With corrupted masks.
    Corrupted(Box<CorruptedObserver<'a>>),
    /// In images.
    Segmented(Box<SegmentedObserver<'a>>),
}

impl<'a> Observing<'a> {
    /// Through the true cameras.
    ///
    /// # Errors
    /// [`ExperimentError::Argument`] where the background cannot be learned, or would take more memory than there is.
    pub(super) fn new(
        truth: &'a GroundTruth,
        filming: &TimedRig,
        settings: &ObservationSettings,
    ) -> Result<Self, ExperimentError> {
        let seed = settings.keyed_seed();
        Ok(match settings.silhouette {
            SilhouetteSource::Exact => Self::Exact(Box::new(Observer::from_filming(truth, filming))),
            SilhouetteSource::Corrupted => {
                Self::Corrupted(Box::new(CorruptedObserver::from_filming(truth, filming, settings.corruption, seed)))
            }
            SilhouetteSource::Segmented => {
                let rig = filming.rig();
                if let Some(detail) = memory::too_little_for(rig, &settings.images, rayon::current_num_threads()) {
                    return Err(ExperimentError::Argument { argument: "observation.silhouette", detail });
                }
                let observer = SegmentedObserver::new(truth, rig, &settings.images, &settings.background, seed);
                let refused = |e: crate::observation::BackgroundError| ExperimentError::Argument {
                    argument: "observation.images.background_frames",
                    detail: e.to_string(),
                };
                Self::Segmented(Box::new(observer.map_err(refused)?))
            }
        })
    }

    /// The observation of one frame, which the truth must have.
    pub(super) fn observe(&self, frame: usize) -> Observation {
        match self {
            Self::Exact(observer) => observer.foreground(frame),
            Self::Corrupted(observer) => observer.observe(frame),
            Self::Segmented(observer) => observer.observe(frame),
        }
    }
}
