//! Finds the common mistake that explains wrong points.

use nalgebra::{Point3, Vector3};

use crate::leaks::mirrored_indices;

/// Tolerance of an explanation, relative to the greatest coordinate.
const TOLERANCE: f64 = 1e-6;

/// The points of one frame; `None` for missing ones.
pub(super) type FramePoints = Vec<Option<Point3<f64>>>;

type CoordinateMistake = (&'static str, fn(&Vector3<f64>) -> Vector3<f64>);

const OF_COORDINATES: [CoordinateMistake; 9] = [
    ("they are in millimetres", |p| p * 1000.0),
    ("they are in centimetres", |p| p * 100.0),
    ("they are in inches", |p| p / 0.0254),
    ("x is flipped", |p| Vector3::new(-p.x, p.y, p.z)),
    ("y is flipped", |p| Vector3::new(p.x, -p.y, p.z)),
    ("z is flipped", |p| Vector3::new(p.x, p.y, -p.z)),
    ("Y is up instead of Z", |p| Vector3::new(p.x, p.z, -p.y)),
    ("y and z are exchanged", |p| Vector3::new(p.x, p.z, p.y)),
    ("x and y are exchanged", |p| Vector3::new(p.y, p.x, p.z)),
];

/// Explains how `found` arose from `expected`; both have one entry per frame, and `names` one per point.
pub(super) fn explain(expected: &[FramePoints], found: &[FramePoints], names: &[String]) -> Option<String> {
    let all = |of: &dyn Fn(usize) -> Option<FramePoints>| {
        (0..found.len()).all(|frame| of(frame).is_none_or(|e| same(&e, &found[frame])))
    };
    for (explanation, mistake) in OF_COORDINATES {
        if all(&|frame| Some(expected[frame].iter().map(|p| p.map(|p| mistake(&p.coords).into())).collect())) {
            return Some(explanation.to_owned());
        }
    }
    let other = mirrored_indices(names);
    if all(&|frame| Some(other.iter().map(|index| expected[frame][*index]).collect())) {
        return Some("left and right are exchanged".to_owned());
    }
    if found.len() > 1 {
        if all(&|frame| frame.checked_sub(1).map(|before| expected[before].clone())) {
            return Some("they are one frame late: each frame has the points of the frame before".to_owned());
        }
        if all(&|frame| expected.get(frame + 1).cloned()) {
            return Some("they are one frame early: each frame has the points of the next".to_owned());
        }
    }
    None
}

fn same(expected: &FramePoints, found: &FramePoints) -> bool {
    let scale = expected.iter().flatten().map(|p| p.coords.amax()).fold(1.0, f64::max);
    let pairs = expected.iter().zip(found);
    expected.len() == found.len()
        && pairs.into_iter().all(|pair| match pair {
            (Some(a), Some(b)) => (a - b).amax() <= TOLERANCE * scale,
            (None, None) => true,
            _ => false,
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_mistake_is_named_and_other_differences_are_not() {
        let point = |f: usize, i: f64| Some(Point3::new(0.3 + i, 0.7 * i + 0.1 * f as f64, 1.1 - 0.2 * i));
        let frames: Vec<FramePoints> = (0..4).map(|f| vec![point(f, 0.1), point(f, 0.5), None]).collect();
        let names = ["left_hip", "right_hip", "head"].map(str::to_owned);
        let with = |change: &dyn Fn(usize) -> FramePoints| {
            let found: Vec<FramePoints> = (0..4).map(change).collect();
            explain(&frames, &found, &names)
        };
        for (words, mistake) in OF_COORDINATES {
            let found = with(&|f| frames[f].iter().map(|p| p.map(|p| mistake(&p.coords).into())).collect());
            assert_eq!(found.as_deref(), Some(words));
        }
        let swapped = with(&|f| vec![frames[f][1], frames[f][0], None]);
        assert!(swapped.unwrap().contains("left and right"));
        assert!(with(&|f| frames[f.saturating_sub(1)].clone()).unwrap().contains("late"));
        assert!(with(&|f| frames[(f + 1).min(3)].clone()).unwrap().contains("early"));
        assert_eq!(with(&|f| vec![frames[f][0], None, None]), None);
    }
}
