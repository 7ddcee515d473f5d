//! A figure for tests.

use nalgebra::{Point3, Vector3};

use skiagraph_core::body::{Landmark, Markers};
use skiagraph_eval::{Evaluation, Sequence, evaluate};

/// Somebody of 1.75 m who faces +X, arms a little forward so that no mirror plane maps the figure to itself.
pub fn standing() -> Markers {
    let points = [
        [0.0, 0.0, 1.45],
        [0.0, 0.0, 0.95],
        [0.0, 0.2, 1.42],
        [0.05, 0.25, 1.12],
        [0.25, 0.22, 0.95],
        [0.0, -0.2, 1.42],
        [-0.03, -0.25, 1.12],
        [0.02, -0.30, 0.88],
        [0.0, 0.1, 0.92],
        [0.12, 0.1, 0.50],
        [0.02, 0.1, 0.08],
        [0.0, -0.1, 0.92],
        [-0.02, -0.1, 0.50],
        [-0.2, -0.1, 0.12],
        [0.02, 0.0, 1.75],
    ];
    points.map(|[x, y, z]| Some(Point3::new(x, y, z)))
}

/// How far forward the parts of arms and legs are at the widest of a step, metres.
pub const SWING: [(Landmark, f64); 8] = [
    (Landmark::LeftKnee, 0.16),
    (Landmark::LeftAnkle, 0.32),
    (Landmark::RightKnee, -0.16),
    (Landmark::RightAnkle, -0.32),
    (Landmark::LeftWrist, -0.22),
    (Landmark::LeftElbow, -0.10),
    (Landmark::RightWrist, 0.22),
    (Landmark::RightElbow, 0.10),
];

/// The figure moved by `shift` metres.
pub fn translated(markers: &Markers, shift: Vector3<f64>) -> Markers {
    markers.map(|marker| marker.map(|p| p + shift))
}

/// Evaluates marker positions alone, at 60 fps.
pub fn evaluate_markers(truth: &[Markers], estimate: &[Markers]) -> Evaluation {
    evaluate(&Sequence::from_markers(60.0, truth, estimate)).unwrap()
}
