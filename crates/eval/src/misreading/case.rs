//! Input and result of the search for a misreading.

use nalgebra::Point3;

use super::{Correction, GivenPositions};
use crate::body::Markers;

/// An estimate as it was read, with the truth.
#[derive(Clone, Debug)]
pub struct MisreadingCase<'a> {
    /// Frames per second.
    pub frames_per_second: f64,
    /// The true markers, one entry per frame, metres.
    pub truth: &'a [Markers],
    /// The repetitions, each with the same number of frames.
    pub given: Vec<GivenPositions<'a>>,
    /// Positions of the cameras, metres: one entry per frame, or a single one if they are fixed; empty if unknown.
    pub cameras: &'a [Vec<Point3<f64>>],
    /// Factors of lengths for the other known units.
    pub scales: Vec<f64>,
}

/// An explanation of most of an estimate's error.
#[derive(Clone, Debug, PartialEq)]
pub struct Misreading {
    /// How the estimate should be read.
    pub correction: Correction,
    /// Mean distance of the markers as the estimate was read, metres.
    pub error_as_read_m: f64,
    /// The same after the correction, metres.
    pub error_corrected_m: f64,
    /// Greatest shift that was searched, frames in either direction: the right one may be beyond it.
    pub longest_shift: i64,
}
