//! Poses as points of a vector space in which a latent model can be learned.
//!
//! For every anatomical joint the exponential map about its mean rotation, then the root's tilt and height, then its
//! velocity in its own heading frame. Position and heading of the root on the ground are left out: a latent model
//! learns *how* a body moves, wherever it is.

mod joint_group;

use faer::Mat;
use nalgebra::{Isometry3, Matrix4, Quaternion, SymmetricEigen, Unit, UnitQuaternion, Vector3};

pub use joint_group::{Ball, JointGroup};

use super::gpdm::PartsError;
use skiagraph_core::body::{Humanoid, Motion, Pose, rotation_about, rotation_from_vector, rotation_vector};

/// Number of an observation vector's numbers that describe the root: roll, pitch, height, forward and sideways
/// velocity, yaw rate.
pub const ROOT_DIMENSIONS: usize = 6;

/// Position and heading of a body on the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanarRoot {
    /// World x, metres.
    pub x: f64,
    /// World y, metres.
    pub y: f64,
    /// Heading about the world's z axis, radians.
    pub yaw: f64,
}

/// Change of the [`PlanarRoot`] from one frame to the next, in the heading frame of the former.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanarStep {
    /// Metres along the heading.
    pub forward: f64,
    /// Metres to the left of the heading.
    pub left: f64,
    /// Rotation about the vertical, radians.
    pub turn: f64,
}

/// A map between poses of one body and observation vectors.
#[derive(Clone, Debug, PartialEq)]
pub struct PoseChart {
    groups: Vec<JointGroup>,
    means: Vec<UnitQuaternion<f64>>,
    /// Divisors that give the root's six numbers the mean spread of the joints' numbers.
    root_units: [f64; ROOT_DIMENSIONS],
    angles: usize,
}

impl PoseChart {
    /// The chart of `body` with mean rotations and units of the training motions.
    pub fn learn(body: &Humanoid, motions: &[Motion]) -> Self {
        let groups = JointGroup::all_of(body);
        let poses = || motions.iter().flat_map(|motion| &motion.poses);
        let means = groups
            .iter()
            .map(|group| match group {
                JointGroup::Ball(_) => mean_rotation(poses().map(|p| group.rotation(p.joint_angles.as_slice()))),
                JointGroup::Hinges(_) | JointGroup::Slide(_) => UnitQuaternion::identity(),
            })
            .collect();
        let angles = body.degrees_of_freedom.len();
        let mut chart = Self { groups, means, root_units: [1.0; ROOT_DIMENSIONS], angles };
        chart.set_root_units(motions);
        chart
    }

    /// The chart of `body` with these mean rotations (`w x y z`, one per joint group) and units of the root's numbers,
    /// as returned by [`Self::mean_rotations`] and [`Self::root_units`].
    ///
    /// # Errors
    /// [`PartsError`] unless there is one unit quaternion for every joint and the units are above zero.
    pub fn from_parts(
        body: &Humanoid,
        means: &[[f64; 4]],
        root_units: [f64; ROOT_DIMENSIONS],
    ) -> Result<Self, PartsError> {
        let groups = JointGroup::all_of(body);
        if means.len() != groups.len() {
            let detail = format!("expected one for each of {} joints, found {}", groups.len(), means.len());
            return Err(PartsError::new("mean rotations", detail));
        }
        let means = means.iter().map(|m| unit_quaternion(*m)).collect::<Option<_>>();
        let means = means.ok_or_else(|| PartsError::new("mean rotations", "expected unit quaternions"))?;
        if !root_units.iter().all(|unit| *unit > 0.0 && unit.is_finite()) {
            return Err(PartsError::new("root units", "expected numbers above zero"));
        }
        Ok(Self { groups, means, root_units, angles: body.degrees_of_freedom.len() })
    }

    /// Mean rotation of every joint group, `w x y z`; the identity for those represented by their angles.
    pub fn mean_rotations(&self) -> Vec<[f64; 4]> {
        self.means.iter().map(|q| [q.w, q.i, q.j, q.k]).collect()
    }

