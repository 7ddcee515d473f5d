//! Keypoints: the points of a person that 2D detectors find in images, and the layouts in which they list them.

mod joint_layouts;
mod layout;
mod places;

pub use layout::KeypointLayout;
pub use places::KeypointPlace;

/// Name, the same point of the other side, and standard deviation of its annotations as a share of the square root of
/// a person's area in the image (`[Ronchi 2017]`; beyond COCO's points those of MMPose's HALPE-26).
struct Entry {
    name: &'static str,
    mirrored: Keypoint,
    deviation: f64,
}

macro_rules! keypoints {
    ($($keypoint:ident $name:literal $mirrored:ident $deviation:literal,)*) => {
        /// A point of a person that a detector finds. [`super::Humanoid::keypoint_places`] defines it on a body.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        #[expect(missing_docs, reason = "self-explanatory names")]
        pub enum Keypoint {
            $($keypoint,)*
        }

        const HALPE26: [Keypoint; 26] = [$(Keypoint::$keypoint,)*];

        impl Keypoint {
            fn entry(self) -> Entry {
                match self {
                    $(Self::$keypoint => Entry { name: $name, mirrored: Self::$mirrored, deviation: $deviation },)*
                }
            }
        }
    };
}

// in the order of HALPE-26
keypoints! {
    Nose "nose" Nose 0.026,
    LeftEye "left_eye" RightEye 0.025,
    RightEye "right_eye" LeftEye 0.025,
    LeftEar "left_ear" RightEar 0.035,
    RightEar "right_ear" LeftEar 0.035,
    LeftShoulder "left_shoulder" RightShoulder 0.079,
    RightShoulder "right_shoulder" LeftShoulder 0.079,
    LeftElbow "left_elbow" RightElbow 0.072,
    RightElbow "right_elbow" LeftElbow 0.072,
    LeftWrist "left_wrist" RightWrist 0.062,
    RightWrist "right_wrist" LeftWrist 0.062,
    LeftHip "left_hip" RightHip 0.107,
    RightHip "right_hip" LeftHip 0.107,
    LeftKnee "left_knee" RightKnee 0.087,
    RightKnee "right_knee" LeftKnee 0.087,
    LeftAnkle "left_ankle" RightAnkle 0.089,
    RightAnkle "right_ankle" LeftAnkle 0.089,
    Head "head" Head 0.026,
    Neck "neck" Neck 0.026,
    MidHip "mid_hip" MidHip 0.066,
    LeftBigToe "left_big_toe" RightBigToe 0.079,
    RightBigToe "right_big_toe" LeftBigToe 0.079,
    LeftSmallToe "left_small_toe" RightSmallToe 0.079,
    RightSmallToe "right_small_toe" LeftSmallToe 0.079,
    LeftHeel "left_heel" RightHeel 0.079,
    RightHeel "right_heel" LeftHeel 0.079,
}

/// Left and right parts of a body that a detector may mistake for each other as a whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum PairedLimb {
    /// Eyes and ears.
    Face = 0,
    /// Shoulders, elbows and wrists.
    Arms = 1,
    /// Hips, knees, ankles and feet.
    Legs = 2,
}

impl Keypoint {
    /// Snake-case name, used in files and messages.
    pub fn name(self) -> &'static str {
        self.entry().name
    }

    /// The same point of the other side; itself for a point in the middle.
    pub fn mirrored(self) -> Self {
        self.entry().mirrored
    }

    /// Standard deviation of COCO's annotations of this point, as a share of the square root of a person's area in the
    /// image.
    pub fn annotation_deviation(self) -> f64 {
        self.entry().deviation
    }

    /// The deviation of its annotations divided by the mean of COCO's 17 points.
    pub fn relative_deviation(self) -> f64 {
        let coco = KeypointLayout::Coco17.keypoints();
        let sum: f64 = coco.iter().map(|point| point.annotation_deviation()).sum();
        self.annotation_deviation() * coco.len() as f64 / sum
    }

    /// The parts that left and right belong to; `None` for a point in the middle.
    pub fn limb(self) -> Option<PairedLimb> {
        use Keypoint as K;
        match self {
            K::Nose | K::Head | K::Neck | K::MidHip => None,
            K::LeftEye | K::RightEye | K::LeftEar | K::RightEar => Some(PairedLimb::Face),
            K::LeftShoulder | K::RightShoulder | K::LeftElbow | K::RightElbow | K::LeftWrist | K::RightWrist => {
                Some(PairedLimb::Arms)
            }
            _ => Some(PairedLimb::Legs),
        }
    }
}
