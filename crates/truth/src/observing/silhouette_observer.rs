//! Silhouettes as a scenario wants them, or as a set says that they were made.

use super::{BackgroundError, CorruptedObserver, ObservationFacts, Observer, SegmentedObserver, SilhouetteSource};
use crate::camera::TimedRig;
use crate::observation::Observation;
use crate::rng::KeyedSeed;
use crate::scene::GroundTruth;

/// Sees any frame of the truth, from any thread.
pub enum SilhouetteObserver<'a> {
    /// Exactly.
    Exact(Box<Observer<'a>>),
    /// With corrupted masks.
    Corrupted(Box<CorruptedObserver<'a>>),
    /// In images.
    Segmented(Box<SegmentedObserver<'a>>),
}

impl<'a> SilhouetteObserver<'a> {
    /// Through the true cameras, which must stand still where silhouettes are segmented.
    ///
    /// # Errors
    /// [`BackgroundError`] where silhouettes are segmented and the background cannot be learned.
    pub fn new(
        truth: &'a GroundTruth,
        rig: &TimedRig,
        facts: &ObservationFacts,
        seed: KeyedSeed,
    ) -> Result<Self, BackgroundError> {
        Ok(match facts.silhouette {
            SilhouetteSource::Exact => Self::Exact(Box::new(Observer::new(truth, rig))),
            SilhouetteSource::Corrupted => {
                Self::Corrupted(Box::new(CorruptedObserver::new(truth, rig, facts.corruption, seed)))
            }
            SilhouetteSource::Segmented => {
                let (images, background) = (facts.images.unwrap_or_default(), facts.background.unwrap_or_default());
                Self::Segmented(Box::new(SegmentedObserver::new(truth, rig.rig(), &images, &background, seed)?))
            }
        })
    }

    /// The observation of one frame, which the truth must have; everybody is in it, distractors too.
    pub fn observe(&self, frame: usize) -> Observation {
        match self {
            Self::Exact(observer) => observer.foreground(frame),
            Self::Corrupted(observer) => observer.observe(frame),
            Self::Segmented(observer) => observer.observe(frame),
        }
    }
}
