//! The geometric Jacobian: velocities of points and links for a change of pose.
//!
//! A pose has `6 + degrees_of_freedom.len()` directions, in this order: the root's translation along the world's x, y,
//! z (metres), the root's rotation about its own x, y, z (radians), then every degree of freedom. A hinge with axis
//! `a` through `o` moves a point `p` by `a x (p - o)` and rotates everything beyond it by `a` (Craig, Introduction to
//! Robotics, ch. 5).

use nalgebra::{Matrix3, Matrix3xX, Point3, Vector3};

use super::{Humanoid, JointKind, LinkFrames, Pose};

/// One direction of a pose that moves a link, with its screw in the world.
enum Screw {
    /// Translation along a vector.
    Slide(Vector3<f64>),
    /// Rotation about an axis through a point.
    Turn(Vector3<f64>, Point3<f64>),
}

impl Screw {
    fn moves(&self, point: &Point3<f64>) -> Vector3<f64> {
        match self {
            Self::Slide(along) => *along,
            Self::Turn(axis, through) => axis.cross(&(point - through)),
        }
    }

    fn turns(&self) -> Vector3<f64> {
        match self {
            Self::Slide(_) => Vector3::zeros(),
            Self::Turn(axis, _) => *axis,
        }
    }
}

impl Humanoid {
    /// Derivative of the world position of a point fixed to `link`, 3 rows, one column per direction of the pose
    /// (module documentation), metres per metre or radian. `frames` must be `pose`'s.
    pub fn point_jacobian(
        &self,
        pose: &Pose,
        frames: &LinkFrames,
        link: usize,
        point_in_world: &Point3<f64>,
    ) -> Matrix3xX<f64> {
        let mut columns = Vec::new();
        self.point_columns(pose, frames, link, point_in_world, &mut columns);
        self.dense(&columns)
    }

    /// Angular velocity of `link` in the world per unit speed of each direction of the pose (module documentation), 3
    /// rows. `frames` must be `pose`'s.
    pub fn link_angular_jacobian(&self, pose: &Pose, frames: &LinkFrames, link: usize) -> Matrix3xX<f64> {
        let mut columns = Vec::new();
        self.angular_columns(pose, frames, link, &mut columns);
        self.dense(&columns)
    }

    /// The columns of [`Self::point_jacobian`] that can be nonzero, with their indices; mimicking joints repeat an
    /// index, and the repeated columns add up.
    pub(super) fn point_columns(
        &self,
        pose: &Pose,
        frames: &LinkFrames,
        link: usize,
        point_in_world: &Point3<f64>,
        columns: &mut Vec<(usize, Vector3<f64>)>,
    ) {
        columns.clear();
        self.for_each_screw(pose, frames, link, |direction, screw| {
            columns.push((direction, screw.moves(point_in_world)));
        });
    }

    /// The columns of [`Self::link_angular_jacobian`] that can be nonzero, with their indices, as in `point_columns`.
    pub(super) fn angular_columns(
        &self,
        pose: &Pose,
        frames: &LinkFrames,
        link: usize,
        columns: &mut Vec<(usize, Vector3<f64>)>,
    ) {
        columns.clear();
        self.for_each_screw(pose, frames, link, |direction, screw| columns.push((direction, screw.turns())));
    }

    /// The effect of a step of the pose ([`Humanoid::step`]) on `link`: for every number of the step that moves it,
    /// its index and the twist `[v, w]` that moves a point `p` of the link by `v + w x (p - about)` per unit. Root
    /// first, then from the link up its chain; mimicking joints repeat an index, and the repeated twists add up.
    /// `frames` must be the pose's.
    ///
    /// Unlike the columns of [`Self::point_jacobian`], those of a rotation vector (spherical and floating joints) are
    /// about the joint's own axes, because steps compose there.
    pub fn step_twists(
        &self,
        frames: &LinkFrames,
        link: usize,
        about: &Point3<f64>,
        twists: &mut Vec<(usize, [Vector3<f64>; 2])>,
    ) {
        twists.clear();
        let turn_vectors = |_: usize| Matrix3::identity();
        self.for_each_screw_with(frames, link, turn_vectors, |direction, screw| {
            twists.push((direction, [screw.moves(about), screw.turns()]));
        });
    }

