//! The solid that bodies are mostly made of.

use nalgebra::{Isometry3, Point3};

/// Convex hull of two balls: a capsule where the radii are equal, a ball where the centres are (or one holds the other).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TaperedCapsule {
    /// Centre of the first ball, metres.
    pub a: Point3<f64>,
    /// Centre of the second ball, metres.
    pub b: Point3<f64>,
    /// Radius of the first ball, metres, >= 0.
    pub radius_a: f64,
    /// Radius of the second ball, metres, >= 0.
    pub radius_b: f64,
}

impl TaperedCapsule {
    /// The same solid in another frame.
    pub fn transformed(&self, to_from_here: &Isometry3<f64>) -> Self {
        Self { a: to_from_here * self.a, b: to_from_here * self.b, ..*self }
    }
}
