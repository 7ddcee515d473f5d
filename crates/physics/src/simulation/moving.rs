//! The state of a moving body at one time, for control.

use nalgebra::{Point3, Vector3};

use skiagraph_core::body::{Humanoid, LinkFrames, Pose};

/// A pose, its rates, and quantities derived from both.
pub(super) struct BodyState {
    pub(super) pose: Pose,
    /// Rates in the order of [`Humanoid::difference`], per second.
    pub(super) rates: Vec<f64>,
    pub(super) frames: LinkFrames,
    /// Centre of mass, world, metres.
    pub(super) centre: Point3<f64>,
    /// Its velocity, m/s.
    pub(super) velocity: Vector3<f64>,
}

impl BodyState {
    pub(super) fn new(body: &Humanoid, pose: Pose, rates: Vec<f64>) -> Self {
        /// Finite-difference step, seconds: above round-off, below curvature.
        const INSTANT: f64 = 1e-5;
        let centre = |frames: &LinkFrames| body.centre_of_mass(frames).unwrap_or_else(Point3::origin);
        let moved: Vec<f64> = rates.iter().map(|rate| rate * INSTANT).collect();
        let soon = centre(&body.link_frames(&body.step(&pose, &moved)));
        let frames = body.link_frames(&pose);
        let centre = centre(&frames);
        Self { pose, rates, frames, centre, velocity: (soon - centre) / INSTANT }
    }
}
