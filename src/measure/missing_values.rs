//! Positions that are probably placeholders for missing values.

use nalgebra::Point3;

use super::hints::RELATIVE;
use skiagraph_core::body::{LANDMARKS, Landmark};
use skiagraph_eval::quantile;
use skiagraph_set::EstimatedSequence;

/// A pelvis nearer than this to the origin in every frame is the origin, metres.
const AT_ORIGIN_M: f64 = 0.001;
/// No scene is larger than this: positions farther from the others are placeholders, metres.
const FAR_M: f64 = 1000.0;
/// Placeholders are farther from the middle than this many times the usual distance.
pub(super) const MANY: f64 = 10.0;
/// Positions are far from the others only if they are at most one of this many; else the unit or origin differs.
const ONE_OF: usize = 10;

/// A note about positions that are probably missing values; `None` without such positions.
/// `remedy` is what to write in their place.
pub(crate) fn note(sequences: &[EstimatedSequence], remedy: &str) -> Option<String> {
    relative_to_the_pelvis(sequences)
        .or_else(|| equal_coordinates(sequences, remedy))
        .or_else(|| far_away(sequences, remedy))
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

/// A note about positions, of which there is at least one that `counts`; `what` is said about them.
fn described(
    sequences: &[EstimatedSequence],
    counts: &dyn Fn(&GivenPlace) -> bool,
    what: &str,
    remedy: &str,
) -> Option<String> {
    let GivenPlace { frame, marker, place } = places(sequences).find(counts)?;
    let (found, all) = (places(sequences).filter(counts).count(), places(sequences).count());
    let [x, y, z] = <[f64; 3]>::from(place.coords).map(|number| (1000.0 * number).round() / 1000.0 + 0.0);
    let name = marker.name();
    Some(format!(
        "has {found} of {all} positions {what}, the first `{name}` in frame {frame} at {x}, {y}, {z} m. They are measured as \
         positions; if they mean missing values, {remedy}"
    ))
}

/// A note about positions whose pelvis is at the origin in every frame: programs that lift image keypoints write them.
fn relative_to_the_pelvis(sequences: &[EstimatedSequence]) -> Option<String> {
    let mut pelvis = places(sequences).filter(|given| given.marker == Landmark::Pelvis).peekable();
    let is_relative = pelvis.peek().is_some() && pelvis.all(|given| given.place.coords.norm() < AT_ORIGIN_M);
    is_relative.then(|| {
        format!(
            "has its pelvis at 0, 0, 0 in every frame: its positions are relative to it, {RELATIVE}, or add its path"
        )
    })
}

/// A note about positions whose three coordinates are equal, such as -1, -1, -1: many programs write them if they have
/// found nothing.
fn equal_coordinates(sequences: &[EstimatedSequence], remedy: &str) -> Option<String> {
    let counts = |given: &GivenPlace| has_equal_coordinates(&given.place);
    described(sequences, &counts, "with three equal coordinates", remedy)
}

/// Signs are ignored, because the file's axes may differ.
pub(crate) fn has_equal_coordinates(place: &Point3<f64>) -> bool {
    let [x, y, z] = <[f64; 3]>::from(place.coords).map(f64::abs);
    x == y && y == z
}

/// A note about a few positions that are farther from the others than any scene is large, such as those with a
/// coordinate of 9999999 mm.
fn far_away(sequences: &[EstimatedSequence], remedy: &str) -> Option<String> {
    let mut middle = Point3::origin();
    for axis in 0..3 {
        let mut values: Vec<f64> = places(sequences).map(|given| given.place[axis]).collect();
        values.sort_by(f64::total_cmp);
        middle[axis] = quantile(&values, 0.5)?;
    }
    let mut distances: Vec<f64> = places(sequences).map(|given| (given.place - middle).norm()).collect();
    distances.sort_by(f64::total_cmp);
    // in another unit, all are far from each other
    let far_m = FAR_M.max(MANY * quantile(&distances, 0.5)?);
    let is_far = |given: &GivenPlace| (given.place - middle).norm() > far_m;
    let (far, all) = (places(sequences).filter(is_far).count(), places(sequences).count());
    let what = format!("more than {far_m:.0} m from the others");
    described(sequences, &is_far, &what, remedy).filter(|_| far * ONE_OF <= all)
}

#[cfg(test)]
mod tests {
    use super::*;
    use skiagraph_core::body::Markers;
    use skiagraph_set::Articulation;

    fn note_for(markers: &[Markers]) -> Option<String> {
        note(&[EstimatedSequence { articulation: Articulation::Unknown, markers: markers.to_vec() }], "write NaN")
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
        assert!(found.contains("`left_wrist` in frame 2 at -1, 1, -1 m"), "{found}");
    }

    #[test]
    fn a_missing_pelvis_at_zero_is_reported_and_positions_relative_to_the_pelvis_are_not() {
        let mut markers = somewhere();
        markers[1][Landmark::Pelvis as usize] = Some(Point3::origin());
        let found = note_for(&markers).unwrap();
        assert!(
            found.starts_with("has 1 of 60 positions") && found.contains("`pelvis` in frame 1 at 0, 0, 0 m"),
            "{found}"
        );
        markers.iter_mut().for_each(|markers| markers[Landmark::Pelvis as usize] = Some(Point3::origin()));
        assert!(note_for(&markers).unwrap().contains("relative to it"));
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