    /// Divisors of the root's numbers.
    pub fn root_units(&self) -> [f64; ROOT_DIMENSIONS] {
        self.root_units
    }

    /// Size of one unit of the root's height, metres.
    pub fn height_unit(&self) -> f64 {
        self.root_units[2]
    }

    /// Length D of an observation vector.
    pub fn dimensions(&self) -> usize {
        self.joint_dimensions() + ROOT_DIMENSIONS
    }

    /// Number of degrees of freedom of the body.
    pub fn angles(&self) -> usize {
        self.angles
    }

    /// The anatomical joints, in the order of an observation vector.
    pub fn groups(&self) -> &[JointGroup] {
        &self.groups
    }

    /// The observation vectors of a motion, one row per frame (T x D). The velocities of a first frame are those of
    /// the second.
    pub fn observe(&self, motion: &Motion) -> Mat<f64> {
        let poses = &motion.poses;
        let rows: Vec<Vec<f64>> = (0..poses.len())
            .map(|t| {
                let last = t.max(1).min(poses.len().saturating_sub(1));
                let step =
                    PlanarRoot::from_pose(&poses[last.saturating_sub(1)]).step_to(&PlanarRoot::from_pose(&poses[last]));
                self.observe_pose(&poses[t], &step)
            })
            .collect();
        Mat::from_fn(rows.len(), self.dimensions(), |t, d| rows[t][d])
    }

    /// The observation vector of a pose reached by a planar step.
    pub fn observe_pose(&self, pose: &Pose, step: &PlanarStep) -> Vec<f64> {
        let angles = pose.joint_angles.as_slice();
        let mut observation = Vec::with_capacity(self.dimensions());
        for (group, mean) in self.groups.iter().zip(&self.means) {
            match group {
                JointGroup::Ball(_) => {
                    observation
                        .extend_from_slice(rotation_vector(&(mean.inverse() * group.rotation(angles))).as_slice());
                }
                JointGroup::Hinges(hinges) => observation.extend(hinges.iter().map(|(_, dof)| angles[*dof])),
                JointGroup::Slide(dof) => observation.push(angles[*dof]),
            }
        }
        let yaw = PlanarRoot::from_pose(pose).yaw;
        // the root's rotation without its heading
        let tilt = rotation_vector(&(rotation_about(&Vector3::z_axis(), -yaw) * pose.world_from_root.rotation));
        let height = pose.world_from_root.translation.z;
        let root = [tilt.x, tilt.y, height, step.forward, step.left, step.turn];
        observation.extend(root.iter().zip(&self.root_units).map(|(value, unit)| value / unit));
        observation
    }

    pub fn planar_step(&self, observation: &[f64]) -> PlanarStep {
        let at = |i: usize| observation[self.joint_dimensions() + i] * self.root_units[i];
        PlanarStep { forward: at(3), left: at(4), turn: at(5) }
    }

    pub fn place(&self, observation: &[f64], root: &PlanarRoot) -> Pose {
        let mut joint_angles = nalgebra::DVector::zeros(self.angles);
        let mut values = observation;
        for (group, mean) in self.groups.iter().zip(&self.means) {
            let (own, rest) = values.split_at(group.dimensions());
            values = rest;
            match group {
                JointGroup::Ball(ball) => {
                    let rotation = mean * rotation_from_vector(&Vector3::new(own[0], own[1], own[2]));
                    ball.write(&rotation, joint_angles.as_mut_slice());
                }
                JointGroup::Hinges(hinges) => hinges.iter().zip(own).for_each(|((_, dof), a)| joint_angles[*dof] = *a),
                JointGroup::Slide(dof) => joint_angles[*dof] = own[0],
            }
        }
        let at = |i: usize| values[i] * self.root_units[i];
        let tilt = rotation_from_vector(&Vector3::new(at(0), at(1), 0.0));
        let heading = rotation_about(&Vector3::z_axis(), root.yaw);
        let position = Vector3::new(root.x, root.y, at(2));
        Pose { world_from_root: Isometry3::from_parts(position.into(), heading * tilt), joint_angles }
    }

