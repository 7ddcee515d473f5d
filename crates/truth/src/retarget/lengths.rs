//! Segment lengths of a subject.

use nalgebra::Point3;
use serde::Serialize;

use super::anatomy::SubjectFrame;
use skiagraph_core::body::{Humanoid, Landmark, Markers};

/// Segment lengths between a body's landmarks, metres; pairs are left and right. `None` if unknown.
///
/// For a recording they are medians over frames, except for trunk and head, which are 90th percentiles because bending
/// shortens them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct SegmentLengths {
    /// Midpoint of the hips to thorax (C7).
    pub trunk: Option<f64>,
    /// Thorax (C7) to top of the head.
    pub head: Option<f64>,
    /// Shoulder to shoulder.
    pub shoulder_width: Option<f64>,
    /// Hip to hip.
    pub hip_width: Option<f64>,
    /// Shoulder to elbow.
    pub upper_arm: [Option<f64>; 2],
    /// Elbow to wrist.
    pub forearm: [Option<f64>; 2],
    /// Hip to knee.
    pub thigh: [Option<f64>; 2],
    /// Knee to ankle.
    pub shank: [Option<f64>; 2],
    /// Ankle to ball of the foot.
    pub foot: [Option<f64>; 2],
}

/// Landmarks at one instant, and the balls of the left and right foot, metres.
type LandmarkPlaces = (Markers, [Option<Point3<f64>>; 2]);

/// The ends of a length.
type Ends = (Option<Point3<f64>>, Option<Point3<f64>>);

impl SegmentLengths {
    /// The lengths of a body at its zero pose.
    pub fn from_body(humanoid: &Humanoid) -> Self {
        let frames = humanoid.link_frames(&humanoid.zero_pose());
        let toes = ["left_toes", "right_toes"]
            .map(|name| humanoid.find_link(name).map(|link| Point3::from(frames[link].translation.vector)));
        Self::measure(&[(humanoid.markers(&frames), toes)])
    }

    /// The lengths between landmarks at one instant; `toes` are the balls of the left and right foot.
    pub(super) fn from_places(markers: &Markers, toes: [Option<Point3<f64>>; 2]) -> Self {
        Self::measure(&[(*markers, toes)])
    }

    pub(super) fn from_subject(frames: &[SubjectFrame]) -> Self {
        Self::measure(&frames.iter().map(|f| (f.markers, f.toes)).collect::<Vec<_>>())
    }

    /// The same lengths on both sides: the mean of left and right.
    pub fn symmetric(self) -> Self {
        let mean = |[left, right]: [Option<f64>; 2]| match (left, right) {
            (Some(left), Some(right)) => [Some(0.5 * (left + right)); 2],
            (one, other) => [one.or(other); 2],
        };
        Self {
            upper_arm: mean(self.upper_arm),
            forearm: mean(self.forearm),
            thigh: mean(self.thigh),
            shank: mean(self.shank),
            foot: mean(self.foot),
            ..self
        }
    }

    /// Length along the body from ankle to crown: shank, thigh, trunk and head; `None` if one is missing.
    pub fn ankle_to_crown(&self) -> Option<f64> {
        let mean = |[left, right]: [Option<f64>; 2]| Some(0.5 * (left? + right?));
        Some(mean(self.shank)? + mean(self.thigh)? + self.trunk? + self.head?)
    }

    fn measure(frames: &[LandmarkPlaces]) -> Self {
        use Landmark as L;
        let quantile = |share: f64, ends: &dyn Fn(&LandmarkPlaces) -> Ends| {
            let distances = frames.iter().filter_map(|frame| match ends(frame) {
                (Some(a), Some(b)) => Some((b - a).norm()),
                _ => None,
            });
            super::quantile(distances.collect(), share)
        };
        let between = |a: L, b: L| quantile(0.5, &|(markers, _)| (markers[a as usize], markers[b as usize]));
        let bending = |a: L, b: L| quantile(0.9, &|(markers, _)| (markers[a as usize], markers[b as usize]));
        let foot = |ankle: L, side: usize| quantile(0.5, &|(markers, toes)| (markers[ankle as usize], toes[side]));
        Self {
            trunk: bending(L::Pelvis, L::Thorax),
            head: bending(L::Thorax, L::HeadTop),
            shoulder_width: between(L::LeftShoulder, L::RightShoulder),
            hip_width: between(L::LeftHip, L::RightHip),
            upper_arm: [between(L::LeftShoulder, L::LeftElbow), between(L::RightShoulder, L::RightElbow)],
            forearm: [between(L::LeftElbow, L::LeftWrist), between(L::RightElbow, L::RightWrist)],
            thigh: [between(L::LeftHip, L::LeftKnee), between(L::RightHip, L::RightKnee)],
            shank: [between(L::LeftKnee, L::LeftAnkle), between(L::RightKnee, L::RightAnkle)],
            foot: [foot(L::LeftAnkle, 0), foot(L::RightAnkle, 1)],
        }
    }
}
