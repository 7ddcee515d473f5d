//! HumanEva's fifteen virtual markers, which define pose errors.

use nalgebra::{Matrix3, Point3};

macro_rules! landmarks {
    ($($landmark:ident $name:literal,)*) => {
        /// One of HumanEva's fifteen virtual markers (`[Sigal 2010]`).
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        #[expect(missing_docs, reason = "self-explanatory names")]
        pub enum Landmark {
            $($landmark,)*
        }

        /// Every landmark, in the order in which markers are stored.
        pub const LANDMARKS: [Landmark; 15] = [$(Landmark::$landmark,)*];

        impl Landmark {
            /// Snake-case name used in files and reports; a URDF link `marker_NAME` defines the marker.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$landmark => $name,)*
                }
            }
        }
    };
}

landmarks! {
    Thorax "thorax",
    Pelvis "pelvis",
    LeftShoulder "left_shoulder",
    LeftElbow "left_elbow",
    LeftWrist "left_wrist",
    RightShoulder "right_shoulder",
    RightElbow "right_elbow",
    RightWrist "right_wrist",
    LeftHip "left_hip",
    LeftKnee "left_knee",
    LeftAnkle "left_ankle",
    RightHip "right_hip",
    RightKnee "right_knee",
    RightAnkle "right_ankle",
    HeadTop "head_top",
}

/// Hip, knee and ankle of the left and of the right leg.
pub(super) const LEGS: [[Landmark; 3]; 2] = [
    [Landmark::LeftHip, Landmark::LeftKnee, Landmark::LeftAnkle],
    [Landmark::RightHip, Landmark::RightKnee, Landmark::RightAnkle],
];
/// Shoulder, elbow and wrist of the left and of the right arm.
pub(super) const ARMS: [[Landmark; 3]; 2] = [
    [Landmark::LeftShoulder, Landmark::LeftElbow, Landmark::LeftWrist],
    [Landmark::RightShoulder, Landmark::RightElbow, Landmark::RightWrist],
];

impl Landmark {
    /// Whether it is one of the twelve joints of arms and legs.
    pub fn is_on_limb(self) -> bool {
        !matches!(self, Self::Thorax | Self::Pelvis | Self::HeadTop)
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
