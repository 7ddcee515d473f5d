//! Observes a scene again as a set says that it was observed.

use crate::camera::TimedRig;
use crate::observation::Observation;
use crate::observing::{CorruptedObserver, ObservationFacts, Observer, SegmentedObserver, SilhouetteSource};
use crate::rng::KeyedSeed;
use crate::scene::GroundTruth;

/// Draws the silhouettes of a set.
pub(super) enum SetObserver<'a> {
    Exact(Box<Observer<'a>>),
    Corrupted(Box<CorruptedObserver<'a>>),
    Segmented(Box<SegmentedObserver<'a>>),
}

impl<'a> SetObserver<'a> {
    pub(super) fn new(
        truth: &'a GroundTruth,
        filming: &TimedRig,
        facts: &ObservationFacts,
        seed: KeyedSeed,
    ) -> Result<Self, String> {
        Ok(match facts.silhouette {
            SilhouetteSource::Exact => Self::Exact(Box::new(Observer::from_filming(truth, filming))),
            SilhouetteSource::Corrupted => {
                Self::Corrupted(Box::new(CorruptedObserver::from_filming(truth, filming, facts.corruption, seed)))
            }
            SilhouetteSource::Segmented => {
                let (images, background) = (facts.images.unwrap_or_default(), facts.background.unwrap_or_default());
                let observer = SegmentedObserver::new(truth, filming.rig(), &images, &background, seed);
                Self::Segmented(Box::new(observer.map_err(|e| format!("not checked: set.toml: {e}"))?))
            }
        })
    }

    pub(super) fn observe(&self, frame: usize) -> Observation {
        match self {
            Self::Exact(observer) => observer.foreground(frame),
            Self::Corrupted(observer) => observer.observe(frame),
            Self::Segmented(observer) => observer.observe(frame),
        }
    }
}
