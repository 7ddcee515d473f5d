//! Balance: which forces of the ground bring the body back to the motion, and what the joints have to do for them.

use super::moving::Moving;
use super::wrench::Wrench;
use crate::body::{Humanoid, ROOT_STEP, rotation_vector};
use crate::physics::constants::GRAVITY;
use crate::physics::dynamics::{Ground, support_points};
use crate::physics::inverse_dynamics;

/// Angular frequencies of the root's return to the motion, rad/s, both critically damped: of its place and of its orientation. A body that
/// leans is turned upright sooner than it is moved back, or its feet strike the ground where the motion does not have them.
const FREQUENCIES: [f64; 2] = [6.0, 12.0];

/// How far the root may be from the motion before the help at the root alone brings it back besides, metres and radians: farther than
/// that, the ground has not given what was asked of it, as joints are too weak or nothing is where the motion sits on.
const MARGINS: [f64; 2] = [0.03, 0.1];
/// Angular frequency of that return, rad/s, critically damped: the body's whole weight moves it by 44 mm more.
const CATCHING: f64 = 15.0;

/// What follows the motion.
#[derive(Clone)]
pub(super) struct Balanced {
    /// Of every degree of freedom, N m or N.
    pub(super) efforts: Vec<f64>,
    /// What the ground cannot give.
    pub(super) missing: Wrench,
    /// What brings a root back that is beyond its margins.
    pub(super) catching: Wrench,
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
        let efforts = |accelerations: &[f64], ground: &[_]| {
            inverse_dynamics(self.body, &now.frames, &now.rates, accelerations, ground)
        };
        let needed = efforts(&accelerations, &[]);
        let root = &now.pose.world_from_root;
        let lever = root.translation.vector - now.centre.coords;
        let moment = needed.root_moment + lever.cross(&needed.root_force);
        let feet = self.feet.iter().filter(|foot| !touching.contains(foot));
        let carries = touching.iter().chain(feet).map(|&link| (link, 0.0));
        let points = support_points(self.body, &now.frames, carries);
        let ground = Ground { points: &points, friction: self.friction, weight: self.mass * GRAVITY };
        let share = ground.share(&now.centre, &[needed.root_force, moment]);
        let held =
            self.body.links[0].inertia.as_ref().map_or(root.translation.vector.into(), |i| root * i.centre_of_mass);
        let [force, moment] = share.missing;
        let caught: Vec<f64> = accelerations.iter().zip(catching(now, wanted)).map(|(a, more)| a + more).collect();
        let caught = efforts(&caught, &[]);
        let more = caught.root_force - needed.root_force;
        let turning = caught.root_moment - needed.root_moment;
        Balanced {
            efforts: efforts(&accelerations, &share.forces).joints,
            missing: Wrench { force, moment: moment + (now.centre - held).cross(&force) },
            catching: Wrench { force: more, moment: turning + (root.translation.vector - held.coords).cross(&more) },
        }
    }
}

/// The motion's accelerations, and for the root those that bring it back besides.
fn returning(now: &Moving, wanted: &Moving, mut accelerations: Vec<f64>) -> Vec<f64> {
    for (i, [away, faster]) in deviation(now, wanted).into_iter().enumerate() {
        let frequency = FREQUENCIES[i / 3];
        accelerations[i] += frequency * frequency * away + 2.0 * frequency * faster;
    }
    accelerations
}

/// Accelerations that bring the root back within its margins, as [`Humanoid::difference`] orders them; zero where it is, and of all joints.
fn catching(now: &Moving, wanted: &Moving) -> Vec<f64> {
    let deviation = deviation(now, wanted);
    let mut accelerations = vec![0.0; now.rates.len()];
    for (kind, margin) in MARGINS.into_iter().enumerate() {
        let three = 3 * kind..3 * kind + 3;
        let away = deviation[three.clone()].iter().map(|[away, _]| away * away).sum::<f64>();
        let beyond = (1.0 - margin / libm::sqrt(away).max(margin)).max(0.0);
        for i in three {
            let [away, faster] = deviation[i];
            accelerations[i] = beyond * (CATCHING * CATCHING * away + 2.0 * CATCHING * faster);
        }
    }
    accelerations
}

/// How far the root is from where it should be, and by how much it is too slow, as [`Humanoid::difference`] orders them.
fn deviation(now: &Moving, wanted: &Moving) -> [[f64; 2]; ROOT_STEP] {
    let (root, to) = (&now.pose.world_from_root, &wanted.pose.world_from_root);
    let apart = to.translation.vector - root.translation.vector;
    let turned = rotation_vector(&(root.rotation.inverse() * to.rotation));
    std::array::from_fn(|i| [if i < 3 { apart[i] } else { turned[i - 3] }, wanted.rates[i] - now.rates[i]])
}
