//! Layouts: which keypoints a detector lists, in which order.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{HALPE26, Keypoint};

/// The keypoints of a family of detectors, in the order of its files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum KeypointLayout {
    /// COCO: 17 points from nose to ankles.
    Coco17,
    /// HALPE-26: those of COCO, then head, neck, middle of the hips, toes and heels.
    Halpe26,
    /// OpenPose's BODY-25.
    Body25,
}

const BODY25: [Keypoint; 25] = {
    use Keypoint as K;
    [
        K::Nose,
        K::Neck,
        K::RightShoulder,
        K::RightElbow,
        K::RightWrist,
        K::LeftShoulder,
        K::LeftElbow,
        K::LeftWrist,
        K::MidHip,
        K::RightHip,
        K::RightKnee,
        K::RightAnkle,
        K::LeftHip,
        K::LeftKnee,
        K::LeftAnkle,
        K::RightEye,
        K::LeftEye,
        K::RightEar,
        K::LeftEar,
        K::LeftBigToe,
        K::LeftSmallToe,
        K::LeftHeel,
        K::RightBigToe,
        K::RightSmallToe,
        K::RightHeel,
    ]
};

/// Number of COCO's points, the first of HALPE-26.
const COCO_POINTS: usize = 17;

impl KeypointLayout {
    /// Every layout.
    pub const ALL: [Self; 3] = [Self::Coco17, Self::Halpe26, Self::Body25];

    /// Its keypoints in order.
    pub fn keypoints(self) -> &'static [Keypoint] {
        match self {
            Self::Coco17 => &HALPE26[..COCO_POINTS],
            Self::Halpe26 => &HALPE26,
            Self::Body25 => &BODY25,
        }
    }

    /// Its name in scenarios, files and messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Coco17 => "coco17",
            Self::Halpe26 => "halpe26",
            Self::Body25 => "body25",
        }
    }

    /// The layout with this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|layout| layout.name() == name)
    }

    /// For every keypoint, the index of the same point of the other side; its own for a point in the middle.
    pub fn mirrored(self) -> Vec<usize> {
        let all = self.keypoints();
        let other = |(own, point): (usize, &Keypoint)| all.iter().position(|p| *p == point.mirrored()).unwrap_or(own);
        all.iter().enumerate().map(other).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layouts_have_the_points_of_their_names_in_pairs() {
        for layout in KeypointLayout::ALL {
            let points = layout.keypoints();
            assert!(layout.name().ends_with(&points.len().to_string()), "{layout:?}");
            assert_eq!(KeypointLayout::named(layout.name()), Some(layout));
            assert_eq!(serde_json::to_value(layout).unwrap(), layout.name());
            let mirrored = layout.mirrored();
            for (index, point) in points.iter().enumerate() {
                let (name, other) = (point.name(), points[mirrored[index]]);
                assert_eq!(mirrored[mirrored[index]], index, "{name}");
                let swapped = match name.split_once('_') {
                    Some(("left", part)) => format!("right_{part}"),
                    Some(("right", part)) => format!("left_{part}"),
                    _ => name.to_owned(),
                };
                assert_eq!((other.name(), point.limb().is_some()), (swapped.as_str(), swapped != name));
                assert_eq!((point.limb(), point.annotation_deviation()), (other.limb(), other.annotation_deviation()));
                assert!(!points[..index].contains(point), "{name} twice");
            }
        }
    }
}
