//! Silhouettes from the source configured in a scenario or recorded in a set.

use super::{BackgroundError, CorruptedObserver, ObservationFacts, Observer, SegmentedObserver, SilhouetteSource};
use crate::scene::GroundTruth;
use skiagraph_core::camera::TimedRig;
use skiagraph_core::observation::Observation;
use skiagraph_core::rng::KeyedSeed;

/// Observes any frame of the truth, from any thread.
pub enum SilhouetteObserver<'a> {
    /// Exact silhouettes.
    Exact(Box<Observer<'a>>),
    /// Corrupted silhouettes.
    Corrupted(Box<CorruptedObserver<'a>>),
    /// Silhouettes segmented from images.
    Segmented(Box<SegmentedObserver<'a>>),
}

impl<'a> SilhouetteObserver<'a> {
    /// An observer with the true cameras, which must be static if silhouettes are segmented.
    pub fn new(
        truth: &'a GroundTruth,
        rig: &TimedRig,
        facts: &ObservationFacts,
        seed: KeyedSeed,
    ) -> Result<Self, BackgroundError> {
        Ok(match facts.silhouette {
            // no truth has footage
            SilhouetteSource::Exact | SilhouetteSource::Footage => Self::Exact(Box::new(Observer::new(truth, rig))),
            SilhouetteSource::Corrupted => {
                Self::Corrupted(Box::new(CorruptedObserver::new(truth, rig, facts.corruption, seed)))
            }
            SilhouetteSource::Segmented => {
                let (images, background) = (facts.images.unwrap_or_default(), facts.background.unwrap_or_default());
                Self::Segmented(Box::new(SegmentedObserver::new(truth, rig.rig(), &images, &background, seed)?))
            }
        })
    }

    /// The observation of one frame, which must exist in the truth, including distractors.
    pub fn observe(&self, frame: usize) -> Observation {
        match self {
            Self::Exact(observer) => observer.foreground(frame),
            Self::Corrupted(observer) => observer.observe(frame),
            Self::Segmented(observer) => observer.observe(frame),
        }
    }
}
