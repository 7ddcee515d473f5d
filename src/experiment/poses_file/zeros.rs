//! Positions that may stand for missing values.

use crate::npz::{Npz, Values};

/// Arrays of positions with those of their names.
const POINTS: [(&str, &str); 2] = [("estimate_markers", "marker_names"), ("estimate_joints", "estimate_joint_names")];

/// What to say of positions that are 0, 0, 0 to the bit, which no tracker estimates: many programs write them where
/// they have found nothing. `None` without any.
pub(super) fn note(npz: &Npz) -> Option<String> {
    let (mut zeros, mut all, mut first) = (0, 0, None);
    for (array, names) in POINTS {
        let Some((found, shape)) = npz.get(array).map(|array| (is_zero(&array.values), array.shape.as_slice())) else {
            continue;
        };
        all += found.len();
        zeros += found.iter().filter(|zero| **zero).count();
        let at = found.iter().position(|zero| *zero);
        // ..., frames, columns, 3
        if let (None, Some(at), [.., frames, columns, 3]) = (&first, at, shape) {
            let names = npz.names("", names).ok().flatten().unwrap_or_default();
            let name = names.get(at % columns).map_or_else(|| format!("column {}", at % columns), String::clone);
            first = Some(format!("`{name}` in frame {}", at / columns % frames));
        }
    }
    let first = first?;
    Some(format!(
        "puts {zeros} of {all} positions at exactly 0, 0, 0, the first {first}: they are measured as positions; if they \
         stand for missing values, write NaN (in CSV: nothing) there"
    ))
}

/// Whether every third of three numbers is all zeros.
fn is_zero(values: &Values) -> Vec<bool> {
    match values {
        Values::F64(numbers) => numbers.as_chunks::<3>().0.iter().map(|place| *place == [0.0; 3]).collect(),
        Values::F32(numbers) => numbers.as_chunks::<3>().0.iter().map(|place| *place == [0.0; 3]).collect(),
        Values::I64(numbers) => numbers.as_chunks::<3>().0.iter().map(|place| *place == [0; 3]).collect(),
        _ => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::npz::Array;

    #[test]
    fn exact_zeros_are_counted_and_the_first_is_named_and_small_numbers_are_none() {
        let archive = |numbers: Vec<f64>| {
            let names = Array::names(["pelvis", "thorax"]);
            Npz::from_iter([("estimate_markers", Array::new(&[1, 3, 2, 3], numbers)), ("marker_names", names)])
        };
        let mut numbers = vec![0.5; 18];
        assert_eq!(note(&archive(numbers.clone())), None);
        numbers[9..12].fill(0.0);
        numbers[12..15].fill(-0.0);
        numbers[15] = 0.0;
        let found = note(&archive(numbers)).unwrap();
        assert!(
            found.starts_with("puts 2 of 6 positions at exactly 0, 0, 0, the first `thorax` in frame 1: "),
            "{found}"
        );
        assert_eq!(note(&archive(vec![1e-300; 18])), None);
        assert_eq!(note(&Npz::default()), None);
    }
}
