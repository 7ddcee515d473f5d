//! Positions that are probably placeholders for missing values.

use nalgebra::Point3;

use crate::benchmark_set::EstimatedSequence;
use crate::body::{LANDMARKS, Landmark};

/// A note about positions whose three coordinates are equal, such as 0, 0, 0 or -1, -1, -1: many programs write them if
/// they have found nothing. `None` without such positions.
pub(crate) fn note(sequences: &[EstimatedSequence]) -> Option<String> {
    let (mut placeholders, mut all, mut first) = (0, 0, None);
    for sequence in sequences {
        for (frame, markers) in sequence.markers.iter().enumerate() {
            for (marker, place) in markers.iter().enumerate() {
                let Some(place) = place else { continue };
                all += 1;
                if is_placeholder(place, LANDMARKS[marker]) {
                    placeholders += 1;
                    first.get_or_insert((LANDMARKS[marker].name(), frame, *place));
                }
            }
        }
    }
    let (name, frame, Point3 { coords }) = first?;
    let [x, y, z] = <[f64; 3]>::from(coords).map(|number| number + 0.0);
    Some(format!(
        "has {placeholders} of {all} positions with three equal coordinates, the first `{name}` in frame {frame} at {x}, \
         {y}, {z}. They are measured as positions; if they mean missing values, write NaN (in CSV: leave the field empty)"
    ))
}

/// Signs are ignored, because the file's axes may differ. A pelvis at 0, 0, 0 is the origin of positions relative to
/// the body.
fn is_placeholder(place: &Point3<f64>, marker: Landmark) -> bool {
    let [x, y, z] = <[f64; 3]>::from(place.coords).map(f64::abs);
    x == y && y == z && !(x == 0.0 && marker == Landmark::Pelvis)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::benchmark_set::Articulation;
    use crate::body::Markers;

    #[test]
    fn positions_with_equal_coordinates_are_counted_and_the_first_is_named() {
        let mut markers = vec![[Some(Point3::new(0.1, 0.2, 1.0)); 15]; 4];
        let note_for = |markers: &Vec<Markers>| {
            let (articulation, covariances) = (Articulation::Unknown, Vec::new());
            note(&[EstimatedSequence { articulation, markers: markers.clone(), covariances }])
        };
        assert_eq!(note_for(&markers), None);
        markers[1][Landmark::Pelvis as usize] = Some(Point3::origin());
        assert_eq!(note_for(&markers), None, "positions relative to the pelvis");
        markers[0][Landmark::LeftWrist as usize] = None;
        markers[2][Landmark::LeftWrist as usize] = Some(Point3::new(-1.0, 1.0, -1.0));
        markers[3][Landmark::LeftKnee as usize] = Some(Point3::new(0.0, -0.0, 0.0));
        let found = note_for(&markers).unwrap();
        assert!(found.starts_with("has 2 of 59 positions"), "{found}");
        assert!(found.contains("`left_wrist` in frame 2 at -1, 1, -1"), "{found}");
    }
}
