//! Penetration of a body with props.

use super::metric::{Direction, Measurement, Metric, Unit};
use super::sequence::{ContactMeasures, Sequence};

/// Of the estimate.
pub(super) const DEPTH: Metric = Metric {
    name: "prop_penetration_mm",
    title: "Prop penetration",
    unit: Unit::Millimetre,
    direction: Direction::LowerIsBetter,
    needs: "poses of the tracker's body (estimate_root and estimate_angles), geometry on its feet, and a prop in the scene",
    protocol: "greatest penetration depth of a link of the tracker's body in a prop of the scene, 0 if none; mean over \
        frames",
    measure: |sequence| depth(sequence, sequence.contacts?.estimate?),
};

/// Of the actor.
pub(super) const TRUE_DEPTH: Metric = Metric {
    name: "truth_prop_penetration_mm",
    title: "Prop penetration, ground truth",
    direction: Direction::Neither,
    needs: "geometry on the actor's feet, and a prop in the scene",
    protocol: "as prop_penetration_mm, of the actor",
    measure: |sequence| depth(sequence, sequence.contacts?.truth),
    ..DEPTH
};

fn depth(sequence: &Sequence<'_>, body: ContactMeasures<'_>) -> Option<Measurement> {
    let depths = body.prop_depth_m?;
    let depth = |frame: usize| body.is_known(frame, 0).then(|| 1000.0 * depths[frame]);
    Some(Measurement::PerFrame(sequence.per_scored_frame(depth)))
}

#[cfg(test)]
mod tests {
    use super::super::contact_fixture::{contacts, measured};

    #[test]
    fn depths_are_means_over_scored_frames() {
        let feet = contacts(&[(true, 0.0, 0.0); 3], &[(true, 0.0, 0.0); 3]);
        // the fixture puts both bodies as deep into a prop as into themselves
        let found = measured(&feet, &feet, [&[90.0, 1.0, 0.0], &[90.0, 12.0, 4.0]]);
        assert!((found["prop_penetration_mm"].mean - 8.0).abs() < 1e-9);
        assert!((found["truth_prop_penetration_mm"].mean - 0.5).abs() < 1e-9);
    }
}
