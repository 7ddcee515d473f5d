//! Anatomical joints: hinges in series at one point form one ball joint.

use nalgebra::{Matrix3, Unit, UnitQuaternion, Vector3};

use skiagraph_core::body::{Humanoid, JointKind, rotation_about, rotation_from_vector, rotation_vector};

#[derive(Clone, Debug, PartialEq)]
pub enum JointGroup {
    /// Three hinges in series about mutually perpendicular axes, or a spherical joint: any rotation.
    Ball(Ball),
    /// Hinges in series that cannot reach every rotation: axes and degrees of freedom.
    Hinges(Vec<(Unit<Vector3<f64>>, usize)>),
    /// A slider: its degree of freedom.
    Slide(usize),
}

/// Representation of a ball joint's rotation in degrees of freedom.
#[derive(Clone, Debug, PartialEq)]
pub enum Ball {
    /// Angles about three perpendicular axes, outermost first, with their limits.
    Series {
        /// Unit axes in the joint's frame.
        axes: [Unit<Vector3<f64>>; 3],
        degrees_of_freedom: [usize; 3],
        /// Lower and upper limit of each, radians.
        limits: [[f64; 2]; 3],
    },
    /// A rotation vector in three consecutive degrees of freedom, beginning with this one.
    RotationVector(usize),
}

impl JointGroup {
    /// The anatomical joints of `body`, parents first, without mimic joints, which follow others, and floating joints,
    /// which are not part of a human body.
    pub fn all_of(body: &Humanoid) -> Vec<Self> {
        let mut groups = Vec::new();
        let mut taken = vec![false; body.joints.len()];
        for (i, joint) in body.joints.iter().enumerate() {
            if taken[i] {
                continue;
            }
            match &joint.kind {
                JointKind::Spherical { first } => groups.push(Self::Ball(Ball::RotationVector(*first))),
                JointKind::Prismatic { drive, .. } => groups.push(Self::Slide(drive.degree_of_freedom)),
                JointKind::Revolute { .. } => {
                    let series = series_from(body, i);
                    series.iter().for_each(|(joint, ..)| taken[*joint] = true);
                    let hinges: Vec<_> = series.into_iter().map(|(_, axis, dof)| (axis, dof)).collect();
                    if !hinges.is_empty() {
                        groups.push(ball(body, &hinges).unwrap_or(Self::Hinges(hinges)));
                    }
                }
                JointKind::Fixed | JointKind::Floating { .. } => {}
            }
        }
        groups
    }

    /// Number of a chart's numbers that describe this joint.
    pub fn dimensions(&self) -> usize {
        match self {
            Self::Ball(_) => 3,
            Self::Hinges(hinges) => hinges.len(),
            Self::Slide(_) => 1,
        }
    }

    /// The rotation of the joint; the identity for a slider.
    pub fn rotation(&self, angles: &[f64]) -> UnitQuaternion<f64> {
        let product = |hinges: &mut dyn Iterator<Item = (Unit<Vector3<f64>>, usize)>| {
            hinges.fold(UnitQuaternion::identity(), |q, (axis, dof)| q * rotation_about(&axis, angles[dof]))
        };
        match self {
            Self::Ball(Ball::Series { axes, degrees_of_freedom, .. }) => {
                product(&mut axes.iter().copied().zip(degrees_of_freedom.iter().copied()))
            }
            Self::Ball(Ball::RotationVector(first)) => {
                rotation_from_vector(&Vector3::new(angles[*first], angles[first + 1], angles[first + 2]))
            }
            Self::Hinges(hinges) => product(&mut hinges.iter().copied()),
            Self::Slide(_) => UnitQuaternion::identity(),
        }
    }
}

impl Ball {
    /// Writes a rotation as angles; of the two solutions for three axes, the one within the limits is used.
    pub fn write(&self, rotation: &UnitQuaternion<f64>, angles: &mut [f64]) {
        match self {
            Self::RotationVector(first) => {
                angles[*first..first + 3].copy_from_slice(rotation_vector(rotation).as_slice());
            }
            Self::Series { axes, degrees_of_freedom, limits } => {
                let found = angles_about(axes, rotation, limits);
                for (dof, angle) in degrees_of_freedom.iter().zip(found) {
                    angles[*dof] = angle;
                }
            }
        }
    }
}

