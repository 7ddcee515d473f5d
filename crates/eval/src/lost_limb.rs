//! Lost limbs: single markers far from the truth, which a mean over the body hides.

use serde::{Deserialize, Serialize};

use super::metric::{Direction, Measurement, Metric, Unit};
use super::{LOSS_FRAMES, Sequence};
use crate::body::LANDMARKS;

/// A marker farther from the truth than this is lost, millimetres; the threshold of PCK.
const LOST_LIMB_MM: f64 = 150.0;

/// Share of frames with a lost marker.
pub(super) const SHARE: Metric = Metric {
    name: "lost_limb",
    title: "Frames with a marker over 150 mm off",
    meaning: "How often any marker is more than 150 mm off: a lost arm or leg, which the mean error hides",
    unit: Unit::Fraction,
    direction: Direction::LowerIsBetter,
    needs: "markers of the truth",
    protocol: "share of the frames in which any of the 15 virtual markers is more than 150 mm from the truth in the \
        world, no alignment; a marker that the estimate has in other frames but not in this one counts as off, one that \
        it never has is left out; a frame without an estimate counts as off",
    measure: share,
};

/// The longest run of frames in which a marker is lost throughout.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LostStretch {
    /// [`crate::body::Landmark::name`] of the markers that are lost in all its frames, at least one.
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

    /// `left elbow and left wrist more than 150 mm off from frame 40 to 260`, with `missing or more than` if the
    /// estimate lacks markers; more than half of the markers are `most of the body`.
    pub fn describe(&self, lacks_markers: bool) -> String {
        let names: Vec<String> = self.markers.iter().map(|name| name.replace('_', " ")).collect();
        let who = match names.as_slice() {
            several if 2 * several.len() > self.of_markers => "most of the body".to_owned(),
            [others @ .., last] if !others.is_empty() => format!("{} and {last}", others.join(", ")),
            all => all.concat(),
        };
        let missing = if lacks_markers { "missing or " } else { "" };
        let frames = format!("from frame {} to {}", self.first_frame, self.last_frame);
        format!("{who} {missing}more than {LOST_LIMB_MM:.0} mm off {frames}")
    }
}

/// The markers that the estimate has in any scored frame.
fn given(sequence: &Sequence<'_>) -> Vec<usize> {
    let has = |landmark: &usize| sequence.scored().any(|f| sequence.estimate_markers.get(f, *landmark).is_some());
    (0..LANDMARKS.len()).filter(has).collect()
}

/// Whether a marker is lost in a frame; `None` if the truth lacks it.
fn is_off(sequence: &Sequence<'_>, frame: usize, landmark: usize) -> Option<bool> {
    let truth = sequence.truth_markers.get(frame, landmark)?;
    let estimate = sequence.estimate_markers.get(frame, landmark);
    Some(estimate.is_none_or(|estimate| 1000.0 * (estimate - truth).norm() > LOST_LIMB_MM))
}

fn share(sequence: &Sequence<'_>) -> Option<Measurement> {
    let given = given(sequence);
    let value = |frame: usize| {
        if sequence.is_lost(frame) {
            return (sequence.truth_markers.count(frame) > 0).then_some(1.0);
        }
        let off = given.iter().filter_map(|landmark| is_off(sequence, frame, *landmark));
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
    use crate::body::{Landmark, Markers};
    use crate::test_figure::{evaluate_markers, standing};
    use nalgebra::Vector3;
    use std::ops::Range;

    /// Moves a marker in some frames.
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
        assert_eq!(
            (longest.frames(), longest.describe(false)),
            (201, "left wrist more than 150 mm off from frame 40 to 240".to_owned())
        );
    }

    #[test]
    fn markers_lost_together_are_named_together_and_most_of_them_as_the_body() {
        let truth = vec![standing(); 61];
        let mut estimate = truth.clone();
        moved(&mut estimate, 20..40, Landmark::LeftWrist, 0.2);
        moved(&mut estimate, 18..41, Landmark::LeftElbow, 0.2);
        moved(&mut estimate, 18..41, Landmark::LeftShoulder, 0.2);
        let words = |estimate: &[Markers]| evaluate_markers(&truth, estimate).longest_lost.unwrap().describe(false);
        assert_eq!(words(&estimate), "left shoulder and left elbow more than 150 mm off from frame 18 to 40");
        estimate[30..61].fill([None; 15]);
        assert_eq!(words(&estimate), "left shoulder and left elbow more than 150 mm off from frame 18 to 60");
        assert_eq!(
            words(
                &vec![[None; 15]; 61]
                    .into_iter()
                    .enumerate()
                    .map(|(f, m)| if f < 3 { truth[f] } else { m })
                    .collect::<Vec<_>>()
            ),
            "most of the body more than 150 mm off from frame 3 to 60"
        );
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

    #[test]
    fn a_marker_that_the_estimate_never_has_is_left_out_and_one_that_it_drops_is_lost() {
        let truth = vec![standing(); 5];
        let mut estimate = truth.clone();
        estimate.iter_mut().for_each(|frame| frame[Landmark::LeftWrist as usize] = None);
        assert_eq!(evaluate_markers(&truth, &estimate).metrics["lost_limb"].mean, 0.0);
        estimate[2][Landmark::RightWrist as usize] = None;
        assert_eq!(evaluate_markers(&truth, &estimate).metrics["lost_limb"].mean, 0.25);
        let nothing = vec![[None; 15]; 5];
        assert_eq!(evaluate_markers(&truth, &nothing).metrics["lost_limb"].mean, 1.0);
    }
}
