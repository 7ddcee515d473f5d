//! Marker positions of a body and their uncertainty.

use nalgebra::{DMatrix, Matrix3, Matrix3xX, Point3};

use super::{Humanoid, JointKind, LinkFrames, LinkPoint, MarkerCovariances, Markers};

/// Points nearer than this are equal, metres.
const SAME_PLACE_M: f64 = 1e-6;

impl Humanoid {
    /// Covariances of the marker positions with the links at `frames`, from the covariance of the pose's step
    /// ([`Humanoid::step`], rows and columns in its order), to first order.
    pub fn marker_covariances(&self, frames: &LinkFrames, covariance: &DMatrix<f64>) -> MarkerCovariances {
        let mut twists = Vec::new();
        self.markers.map(|marker| {
            let LinkPoint { link, point_in_link } = marker?;
            self.step_twists(frames, link, &(frames[link] * point_in_link), &mut twists);
            let mut moves = Matrix3xX::zeros(covariance.nrows());
            for (number, [v, _]) in &twists {
                let sum = moves.column(*number) + v;
                moves.set_column(*number, &sum);
            }
            let of_marker: Matrix3<f64> = &moves * covariance * moves.transpose();
            Some(0.5 * (of_marker + of_marker.transpose()))
        })
    }

    /// The marker positions with the links at `frames`.
    pub fn markers(&self, frames: &LinkFrames) -> Markers {
        self.markers.map(|marker| marker.map(|m| frames[m.link] * m.point_in_link))
    }

    /// The markers (indices into [`super::LANDMARKS`]) that coincide with a joint in every pose.
    pub fn markers_on_joint(&self, joint: usize) -> impl Iterator<Item = usize> {
        let origin = self.anchored(LinkPoint { link: joint + 1, point_in_link: Point3::origin() });
        self.anchored_markers()
            .filter(move |(_, marker)| {
                marker.link == origin.link && (marker.point_in_link - origin.point_in_link).norm() < SAME_PLACE_M
            })
            .map(|(landmark, _)| landmark)
    }

    /// The markers (indices into [`super::LANDMARKS`]) that move with the root link, with their positions in its
    /// frame, metres.
    pub fn markers_on_root(&self) -> impl Iterator<Item = (usize, Point3<f64>)> {
        self.anchored_markers()
            .filter(|(_, marker)| marker.link == 0)
            .map(|(landmark, marker)| (landmark, marker.point_in_link))
    }

    fn anchored_markers(&self) -> impl Iterator<Item = (usize, LinkPoint)> {
        let markers = self.markers.iter().enumerate();
        markers.filter_map(|(landmark, marker)| Some((landmark, self.anchored((*marker)?))))
    }

    /// The same point on the link nearest to the root that carries it in every pose.
    fn anchored(&self, mut point: LinkPoint) -> LinkPoint {
        while let Some(joint) = point.link.checked_sub(1).map(|joint| &self.joints[joint]) {
            let stays = match joint.kind {
                JointKind::Fixed => true,
                JointKind::Revolute { .. } | JointKind::Spherical { .. } => {
                    point.point_in_link.coords.norm() < SAME_PLACE_M
                }
                JointKind::Prismatic { .. } | JointKind::Floating { .. } => false,
            };
            if !stays {
                break;
            }
            point = LinkPoint { link: joint.parent, point_in_link: joint.parent_from_joint * point.point_in_link };
        }
        point
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::{LANDMARKS, shipped};
    use crate::test_bodies::{person, walk};

    #[test]
    fn markers_on_joints_coincide_with_the_joints_in_every_pose() {
        let body = person();
        for pose in walk(40).poses {
            let frames = body.link_frames(&pose);
            let markers = body.markers(&frames);
            for joint in 0..body.joints.len() {
                let place = Point3::from(frames[joint + 1].translation.vector);
                let on_it: Vec<usize> = body.markers_on_joint(joint).collect();
                assert!(on_it.iter().all(|landmark| (markers[*landmark].unwrap() - place).norm() < 1e-9), "{joint}");
            }
            for (landmark, point) in body.markers_on_root() {
                assert!((markers[landmark].unwrap() - frames[0] * point).norm() < 1e-9);
            }
        }
    }

    #[test]
    fn the_tracker_has_markers_on_limb_joints_and_the_actor_on_wrists_and_ankles_too() {
        let on_joints = |robot: &str| -> Vec<&str> {
            let body = shipped(robot).unwrap();
            let found = (0..body.joints.len()).flat_map(|joint| body.markers_on_joint(joint).collect::<Vec<_>>());
            found.map(|landmark| LANDMARKS[landmark].name()).collect()
        };
        let (tracker, actor) = (on_joints("tracker25"), on_joints("actor"));
        for part in ["shoulder", "elbow", "hip", "knee"] {
            let (left, right) = (format!("left_{part}"), format!("right_{part}"));
            assert!(tracker.contains(&left.as_str()) && tracker.contains(&right.as_str()), "{tracker:?}");
        }
        assert!(!["left_ankle", "head_top", "pelvis"].iter().any(|name| tracker.contains(name)), "{tracker:?}");
        assert!(actor.contains(&"left_ankle") && actor.contains(&"right_wrist"), "{actor:?}");
        assert!(!actor.contains(&"head_top"), "{actor:?}");
    }
}
