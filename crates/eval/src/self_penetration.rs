//! Penetration of parts of a body with each other.

use super::metric::{Direction, Measurement, Metric, Unit};
use super::sequence::{ContactMeasures, Sequence};

/// Of the estimate.
pub(super) const DEPTH: Metric = Metric {
    name: "self_penetration_mm",
    title: "Self-penetration",
    unit: Unit::Millimetre,
    direction: Direction::LowerIsBetter,
    needs: "poses of the tracker's body (estimate_root and estimate_angles) and geometry on its feet",
    protocol: "greatest penetration depth between two links of the tracker's body, without pairs that are adjacent or \
        touch in the bind pose; mean over frames",
    measure: |sequence| depth(sequence, sequence.contacts?.estimate?),
};

/// Of the actor.
pub(super) const TRUE_DEPTH: Metric = Metric {
    name: "truth_self_penetration_mm",
    title: "Self-penetration, ground truth",
    direction: Direction::Neither,
    needs: "geometry on the actor's feet",
    protocol: "as self_penetration_mm, of the actor",
    measure: |sequence| depth(sequence, sequence.contacts?.truth),
    ..DEPTH
};

fn depth(sequence: &Sequence<'_>, body: ContactMeasures<'_>) -> Option<Measurement> {
    let depth = |frame: usize| body.is_known(frame, 0).then(|| 1000.0 * body.self_depth_m[frame]);
    Some(Measurement::PerFrame(sequence.per_scored_frame(depth)))
}

#[cfg(test)]
mod tests {
    use super::super::contact_fixture::{contacts, measured};

    #[test]
    fn depths_are_means_over_scored_frames() {
        let feet = contacts(&[(true, 0.0, 0.0); 3], &[(true, 0.0, 0.0); 3]);
        let found = measured(&feet, &feet, [&[90.0, 1.0, 0.0], &[90.0, 12.0, 4.0]]);
        assert!((found["self_penetration_mm"].mean - 8.0).abs() < 1e-9);
        assert!((found["truth_self_penetration_mm"].mean - 0.5).abs() < 1e-9);
    }
}
