//! Confusion of left and right limbs.

use nalgebra::Point3;

use super::Sequence;
use super::metric::{Direction, Measurement, Metric, Unit};
use skiagraph_core::body::{Landmark, Markers};

/// Share of frames in which limbs are nearer to the truth with left and right exchanged. That does not prove that they
/// are exchanged: [`super::limbs_exchanged`] also requires a small error after the exchange.
pub(super) const SHARE: Metric = Metric {
    name: "limb_swaps",
    title: "Frames that fit better exchanged",
    meaning: "How often legs or arms fit better with left and right exchanged, however slightly: a hint, not a fault",
    unit: Unit::Fraction,
    direction: Direction::LowerIsBetter,
    needs: "both knees and ankles, or both elbows and wrists, in truth and estimate",
    protocol: "share of the frames in which exchanging left and right of the estimate's legs (knee and ankle) or arms \
        (elbow and wrist) reduces the sum of these markers' distances from the truth, no alignment; legs and arms are \
        tested separately, one swap is enough; limbs with a missing marker in truth or estimate are skipped, frames \
        without complete limbs are left out",
    measure: share,
};

/// The markers of a left and a right limb that move relative to the trunk, joint by joint.
pub(super) type Limbs = [[Landmark; 2]; 2];
pub(super) const LEGS: Limbs = [[Landmark::LeftKnee, Landmark::RightKnee], [Landmark::LeftAnkle, Landmark::RightAnkle]];
pub(super) const ARMS: Limbs =
    [[Landmark::LeftElbow, Landmark::RightElbow], [Landmark::LeftWrist, Landmark::RightWrist]];

fn share(sequence: &Sequence<'_>) -> Option<Measurement> {
    let swapped = |frame: usize| {
        let (truth, estimate) = (sequence.truth_markers.frame(frame), sequence.estimate_markers.frame(frame));
        let judged = [LEGS, ARMS].iter().filter_map(|limbs| is_swapped(&truth, &estimate, limbs));
        judged.reduce(|one, other| one || other).map(|swapped| f64::from(u8::from(swapped)))
    };
    Some(Measurement::PerFrame(sequence.per_scored_frame(swapped)))
}

/// Whether the limbs fit better with left and right exchanged; `None` if a marker is missing.
fn is_swapped(truth: &Markers, estimate: &Markers, limbs: &Limbs) -> Option<bool> {
    let (mut as_is, mut exchanged) = (0.0, 0.0);
    for [left, right] in limbs {
        let places = |markers: &Markers| -> Option<[Point3<f64>; 2]> {
            Some([markers[*left as usize]?, markers[*right as usize]?])
        };
        let ([a, b], [x, y]) = (places(truth)?, places(estimate)?);
        as_is += (x - a).norm() + (y - b).norm();
        exchanged += (y - a).norm() + (x - b).norm();
    }
    Some(exchanged < as_is)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::test_figure::{evaluate_markers, standing, translated};
    use nalgebra::Vector3;

    pub(crate) fn exchanged(markers: &Markers, limbs: &Limbs) -> Markers {
        let mut exchanged = *markers;
        limbs.iter().for_each(|[left, right]| exchanged.swap(*left as usize, *right as usize));
        exchanged
    }

    #[test]
    fn legs_and_arms_are_tested_separately_and_a_frame_counts_once() {
        let truth = vec![standing(); 6];
        let mut estimate = truth.clone();
        estimate[0] = exchanged(&truth[0], &LEGS); // left out
        estimate[1] = exchanged(&truth[1], &LEGS);
        estimate[2] = exchanged(&truth[2], &ARMS);
        estimate[3] = exchanged(&exchanged(&truth[3], &LEGS), &ARMS);
        let metric = &evaluate_markers(&truth, &estimate).metrics["limb_swaps"];
        assert_eq!(metric.per_frame, [None, Some(1.0), Some(1.0), Some(1.0), Some(0.0), Some(0.0)]);
        assert!((metric.mean - 3.0 / 5.0).abs() < 1e-12);
    }

    /// The ankles are 0.2 m apart sideways and 0.22 m along, the knees 0.2 and 0.14 m: moved to the left by 0.3 m,
    /// every right marker is 0.1 m to the left of the true left one. Unchanged they are 4 x 0.3 m off. Exchanged, the
    /// right ones are hypot(0.1, 0.22) and hypot(0.1, 0.14) m off, the left ones hypot(0.5, 0.22) and hypot(0.5, 0.14):
    /// 1.479 m in all.
    #[test]
    fn a_body_beside_the_true_one_is_not_exchanged() {
        let hypot = f64::hypot;
        assert!(hypot(0.1, 0.22) + hypot(0.1, 0.14) + hypot(0.5, 0.22) + hypot(0.5, 0.14) > 1.2);
        let truth = vec![standing(); 3];
        let beside: Vec<_> = truth.iter().map(|m| translated(m, Vector3::new(0.0, 0.3, 0.0))).collect();
        assert_eq!(evaluate_markers(&truth, &beside).metrics["limb_swaps"].mean, 0.0);
    }

    #[test]
    fn limbs_that_lack_a_marker_are_skipped_and_frames_without_limbs_left_out() {
        let truth = vec![standing(); 3];
        let mut estimate: Vec<_> = truth.iter().map(|m| exchanged(m, &LEGS)).collect();
        estimate[1][Landmark::LeftKnee as usize] = None;
        estimate[2][Landmark::LeftKnee as usize] = None;
        estimate[2][Landmark::RightWrist as usize] = None;
        let metric = &evaluate_markers(&truth, &estimate).metrics["limb_swaps"];
        assert_eq!(metric.per_frame, [None, Some(0.0), None]);
    }
}
