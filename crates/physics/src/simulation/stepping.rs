//! Foot placement: swinging feet are steered below the simulated body instead of to their recorded positions.

use nalgebra::{DMatrix, Vector3, Vector6};

use super::moving::BodyState;
use skiagraph_core::body::{Humanoid, JointKind, LinkFrames, Pose, ROOT_STEP, rotation_vector};
use skiagraph_core::dynamics::GRAVITY;

/// Share of the distance to the capture point, at which a step would stop the body's excess speed.
const CAPTURE: f64 = 0.15;
/// Time constant of the legs' response, seconds.
const FOLLOW_S: f64 = 0.03;
/// Weight of one radian of a foot's orientation, metres.
const LEVER: f64 = 0.1;
/// Damping of the least squares, metres: keeps stretched legs stable.
const DAMPING: f64 = 0.03;
/// Greatest deviation of a joint, radians.
const MOST: f64 = 0.5;

#[derive(Clone)]
struct Leg {
    /// Links of the foot; the first carries the ankle.
    foot: Vec<usize>,
    /// Degrees of freedom between the root and the foot.
    joints: Vec<usize>,
}

/// Deviations of the legs' targets from the motion. A swinging foot is steered to its position relative to the centre
/// of mass in the motion, plus a share of the capture point's lead (`[Pratt 2006]`), and to the motion's height and
/// orientation in the world, independent of the body's lean. A standing leg returns to the motion.
#[derive(Clone)]
pub(super) struct Stepping<'a> {
    body: &'a Humanoid,
    legs: Vec<Leg>,
    /// One per degree of freedom, radians (metres).
    pub(super) deviations: Vec<f64>,
}

impl<'a> Stepping<'a> {
    pub(super) fn new(body: &'a Humanoid) -> Self {
        let legs = body.foot_links().into_iter().filter(|foot| !foot.is_empty());
        let legs = legs.map(|foot| Leg { joints: joints_above(body, foot[0]), foot }).collect();
        Self { body, legs, deviations: vec![0.0; body.degrees_of_freedom.len()] }
    }

    /// Advances by `seconds`, for a body in state `now` that should be in state `wanted` with these links on the
    /// ground.
    pub(super) fn update(&mut self, now: &BodyState, wanted: &BodyState, touching: &[usize], seconds: f64) {
        let joint_angles = wanted.pose.joint_angles.clone();
        let leaning = Pose { world_from_root: now.pose.world_from_root, joint_angles };
        let leaning_frames = self.body.link_frames(&leaning);
        let fall_s = libm::sqrt(wanted.centre.z.max(0.1) / GRAVITY);
        let mut shift = now.centre - wanted.centre + (now.velocity - wanted.velocity) * (CAPTURE * fall_s);
        shift.z = 0.0;
        let follow = 1.0 - libm::exp(-seconds / FOLLOW_S);
        for leg in &self.legs {
            let stands = leg.foot.iter().any(|link| touching.contains(link));
            let reached = if stands {
                vec![0.0; leg.joints.len()]
            } else {
                self.reach(leg, &leaning, &leaning_frames, &wanted.frames, &shift)
            };
            for (&dof, to) in leg.joints.iter().zip(reached) {
                self.deviations[dof] += follow * (to.clamp(-MOST, MOST) - self.deviations[dof]);
            }
        }
    }

    /// The change of a leg's joints that brings its foot to its `wanted` position plus a shift: one step of damped
    /// least squares (`[Wampler 1986]`).
    fn reach(
        &self,
        leg: &Leg,
        pose: &Pose,
        frames: &LinkFrames,
        wanted: &LinkFrames,
        shift: &Vector3<f64>,
    ) -> Vec<f64> {
        let foot = leg.foot[0];
        let (is, to) = (&frames[foot], &wanted[foot]);
        let along = to.translation.vector + shift - is.translation.vector;
        let turned = rotation_vector(&(to.rotation * is.rotation.inverse())) * LEVER;
        let apart = Vector6::from_iterator(along.iter().chain(turned.iter()).copied());
        let linear = self.body.point_jacobian(pose, frames, foot, &is.translation.vector.into());
        let angular = self.body.link_angular_jacobian(pose, frames, foot);
        let jacobian = DMatrix::from_fn(6, leg.joints.len(), |row, column| {
            let direction = ROOT_STEP + leg.joints[column];
            if row < 3 { linear[(row, direction)] } else { LEVER * angular[(row - 3, direction)] }
        });
        let normal = &jacobian * jacobian.transpose() + DMatrix::identity(6, 6) * (DAMPING * DAMPING);
        let Some(factor) = normal.cholesky() else { return vec![0.0; leg.joints.len()] };
        jacobian.tr_mul(&factor.solve(&apart)).iter().copied().collect()
    }
}

/// The degrees of freedom of the hinges and sliders above a link.
fn joints_above(body: &Humanoid, mut link: usize) -> Vec<usize> {
    let mut found = Vec::new();
    while let Some(parent) = body.parent(link) {
        if let JointKind::Revolute { drive, .. } | JointKind::Prismatic { drive, .. } = &body.joints[link - 1].kind {
            found.push(drive.degree_of_freedom);
        }
        link = parent;
    }
    found
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, UnitQuaternion};

    use super::*;
    use crate::test_bodies::standing;

    #[test]
    fn a_swinging_foot_of_a_leaning_body_is_brought_level_below_it() {
        let (body, motion) = standing(1);
        let still = vec![0.0; body.step_len()];
        let wanted = BodyState::new(&body, motion.poses[0].clone(), still.clone());
        let lean = Isometry3::from_parts(
            Vector3::new(0.02, 0.01, 0.0).into(),
            UnitQuaternion::from_euler_angles(0.03, 0.05, 0.0),
        );
        let mut pose = motion.poses[0].clone();
        pose.world_from_root *= lean;
        let now = BodyState::new(&body, pose, still);
        let mut stepping = Stepping::new(&body);
        let [left, right] = body.foot_links();
        (0..20).for_each(|_| stepping.update(&now, &wanted, &right, 0.05));
        let mut stepped = now.pose.clone();
        stepped.joint_angles.iter_mut().zip(&stepping.deviations).for_each(|(angle, deviation)| *angle += deviation);
        let shift = (now.centre - wanted.centre).component_mul(&Vector3::new(1.0, 1.0, 0.0));
        let off = |frames: &LinkFrames, foot: usize| {
            let to = &wanted.frames[foot];
            let apart = frames[foot].translation.vector - to.translation.vector - shift;
            [apart.norm(), (to.rotation.inverse() * frames[foot].rotation).angle()]
        };
        let (before, after) = (off(&now.frames, left[0]), off(&body.link_frames(&stepped), left[0]));
        assert!((0..2).all(|i| after[i] < 0.4 * before[i]), "{before:?} {after:?}");
        assert_eq!(off(&now.frames, right[0]), off(&body.link_frames(&stepped), right[0]), "a standing foot");
    }
}
