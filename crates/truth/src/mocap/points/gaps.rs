//! Interpolation over frames in which a point is missing.
//!
//! A gap is filled by linear interpolation between the positions before and after it, relative to the trunk's points if
//! there are any; gaps at the ends hold the nearest position.

use nalgebra::{Point3, Vector3};

/// A point's position in every frame, metres.
pub(super) type Track = Vec<Option<Point3<f64>>>;

/// Missing frames of a track: their number, and the longest run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct MissingFrames {
    pub(super) frames: usize,
    pub(super) longest: usize,
}

/// Counts the missing frames of a track.
pub(super) fn missing_frames(track: &Track) -> MissingFrames {
    let runs = track.split(Option::is_some).map(<[_]>::len);
    MissingFrames { frames: track.iter().filter(|place| place.is_none()).count(), longest: runs.max().unwrap_or(0) }
}

/// The track with its gaps filled; `reference` is the trunk's position in every frame.
///
/// `None` if the point is never seen.
pub(super) fn fill(track: &Track, reference: &[Vector3<f64>]) -> Option<Vec<Point3<f64>>> {
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
    fn gaps_are_interpolated_relative_to_the_trunk_and_held_at_the_ends() {
        let reference: Vec<Vector3<f64>> = (0..6).map(|i| Vector3::x() * f64::from(i)).collect();
        let place = |x: f64, z: f64| Some(Point3::new(x, 0.0, z));
        let track = vec![None, place(1.0, 0.0), None, None, place(4.0, 3.0), None];
        let found = fill(&track, &reference).unwrap();
        let expected = [(0.0, 0.0), (1.0, 0.0), (2.0, 1.0), (3.0, 2.0), (4.0, 3.0), (5.0, 3.0)];
        for (found, (x, z)) in found.iter().zip(expected) {
            assert!((found - Point3::new(x, 0.0, z)).norm() < 1e-12, "{found}");
        }
        assert_eq!(missing_frames(&track), MissingFrames { frames: 4, longest: 2 });
        assert_eq!(fill(&vec![None; 3], &reference), None);
    }
}
