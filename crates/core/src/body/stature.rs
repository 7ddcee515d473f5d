//! How tall a body is.

use super::{Humanoid, Landmark};

impl Humanoid {
    /// From the lowest point of the body to the top of its head, upright at its zero pose, metres; `None` for a body
    /// without a head or solids.
    pub fn stature(&self) -> Option<f64> {
        let frames = self.link_frames(&self.zero_pose());
        let top = self.markers(&frames)[Landmark::HeadTop as usize]?;
        let links: Vec<usize> = (0..self.links.len()).collect();
        Some(top.z - self.lowest_point(&frames, &links)?.z)
    }
}
