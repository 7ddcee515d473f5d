//! Balance: which forces of the ground bring the body back to the motion, and what the joints have to do for them.

use nalgebra::Vector3;

use super::moving::Moving;
use super::simulated_body::GRAVITY;
use crate::body::{Humanoid, ROOT_STEP, rotation_vector};
use crate::contact::dynamics::{Ground, support_points};
use crate::contact::inverse_dynamics;

/// Angular frequencies of the root's return to the motion, rad/s, both critically damped: of its place and of its orientation. A body that
/// leans is turned upright sooner than it is moved back, or its feet strike the ground where the motion does not have them.
const FREQUENCIES: [f64; 2] = [6.0, 12.0];

/// What follows the motion.
#[derive(Clone)]
pub(super) struct Balanced {
    /// Of every degree of freedom, N m or N.
    pub(super) efforts: Vec<f64>,
    /// Force at the root link's centre of mass, and moment, that the ground cannot give; world, N and N m.
    pub(super) missing: [Vector3<f64>; 2],
}

/// Brings the root back with the ground's forces: inverse dynamics of the body as it is, accelerated as the motion is and, at the
/// root, towards it; the wrench that this takes is shared among the friction cones where it touches the ground (as Macchietto, Zordan
/// and Shelton 2009 and de Lasa, Mordatch and Hertzmann 2010 do with the momentum).
#[derive(Clone)]
pub(super) struct Balance<'a> {
    body: &'a Humanoid,
    mass: f64,
    friction: f64,
    /// The links of both feet.
    feet: Vec<usize>,
}

impl<'a> Balance<'a> {
    pub(super) fn new(body: &'a Humanoid, friction: f64) -> Self {
        Self { body, mass: body.total_mass(), friction, feet: body.foot_links().concat() }
    }

    /// Of a body that moves as `now` and should move as `wanted`, with these accelerations and these links on the ground in the motion.
    /// What is high above the ground carries nothing; a foot that is down carries, whether the motion has it down yet or not.
    pub(super) fn at(&self, now: &Moving, wanted: &Moving, accelerations: Vec<f64>, touching: &[usize]) -> Balanced {
        let accelerations = returning(now, wanted, accelerations);
        let efforts = |ground: &[_]| inverse_dynamics(self.body, &now.frames, &now.rates, &accelerations, ground);
        let needed = efforts(&[]);
        let root = &now.pose.world_from_root;
        let moment = needed.root_moment + (root.translation.vector - now.centre.coords).cross(&needed.root_force);
        let feet = self.feet.iter().filter(|foot| !touching.contains(foot));
        let carries = touching.iter().chain(feet).map(|&link| (link, 0.0));
        let points = support_points(self.body, &now.frames, carries);
        let weight = self.mass * GRAVITY;
        let ground = Ground { points: &points, friction: self.friction, weight };
        let share = ground.share(&now.centre, &[needed.root_force, moment]);
        let [force, moment] = share.missing;
        let held =
            self.body.links[0].inertia.as_ref().map_or(root.translation.vector.into(), |i| root * i.centre_of_mass);
        Balanced {
            efforts: efforts(&share.forces).joints,
            missing: [force, moment + (now.centre - held).cross(&force)],
        }
    }
}

/// The motion's accelerations, and for the root those that bring it back besides.
fn returning(now: &Moving, wanted: &Moving, mut accelerations: Vec<f64>) -> Vec<f64> {
    let (root, to) = (&now.pose.world_from_root, &wanted.pose.world_from_root);
    let apart = to.translation.vector - root.translation.vector;
    let turned = rotation_vector(&(root.rotation.inverse() * to.rotation));
    let away = apart.iter().chain(turned.iter());
    for (i, away) in away.enumerate().take(ROOT_STEP) {
        let faster = wanted.rates[i] - now.rates[i];
        let frequency = FREQUENCIES[usize::from(i >= 3)];
        accelerations[i] += frequency * frequency * away + 2.0 * frequency * faster;
    }
    accelerations
}
