//! Keypoints: the points of a person that 2D detectors find in images, and the layouts in which they list them.

mod joint_layouts;
mod layout;
mod places;

pub use layout::KeypointLayout;
pub use places::KeypointPlace;

/// A point of a person that a detector finds. [`super::Humanoid::keypoint_places`] defines it on a body.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[expect(missing_docs, reason = "self-explanatory names")]
pub enum Keypoint {
    Nose,
    LeftEye,
    RightEye,
    LeftEar,
    RightEar,
    LeftShoulder,
    RightShoulder,
    LeftElbow,
    RightElbow,
    LeftWrist,
    RightWrist,
    LeftHip,
    RightHip,
    LeftKnee,
    RightKnee,
    LeftAnkle,
    RightAnkle,
    Head,
    Neck,
    MidHip,
    LeftBigToe,
    RightBigToe,
    LeftSmallToe,
    RightSmallToe,
    LeftHeel,
    RightHeel,
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

/// Name, the same point of the other side, and standard deviation of its annotations as a share of the square root of
/// a person's area in the image (`[Ronchi 2017]`; beyond COCO's points those of MMPose's HALPE-26).
struct Entry {
    name: &'static str,
    mirrored: Keypoint,
    deviation: f64,
}

const fn entry(name: &'static str, mirrored: Keypoint, deviation: f64) -> Entry {
    Entry { name, mirrored, deviation }
}

impl Keypoint {
    fn entry(self) -> Entry {
        use Keypoint as K;
        match self {
            K::Nose => entry("nose", self, 0.026),
            K::LeftEye => entry("left_eye", K::RightEye, 0.025),
            K::RightEye => entry("right_eye", K::LeftEye, 0.025),
            K::LeftEar => entry("left_ear", K::RightEar, 0.035),
            K::RightEar => entry("right_ear", K::LeftEar, 0.035),
            K::LeftShoulder => entry("left_shoulder", K::RightShoulder, 0.079),
            K::RightShoulder => entry("right_shoulder", K::LeftShoulder, 0.079),
            K::LeftElbow => entry("left_elbow", K::RightElbow, 0.072),
            K::RightElbow => entry("right_elbow", K::LeftElbow, 0.072),
            K::LeftWrist => entry("left_wrist", K::RightWrist, 0.062),
            K::RightWrist => entry("right_wrist", K::LeftWrist, 0.062),
            K::LeftHip => entry("left_hip", K::RightHip, 0.107),
            K::RightHip => entry("right_hip", K::LeftHip, 0.107),
            K::LeftKnee => entry("left_knee", K::RightKnee, 0.087),
            K::RightKnee => entry("right_knee", K::LeftKnee, 0.087),
            K::LeftAnkle => entry("left_ankle", K::RightAnkle, 0.089),
            K::RightAnkle => entry("right_ankle", K::LeftAnkle, 0.089),
            K::Head => entry("head", self, 0.026),
            K::Neck => entry("neck", self, 0.026),
            K::MidHip => entry("mid_hip", self, 0.066),
            K::LeftBigToe => entry("left_big_toe", K::RightBigToe, 0.079),
            K::RightBigToe => entry("right_big_toe", K::LeftBigToe, 0.079),
            K::LeftSmallToe => entry("left_small_toe", K::RightSmallToe, 0.079),
            K::RightSmallToe => entry("right_small_toe", K::LeftSmallToe, 0.079),
            K::LeftHeel => entry("left_heel", K::RightHeel, 0.079),
            K::RightHeel => entry("right_heel", K::LeftHeel, 0.079),
        }
    }

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
