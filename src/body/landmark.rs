//! HumanEva's fifteen virtual markers: the points on which pose error is measured.

use nalgebra::Point3;

use super::{Humanoid, LinkFrames};

/// One of HumanEva's fifteen virtual markers (Sigal and Black 2006).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[expect(missing_docs, reason = "the names say it")]
pub enum Landmark {
    Thorax,
    Pelvis,
    LeftShoulder,
    LeftElbow,
    LeftWrist,
    RightShoulder,
    RightElbow,
    RightWrist,
    LeftHip,
    LeftKnee,
    LeftAnkle,
    RightHip,
    RightKnee,
    RightAnkle,
    HeadTop,
}

/// Every landmark, in the order in which markers are stored.
pub const LANDMARKS: [Landmark; 15] = [
    Landmark::Thorax,
    Landmark::Pelvis,
    Landmark::LeftShoulder,
    Landmark::LeftElbow,
    Landmark::LeftWrist,
    Landmark::RightShoulder,
    Landmark::RightElbow,
    Landmark::RightWrist,
    Landmark::LeftHip,
    Landmark::LeftKnee,
    Landmark::LeftAnkle,
    Landmark::RightHip,
    Landmark::RightKnee,
    Landmark::RightAnkle,
    Landmark::HeadTop,
];

impl Landmark {
    /// Snake-case name, as files and reports spell it; a URDF link `marker_NAME` places the marker.
    pub fn name(self) -> &'static str {
        match self {
            Self::Thorax => "thorax",
            Self::Pelvis => "pelvis",
            Self::LeftShoulder => "left_shoulder",
            Self::LeftElbow => "left_elbow",
            Self::LeftWrist => "left_wrist",
            Self::RightShoulder => "right_shoulder",
            Self::RightElbow => "right_elbow",
            Self::RightWrist => "right_wrist",
            Self::LeftHip => "left_hip",
            Self::LeftKnee => "left_knee",
            Self::LeftAnkle => "left_ankle",
            Self::RightHip => "right_hip",
            Self::RightKnee => "right_knee",
            Self::RightAnkle => "right_ankle",
            Self::HeadTop => "head_top",
        }
    }
}

/// A point fixed to a link.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinkPoint {
    /// Index of the link.
    pub link: usize,
    /// Metres, in the link's frame.
    pub point_in_link: Point3<f64>,
}

/// World positions of the markers, in the order of [`LANDMARKS`]; metres; `None` where the body has no such marker.
pub type Markers = [Option<Point3<f64>>; LANDMARKS.len()];

impl Humanoid {
    /// Where the markers are when the links are at `frames`.
    pub fn markers(&self, frames: &LinkFrames) -> Markers {
        self.markers.map(|marker| marker.map(|m| frames[m.link] * m.point_in_link))
    }
}
