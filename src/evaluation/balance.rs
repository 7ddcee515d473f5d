//! Whether a motion could have happened: its balance and the forces that it takes.

use super::metric::{Direction, Measurement, Metric, Unit};
use super::sequence::{Sequence, Touching};
use crate::physics::{Dynamics, DynamicsFrame};

const DYNAMICS: &str = "poses of the tracker's body (estimate_root and estimate_angles), of which a stretch spans 1/15 s either way of a frame, \
                        and mass and feet with geometry on that body";
const TRUE_DYNAMICS: &str = "mass and feet with geometry on the actor";

/// Balance of the estimate.
pub(super) const UNBALANCED: Metric = Metric {
    name: "zmp_outside",
    title: "Zero-moment point outside the support",
    unit: Unit::Fraction,
    direction: Direction::LowerIsBetter,
    needs: DYNAMICS,
    protocol: "share of the frames in which the tracker's body stands and presses on the ground with more than a fifth of its \
               weight (gravity {gravity}) where its zero-moment point lies outside the convex hull of what touches it (flesh \
               yields by 10 mm); rates and accelerations from parabolas over 1/15 s either way",
    measure: |sequence| unbalanced(sequence, sequence.contacts?.estimate?),
};

/// The same of the actor.
pub(super) const TRUE_UNBALANCED: Metric = Metric {
    name: "truth_zmp_outside",
    title: "Zero-moment point outside the support, of the truth itself",
    direction: Direction::Neither,
    needs: TRUE_DYNAMICS,
    protocol: "as zmp_outside, of the actor",
    measure: |sequence| unbalanced(sequence, sequence.contacts?.truth),
    ..UNBALANCED
};

/// What nothing on the ground explains of the estimate.
pub(super) const RESIDUAL: Metric = Metric {
    name: "residual_wrench_body_weights",
    title: "Residual root wrench",
    unit: Unit::BodyWeight,
    direction: Direction::LowerIsBetter,
    needs: DYNAMICS,
    protocol: "wrench that the motion of the tracker's body needs and no forces within the friction cones ({friction}) of what \
               touches the ground explain: norm of its force and of its moment about the centre of mass over the centre's \
               height, over the body's weight (gravity {gravity}); mean over frames",
    measure: |sequence| residual(sequence, sequence.contacts?.estimate?),
};

/// The same of the actor.
pub(super) const TRUE_RESIDUAL: Metric = Metric {
    name: "truth_residual_wrench_body_weights",
    title: "Residual root wrench of the truth itself",
    direction: Direction::Neither,
    needs: TRUE_DYNAMICS,
    protocol: "as residual_wrench_body_weights, of the actor",
    measure: |sequence| residual(sequence, sequence.contacts?.truth),
    ..RESIDUAL
};

/// Joints of the estimate that are where or as fast as they cannot be.
pub(super) const VIOLATIONS: Metric = Metric {
    name: "joint_violations",
    title: "Joints beyond limit or speed",
    unit: Unit::Fraction,
    direction: Direction::LowerIsBetter,
    needs: DYNAMICS,
    protocol: "share of the frames in which a joint of the tracker's body is beyond its limits (by more than 1e-6 rad or m) or \
               faster than its greatest speed",
    measure: |sequence| violations(sequence, sequence.contacts?.estimate?),
};

/// The same of the actor.
pub(super) const TRUE_VIOLATIONS: Metric = Metric {
    name: "truth_joint_violations",
    title: "Joints beyond limit or speed of the truth itself",
    direction: Direction::Neither,
    needs: TRUE_DYNAMICS,
    protocol: "as joint_violations, of the actor",
    measure: |sequence| violations(sequence, sequence.contacts?.truth),
    ..VIOLATIONS
};

fn per_frame(
    sequence: &Sequence<'_>,
    body: Touching<'_>,
    value: impl Fn(&DynamicsFrame) -> Option<f64>,
) -> Option<Measurement> {
    let dynamics = body.dynamics?;
    let reach = Dynamics::reach(sequence.frames_per_second);
    let value = |frame: usize| value(&dynamics.frames[frame]).filter(|_| body.is_known(frame, reach));
    Some(Measurement::PerFrame(sequence.per_scored_frame(value)))
}

fn unbalanced(sequence: &Sequence<'_>, body: Touching<'_>) -> Option<Measurement> {
    per_frame(sequence, body, |frame| frame.margin_m.map(|margin| f64::from(u8::from(margin < 0.0))))
}

fn residual(sequence: &Sequence<'_>, body: Touching<'_>) -> Option<Measurement> {
    per_frame(sequence, body, |frame| Some(frame.residual))
}

fn violations(sequence: &Sequence<'_>, body: Touching<'_>) -> Option<Measurement> {
    per_frame(sequence, body, |frame| Some(f64::from(u8::from(frame.violations != [0, 0]))))
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::super::contact_fixture::{contacts, measured_with};
    use crate::physics::{Dynamics, DynamicsFrame};

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
    fn balance_is_counted_where_there_is_any_and_the_start_is_left_out() {
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
