//! Observations: one silhouette per view and frame, exact or corrupted.
//!
//! [`observe`] renders exact silhouettes, [`CorruptedObserver`] corrupts them along [`AXES`], [`SegmentedObserver`]
//! segments them from simulated images, and [`TruthImageObserver`] renders the truth of every pixel.
//! [`KeypointDetector`] finds the keypoints of the actor, exact or with the errors of a detector.
//!
//! ```
//! use skiagraph_core::body::{Motion, shipped};
//! use skiagraph_core::camera::{CameraRig, RingParameters};
//! use skiagraph_truth::observing::{CorruptedObserver, Corruption, observe};
//! use skiagraph_truth::scene::GroundTruth;
//!
//! let body = shipped("tracker25")?;
//! let mut pose = body.zero_pose();
//! pose.world_from_root.translation.z = 0.95;
//! let motion = Motion { frames_per_second: 30.0, poses: vec![pose; 2] };
//! let ring = RingParameters { count: 2, radius: 3.5, image_size: [80, 60], ..RingParameters::default() };
//! let rig = CameraRig::ring(&ring)?;
//! let truth = GroundTruth::from_motion(body, &motion, &rig)?;
//! let exact = observe(&truth, &rig);
//! let corruption = Corruption { holes: 0.1, ..Corruption::default() };
//! let corrupted = CorruptedObserver::new(&truth, &rig, corruption, 1).observe(0);
//! assert!(corrupted.silhouettes[0].count() < exact[0].silhouettes[0].count());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

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
