//! Positions that are probably placeholders for missing values.

use nalgebra::Point3;

use crate::benchmark_set::EstimatedSequence;
use crate::body::{LANDMARKS, Landmark};
use crate::evaluation::quantile;

/// No scene is larger than this: positions farther from the others are placeholders, metres.
const FAR_M: f64 = 1000.0;
/// Placeholders are farther from the middle than this many times the usual distance.
const MANY: f64 = 10.0;
/// Positions are far from the others only if they are at most one of this many; else the unit or origin differs.
const ONE_OF: usize = 10;

/// A note about positions that are probably missing values; `None` without such positions.
pub(crate) fn note(sequences: &[EstimatedSequence]) -> Option<String> {
    equal_coordinates(sequences).or_else(|| far_away(sequences))
}

/// A position with its frame.
struct GivenPlace {
    frame: usize,
    marker: Landmark,
    place: Point3<f64>,
}

fn places(sequences: &[EstimatedSequence]) -> impl Iterator<Item = GivenPlace> + '_ {
    let frames = sequences.iter().flat_map(|sequence| sequence.markers.iter().enumerate());
    frames.flat_map(|(frame, markers)| {
        let named = markers.iter().zip(LANDMARKS);
        named.filter_map(move |(place, marker)| Some(GivenPlace { frame, marker, place: (*place)? }))
    })
}

/// A note about positions whose three coordinates are equal, such as 0, 0, 0 or -1, -1, -1: many programs write them if
/// they have found nothing.
fn equal_coordinates(sequences: &[EstimatedSequence]) -> Option<String> {
    // the pelvis of positions relative to the body is at 0, 0, 0 in every frame
    let mut pelvis = places(sequences).filter(|given| given.marker == Landmark::Pelvis);
    let is_relative = pelvis.all(|given| given.place == Point3::origin());
    let counts =
        |given: &GivenPlace| has_equal_coordinates(&given.place) && !(is_relative && given.marker == Landmark::Pelvis);
    let placeholders = places(sequences).filter(counts).count();
    let GivenPlace { frame, marker, place } = places(sequences).find(counts)?;
    let [x, y, z] = <[f64; 3]>::from(place.coords).map(|number| number + 0.0);
    let (name, all) = (marker.name(), places(sequences).count());
    Some(format!(
        "has {placeholders} of {all} positions with three equal coordinates, the first `{name}` in frame {frame} at {x}, \
         {y}, {z}. They are measured as positions; if they mean missing values, write NaN (in CSV: leave the field empty)"
    ))
}

/// Signs are ignored, because the file's axes may differ.
fn has_equal_coordinates(place: &Point3<f64>) -> bool {
    let [x, y, z] = <[f64; 3]>::from(place.coords).map(f64::abs);
    x == y && y == z
}

/// A note about a few positions that are farther from the others than any scene is large, such as those with a
/// coordinate of 9999999 mm.
fn far_away(sequences: &[EstimatedSequence]) -> Option<String> {
    let median = |axis: usize| {
        let mut values: Vec<f64> = places(sequences).map(|given| given.place[axis]).collect();
        values.sort_by(f64::total_cmp);
        quantile(&values, 0.5)
    };
    let middle = Point3::new(median(0)?, median(1)?, median(2)?);
    let mut distances: Vec<f64> = places(sequences).map(|given| (given.place - middle).norm()).collect();
    distances.sort_by(f64::total_cmp);
    // in another unit, all are far from each other
    let far_m = FAR_M.max(MANY * quantile(&distances, 0.5)?);
    let is_far = |given: &GivenPlace| (given.place - middle).norm() > far_m;
    let GivenPlace { frame, marker, place } = places(sequences).find(is_far)?;
    let (far, all) = (places(sequences).filter(is_far).count(), places(sequences).count());
    let [x, y, z] = <[f64; 3]>::from(place.coords).map(|number| (1000.0 * number).round() / 1000.0);
    let name = marker.name();
    (far * ONE_OF <= all).then(|| {
        format!(
            "has {far} of {all} positions more than {far_m:.0} m from the others, the first `{name}` in frame {frame} at \
             {x}, {y}, {z} m. They are measured as positions; if they mean missing values, write NaN (in CSV: leave the \
             field empty)"
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::benchmark_set::Articulation;
    use crate::body::Markers;

    fn note_for(markers: &[Markers]) -> Option<String> {
        let (articulation, covariances) = (Articulation::Unknown, Vec::new());
        note(&[EstimatedSequence { articulation, markers: markers.to_vec(), covariances }])
    }

    fn somewhere() -> Vec<Markers> {
        vec![[Some(Point3::new(0.1, 0.2, 1.0)); 15]; 4]
    }

    #[test]
    fn positions_with_equal_coordinates_are_counted_and_the_first_is_named() {
        let mut markers = somewhere();
        assert_eq!(note_for(&markers), None);
        markers[0][Landmark::LeftWrist as usize] = None;
        markers[2][Landmark::LeftWrist as usize] = Some(Point3::new(-1.0, 1.0, -1.0));
        markers[3][Landmark::LeftKnee as usize] = Some(Point3::new(0.0, -0.0, 0.0));
        let found = note_for(&markers).unwrap();
        assert!(found.starts_with("has 2 of 59 positions"), "{found}");
        assert!(found.contains("`left_wrist` in frame 2 at -1, 1, -1"), "{found}");
    }

    #[test]
    fn a_missing_pelvis_at_zero_is_reported_and_positions_relative_to_the_pelvis_are_not() {
        let mut markers = somewhere();
        markers[1][Landmark::Pelvis as usize] = Some(Point3::origin());
        let found = note_for(&markers).unwrap();
        assert!(
            found.starts_with("has 1 of 60 positions") && found.contains("`pelvis` in frame 1 at 0, 0, 0"),
            "{found}"
        );
        markers.iter_mut().for_each(|markers| markers[Landmark::Pelvis as usize] = Some(Point3::origin()));
        assert_eq!(note_for(&markers), None, "relative to the pelvis");
    }

    #[test]
    fn a_coordinate_of_9999999_mm_is_reported_with_frame_and_marker() {
        let mut markers = somewhere();
        markers[2][Landmark::RightKnee as usize] = Some(Point3::new(0.1, 9999.999, 1.0));
        let found = note_for(&markers).unwrap();
        assert!(found.starts_with("has 1 of 60 positions more than 1000 m from the others"), "{found}");
        assert!(found.contains("`right_knee` in frame 2 at 0.1, 9999.999, 1 m"), "{found}");
        let elsewhere = vec![[Some(Point3::new(500_000.1, 4e5, 1.0)); 15]; 4];
        assert_eq!(note_for(&elsewhere), None, "coordinates of a map");
        let walking = |frame: i32| [Some(Point3::new(70.0 * f64::from(frame), 1000.0, 1.0)); 15];
        assert_eq!(note_for(&(0..40).map(walking).collect::<Vec<_>>()), None, "millimetres taken for metres");
    }
}
