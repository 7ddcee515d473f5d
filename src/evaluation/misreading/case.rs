//! What is asked, and what is found.

use nalgebra::Point3;

use super::{Correction, GivenPositions};
use crate::body::Markers;

/// An estimate as it was read, with the truth.
#[derive(Clone, Debug)]
pub struct MisreadingCase<'a> {
    /// Frames a second.
    pub frames_per_second: f64,
    /// The true markers, one entry a frame, metres.
    pub truth: &'a [Markers],
    /// Every repetition, of as many frames.
    pub given: Vec<GivenPositions<'a>>,
    /// Where the cameras are, one entry a frame, or a single one where they stand still, metres; empty where none are
    /// known.
    pub cameras: &'a [Vec<Point3<f64>>],
    /// Factors that lengths would have to be multiplied by if their unit were another known one.
    pub scales: Vec<f64>,
}

/// An explanation of most of an estimate's error.
#[derive(Clone, Debug, PartialEq)]
pub struct Misreading {
    /// How the estimate is to be read.
    pub correction: Correction,
    /// Mean distance of the markers as the estimate was read, metres.
    pub error_as_read_m: f64,
    /// The same when it is read so, metres.
    pub error_corrected_m: f64,
}
