//! Positions that may stand for missing values.

use nalgebra::Point3;

use crate::benchmark_set::EstimatedSequence;
use crate::body::{LANDMARKS, Landmark};

/// What to say of positions whose three coordinates are one number, such as 0, 0, 0 or -1, -1, -1, which no tracker
/// estimates: many programs write them where they have found nothing. `None` without any.
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
        "puts {placeholders} of {all} positions where all three coordinates are the same number, the first `{name}` in frame \
         {frame} at {x}, {y}, {z}. They are measured as positions; if they stand for missing values, write NaN (in CSV: \
         nothing)"
    ))
}

/// Axes may have other signs in the file. A pelvis at 0, 0, 0 is the origin of positions relative to the body.
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
    fn places_of_one_number_are_counted_and_the_first_is_named() {
        let mut markers = vec![[Some(Point3::new(0.1, 0.2, 1.0)); 15]; 4];
        let told = |markers: &Vec<Markers>| {
            let (articulation, covariances) = (Articulation::Unknown, Vec::new());
            note(&[EstimatedSequence { articulation, markers: markers.clone(), covariances }])
        };
        assert_eq!(told(&markers), None);
        markers[1][Landmark::Pelvis as usize] = Some(Point3::origin());
        assert_eq!(told(&markers), None, "positions relative to the pelvis");
        markers[0][Landmark::LeftWrist as usize] = None;
        markers[2][Landmark::LeftWrist as usize] = Some(Point3::new(-1.0, 1.0, -1.0));
        markers[3][Landmark::LeftKnee as usize] = Some(Point3::new(0.0, -0.0, 0.0));
        let said = told(&markers).unwrap();
        assert!(said.starts_with("puts 2 of 59 positions"), "{said}");
        assert!(said.contains("`left_wrist` in frame 2 at -1, 1, -1"), "{said}");
    }
}
