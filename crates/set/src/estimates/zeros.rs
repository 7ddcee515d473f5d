//! Positions at exactly 0, 0, 0, which many programs write for points that they did not find.

use crate::SetError;
use skiagraph_core::npz::{Array, Npz};

/// A point at the origin in every frame is the root of the others if one of them is always nearer to it than this share
/// of the body's size.
const NEAR: f64 = 0.3;
const NAMES: [(&str, &str); 2] = [("estimate_markers", "marker_names"), ("estimate_joints", "estimate_joint_names")];

/// The archive with these positions missing, and a note. A root at the origin in every frame stays: the positions are
/// relative to it.
///
/// # Errors
/// [`SetError::Malformed`] about numbers that cannot be read.
pub fn zeros_as_missing(npz: &Npz, file: &str) -> Result<(Npz, Option<String>), SetError> {
    let mut found: Vec<String> = Vec::new();
    let mut all = npz.clone();
    for (points, names) in NAMES {
        let (Some(array), Some(names)) = (npz.get(points), npz.names(file, names)?) else {
            continue;
        };
        let mut numbers = npz.numbers(file, points, &vec![None; array.shape.len()])?;
        let width = names.len();
        let places = numbers.as_chunks_mut::<3>().0;
        if width == 0 || array.shape.last() != Some(&3) || places.len() % width != 0 {
            // refused by the reader
            continue;
        }
        let mut zeros = vec![0; width];
        for (at, _) in places.iter().enumerate().filter(|(_, place)| **place == [0.0; 3]) {
            zeros[at % width] += 1;
        }
        for (column, count) in zeros.into_iter().enumerate().filter(|(_, count)| *count > 0) {
            if is_root(places, width, column) {
                continue;
            }
            let of_column = places.iter_mut().skip(column).step_by(width);
            of_column.filter(|place| **place == [0.0; 3]).for_each(|place| *place = [f64::NAN; 3]);
            found.push(format!("{} {count}", names[column]));
        }
        let rewritten = Array::new(&array.shape, numbers);
        let others = all.iter().map(|(name, array)| (name, if name == points { &rewritten } else { array }.clone()));
        all = others.collect();
    }
    let note = format!("{file}: positions at exactly 0, 0, 0 count as missing: {}", found.join(", "));
    Ok((all, (!found.is_empty()).then_some(note)))
}

/// Whether a column is at the origin wherever it is given, beside the others.
fn is_root(places: &[[f64; 3]], width: usize, column: usize) -> bool {
    let length = |place: &[f64; 3]| place.iter().map(|x| x * x).sum::<f64>().sqrt();
    places.chunks_exact(width).all(|row| {
        let others = row.iter().enumerate().filter(|(other, place)| *other != column && **place != [0.0; 3]);
        let lengths: Vec<f64> = others.map(|(_, place)| length(place)).filter(|length| length.is_finite()).collect();
        let nearest = lengths.iter().copied().fold(f64::INFINITY, f64::min);
        let farthest = lengths.iter().copied().fold(0.0, f64::max);
        row[column] == [0.0; 3] && !lengths.is_empty() && nearest <= NEAR * farthest || row[column][0].is_nan()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn archive(rows: &[[[f64; 3]; 3]]) -> Npz {
        Npz::from_iter([
            ("estimate_markers", Array::new(&[1, rows.len(), 3, 3], rows.as_flattened().as_flattened().to_vec())),
            ("marker_names", Array::names(["pelvis", "left_hip", "head_top"])),
        ])
    }

    fn missing(rows: &[[[f64; 3]; 3]]) -> (Vec<bool>, Option<String>) {
        let (npz, note) = zeros_as_missing(&archive(rows), "p").unwrap();
        let numbers = npz.f64s("p", "estimate_markers", &[Some(1), None, Some(3), Some(3)]).unwrap();
        (numbers.chunks(3).map(|place| place[0].is_nan()).collect(), note)
    }

    #[test]
    fn points_at_zero_count_as_missing_unless_they_are_the_root_of_all() {
        let (hip, head, zero) = ([0.0, 0.1, 0.0], [0.0, 0.0, 0.8], [0.0; 3]);
        assert_eq!(missing(&[[zero, hip, head], [zero, hip, head]]), (vec![false; 6], None), "relative to the pelvis");
        let world = |[x, y, z]: [f64; 3]| [x + 2.0, y, z + 1.0];
        let (hip, head) = (world(hip), world(head));
        let (lost, note) = missing(&[[zero, hip, head], [world(zero), hip, zero]]);
        assert_eq!(lost, [true, false, false, false, false, true]);
        assert_eq!(note.unwrap(), "p: positions at exactly 0, 0, 0 count as missing: pelvis 1, head_top 1");
        assert_eq!(missing(&[[hip, zero, head], [hip, zero, head]]).0, [false, true, false, false, true, false]);
    }
}