    fn dense(&self, columns: &[(usize, Vector3<f64>)]) -> Matrix3xX<f64> {
        let mut matrix = Matrix3xX::zeros(6 + self.degrees_of_freedom.len());
        for (direction, column) in columns {
            let sum = matrix.column(*direction) + column;
            matrix.set_column(*direction, &sum);
        }
        matrix
    }

    /// Every direction of the pose that moves `link`, root first, then from the link up its chain.
    fn for_each_screw(&self, pose: &Pose, frames: &LinkFrames, link: usize, visit: impl FnMut(usize, Screw)) {
        let of_vector = |first: usize| right_jacobian(&pose.joint_angles.fixed_rows::<3>(first).into_owned());
        self.for_each_screw_with(frames, link, of_vector, visit);
    }

    /// As [`Self::for_each_screw`]; `turn` maps the index of a rotation vector's first number to the axes, in the
    /// child's frame, about which its three numbers rotate, as columns.
    fn for_each_screw_with(
        &self,
        frames: &LinkFrames,
        link: usize,
        turn: impl Fn(usize) -> Matrix3<f64>,
        mut visit: impl FnMut(usize, Screw),
    ) {
        let root = frames[0];
        let root_axes = root.rotation.to_rotation_matrix();
        for k in 0..3 {
            visit(k, Screw::Slide(Vector3::ith(k, 1.0)));
            visit(3 + k, Screw::Turn(root_axes.matrix().column(k).into_owned(), root.translation.vector.into()));
        }
        let mut child = link;
        while let Some(parent) = self.parent(child) {
            let joint = &self.joints[child - 1];
            let frame = frames[child];
            let origin = Point3::from(frame.translation.vector);
            let mut turn_by_vector = |first: usize| {
                let axes = frame.rotation.to_rotation_matrix() * turn(first);
                for k in 0..3 {
                    visit(6 + first + k, Screw::Turn(axes.column(k).into_owned(), origin));
                }
            };
            match &joint.kind {
                JointKind::Fixed => {}
                JointKind::Revolute { axis, drive } => {
                    let axis = frame.rotation * (axis.into_inner() * drive.multiplier);
                    visit(6 + drive.degree_of_freedom, Screw::Turn(axis, origin));
                }
                JointKind::Prismatic { axis, drive } => {
                    let along = frame.rotation * (axis.into_inner() * drive.multiplier);
                    visit(6 + drive.degree_of_freedom, Screw::Slide(along));
                }
                JointKind::Spherical { first } => turn_by_vector(*first),
                JointKind::Floating { first } => {
                    turn_by_vector(first + 3);
                    let joint_axes = frames[parent].rotation * joint.parent_from_joint.rotation;
                    for k in 0..3 {
                        visit(6 + first + k, Screw::Slide(joint_axes * Vector3::ith(k, 1.0)));
                    }
                }
            }
            child = parent;
        }
    }
}

/// The right Jacobian of a rotation vector `v`: `R(v + d) = R(v) R(J d)` to first order (`[Sola 2018]`, Eq. 143).
fn right_jacobian(v: &Vector3<f64>) -> Matrix3<f64> {
    let square = v.norm_squared();
    let angle = libm::sqrt(square);
    let (a, b) = if angle < 1e-4 {
        (0.5 - square / 24.0, 1.0 / 6.0 - square / 120.0)
    } else {
        ((1.0 - libm::cos(angle)) / square, (angle - libm::sin(angle)) / (square * angle))
    };
    let cross = v.cross_matrix();
    Matrix3::identity() - cross * a + cross * cross * b
}

#[cfg(test)]
mod tests {
    use super::super::kinematics::rotation_from_vector;
    use super::super::{DegreeOfFreedom, Drive, Joint, Link};
    use super::*;
    use nalgebra::{DVector, Isometry3, Unit, UnitQuaternion};

