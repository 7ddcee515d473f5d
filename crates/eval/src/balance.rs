//! Physical plausibility of a motion: balance and required forces.

use super::metric::{Direction, Measurement, Metric, Unit};
use super::sequence::{ContactMeasures, Sequence};
use crate::dynamics::{Dynamics, DynamicsFrame};

const DYNAMICS: &str = "poses of the tracker's body (estimate_root and estimate_angles) over at least 1/15 s before and \
    after a frame, and mass and feet with geometry on that body";
const TRUE_DYNAMICS: &str = "mass and feet with geometry on the actor";

/// Balance of the estimate.
pub(super) const UNBALANCED: Metric = Metric {
    name: "zmp_outside",
    title: "Zero-moment point outside the support",
    meaning: "How often a body with this motion would tip over, because its weight is not above its feet",
    unit: Unit::Fraction,
    direction: Direction::LowerIsBetter,
    needs: DYNAMICS,
    protocol: "share of the frames with the zero-moment point outside the support polygon (convex hull of the points \
        within 10 mm of the ground), among frames in which the tracker's body stands and presses on the ground with \
        more than a fifth of its weight (gravity {gravity}); velocities and accelerations from parabolas over 1/15 s \
        before and after",
    measure: |sequence| unbalanced(sequence, sequence.contacts?.estimate?),
};

/// The same for the actor.
pub(super) const TRUE_UNBALANCED: Metric = Metric {
    name: "truth_zmp_outside",
    title: "Zero-moment point outside the support, ground truth",
    direction: Direction::Neither,
    needs: TRUE_DYNAMICS,
    protocol: "as zmp_outside, of the actor",
    measure: |sequence| unbalanced(sequence, sequence.contacts?.truth),
    ..UNBALANCED
};

/// Residual wrench of the estimate.
pub(super) const RESIDUAL: Metric = Metric {
    name: "residual_wrench_body_weights",
    title: "Residual root wrench",
    meaning: "How much force the motion needs that the ground cannot give: 0 for a motion that is physically possible",
    unit: Unit::BodyWeight,
    direction: Direction::LowerIsBetter,
    needs: DYNAMICS,
    protocol: "part of the root wrench needed for the motion of the tracker's body that contact forces within the \
        friction cones ({friction}) cannot supply: norm of its force and of its moment about the centre of mass divided \
        by the centre's height, relative to body weight (gravity {gravity}); mean over frames",
    measure: |sequence| residual(sequence, sequence.contacts?.estimate?),
};

/// The same for the actor.
pub(super) const TRUE_RESIDUAL: Metric = Metric {
    name: "truth_residual_wrench_body_weights",
    title: "Residual root wrench, ground truth",
    direction: Direction::Neither,
    needs: TRUE_DYNAMICS,
    protocol: "as residual_wrench_body_weights, of the actor",
    measure: |sequence| residual(sequence, sequence.contacts?.truth),
    ..RESIDUAL
};

/// Joints of the estimate beyond position or velocity limits.
pub(super) const VIOLATIONS: Metric = Metric {
    name: "joint_violations",
    title: "Joints beyond position or velocity limits",
    meaning: "How often a joint is bent or moved further or faster than it can be",
    unit: Unit::Fraction,
    direction: Direction::LowerIsBetter,
    needs: DYNAMICS,
    protocol: "share of the frames in which a joint of the tracker's body is beyond its position limits (by more than \
        1e-6 rad or m) or its velocity limit",
    measure: |sequence| violations(sequence, sequence.contacts?.estimate?),
};

/// The same for the actor.
pub(super) const TRUE_VIOLATIONS: Metric = Metric {
    name: "truth_joint_violations",
    title: "Joints beyond position or velocity limits, ground truth",
    direction: Direction::Neither,
    needs: TRUE_DYNAMICS,
    protocol: "as joint_violations, of the actor",
    measure: |sequence| violations(sequence, sequence.contacts?.truth),
    ..VIOLATIONS
};

fn per_frame(
    sequence: &Sequence<'_>,
    body: ContactMeasures<'_>,
    value: impl Fn(&DynamicsFrame) -> Option<f64>,
) -> Option<Measurement> {
    let dynamics = body.dynamics?;
    let reach = Dynamics::reach(sequence.frames_per_second);
    let value = |frame: usize| value(&dynamics.frames[frame]).filter(|_| body.is_known(frame, reach));
    Some(Measurement::PerFrame(sequence.per_scored_frame(value)))
}

fn unbalanced(sequence: &Sequence<'_>, body: ContactMeasures<'_>) -> Option<Measurement> {
    per_frame(sequence, body, |frame| frame.margin_m.map(|margin| f64::from(u8::from(margin < 0.0))))
}

fn residual(sequence: &Sequence<'_>, body: ContactMeasures<'_>) -> Option<Measurement> {
    per_frame(sequence, body, |frame| Some(frame.residual))
}

fn violations(sequence: &Sequence<'_>, body: ContactMeasures<'_>) -> Option<Measurement> {
    per_frame(sequence, body, |frame| Some(f64::from(u8::from(frame.violations != [0, 0]))))
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::super::contact_fixture::{contacts, measured_with};
    use crate::dynamics::{Dynamics, DynamicsFrame};

    fn frame(margin_m: Option<f64>, residual: f64, violations: [usize; 2]) -> DynamicsFrame {
        DynamicsFrame {
            centre_of_mass: Point3::new(0.0, 0.0, 1.0),
            zero_moment_point: None,
            support: vec![],
            margin_m,
            residual,
            efforts: vec![],
            violations,
        }
    }

    #[test]
    fn balance_is_averaged_over_frames_in_contact_without_the_start_frame() {
        let flat = contacts(&[(true, 0.0, 0.0); 5], &[(true, 0.0, 0.0); 5]);
        let truth = Dynamics { mass: 70.0, frames: vec![frame(Some(0.05), 0.1, [0, 0]); 5] };
        let estimate = Dynamics {
            mass: 70.0,
            frames: vec![
                frame(Some(-9.0), 9.0, [7, 7]),
                frame(Some(-0.01), 0.4, [1, 0]),
                frame(Some(0.02), 0.2, [0, 2]),
                frame(None, 0.6, [0, 0]),
                frame(Some(0.0), 0.0, [0, 0]),
            ],
        };
        let found = measured_with(&flat, &flat, [&[0.0; 5]; 2], Some([&truth, &estimate]));
        assert!((found["zmp_outside"].mean - 1.0 / 3.0).abs() < 1e-12, "one of three, one flies");
        assert_eq!(found["zmp_outside"].per_frame[3], None);
        assert_eq!(found["truth_zmp_outside"].mean, 0.0);
        assert!((found["residual_wrench_body_weights"].mean - 0.3).abs() < 1e-12);
        assert!((found["truth_residual_wrench_body_weights"].mean - 0.1).abs() < 1e-12);
        assert!((found["joint_violations"].mean - 0.5).abs() < 1e-12);
        assert_eq!(found["truth_joint_violations"].mean, 0.0);
    }

    #[test]
    fn a_body_without_mass_has_no_balance() {
        let flat = contacts(&[(true, 0.0, 0.0); 3], &[(true, 0.0, 0.0); 3]);
        let found = measured_with(&flat, &flat, [&[0.0; 3]; 2], None);
        assert!(!found.contains_key("zmp_outside") && !found.contains_key("residual_wrench_body_weights"));
    }
}