    /// Rotations of all anatomical joints, for [`distance`].
    pub fn rotations(&self, pose: &Pose) -> Vec<UnitQuaternion<f64>> {
        self.groups.iter().map(|group| group.rotation(pose.joint_angles.as_slice())).collect()
    }

    /// As [`Self::rotations`], for an observation vector.
    pub fn rotations_of(&self, observation: &[f64]) -> Vec<UnitQuaternion<f64>> {
        self.rotations(&self.place(observation, &PlanarRoot { x: 0.0, y: 0.0, yaw: 0.0 }))
    }

    fn joint_dimensions(&self) -> usize {
        self.groups.iter().map(JointGroup::dimensions).sum()
    }

    fn set_root_units(&mut self, motions: &[Motion]) {
        let rows: Vec<Mat<f64>> = motions.iter().map(|motion| self.observe(motion)).collect();
        let deviation = |d: usize| {
            let values = || rows.iter().flat_map(|m| m.col(d).iter().copied());
            let count = values().count().max(1) as f64;
            let mean = values().sum::<f64>() / count;
            (values().map(|x| (x - mean) * (x - mean)).sum::<f64>() / count).sqrt()
        };
        let joints = self.joint_dimensions();
        let spread = (0..joints).map(deviation).sum::<f64>() / joints.max(1) as f64;
        for (i, unit) in self.root_units.iter_mut().enumerate() {
            let own = deviation(joints + i);
            *unit = if own > 1e-6 && spread > 1e-6 { own / spread } else { 1.0 };
        }
    }
}

impl PlanarRoot {
    pub fn from_pose(pose: &Pose) -> Self {
        let translation = &pose.world_from_root.translation;
        let q = pose.world_from_root.rotation;
        Self { x: translation.x, y: translation.y, yaw: 2.0 * libm::atan2(q.k, q.w) }
    }

    pub fn step_to(&self, next: &Self) -> PlanarStep {
        let (sin, cos) = libm::sincos(self.yaw);
        let (dx, dy) = (next.x - self.x, next.y - self.y);
        PlanarStep { forward: cos * dx + sin * dy, left: cos * dy - sin * dx, turn: wrapped(next.yaw - self.yaw) }
    }

    pub fn after(&self, step: &PlanarStep) -> Self {
        let (sin, cos) = libm::sincos(self.yaw);
        Self {
            x: self.x + cos * step.forward - sin * step.left,
            y: self.y + sin * step.forward + cos * step.left,
            yaw: wrapped(self.yaw + step.turn),
        }
    }
}

/// Squared geodesic angles between the rotations of corresponding joints, summed over all joints with weight 1
/// (`[GPDM graph]` Eq. 8, rad^2). The angle is the full one, twice the norm of the quaternion's logarithm.
pub fn distance(a: &[UnitQuaternion<f64>], b: &[UnitQuaternion<f64>]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(a, b)| {
            let (sin, cos) = ((b.inverse() * a).imag().norm(), a.coords.dot(&b.coords).abs());
            let angle = 2.0 * libm::atan2(sin, cos);
            angle * angle
        })
        .sum()
}

/// The rotation of a quaternion `w x y z`, bit by bit; `None` unless it has unit length.
pub fn unit_quaternion([w, x, y, z]: [f64; 4]) -> Option<UnitQuaternion<f64>> {
    let q = Quaternion::new(w, x, y, z);
    ((q.norm() - 1.0).abs() < 1e-9).then(|| UnitQuaternion::new_unchecked(q))
}

/// Wraps an angle to `(-pi, pi]`.
fn wrapped(angle: f64) -> f64 {
    let turn = std::f64::consts::TAU;
    angle - turn * libm::round(angle / turn)
}

