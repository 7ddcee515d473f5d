//! Frames that repeat the one before, as when 30 frames a second are written as 60.

use super::Clip;

/// More equal frames in a row are a body that holds still.
const LONGEST_REPEAT: usize = 8;
/// Fewer different frames tell nothing.
const LEAST_FRAMES: usize = 10;
/// A smaller share of repeated frames is not noted: systems repeat a frame that they lost.
const LEAST_SHARE: f64 = 0.1;

/// A note if many frames repeat the one before.
pub(super) fn note(clip: &Clip) -> Option<String> {
    let runs: Vec<usize> = clip.frames.chunk_by(|one, next| one == next).map(<[_]>::len).collect();
    // the first and last run may be cut
    let inner = runs.get(1..runs.len().saturating_sub(1)).unwrap_or_default();
    let moving: Vec<usize> = inner.iter().copied().filter(|run| *run <= LONGEST_REPEAT).collect();
    let (different, all): (usize, usize) = (moving.len(), moving.iter().sum());
    let repeated = moving.iter().filter(|run| **run > 1).count();
    if different < LEAST_FRAMES || (repeated as f64) < LEAST_SHARE * different as f64 {
        return None;
    }
    let own = clip.frames_per_second * different as f64 / all as f64;
    Some(format!(
        "{} of {all} frames are equal to the one before: {own:.1} different frames a second, written as {}; set \
         `frames_per_second` to at most {own:.1}, or the body moves in steps",
        all - different,
        clip.frames_per_second
    ))
}

#[cfg(test)]
mod tests {
    use nalgebra::Isometry3;

    use super::*;

    // A recording of 30 Hz with every row twice was a body that stops 30 times a second.
    #[test]
    fn frames_written_twice_are_noted() {
        let clip = |places: &[usize]| Clip {
            frames_per_second: 60.0,
            frames: places.iter().map(|place| vec![Isometry3::translation(*place as f64, 0.0, 0.0)]).collect(),
            ..Clip::default()
        };
        let twice = note(&clip(&(0..40).map(|frame| frame / 2).collect::<Vec<_>>())).unwrap();
        let found = "18 of 36 frames are equal to the one before: 30.0 different frames a second";
        assert!(twice.starts_with(found), "{twice}");
        let pulled = note(&clip(&(0..50).map(|frame| frame * 4 / 5).collect::<Vec<_>>())).unwrap();
        assert!(pulled.contains("48.5 different frames"), "{pulled}");
        // still, then moving; and one lost frame
        assert_eq!(note(&clip(&(0..60).map(|frame: usize| frame.saturating_sub(30)).collect::<Vec<_>>())), None);
        assert_eq!(note(&clip(&(0..40).map(|frame| frame - usize::from(frame == 20)).collect::<Vec<_>>())), None);
    }
}