    /// A chain with every kind of joint; the second hinge mimics the first.
    fn chain() -> Humanoid {
        let axis = |x, y, z| Unit::new_normalize(Vector3::new(x, y, z));
        let mimic = Drive { degree_of_freedom: 0, multiplier: -0.7, offset: 0.2 };
        let kinds = [
            JointKind::Revolute { axis: axis(0.2, 1.0, 0.1), drive: Drive::direct(0) },
            JointKind::Fixed,
            JointKind::Revolute { axis: axis(1.0, -0.3, 0.0), drive: mimic },
            JointKind::Prismatic { axis: axis(0.0, 1.0, 1.0), drive: Drive::direct(1) },
            JointKind::Spherical { first: 2 },
            JointKind::Floating { first: 5 },
        ];
        let offset = Isometry3::new(Vector3::new(0.1, -0.05, 0.3), Vector3::new(0.3, -0.2, 0.5));
        let joints = kinds.into_iter().enumerate().map(|(parent, kind)| Joint {
            name: format!("joint{parent}"),
            parent,
            parent_from_joint: offset,
            kind,
        });
        let degree = |i: usize| DegreeOfFreedom {
            name: format!("angle{i}"),
            lower: -9.0,
            upper: 9.0,
            max_velocity: 9.0,
            max_effort: 9.0,
        };
        Humanoid {
            name: "chain".into(),
            links: (0..7).map(|i| Link { name: format!("link{i}"), solids: vec![], inertia: None }).collect(),
            joints: joints.collect(),
            degrees_of_freedom: (0..11).map(degree).collect(),
            markers: Default::default(),
            skin: None,
            notes: vec![],
        }
    }

    fn bent(scale: f64) -> Pose {
        Pose {
            world_from_root: Isometry3::new(Vector3::new(1.0, 2.0, 0.5), Vector3::new(0.4, -1.0, 2.0)),
            joint_angles: DVector::from_fn(11, |i, _| scale * (0.9 - 0.17 * i as f64)),
        }
    }

    fn nudged(pose: &Pose, direction: usize, by: f64) -> Pose {
        let mut pose = pose.clone();
        match direction {
            0..3 => pose.world_from_root.translation.vector[direction] += by,
            3..6 => pose.world_from_root.rotation *= rotation_from_vector(&Vector3::ith(direction - 3, by)),
            _ => pose.joint_angles[direction - 6] += by,
        }
        pose
    }

    #[test]
    fn the_jacobians_agree_with_finite_differences_through_every_kind_of_joint() {
        let robot = chain();
        let h = 1e-5;
        for (scale, link) in [(1.0, 6), (1.0, 4), (0.0, 6), (1e-5, 6), (2.5, 6)] {
            let pose = bent(scale);
            let frames = robot.link_frames(&pose);
            let point_in_link = Point3::new(0.2, 0.1, -0.3);
            let moves = robot.point_jacobian(&pose, &frames, link, &(frames[link] * point_in_link));
            let turns = robot.link_angular_jacobian(&pose, &frames, link);
            for direction in 0..17 {
                let [ahead, behind] = [h, -h].map(|by| robot.link_frames(&nudged(&pose, direction, by))[link]);
                let moved = (ahead * point_in_link - behind * point_in_link) / (2.0 * h);
                let turned: UnitQuaternion<f64> = ahead.rotation * behind.rotation.inverse();
                let turned = turned.scaled_axis() / (2.0 * h);
                assert!((moves.column(direction) - moved).norm() < 1e-8, "{scale} {link} {direction}: point");
                assert!((turns.column(direction) - turned).norm() < 1e-8, "{scale} {link} {direction}: rotation");
            }
        }
    }

    #[test]
    fn the_twists_of_a_step_agree_with_finite_differences_through_every_kind_of_joint() {
        let robot = chain();
        let (h, about, mut twists) = (1e-5, Point3::new(0.3, -0.2, 0.9), Vec::new());
        for (scale, link) in [(1.0, 6), (0.0, 6), (2.5, 4)] {
            let pose = bent(scale);
            let frames = robot.link_frames(&pose);
            robot.step_twists(&frames, link, &about, &mut twists);
            let point_in_link = Point3::new(0.2, 0.1, -0.3);
            let point = frames[link] * point_in_link;
            for direction in 0..robot.step_len() {
                let [ahead, behind] = [h, -h].map(|by| {
                    let mut step = vec![0.0; robot.step_len()];
                    step[direction] = by;
                    robot.link_frames(&robot.step(&pose, &step))[link] * point_in_link
                });
                let moved = (ahead - behind) / (2.0 * h);
                let own = twists.iter().filter(|(index, _)| *index == direction);
                let predicted: Vector3<f64> = own.map(|(_, [v, w])| v + w.cross(&(point - about))).sum();
                assert!((predicted - moved).norm() < 1e-8, "{scale} {link} {direction}: {predicted} {moved}");
            }
        }
    }
}
