//! The joints of common data sets on a body: where each is, in the order of that data set.

use nalgebra::Point3;

use super::{Keypoint, KeypointLayout};
use crate::body::{Humanoid, Landmark, LinkPoint};

/// A place on a body that a data set has a name for.
#[derive(Clone, Copy, Debug)]
enum Place {
    Marker(Landmark),
    Keypoint(Keypoint),
    /// Where the collarbone of this shoulder begins.
    Collar(Landmark),
    /// Where the head meets the neck.
    SkullBase,
    /// The joint beyond this ankle.
    Toes(Landmark),
    /// No joint or surface point of these bodies is there.
    Nowhere,
}

type NamedPlaces = &'static [(&'static str, Place)];

use Landmark as L;
use Place::{Collar, Marker, Nowhere, SkullBase, Toes};

/// Human3.6M's 17, in the order of its usual benchmark.
const HUMAN36M: NamedPlaces = &[
    ("hip", Marker(L::Pelvis)),
    ("right_hip", Marker(L::RightHip)),
    ("right_knee", Marker(L::RightKnee)),
    ("right_foot", Marker(L::RightAnkle)),
    ("left_hip", Marker(L::LeftHip)),
    ("left_knee", Marker(L::LeftKnee)),
    ("left_foot", Marker(L::LeftAnkle)),
    ("spine", Nowhere),
    ("thorax", Marker(L::Thorax)),
    ("nose", Place::Keypoint(Keypoint::Nose)),
    ("head", Marker(L::HeadTop)),
    ("left_shoulder", Marker(L::LeftShoulder)),
    ("left_elbow", Marker(L::LeftElbow)),
    ("left_wrist", Marker(L::LeftWrist)),
    ("right_shoulder", Marker(L::RightShoulder)),
    ("right_elbow", Marker(L::RightElbow)),
    ("right_wrist", Marker(L::RightWrist)),
];

/// The 24 of SMPL.
const SMPL: NamedPlaces = &[
    ("pelvis", Marker(L::Pelvis)),
    ("left_hip", Marker(L::LeftHip)),
    ("right_hip", Marker(L::RightHip)),
    ("spine1", Nowhere),
    ("left_knee", Marker(L::LeftKnee)),
    ("right_knee", Marker(L::RightKnee)),
    ("spine2", Nowhere),
    ("left_ankle", Marker(L::LeftAnkle)),
    ("right_ankle", Marker(L::RightAnkle)),
    ("spine3", Nowhere),
    ("left_foot", Toes(L::LeftAnkle)),
    ("right_foot", Toes(L::RightAnkle)),
    ("neck", Marker(L::Thorax)),
    ("left_collar", Collar(L::LeftShoulder)),
    ("right_collar", Collar(L::RightShoulder)),
    ("head", SkullBase),
    ("left_shoulder", Marker(L::LeftShoulder)),
    ("right_shoulder", Marker(L::RightShoulder)),
    ("left_elbow", Marker(L::LeftElbow)),
    ("right_elbow", Marker(L::RightElbow)),
    ("left_wrist", Marker(L::LeftWrist)),
    ("right_wrist", Marker(L::RightWrist)),
    ("left_hand", Nowhere),
    ("right_hand", Nowhere),
];

impl Humanoid {
    /// The joints of a data set on this body by name, in its order: `smpl24`, `h36m17`, or a [`KeypointLayout`]. `None`
    /// for joints that this body does not have; nothing for an unknown name.
    #[doc(hidden)]
    pub fn joints_as(&self, layout: &str) -> Option<Vec<(&'static str, Option<LinkPoint>)>> {
        if let Some(layout) = KeypointLayout::named(layout) {
            let places = self.keypoint_places(layout).into_iter().map(|place| Some(place?.point));
            return Some(layout.keypoints().iter().map(|point| point.name()).zip(places).collect());
        }
        let named = match layout {
            "h36m17" => HUMAN36M,
            "smpl24" => SMPL,
            _ => return None,
        };
        Some(named.iter().map(|(name, place)| (*name, self.place_of(*place))).collect())
    }

