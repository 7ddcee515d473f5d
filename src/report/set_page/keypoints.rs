//! Keypoints over the images of a set.

use serde::Serialize;

/// Found keypoints with their marks.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SetKeypointMarks {
    /// `[stored frame][camera]`: what was found.
    pub views: Vec<Vec<Vec<KeypointMark>>>,
    /// Whether the truth is known, so that marks differ.
    pub is_told: bool,
}

/// A found keypoint: pixels from the outer corner of the top-left pixel, rounded to a tenth, and its mark: 0 visible or
/// unknown, 1 hidden, 2 exchanged.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct KeypointMark(f64, f64, u8);

impl KeypointMark {
    /// A keypoint at a pixel.
    pub fn new([x, y]: [f64; 2], mark: u8) -> Self {
        let rounded = |pixel: f64| (10.0 * pixel).round() / 10.0;
        Self(rounded(x), rounded(y), mark)
    }
}
