//! Lifts parts that sink after planting out of the ground: limbs by their joints, the rest with the whole body.

use nalgebra::Vector3;

use super::lifts::smooth_lifts;
use skiagraph_core::body::{Humanoid, LinkFrames, Motion};
use skiagraph_core::parallel;

/// Smaller depths are left to the lift of the whole body, metres.
const SHALLOW: f64 = 0.0005;
/// A link lifted by this much is held as firmly as a foot, metres; with smaller lifts less firmly, so that holding
/// begins and ends without a jump.
const FIRM: f64 = 0.01;

/// Required lift of each link, frame by frame.
pub(super) struct LinkLifts {
    /// The links with geometry.
    links: Vec<usize>,
    /// Metres, one row per link of the body.
    lifts: Vec<Vec<f64>>,
}

impl LinkLifts {
    /// No lifts.
    pub(super) fn new(body: &Humanoid, frames: usize) -> Self {
        let links = (0..body.links.len()).filter(|&link| !body.links[link].solids.is_empty()).collect();
        Self { links, lifts: vec![vec![0.0; frames]; body.links.len()] }
    }

    /// Increases the lifts of links that still sink in `motion`, which was computed with the current lifts. Returns
    /// whether any link sinks.
    pub(super) fn raise(&mut self, body: &Humanoid, motion: &Motion) -> bool {
        let frames = parallel::map(motion.poses.len(), |frame| body.link_frames(&motion.poses[frame]));
        let more = parallel::map(self.links.len(), |index| {
            let link = [self.links[index]];
            let depths: Vec<f64> = frames.iter().map(|frames| depth(body, frames, &link)).collect();
            let sinks = depths.iter().any(|depth| *depth > SHALLOW);
            sinks.then(|| smooth_lifts(&depths, motion.frames_per_second))
        });
        let mut any = false;
        for (&link, more) in self.links.iter().zip(more) {
            any |= more.is_some();
            self.lifts[link].iter_mut().zip(more.into_iter().flatten()).for_each(|(lift, more)| *lift += more);
        }
        any
    }

    pub(super) fn any(&self, frame: usize) -> bool {
        self.lifts.iter().any(|lifts| lifts[frame] > 0.0)
    }

    /// Lift of a link in a frame, world, metres.
    pub(super) fn shift(&self, link: usize, frame: usize) -> Vector3<f64> {
        Vector3::z() * self.lifts[link][frame]
    }

    /// Weight with which a lifted link is held, 0 to 1.
    pub(super) fn firmness(&self, link: usize, frame: usize) -> f64 {
        (self.lifts[link][frame] / FIRM).min(1.0)
    }
}

/// Lifts the whole body where any part is below the ground; returns the lift of every frame, metres.
pub(super) fn lift_whole_body(body: &Humanoid, motion: &mut Motion) -> Vec<f64> {
    let all: Vec<usize> = (0..body.links.len()).collect();
    let depths = parallel::map(motion.poses.len(), |frame| depth(body, &body.link_frames(&motion.poses[frame]), &all));
    let lifts = smooth_lifts(&depths, motion.frames_per_second);
    for (pose, lift) in motion.poses.iter_mut().zip(&lifts) {
        pose.world_from_root.translation.z += lift;
    }
    lifts
}

/// Greatest depth of these links below the ground, metres; 0 above.
fn depth(body: &Humanoid, frames: &LinkFrames, links: &[usize]) -> f64 {
    body.lowest_point(frames, links).map_or(0.0, |lowest| (-lowest.z).max(0.0))
}