    fn place_of(&self, place: Place) -> Option<LinkPoint> {
        let marker = |landmark: Landmark| self.markers[landmark as usize];
        let origin_of = |link: usize| LinkPoint { link, point_in_link: Point3::origin() };
        match place {
            Place::Marker(landmark) => marker(landmark),
            Place::Keypoint(point) => {
                let layout = KeypointLayout::Halpe26;
                let index = layout.keypoints().iter().position(|known| *known == point)?;
                Some(self.keypoint_places(layout)[index]?.point)
            }
            Place::SkullBase => {
                let link = marker(L::HeadTop)?.link;
                (link != marker(L::Thorax)?.link).then(|| origin_of(link))
            }
            Place::Collar(shoulder) => {
                let above = self.segment_above(marker(shoulder)?.link)?;
                // without collarbones an arm begins at the trunk
                (above != marker(L::Thorax)?.link).then(|| origin_of(above))
            }
            Place::Toes(ankle) => {
                let foot = marker(ankle)?.link;
                let beyond = (1..self.links.len()).find(|link| self.segment_above(*link) == Some(foot))?;
                Some(origin_of(beyond))
            }
            Place::Nowhere => None,
        }
    }

    /// The link on which the segment of a link begins: joints at the same place are passed over. `None` for the root.
    fn segment_above(&self, link: usize) -> Option<usize> {
        let joint = &self.joints[link.checked_sub(1)?];
        let is_apart = joint.parent_from_joint.translation.vector.norm() > 1e-6;
        if is_apart { Some(joint.parent) } else { self.segment_above(joint.parent) }
    }
}

#[cfg(test)]
mod tests {
    use crate::body::{Humanoid, LANDMARKS, shipped};

    fn standing(body: &Humanoid, layout: &str) -> Vec<(&'static str, Option<nalgebra::Point3<f64>>)> {
        let frames = body.link_frames(&body.standing_pose());
        let place = |point: crate::body::LinkPoint| frames[point.link] * point.point_in_link;
        body.joints_as(layout).unwrap().into_iter().map(|(name, point)| (name, point.map(place))).collect()
    }

    #[test]
    fn layouts_have_their_joints_where_anatomy_has_them() {
        let body = shipped("actor").unwrap();
        for (layout, absent) in [("smpl24", 5), ("h36m17", 1), ("coco17", 0), ("halpe26", 0), ("body25", 0)] {
            let found = standing(&body, layout);
            assert!(layout.ends_with(&found.len().to_string()));
            assert_eq!(found.iter().filter(|(_, place)| place.is_none()).count(), absent, "{layout}");
        }
        assert!(body.joints_as("smpl").is_none());
        let smpl = standing(&body, "smpl24");
        let at = |name: &str| smpl.iter().find(|(known, _)| *known == name).unwrap().1.unwrap();
        for side in ["left", "right"] {
            let [collar, shoulder, foot, ankle] =
                ["collar", "shoulder", "foot", "ankle"].map(|part| at(&format!("{side}_{part}")));
            assert!(collar.y.abs() < 0.5 * shoulder.y.abs() && collar.y * shoulder.y > 0.0, "{collar} {shoulder}");
            assert!(foot.x > ankle.x + 0.08 && foot.z < ankle.z, "{foot} {ankle}");
        }
        let top = standing(&body, "h36m17")[10].1.unwrap();
        assert!(at("head").z > at("neck").z + 0.05 && at("head").z < top.z - 0.1);
    }

    #[test]
    fn a_body_without_the_joint_does_not_have_the_place() {
        let mut body = shipped("tracker25").unwrap();
        assert!(body.joints_as("smpl24").unwrap()[13].1.is_none(), "it has no collarbones");
        body.markers = [None; LANDMARKS.len()];
        assert!(body.joints_as("smpl24").unwrap().iter().all(|(_, place)| place.is_none()));
    }
}
