//! Observations: one silhouette per view and frame, exact or spoiled.

mod background;
mod corruption;
mod image;
mod imaging;
mod layers;
mod light;
mod observe;
mod settings;

pub use self::image::Image;
pub use background::{
    BackgroundError, BackgroundMixture, BackgroundSettings, Cleaning, OnlineBackground, OnlineSettings, Risk,
    Segmenter, ShadowRule,
};
pub use corruption::{AXES, CorruptedObserver, Corruption, CorruptionAxis, told_rig, told_start};
pub use imaging::{ImageSettings, SceneCamera, SegmentedObserver};
pub use layers::{LayerImages, LayerObserver, WantedLayers};
pub use observe::{Observer, observe, observe_frame};
pub use settings::{ObservationFacts, ObservationSettings, SilhouetteSource};

use crate::raster::Mask;

/// The images of all cameras of a rig at one time. A tracker gets only these, the cameras, a body and a start pose.
#[derive(Clone, Debug, PartialEq)]
pub struct Observation {
    /// Frame number, from 0.
    pub frame: usize,
    /// Seconds from frame 0.
    pub time_s: f64,
    /// One silhouette per camera, in the rig's order, in the camera's own (distorted) pixels.
    pub silhouettes: Vec<Mask>,
}
