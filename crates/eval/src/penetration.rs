//! Penetration of body parts into each other and into props.

use super::metric::{Direction, Measurement, Metric, Unit};
use super::sequence::{ContactMeasures, Sequence};

pub(super) const SELF_DEPTH: Metric = Metric {
    name: "self_penetration_mm",
    title: "Self-penetration",
    meaning: "How deep parts of the body are inside each other",
    unit: Unit::Millimetre,
    direction: Direction::LowerIsBetter,
    needs: "poses of the tracker's body (estimate_root and estimate_angles) and geometry on its feet",
    protocol: "greatest penetration depth between two links of the tracker's body, without pairs that are adjacent or \
        touch in the bind pose; mean over frames",
    measure: |sequence| mean_depth(sequence, sequence.contacts?.estimate?, |body| Some(body.self_depth_m)),
};

pub(super) const TRUE_SELF_DEPTH: Metric = Metric {
    name: "truth_self_penetration_mm",
    title: "Self-penetration, ground truth",
    direction: Direction::Neither,
    needs: "geometry on the actor's feet",
    protocol: "as self_penetration_mm, of the actor",
    measure: |sequence| mean_depth(sequence, sequence.contacts?.truth, |body| Some(body.self_depth_m)),
    ..SELF_DEPTH
};

pub(super) const PROP_DEPTH: Metric = Metric {
    name: "prop_penetration_mm",
    title: "Prop penetration",
    meaning: "How deep the body is inside an object of the scene",
    unit: Unit::Millimetre,
    direction: Direction::LowerIsBetter,
    needs: "poses of the tracker's body (estimate_root and estimate_angles), geometry on its feet, and a prop in the scene",
    protocol: "greatest penetration depth of a link of the tracker's body in a prop of the scene, 0 if none; mean over \
        frames",
    measure: |sequence| mean_depth(sequence, sequence.contacts?.estimate?, |body| body.prop_depth_m),
};

pub(super) const TRUE_PROP_DEPTH: Metric = Metric {
    name: "truth_prop_penetration_mm",
    title: "Prop penetration, ground truth",
    direction: Direction::Neither,
    needs: "geometry on the actor's feet, and a prop in the scene",
    protocol: "as prop_penetration_mm, of the actor",
    measure: |sequence| mean_depth(sequence, sequence.contacts?.truth, |body| body.prop_depth_m),
    ..PROP_DEPTH
};

type Depths = for<'a> fn(ContactMeasures<'a>) -> Option<&'a [f64]>;

fn mean_depth(sequence: &Sequence<'_>, body: ContactMeasures<'_>, depths_m: Depths) -> Option<Measurement> {
    let depths_m = depths_m(body)?;
    let depth = |frame: usize| body.is_known(frame, 0).then(|| 1000.0 * depths_m[frame]);
    Some(Measurement::PerFrame(sequence.per_scored_frame(depth)))
}

#[cfg(test)]
mod tests {
    use super::super::contact_fixture::{contacts, measured};

    #[test]
    fn depths_are_means_over_scored_frames() {
        let feet = contacts(&[(true, 0.0, 0.0); 3], &[(true, 0.0, 0.0); 3]);
        // in the fixture, both bodies are as deep in a prop as in themselves
        let found = measured(&feet, &feet, [&[90.0, 1.0, 0.0], &[90.0, 12.0, 4.0]]);
        for what in ["self", "prop"] {
            assert!((found[&format!("{what}_penetration_mm")].mean - 8.0).abs() < 1e-9);
            assert!((found[&format!("truth_{what}_penetration_mm")].mean - 0.5).abs() < 1e-9);
        }
    }
}
