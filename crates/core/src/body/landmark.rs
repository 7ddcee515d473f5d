//! HumanEva's fifteen virtual markers, which define pose errors.

use nalgebra::{Matrix3, Point3};

/// One of HumanEva's fifteen virtual markers (`[Sigal 2010]`).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[expect(missing_docs, reason = "self-explanatory names")]
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
    /// Whether it is one of the twelve joints of arms and legs.
    pub fn is_on_limb(self) -> bool {
        !matches!(self, Self::Thorax | Self::Pelvis | Self::HeadTop)
    }

    /// Snake-case name used in files and reports; a URDF link `marker_NAME` defines the marker.
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

/// World positions of the markers, in the order of [`LANDMARKS`]; metres; `None` for markers that the body lacks.
pub type Markers = [Option<Point3<f64>>; LANDMARKS.len()];

/// Uncertainty of the markers' world positions: covariances, square metres, in the order of [`LANDMARKS`]; `None` if
/// unknown.
pub type MarkerCovariances = [Option<Matrix3<f64>>; LANDMARKS.len()];
