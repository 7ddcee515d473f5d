//! What the cameras saw: one silhouette per view and instant.

mod observe;

pub use observe::{Observer, observe, observe_frame};

use crate::raster::Mask;

/// What all cameras of a rig saw at one instant. This, the cameras, a body and a start pose are all a tracker gets.
#[derive(Clone, Debug, PartialEq)]
pub struct Observation {
    /// Frame number, from 0.
    pub frame: usize,
    /// Seconds from frame 0.
    pub time_s: f64,
    /// One silhouette per camera, in the rig's order, in the camera's own (distorted) pixels.
    pub silhouettes: Vec<Mask>,
}
