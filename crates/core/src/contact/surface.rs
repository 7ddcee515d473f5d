//! The interface between contact and the representation of a body's surface.

use nalgebra::Point3;

use crate::body::{Humanoid, LinkFrames};

/// A point of a body's surface that moves with a link.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// Index of the link that carries it.
    pub link: usize,
    /// World, metres.
    pub point: Point3<f64>,
}

/// A surface that can touch the ground z = 0.
pub trait Surface: Sync {
    /// The lowest point of the surface of these links; `None` where they have none.
    fn lowest_point(&self, frames: &LinkFrames, links: &[usize]) -> Option<SurfacePoint>;
}

/// The skin of the body, or its solids.
impl Surface for Humanoid {
    fn lowest_point(&self, frames: &LinkFrames, links: &[usize]) -> Option<SurfacePoint> {
        self.lowest_on_link(frames, links).map(|(link, point)| SurfacePoint { link, point })
    }
}
