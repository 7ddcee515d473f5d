//! Frames in which a point is not seen.
//!
//! A gap is filled by a straight line between the places before and behind it, relative to points that move with the
//! trunk where there are some; at an end the last place is held.

use nalgebra::{Point3, Vector3};

/// A point over all frames, metres.
pub(super) type Track = Vec<Option<Point3<f64>>>;

/// What was missing of a track.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Missing {
    pub(super) frames: usize,
    pub(super) longest: usize,
}

/// How many frames lack a point.
pub(super) fn missing(track: &Track) -> Missing {
    let runs = track.split(Option::is_some).map(<[_]>::len);
    Missing { frames: track.iter().filter(|place| place.is_none()).count(), longest: runs.max().unwrap_or(0) }
}

/// The track without gaps; `reference` is where the trunk is in every frame.
///
/// `None` for a track that is never seen.
pub(super) fn filled(track: &Track, reference: &[Vector3<f64>]) -> Option<Vec<Point3<f64>>> {
    let own = |frame: usize| Some(track.get(frame).copied()??.coords - reference[frame]);
    let seen: Vec<usize> = (0..track.len()).filter(|frame| track[*frame].is_some()).collect();
    let (first, last) = (*seen.first()?, *seen.last()?);
    let at = |frame: usize| {
        let behind = seen.partition_point(|seen| *seen < frame);
        let (before, behind) = match seen.get(behind) {
            Some(same) if *same == frame => (frame, frame),
            Some(next) if behind > 0 => (seen[behind - 1], *next),
            Some(_) => (first, first),
            None => (last, last),
        };
        let share = if behind > before { (frame - before) as f64 / (behind - before) as f64 } else { 0.0 };
        Some(Point3::from(own(before)?.lerp(&own(behind)?, share) + reference[frame]))
    };
    (0..track.len()).map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_are_filled_along_with_the_trunk_and_held_at_the_ends() {
        let reference: Vec<Vector3<f64>> = (0..6).map(|i| Vector3::x() * f64::from(i)).collect();
        let place = |x: f64, z: f64| Some(Point3::new(x, 0.0, z));
        let track = vec![None, place(1.0, 0.0), None, None, place(4.0, 3.0), None];
        let found = filled(&track, &reference).unwrap();
        let expected = [(0.0, 0.0), (1.0, 0.0), (2.0, 1.0), (3.0, 2.0), (4.0, 3.0), (5.0, 3.0)];
        for (found, (x, z)) in found.iter().zip(expected) {
            assert!((found - Point3::new(x, 0.0, z)).norm() < 1e-12, "{found}");
        }
        assert_eq!(missing(&track), Missing { frames: 4, longest: 2 });
        assert_eq!(filled(&vec![None; 3], &reference), None);
    }
}
