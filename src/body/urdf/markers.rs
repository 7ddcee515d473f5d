//! Markers: placed by links named `marker_NAME`, or recognised by the names of other projects' links.

use nalgebra::Point3;
use roxmltree::Node;

use super::UrdfError;
use super::document::Document;
use crate::body::{Joint, JointKind, LANDMARKS, Landmark, Link, LinkPoint};

/// One place per landmark.
pub(super) type MarkerSet = [Option<LinkPoint>; LANDMARKS.len()];

/// Landmark, and the names of links whose origin is its place: pybullet's humanoid, Gepetto's human, and the subjects of
/// human-gazebo (Xsens segments).
const KNOWN_LINKS: [(Landmark, [&str; 3]); 14] = [
    (Landmark::Thorax, ["neck", "middle_head", "Neck"]),
    (Landmark::Pelvis, ["root", "middle_pelvis", "Pelvis"]),
    (Landmark::LeftShoulder, ["left_shoulder", "left_upperarm", "LeftUpperArm"]),
    (Landmark::LeftElbow, ["left_elbow", "left_lowerarm", "LeftForeArm"]),
    (Landmark::LeftWrist, ["left_wrist", "left_hand", "LeftHand"]),
    (Landmark::RightShoulder, ["right_shoulder", "right_upperarm", "RightUpperArm"]),
    (Landmark::RightElbow, ["right_elbow", "right_lowerarm", "RightForeArm"]),
    (Landmark::RightWrist, ["right_wrist", "right_hand", "RightHand"]),
    (Landmark::LeftHip, ["left_hip", "left_upperleg", "LeftUpperLeg"]),
    (Landmark::LeftKnee, ["left_knee", "left_lowerleg", "LeftLowerLeg"]),
    (Landmark::LeftAnkle, ["left_ankle", "left_foot", "LeftFoot"]),
    (Landmark::RightHip, ["right_hip", "right_upperleg", "RightUpperLeg"]),
    (Landmark::RightKnee, ["right_knee", "right_lowerleg", "RightLowerLeg"]),
    (Landmark::RightAnkle, ["right_ankle", "right_foot", "RightFoot"]),
];

/// The marker that a link of this name is.
pub(super) fn slot(link: &str) -> Option<usize> {
    let name = link.strip_prefix("marker_")?;
    LANDMARKS.iter().position(|l| l.name() == name)
}

/// Where the marker that `link` is sits on the link that `joint` hangs it from.
pub(super) fn place(
    document: &Document<'_>,
    node: Node<'_, '_>,
    link: &Link,
    joint: &Joint,
) -> Result<LinkPoint, UrdfError> {
    if !link.flesh.is_empty() || link.inertia.is_some() || joint.kind != JointKind::Fixed {
        return Err(document.refuse(node, "a marker must be a link without mass and flesh on a fixed joint"));
    }
    Ok(LinkPoint { link: joint.parent, point_in_link: joint.parent_from_joint.translation.vector.into() })
}

/// The markers of a body that places none itself, recognised by the names of its links.
pub(super) fn recognised(links: &[Link]) -> MarkerSet {
    let mut markers = MarkerSet::default();
    for family in 0..3 {
        let found = |landmark: Landmark| {
            let (_, names) = KNOWN_LINKS.iter().find(|k| k.0 == landmark)?;
            let link = links.iter().position(|l| l.name == names[family])?;
            Some(LinkPoint { link, point_in_link: Point3::origin() })
        };
        let guess = LANDMARKS.map(found);
        if guess.iter().flatten().count() > markers.iter().flatten().count() {
            markers = guess;
        }
    }
    markers
}
