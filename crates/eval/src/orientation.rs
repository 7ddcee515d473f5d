//! Orientation error of the body.

use nalgebra::UnitQuaternion;

use super::Sequence;
use super::metric::{Direction, Measurement, Metric, Unit};

const ROTATIONS: &str = "rotations of the estimate's root link (estimate_root)";

/// Body orientation error of `[Skinned APF]`.
pub(super) const BODY: Metric = Metric {
    name: "body_orientation_deg",
    title: "Body orientation error",
    meaning: "How far the trunk is turned or tilted away from its true direction",
    unit: Unit::Degree,
    direction: Direction::LowerIsBetter,
    needs: ROTATIONS,
    protocol: "geodesic angle between the true and the estimated world rotation of the body axes at the root (X \
        forward, Y left, Z up at the zero pose, defined by hips and thorax); mean over frames",
    measure: |sequence| angles(sequence, |truth, estimate| Some(geodesic_angle(truth, estimate))),
};

pub(super) const HEADING: Metric = Metric {
    name: "heading_deg",
    title: "Heading error",
    meaning: "How far the body faces away from its true heading, seen from above",
    unit: Unit::Degree,
    direction: Direction::LowerIsBetter,
    needs: ROTATIONS,
    protocol: "absolute difference of the headings (twist of that rotation about the vertical); mean over frames",
    measure: heading,
};

fn heading(sequence: &Sequence<'_>) -> Option<Measurement> {
    angles(sequence, |truth, estimate| {
        let turn = heading_of(estimate)? - heading_of(truth)?;
        Some(libm::fabs(libm::remainder(turn, std::f64::consts::TAU)))
    })
}

type Angle = fn(&UnitQuaternion<f64>, &UnitQuaternion<f64>) -> Option<f64>;

fn angles(sequence: &Sequence<'_>, radians: Angle) -> Option<Measurement> {
    let roots = sequence.roots?;
    Some(Measurement::PerFrame(
        sequence.per_scored_frame(|frame| radians(&roots.truth[frame], &roots.estimate[frame]?).map(f64::to_degrees)),
    ))
}

/// Angle of the rotation between `a` and `b`, radians in `0 ..= pi`; by atan2, which is precise near zero, unlike arc
/// cosine.
pub(super) fn geodesic_angle(a: &UnitQuaternion<f64>, b: &UnitQuaternion<f64>) -> f64 {
    let between = a.inverse() * b;
    2.0 * libm::atan2(between.imag().norm(), libm::fabs(between.w))
}

/// Twist about the vertical, radians; `None` for an upside-down body, for which it is undefined.
fn heading_of(rotation: &UnitQuaternion<f64>) -> Option<f64> {
    (libm::hypot(rotation.w, rotation.k) > 1e-9).then(|| 2.0 * libm::atan2(rotation.k, rotation.w))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_figure::standing;
    use crate::{RootRotations, evaluate};
    use nalgebra::Vector3;

    fn errors(truth: UnitQuaternion<f64>, estimate: UnitQuaternion<f64>) -> [f64; 2] {
        let markers = vec![standing(); 3];
        let (truth, estimate) = (vec![truth; 3], vec![Some(estimate); 3]);
        let mut sequence = Sequence::from_markers(60.0, &markers, &markers);
        sequence.roots = Some(RootRotations { truth: &truth, estimate: &estimate });
        let metrics = evaluate(&sequence).unwrap().metrics;
        ["body_orientation_deg", "heading_deg"].map(|name| metrics[name].mean)
    }

    fn about(axis: Vector3<f64>, degrees: f64) -> UnitQuaternion<f64> {
        UnitQuaternion::new(axis * degrees.to_radians())
    }

    #[test]
    fn leans_are_no_heading_and_neither_whole_turns_nor_signs_of_quaternions_matter() {
        let (still, skew) = (UnitQuaternion::identity(), about(Vector3::new(0.3, -0.5, 0.8), 70.0));
        let negated = UnitQuaternion::new_unchecked(-skew.into_inner());
        for (truth, estimate, [body, heading], within) in [
            (still, about(Vector3::y(), 8.0), [8.0, 0.0], 1e-9),
            (about(Vector3::z(), 179.0), about(Vector3::z(), -179.0), [2.0, 2.0], 1e-9),
            (skew, negated, [0.0, 0.0], 1e-6),
        ] {
            let found = errors(truth, estimate);
            assert!((found[0] - body).abs() < within && (found[1] - heading).abs() < within, "{found:?}");
        }
    }

    #[test]
    fn tiny_angles_are_precise() {
        let [body, _] = errors(UnitQuaternion::identity(), about(Vector3::x(), 1e-7));
        assert!((body - 1e-7).abs() < 1e-12);
    }
}
