//! Runs of frames in which something stands.

use std::ops::Range;

/// Names of the tracks of the left and of the right foot.
pub const FOOT_NAMES: [&str; 2] = ["left foot", "right foot"];

/// Frames of one uninterrupted contact.
pub type Stance = Range<usize>;

/// The uninterrupted contacts of a list of labels, in order.
pub fn stances(in_contact: &[bool]) -> Vec<Stance> {
    let mut found: Vec<Stance> = Vec::new();
    for frame in (0..in_contact.len()).filter(|&frame| in_contact[frame]) {
        match found.last_mut() {
            Some(stance) if stance.end == frame => stance.end += 1,
            _ => found.push(frame..frame + 1),
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stances_are_the_runs_of_contact() {
        assert_eq!(stances(&[true, true, false, true, false, false, true]), [0..2, 3..4, 6..7]);
        assert!(stances(&[false; 3]).is_empty() && stances(&[]).is_empty());
    }
}
