//! Mean per-joint angle error: the error of the rotations of body parts.

use nalgebra::UnitQuaternion;

use super::Sequence;
use super::metric::{Direction, Measurement, Metric, Unit};
use super::mpjpe::pooled;
use super::orientation::geodesic_angle;
use super::procrustes::aligning_rotation;
use super::sequence::PARTS;

const NEEDS: &str = "poses of the tracker's body (estimate_root and estimate_angles), with limbs that point as the actor's at \
                     the zero pose";

/// The angle error of the 3DPW challenge, over the world rotations of nine parts.
pub(super) const ABSOLUTE: Metric = Metric {
    name: "mpjae_deg",
    title: "MPJAE, angle error of parts",
    meaning: "How far trunk, thighs, shanks, upper arms and forearms are turned away from the truth, twist included",
    unit: Unit::Degree,
    direction: Direction::LowerIsBetter,
    needs: NEEDS,
    protocol: "geodesic angle between the true and the estimated world rotation of root, thighs, shanks, upper arms and \
               forearms (links that carry hips, knees, shoulders and elbows), each from its rotation at the zero pose; no \
               alignment; turns about a limb's own axis count, which silhouettes hardly show; pooled over all parts of all frames",
    measure: |sequence| angles(sequence, |_| Some(UnitQuaternion::identity())),
};

/// [`ABSOLUTE`] after the rotation of the Procrustes alignment of the markers.
pub(super) const ALIGNED: Metric = Metric {
    name: "pa_mpjae_deg",
    title: "PA-MPJAE, after alignment",
    meaning: "As the angle error of parts, once the whole body is turned to fit best",
    unit: Unit::Degree,
    direction: Direction::LowerIsBetter,
    needs: NEEDS,
    protocol: "as mpjae_deg, after the rotation that aligns the estimated markers of the frame with the true ones (the \
               rotation of pa_mpjpe_mm)",
    measure: |sequence| angles(sequence, |frame| aligning_rotation(sequence, frame)),
};

/// Degrees; `turn(frame)` is applied to the estimate.
fn angles(sequence: &Sequence<'_>, turn: impl Fn(usize) -> Option<UnitQuaternion<f64>>) -> Option<Measurement> {
    let parts = sequence.parts?;
    pooled(sequence, |frame| {
        let Some(turn) = turn(frame) else { return vec![] };
        let both = (0..PARTS).filter_map(|part| Some((parts.truth[frame][part]?, parts.estimate[frame][part]?)));
        both.map(|(truth, estimate)| geodesic_angle(&truth, &(turn * estimate)).to_degrees()).collect()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate;
    use crate::sequence::PartRotations;
    use crate::test_figure::standing;
    use nalgebra::Vector3;
    use skiagraph_core::body::Markers;

    fn measured(estimate: [Option<UnitQuaternion<f64>>; PARTS], markers: Markers) -> [f64; 2] {
        let (truth, estimated) = (vec![standing(); 3], vec![markers; 3]);
        let parts = [[Some(UnitQuaternion::identity()); PARTS], estimate].map(|parts| vec![parts; 3]);
        let mut sequence = Sequence::from_markers(60.0, &truth, &estimated);
        sequence.parts = Some(PartRotations { truth: &parts[0], estimate: &parts[1] });
        let metrics = evaluate(&sequence).unwrap().metrics;
        ["mpjae_deg", "pa_mpjae_deg"].map(|name| metrics[name].mean)
    }

    #[test]
    fn alignment_removes_the_error_of_a_body_that_faces_another_way() {
        let turn = UnitQuaternion::new(Vector3::z() * 0.5);
        let markers = standing().map(|marker| marker.map(|p| turn * p));
        let mut parts = [Some(turn); PARTS];
        // unknown rotations do not count
        parts[4] = None;
        let [absolute, aligned] = measured(parts, markers);
        assert!((absolute - 0.5_f64.to_degrees()).abs() < 1e-6 && aligned < 1e-5, "{absolute} {aligned}");
    }
}