/// The hinges that rotate about the same point as joint `first`: `(joint, axis, degree of freedom)`.
fn series_from(body: &Humanoid, first: usize) -> Vec<(usize, Unit<Vector3<f64>>, usize)> {
    let mut series = Vec::new();
    let mut joint = first;
    while let JointKind::Revolute { axis, drive } = &body.joints[joint].kind {
        if drive.multiplier != 1.0 || drive.offset != 0.0 {
            break;
        }
        series.push((joint, *axis, drive.degree_of_freedom));
        let link = joint + 1;
        let bare = body.links[link].solids.is_empty() && body.links[link].inertia.is_none();
        let mut children = (0..body.joints.len()).filter(|j| body.joints[*j].parent == link);
        let (Some(only), None) = (children.next(), children.next()) else { break };
        let at_same_point = body.joints[only].parent_from_joint == nalgebra::Isometry3::identity();
        if series.len() == 3 || !bare || !at_same_point {
            break;
        }
        joint = only;
    }
    series
}

fn ball(body: &Humanoid, hinges: &[(Unit<Vector3<f64>>, usize)]) -> Option<JointGroup> {
    let [a, b, c] = hinges else { return None };
    let perpendicular = [(a, b), (b, c), (a, c)].iter().all(|(x, y)| x.0.dot(&y.0).abs() < 1e-9);
    let limit = |dof: usize| [body.degrees_of_freedom[dof].lower, body.degrees_of_freedom[dof].upper];
    perpendicular.then(|| {
        JointGroup::Ball(Ball::Series {
            axes: [a.0, b.0, c.0],
            degrees_of_freedom: [a.1, b.1, c.1],
            limits: [limit(a.1), limit(b.1), limit(c.1)],
        })
    })
}

/// Angles whose successive rotations about three perpendicular axes equal `rotation`.
fn angles_about(axes: &[Unit<Vector3<f64>>; 3], rotation: &UnitQuaternion<f64>, limits: &[[f64; 2]; 3]) -> [f64; 3] {
    let [x, y, third] = axes.map(Unit::into_inner);
    let z = x.cross(&y);
    // a left-handed triple rotates in the opposite sense about its third axis
    let sign = if z.dot(&third) < 0.0 { -1.0 } else { 1.0 };
    let basis = Matrix3::from_columns(&[x, y, z]);
    let m = basis.transpose() * rotation.to_rotation_matrix().into_inner() * basis;
    let middle = libm::asin(m[(0, 2)].clamp(-1.0, 1.0));
    if m[(0, 2)].abs() > 1.0 - 1e-12 {
        return [libm::atan2(m[(2, 1)], m[(1, 1)]), middle, 0.0];
    }
    let near = [libm::atan2(-m[(1, 2)], m[(2, 2)]), middle, sign * libm::atan2(-m[(0, 1)], m[(0, 0)])];
    let half_turn = |angle: f64| if angle > 0.0 { angle - std::f64::consts::PI } else { angle + std::f64::consts::PI };
    let far = [half_turn(near[0]), half_turn(-near[1]), half_turn(near[2])];
    let excess = |angles: &[f64; 3]| -> f64 {
        angles.iter().zip(limits).map(|(a, [low, high])| (low - a).max(0.0) + (a - high).max(0.0)).sum()
    };
    if excess(&far) < excess(&near) { far } else { near }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn the_tracked_body_has_nine_anatomical_joints_including_five_balls() {
        let groups = JointGroup::all_of(&Humanoid::tracker25().unwrap());
        assert_eq!(groups.len(), 9, "{groups:?}");
        assert_eq!(groups.iter().filter(|g| matches!(g, JointGroup::Ball(_))).count(), 5);
        assert_eq!(groups.iter().map(JointGroup::dimensions).sum::<usize>(), 19);
    }

    proptest! {
        #[test]
        fn angles_of_a_rotation_reproduce_the_rotation(
            a in -3.0..3.0_f64, b in -1.5..1.5_f64, c in -3.0..3.0_f64, mirrored: bool,
        ) {
            let third = if mirrored { -Vector3::x() } else { Vector3::x() };
            let axes = [Vector3::y_axis(), Vector3::z_axis(), Unit::new_normalize(third)];
            let make = |angles: [f64; 3]| {
                axes.iter().zip(angles).fold(UnitQuaternion::identity(), |q, (axis, angle)| q * rotation_about(axis, angle))
            };
            let rotation = make([a, b, c]);
            let found = angles_about(&axes, &rotation, &[[-10.0, 10.0]; 3]);
            prop_assert!(make(found).angle_to(&rotation) < 1e-7);
        }
    }
}
