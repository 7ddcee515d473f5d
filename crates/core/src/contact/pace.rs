//! How fast a motion passes the recording it was made of.

/// Times as fast as it was recorded, frame by frame; where there is none, as fast. A stance is found at the recording's
/// own speed: a step that is played at a quarter of its speed is a step, though its foot swings as slowly as others
/// stand.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pace<'a>(
    /// One finite number above 0 a frame, 0.25 for a quarter of the recorded speed; empty for none.
    pub &'a [f64],
);

impl Pace<'_> {
    /// Times as fast as recorded in a frame.
    #[inline]
    pub fn at(&self, frame: usize) -> f64 {
        self.0.get(frame).copied().unwrap_or(1.0)
    }
}