/// The rotation nearest to all in the least-squares sense: the leading eigenvector of sum q q^T (`[Markley 2007]`).
fn mean_rotation(rotations: impl Iterator<Item = UnitQuaternion<f64>>) -> UnitQuaternion<f64> {
    let sum = rotations.fold(Matrix4::zeros(), |sum, q| sum + q.coords * q.coords.transpose());
    let eigen = SymmetricEigen::new(sum);
    let leading = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned();
    let q = Unit::new_normalize(Quaternion::from_vector(leading));
    if q.w < 0.0 { UnitQuaternion::new_unchecked(-q.into_inner()) } else { q }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    pub(in crate::motion_model) fn swinging(body: &Humanoid, frames: usize) -> Motion {
        let pose = |t: usize| {
            let mut pose = body.zero_pose();
            for (i, angle) in pose.joint_angles.iter_mut().enumerate() {
                let dof = &body.degrees_of_freedom[i];
                *angle = (0.3 * (t as f64 * 0.2 + i as f64).sin()).clamp(dof.lower, dof.upper);
            }
            pose
        };
        Motion { frames_per_second: 60.0, poses: (0..frames).map(pose).collect() }
    }

    fn walk(body: &Humanoid) -> Motion {
        let mut motion = swinging(body, 40);
        for (t, pose) in motion.poses.iter_mut().enumerate() {
            let phase = t as f64 * 0.2;
            let heading = rotation_about(&Vector3::z_axis(), 3.0 + 0.02 * t as f64);
            let tilt = rotation_from_vector(&Vector3::new(0.05 * phase.sin(), 0.1, 0.0));
            let position = Vector3::new(0.02 * t as f64, -0.01 * t as f64, 0.95 + 0.02 * phase.cos());
            pose.world_from_root = Isometry3::from_parts(position.into(), heading * tilt);
        }
        motion
    }

    #[test]
    fn a_motion_is_reconstructed_from_its_observation_vectors_and_first_root() {
        let body = Humanoid::tracker25().unwrap();
        let motion = walk(&body);
        let chart = PoseChart::learn(&body, std::slice::from_ref(&motion));
        let observations = chart.observe(&motion);
        assert_eq!(observations.ncols(), 25);
        let mut root = PlanarRoot::from_pose(&motion.poses[0]);
        for (t, pose) in motion.poses.iter().enumerate() {
            let row: Vec<f64> = observations.row(t).iter().copied().collect();
            if t > 0 {
                root = root.after(&chart.planar_step(&row));
            }
            let rebuilt = chart.place(&row, &root);
            assert!((rebuilt.joint_angles - &pose.joint_angles).amax() < 1e-9);
            let (a, b) = (rebuilt.world_from_root, pose.world_from_root);
            assert!((a.translation.vector - b.translation.vector).norm() < 1e-9);
            assert!(a.rotation.angle_to(&b.rotation) < 1e-7);
        }
    }

    #[test]
    fn a_chart_is_determined_by_its_numbers() {
        let body = Humanoid::tracker25().unwrap();
        let chart = PoseChart::learn(&body, &[walk(&body)]);
        let (means, units) = (chart.mean_rotations(), chart.root_units());
        assert_eq!(PoseChart::from_parts(&body, &means, units).unwrap(), chart);
        assert!(PoseChart::from_parts(&body, &means[1..], units).is_err());
        assert!(PoseChart::from_parts(&body, &vec![[0.9, 0.0, 0.0, 0.0]; means.len()], units).is_err());
        assert!(PoseChart::from_parts(&body, &means, [0.0; ROOT_DIMENSIONS]).is_err());
    }

    #[test]
    fn distance_is_the_squared_angle_for_either_sign_of_the_quaternion() {
        let turn = |angle: f64| rotation_about(&Vector3::y_axis(), angle);
        let negated = UnitQuaternion::new_unchecked(-turn(0.7).into_inner());
        assert!((distance(&[turn(0.2)], &[turn(0.7)]) - 0.25).abs() < 1e-12);
        assert!((distance(&[turn(0.2)], &[negated]) - 0.25).abs() < 1e-12);
        assert_eq!(distance(&[turn(0.2)], &[turn(0.2)]), 0.0);
    }

    #[test]
    fn the_mean_of_rotations_about_half_a_turn_is_half_a_turn() {
        let turns = [179.0_f64, -179.0].map(|deg| rotation_about(&Vector3::z_axis(), deg.to_radians()));
        let mean = mean_rotation(turns.into_iter());
        assert!((mean.angle() - std::f64::consts::PI).abs() < 1e-9);
    }
}
