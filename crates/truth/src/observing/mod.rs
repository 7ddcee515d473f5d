//! Observations: one silhouette per view and frame, exact or corrupted.
//!
//! [`observe`] renders exact silhouettes, [`CorruptedObserver`] corrupts them along [`AXES`], [`SegmentedObserver`]
//! segments them from simulated images, and [`TruthImageObserver`] renders the truth of every pixel.
//! [`KeypointDetector`] finds the keypoints of the actor, exact or with the errors of a detector.

mod background;
mod corruption;
mod eye;
mod image;
mod imaging;
mod keypoints;
mod light;
mod observe;
mod settings;
mod silhouette_observer;
mod truth_images;

pub use corruption::{CorruptedObserver, Corruption};
pub use observe::{Observer, observe};
pub use settings::ObservationSettings;

// Kinds of observers and their parts, for the application and the studies: scenarios describe them to users.
#[doc(hidden)]
pub use self::{
    background::{
        BackgroundError, BackgroundMixture, BackgroundSettings, Cleaning, LEAST_BACKGROUND, Risk, Segmenter, ShadowRule,
    },
    corruption::{AXES, BOUNDARY_CORRELATION_PX, CorruptionAxis, tracker_rig, tracker_start},
    image::Image,
    imaging::{ColourCamera, ImageSettings, SceneCamera, SegmentedObserver, image_from_jpeg},
    keypoints::{KEYPOINT_AXES, KeypointAxis, KeypointDetector, KeypointSettings, KeypointView, SequenceKeypoints},
    settings::{ColourFormat, ObservationFacts, PlacePreset, SilhouetteSource},
    silhouette_observer::SilhouetteObserver,
    truth_images::{TruthImageObserver, TruthImages, WantedTruthImages},
};
