//! Observations: one silhouette per view and frame.

mod observe;

pub use observe::{Observer, observe, observe_frame};

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
