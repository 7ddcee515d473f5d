//! Balance: which forces of the ground bring the body back to the motion, and what the joints have to do for them.

use nalgebra::Vector3;

use super::moving::Moving;
use super::simulated_body::GRAVITY;
use crate::body::{Humanoid, ROOT_STEP, rotation_vector};
use crate::contact::dynamics::{Ground, support_points};
use crate::contact::inverse_dynamics;

/// Angular frequency of the root's return to the motion, rad/s; it is critically damped.
const FREQUENCY: f64 = 6.0;

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
}

impl<'a> Balance<'a> {
    pub(super) fn new(body: &'a Humanoid, friction: f64) -> Self {
        Self { body, mass: body.total_mass(), friction }
    }

    /// Of a body that moves as `now` and should move as `wanted`, with these accelerations and these links on the ground.
    pub(super) fn at(
        &self,
        now: &Moving,
        wanted: &Moving,
        accelerations: Vec<f64>,
        touching: impl Iterator<Item = usize>,
    ) -> Balanced {
        let accelerations = returning(now, wanted, accelerations);
        let efforts = |ground: &[_]| inverse_dynamics(self.body, &now.frames, &now.rates, &accelerations, ground);
        let needed = efforts(&[]);
        let root = &now.pose.world_from_root;
        let moment = needed.root_moment + (root.translation.vector - now.centre.coords).cross(&needed.root_force);
        // the body is where it is: what is high above the ground carries nothing
        let points = support_points(self.body, &now.frames, touching.map(|link| (link, 0.0)));
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
        accelerations[i] += FREQUENCY * FREQUENCY * away + 2.0 * FREQUENCY * faster;
    }
    accelerations
}
