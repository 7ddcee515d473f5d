//! Lost limbs: single markers far from the truth, which a mean over the body hides.

use serde::{Deserialize, Serialize};

use super::metric::{Direction, Measurement, Metric, Unit};
use super::{LOSS_FRAMES, Sequence};
use skiagraph_core::body::LANDMARKS;

/// A marker farther from the truth than this is lost, millimetres; the threshold of PCK.
const LOST_LIMB_MM: f64 = 150.0;

pub(super) const SHARE: Metric = Metric {
    name: "lost_limb",
    title: "Frames with a marker over 150 mm off",
    meaning: "How often any marker is more than 150 mm off: a lost arm or leg, which the mean error hides",
    unit: Unit::Fraction,
    direction: Direction::LowerIsBetter,
    needs: "a marker that is in both truth and estimate",
    protocol: "share of the frames in which any of the 15 virtual markers is more than 150 mm from the truth in the \
        world, no alignment; a marker without an estimate is not judged, and a frame without any is left out: coverage \
        and lost frames count them",
    measure: share,
};

/// The longest run of frames in which a marker is lost throughout.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LostStretch {
    /// [`skiagraph_core::body::Landmark::name`] of the markers that are lost in all its frames, at least one.
    pub markers: Vec<String>,
    /// First frame.
    pub first_frame: usize,
    /// Last frame.
    pub last_frame: usize,
    /// Number of markers that the estimate has.
    pub of_markers: usize,
}

impl LostStretch {
    /// Number of frames.
    pub fn frames(&self) -> usize {
        self.last_frame + 1 - self.first_frame
    }
}

/// The markers that the estimate has in any scored frame.
fn given(sequence: &Sequence<'_>) -> Vec<usize> {
    let has = |landmark: &usize| sequence.scored().any(|f| sequence.estimate_markers.get(f, *landmark).is_some());
    (0..LANDMARKS.len()).filter(has).collect()
}

/// Whether a marker is lost in a frame; `None` if the truth or the estimate lacks it.
fn is_off(sequence: &Sequence<'_>, frame: usize, landmark: usize) -> Option<bool> {
    let truth = sequence.truth_markers.get(frame, landmark)?;
    let estimate = sequence.estimate_markers.get(frame, landmark)?;
    Some(1000.0 * (estimate - truth).norm() > LOST_LIMB_MM)
}

fn share(sequence: &Sequence<'_>) -> Option<Measurement> {
    let value = |frame: usize| {
        let off = (0..LANDMARKS.len()).filter_map(|landmark| is_off(sequence, frame, landmark));
        off.reduce(|one, other| one || other).map(|off| f64::from(u8::from(off)))
    };
    Some(Measurement::PerFrame(sequence.per_scored_frame(value)))
}

/// The longest run of frames with a lost marker; `None` if none has [`LOSS_FRAMES`] frames, or all scored frames of a
/// shorter sequence.
pub(super) fn longest_stretch(sequence: &Sequence<'_>) -> Option<LostStretch> {
    let given = given(sequence);
    let off = |frame: usize, landmark: usize| is_off(sequence, frame, landmark) == Some(true);
    let mut longest: Option<(usize, usize)> = None;
    for landmark in &given {
        let mut start = sequence.first_scored;
        for frame in sequence.first_scored..=sequence.frames() {
            if frame < sequence.frames() && off(frame, *landmark) {
                continue;
            }
            if frame - start > longest.map_or(0, |(first, end)| end - first) {
                longest = Some((start, frame));
            }
            start = frame + 1;
        }
    }
    let enough = LOSS_FRAMES.min(sequence.scored().len());
    let (first, end) = longest.filter(|(first, end)| end - first >= enough)?;
    let throughout = given.iter().filter(|landmark| (first..end).all(|frame| off(frame, **landmark)));
    Some(LostStretch {
        markers: throughout.map(|landmark| LANDMARKS[*landmark].name().to_owned()).collect(),
        first_frame: first,
        last_frame: end - 1,
        of_markers: given.len(),
    })
}

