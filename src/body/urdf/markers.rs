//! Collects links and joints while turning `marker_NAME` links into markers.

use nalgebra::{Isometry3, Point3};

use super::document::Document;
use super::tree::Tree;
use super::{UrdfError, isometry};
use crate::body::{Joint, JointKind, LANDMARKS, Landmark, Link, LinkPoint};

type MarkerSet = [Option<LinkPoint>; LANDMARKS.len()];

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

/// Links, joints and markers so far.
#[derive(Default)]
pub(super) struct Builder {
    links: Vec<Link>,
    joints: Vec<Joint>,
    markers: MarkerSet,
    /// Pairs of the file's index of a link and ours.
    placed: Vec<(usize, usize)>,
}

impl Builder {
    /// Takes the root.
    pub(super) fn root(&mut self, index: usize, link: Link) {
        self.placed.push((index, 0));
        self.links.push(link);
    }

    /// Takes a link and the joint that carries it, or the marker that they are.
    #[expect(clippy::too_many_arguments, reason = "a link is known by its place in the text, the tree and the robot")]
    pub(super) fn link(
        &mut self,
        document: &Document<'_>,
        tree: &Tree,
        index: usize,
        link: Link,
        joint: usize,
        robot: &urdf_rs::Robot,
        kind: JointKind,
    ) -> Result<(), UrdfError> {
        let parent_in_file = tree.parent_link[joint];
        let parent = self.placed.iter().find(|p| p.0 == parent_in_file).map_or(0, |p| p.1);
        let parent_from_joint = isometry(&robot.joints[joint].origin);
        if let Some(slot) = marker_slot(&link.name) {
            let bare = link.flesh.is_empty() && link.inertia.is_none() && tree.joints_below[index].is_empty();
            if !bare || kind != JointKind::Fixed {
                return Err(document.refuse(
                    document.link(index),
                    "a marker must be a link without mass, flesh and children on a fixed joint",
                ));
            }
            self.markers[slot] = Some(LinkPoint { link: parent, point_in_link: origin(&parent_from_joint) });
            return Ok(());
        }
        self.placed.push((index, self.links.len()));
        self.links.push(link);
        self.joints.push(Joint { name: robot.joints[joint].name.clone(), parent, parent_from_joint, kind });
        Ok(())
    }

    /// All links, joints and markers; where the file places no marker at all, those recognised by their links' names.
    pub(super) fn finish(self) -> (Vec<Link>, Vec<Joint>, MarkerSet) {
        let markers = if self.markers.iter().all(Option::is_none) { recognised(&self.links) } else { self.markers };
        (self.links, self.joints, markers)
    }
}

fn origin(frame: &Isometry3<f64>) -> Point3<f64> {
    frame.translation.vector.into()
}

fn marker_slot(link: &str) -> Option<usize> {
    let name = link.strip_prefix("marker_")?;
    LANDMARKS.iter().position(|l| l.name() == name)
}

fn recognised(links: &[Link]) -> MarkerSet {
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
