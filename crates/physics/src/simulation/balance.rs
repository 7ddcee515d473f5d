//! Balance: ground forces that return the body to the motion, and the joint efforts for them.

use super::moving::BodyState;
use super::wrench::Wrench;
use skiagraph_core::body::{Humanoid, ROOT_STEP, rotation_vector};
use skiagraph_core::dynamics::GRAVITY;
use skiagraph_core::dynamics::inverse_dynamics;
use skiagraph_core::dynamics::{GroundSupport, support_points};

/// Angular frequencies of the root's return to the motion, rad/s, both critically damped: of its position and of its
/// orientation. Orientation is corrected faster than position, because the feet of a leaning body strike the ground at
/// wrong positions.
const FREQUENCIES: [f64; 2] = [6.0, 12.0];

/// Distance of the root from the motion beyond which the wrench at the root also pulls it back, metres and radians:
/// beyond it, the ground has not supplied the requested forces, because joints are too weak or a support is missing.
const MARGINS: [f64; 2] = [0.03, 0.1];
/// Angular frequency of that return, rad/s, critically damped: the body's whole weight moves the root by another 44
/// mm.
const RECOVERY: f64 = 15.0;

/// The forces that follow the motion.
#[derive(Clone)]
pub(super) struct Balanced {
    /// Effort of every degree of freedom, N m or N.
    pub(super) efforts: Vec<f64>,
    /// The part that the ground cannot supply.
    pub(super) missing: Wrench,
    /// The wrench that returns the root from beyond its margins.
    pub(super) recovery: Wrench,
}

/// Returns the root by ground forces: inverse dynamics of the current body with the accelerations of the motion and,
/// at the root, towards the motion; the required wrench is distributed over the friction cones at its contacts (as
/// `[Macchietto 2009]` and `[de Lasa 2010]` do with the momentum).
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

    /// Balance of a body in state `now` that should be in state `wanted`, with these accelerations and these links on
    /// the ground in the motion. Links high above the ground support nothing; a foot on the ground supports even if it
    /// is not on the ground in the motion.
    pub(super) fn at(
        &self,
        now: &BodyState,
        wanted: &BodyState,
        accelerations: Vec<f64>,
        touching: &[usize],
    ) -> Balanced {
        let accelerations = with_root_return(now, wanted, accelerations);
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
        let ground = GroundSupport { points: &points, friction: self.friction, weight: self.mass * GRAVITY };
        let share = ground.share(&now.centre, &[needed.root_force, moment]);
        let held =
            self.body.links[0].inertia.as_ref().map_or(root.translation.vector.into(), |i| root * i.centre_of_mass);
        let [force, moment] = share.missing;
        let with_recovery: Vec<f64> =
            accelerations.iter().zip(recovery(now, wanted)).map(|(a, more)| a + more).collect();
        let with_recovery = efforts(&with_recovery, &[]);
        let more = with_recovery.root_force - needed.root_force;
        let turning = with_recovery.root_moment - needed.root_moment;
        Balanced {
            efforts: efforts(&accelerations, &share.forces).joints,
            missing: Wrench { force, moment: moment + (now.centre - held).cross(&force) },
            recovery: Wrench { force: more, moment: turning + (root.translation.vector - held.coords).cross(&more) },
        }
    }
}

/// The motion's accelerations, plus those that return the root.
fn with_root_return(now: &BodyState, wanted: &BodyState, mut accelerations: Vec<f64>) -> Vec<f64> {
    for (i, [away, faster]) in deviation(now, wanted).into_iter().enumerate() {
        let frequency = FREQUENCIES[i / 3];
        accelerations[i] += frequency * frequency * away + 2.0 * frequency * faster;
    }
    accelerations
}

/// Accelerations that bring the root back within its margins, in the order of [`Humanoid::difference`]; zero within
/// the margins, and for all joints.
fn recovery(now: &BodyState, wanted: &BodyState) -> Vec<f64> {
    let deviation = deviation(now, wanted);
    let mut accelerations = vec![0.0; now.rates.len()];
    for (kind, margin) in MARGINS.into_iter().enumerate() {
        let three = 3 * kind..3 * kind + 3;
        let away = deviation[three.clone()].iter().map(|[away, _]| away * away).sum::<f64>();
        let beyond = (1.0 - margin / libm::sqrt(away).max(margin)).max(0.0);
        for i in three {
            let [away, faster] = deviation[i];
            accelerations[i] = beyond * (RECOVERY * RECOVERY * away + 2.0 * RECOVERY * faster);
        }
    }
    accelerations
}

/// The root's position and velocity errors, in the order of [`Humanoid::difference`].
fn deviation(now: &BodyState, wanted: &BodyState) -> [[f64; 2]; ROOT_STEP] {
    let (root, to) = (&now.pose.world_from_root, &wanted.pose.world_from_root);
    let apart = to.translation.vector - root.translation.vector;
    let turned = rotation_vector(&(root.rotation.inverse() * to.rotation));
    std::array::from_fn(|i| [if i < 3 { apart[i] } else { turned[i - 3] }, wanted.rates[i] - now.rates[i]])
}