#[cfg(test)]
mod tests {
    use crate::test_figure::{evaluate_markers, standing};
    use nalgebra::Vector3;
    use skiagraph_core::body::{Landmark, Markers};
    use std::ops::Range;

    fn moved(frames: &mut [Markers], range: Range<usize>, landmark: Landmark, metres: f64) {
        for frame in &mut frames[range] {
            let marker = &mut frame[landmark as usize];
            *marker = marker.map(|p| p + Vector3::new(0.0, metres, 0.0));
        }
    }

    /// Regression: the mean is only 27 mm with an arm that is lost in half of the frames.
    #[test]
    fn an_arm_lost_for_two_hundred_frames_is_reported_despite_a_small_mean() {
        let truth = vec![standing(); 401];
        let mut estimate = truth.clone();
        moved(&mut estimate, 40..241, Landmark::LeftWrist, 0.6);
        moved(&mut estimate, 41..240, Landmark::LeftElbow, 0.2);
        let evaluation = evaluate_markers(&truth, &estimate);
        assert!(evaluation.metrics["humaneva_mm"].mean < 30.0);
        assert!((evaluation.metrics["lost_limb"].mean - 201.0 / 400.0).abs() < 1e-12);
        let longest = evaluation.longest_lost.unwrap();
        assert_eq!((longest.first_frame, longest.last_frame, longest.frames()), (40, 240, 201));
        assert_eq!(longest.markers, ["left_wrist"]);
    }

    #[test]
    fn markers_lost_throughout_are_named() {
        let truth = vec![standing(); 61];
        let mut estimate = truth.clone();
        moved(&mut estimate, 20..40, Landmark::LeftWrist, 0.2);
        moved(&mut estimate, 18..41, Landmark::LeftElbow, 0.2);
        moved(&mut estimate, 18..41, Landmark::LeftShoulder, 0.2);
        let last = |estimate: &[Markers]| {
            let longest = evaluate_markers(&truth, estimate).longest_lost.unwrap();
            assert_eq!((longest.first_frame, longest.of_markers), (18, 15));
            assert_eq!(longest.markers, ["left_shoulder", "left_elbow"]);
            longest.last_frame
        };
        assert_eq!(last(&estimate), 40);
        // no limb is known to be off where there is none
        estimate[38..61].fill([None; 15]);
        assert_eq!(last(&estimate), 37);
    }

    #[test]
    fn a_short_loss_counts_in_the_share_but_is_not_the_longest_stretch() {
        let truth = vec![standing(); 61];
        let mut estimate = truth.clone();
        moved(&mut estimate, 20..34, Landmark::LeftAnkle, 0.151);
        moved(&mut estimate, 40..55, Landmark::LeftAnkle, 0.149);
        let evaluation = evaluate_markers(&truth, &estimate);
        assert!((evaluation.metrics["lost_limb"].mean - 14.0 / 60.0).abs() < 1e-12);
        assert_eq!(evaluation.longest_lost, None);
    }

    // Every frame with a missing marker counted as one with a marker over 150 mm off: 10 % of points missing, 3 mm off
    // otherwise, was 80 % lost.
    #[test]
    fn missing_marker_is_not_off() {
        let truth = vec![standing(); 5];
        let mut estimate = truth.clone();
        estimate[2][Landmark::RightWrist as usize] = None;
        estimate[3] = [None; 15];
        let evaluation = evaluate_markers(&truth, &estimate);
        let lost = &evaluation.metrics["lost_limb"];
        assert_eq!((lost.mean, lost.frames), (0.0, 3));
        assert_eq!(evaluation.metrics["lost_frames"].mean, 0.25);
        moved(&mut estimate, 2..3, Landmark::RightElbow, 0.2);
        assert_eq!(evaluate_markers(&truth, &estimate).metrics["lost_limb"].mean, 1.0 / 3.0);
        let nothing = vec![[None; 15]; 5];
        assert!(!evaluate_markers(&truth, &nothing).metrics.contains_key("lost_limb"));
    }
}
