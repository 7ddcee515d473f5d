//! A body's own axes (X forward, Y left, Z up) in the frames of its links.
//!
//! Robots define the axes of their links arbitrarily, for example with Y up or X to the right. The positions of hips
//! and thorax at the zero pose determine the body's own axes.

use nalgebra::{DVector, Matrix3, Rotation3, UnitQuaternion, Vector3};

use super::{Humanoid, Landmark, Markers, Pose};

/// Cosine of the greatest angle between the body's axes and those of its root that is treated as a leaning trunk
/// rather than different axes: 35 degrees.
const LEANING: f64 = 0.82;

impl Humanoid {
    /// The body's axes (X forward, Y left, Z up) in the root's frame, from hips and thorax at the zero pose; snapped
    /// to right angles if they are close. The identity for a body without those markers.
    pub fn root_from_body(&self) -> UnitQuaternion<f64> {
        let markers = self.markers(&self.link_frames(&self.zero_pose()));
        axes(&markers).map_or_else(UnitQuaternion::identity, |[x, y]| from_axes(x, y))
    }

    /// Heading of the body in a pose: as [`Pose::heading`], with the body's own axes in place of its root's.
    pub fn heading(&self, pose: &Pose) -> Option<f64> {
        let root_from_body = self.root_from_body();
        if root_from_body == UnitQuaternion::identity() {
            return pose.heading();
        }
        let world_from_body = pose.world_from_root * root_from_body;
        Pose { world_from_root: world_from_body, joint_angles: DVector::zeros(0) }.heading()
    }

    /// The zero pose with its root rotated so that the body is upright and faces along X, for any axes of its links.
    pub fn standing_pose(&self) -> Pose {
        let mut pose = self.zero_pose();
        pose.world_from_root.rotation = self.root_from_body().inverse();
        pose
    }

    /// Rotation of every link at the zero pose relative to the body's axes (X forward, Y left, Z up).
    pub fn body_from_links(&self) -> Vec<UnitQuaternion<f64>> {
        let body_from_root = self.root_from_body().inverse();
        self.link_frames(&self.zero_pose()).0.iter().map(|frame| body_from_root * frame.rotation).collect()
    }
}

/// Forward and left.
fn axes(markers: &Markers) -> Option<[Vector3<f64>; 2]> {
    let place = |landmark: Landmark| markers[landmark as usize];
    let (left, right) = (place(Landmark::LeftHip)?, place(Landmark::RightHip)?);
    let y = (left - right).try_normalize(1e-6)?;
    let trunk = place(Landmark::Thorax)? - nalgebra::center(&left, &right);
    let up = trunk.try_normalize(1e-6)?;
    let (y_axis, z_axis) = (nearest_axis(&y), nearest_axis(&up));
    if y.dot(&y_axis) > LEANING && up.dot(&z_axis) > LEANING {
        return Some([y_axis.cross(&z_axis), y_axis]);
    }
    Some([y.cross(&up).try_normalize(1e-6)?, y])
}

/// The coordinate axis, with its sign, nearest to a direction.
pub(super) fn nearest_axis(direction: &Vector3<f64>) -> Vector3<f64> {
    let most = direction.iamax();
    Vector3::ith(most, if direction[most] < 0.0 { -1.0 } else { 1.0 })
}

/// The rotation with these perpendicular unit vectors as X and Y axes.
pub fn from_axes(x: Vector3<f64>, y: Vector3<f64>) -> UnitQuaternion<f64> {
    let axes = Matrix3::from_columns(&[x, y, x.cross(&y)]);
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::shipped;
    use nalgebra::Isometry3;

    #[test]
    fn built_in_bodies_have_the_axes_of_the_world() {
        for name in ["actor", "tracker25"] {
            let body = shipped(name).unwrap();
            assert_eq!(body.root_from_body(), UnitQuaternion::identity());
            assert!(body.body_from_links().iter().all(|rotation| *rotation == UnitQuaternion::identity()), "{name}");
        }
    }

    /// A body with a rotated root frame.
    #[test]
    fn the_axes_of_a_body_with_another_root_frame_are_found() {
        let body = shipped("actor").unwrap();
        for turn in [
            UnitQuaternion::from_axis_angle(&Vector3::x_axis(), -std::f64::consts::FRAC_PI_2),
            UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::FRAC_PI_2),
            UnitQuaternion::from_scaled_axis(Vector3::new(0.4, -0.7, 0.9)),
        ] {
            let root_from_old = Isometry3::from_parts(Default::default(), turn);
            let mut turned = body.clone();
            for joint in turned.joints.iter_mut().filter(|j| j.parent == 0) {
                joint.parent_from_joint = root_from_old * joint.parent_from_joint;
            }
            for marker in turned.markers.iter_mut().flatten().filter(|m| m.link == 0) {
                marker.point_in_link = root_from_old * marker.point_in_link;
            }
            let angle = turned.root_from_body().angle_to(&turn);
            assert!(angle < 0.02, "{angle} rad off");
            let mut pose = turned.standing_pose();
            pose.world_from_root = Isometry3::rotation(Vector3::z() * 0.7) * pose.world_from_root;
            assert!((turned.heading(&pose).unwrap() - 0.7).abs() < 1e-9, "independent of the root's axes");
        }
    }
}
