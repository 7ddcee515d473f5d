//! What moves the simulated body: springs in its joints, what balance asks of them, and a bounded wrench at its root.

use super::balance::{Balance, Balanced};
use super::moving::Moving;
use super::reference::Reference;
use super::settings::SimulationSettings;
use super::simulated_body::SimulatedBody;
use super::stepping::Stepping;
use super::wrench::Wrench;
use crate::body::{DegreeOfFreedom, Humanoid, ROOT_STEP};
use crate::physics::constants::GRAVITY;

/// A joint's spring yields this much under the greatest effort of its joint, radians (metres).
const YIELD: f64 = 0.08;
/// Dampers are this many seconds of the springs.
const DAMPING_S: f64 = 0.05;
/// Efforts beyond what a strong adult's hip gives are none that a body would hold with, N m per kg of body.
const GREATEST_EFFORT: f64 = 4.0;
/// How often balance is looked after, about, Hz.
const BALANCE_RATE: f64 = 120.0;

/// Control of one body.
pub(super) struct Control<'a> {
    body: &'a Humanoid,
    springs: Vec<Spring>,
    balance: Balance<'a>,
    stepping: Stepping<'a>,
    balanced: Balanced,
    mass: f64,
    /// Lever that makes a force of a moment: height of the centre of mass at the start, metres.
    lever: f64,
    /// Greatest wrench at the root, newtons.
    bound: f64,
}

struct Spring {
    stiffness: f64,
    damping: f64,
    effort: f64,
}

impl<'a> Control<'a> {
    pub(super) fn new(body: &'a Humanoid, reference: &Reference<'_>, settings: &SimulationSettings) -> Self {
        let mass = body.total_mass();
        let spring = |dof: &DegreeOfFreedom| {
            let most = GREATEST_EFFORT * mass;
            let effort = if dof.max_effort > 0.0 { dof.max_effort.min(most) } else { most };
            let stiffness = effort / YIELD;
            Spring { stiffness, damping: DAMPING_S * stiffness, effort }
        };
        Self {
            body,
            springs: body.degrees_of_freedom.iter().map(spring).collect(),
            balance: Balance::new(body, settings.friction),
            stepping: Stepping::new(body),
            balanced: Balanced {
                efforts: vec![0.0; body.degrees_of_freedom.len()],
                missing: Wrench::zero(),
                catching: Wrench::zero(),
            },
            mass,
            lever: reference.height(0).max(0.1),
            bound: settings.root_wrench * mass * GRAVITY,
        }
    }

    /// Sets the springs and the root's wrench for the step that ends at `step`; returns the wrench's size, body weights.
    pub(super) fn drive(&mut self, simulated: &mut SimulatedBody, reference: &Reference<'_>, step: usize) -> f64 {
        let (pose, rates) = (simulated.pose(), simulated.rates());
        let every = libm::round(reference.steps_per_second() / BALANCE_RATE).max(1.0) as usize;
        if (step - 1).is_multiple_of(every) {
            let now = Moving::new(self.body, pose.clone(), rates.clone());
            let wanted = Moving::new(self.body, reference.pose(step).clone(), reference.rate(step));
            let touching = reference.touching(step);
            let seconds = every as f64 / reference.steps_per_second();
            self.stepping.update(&now, &wanted, touching, seconds);
            self.balanced = self.balance.at(&now, &wanted, reference.acceleration(step), touching);
        }
        let (target, target_rates) = (reference.pose(step), reference.rate(step));
        for (dof, spring) in self.springs.iter().enumerate() {
            let to = target.joint_angles[dof] + self.stepping.deviations[dof];
            let effort = self.balanced.efforts[dof];
            let rest = spring.rest(
                [to, pose.joint_angles[dof]],
                [target_rates[ROOT_STEP + dof], rates[ROOT_STEP + dof]],
                effort,
            );
            simulated.set_spring(dof, spring.stiffness, spring.damping, rest);
        }
        self.help(simulated)
    }

    /// Gives the root what the ground cannot, and with what is left of the bound brings it back within its margins.
    fn help(&self, simulated: &mut SimulatedBody) -> f64 {
        let Balanced { missing, catching, .. } = &self.balanced;
        let size = missing.size(self.lever);
        let help = match size > self.bound {
            true => missing.scaled(self.bound / size),
            false => missing.and(&catching.scaled(missing.room(catching, self.lever, self.bound))),
        };
        simulated.add_wrench(0, &help.force, &help.moment);
        help.size(self.lever) / (self.mass * GRAVITY)
    }
}

impl Spring {
    /// Where the spring rests that pulls an angle towards another, and a speed likewise (each wanted, found), and adds an effort, by
    /// the greatest effort at most.
    fn rest(&self, [to, at]: [f64; 2], [rate, speed]: [f64; 2], effort: f64) -> f64 {
        // the damper brakes towards rest; what it takes from the wanted speed, the spring gives back
        let lead = self.damping / self.stiffness;
        let wanted = to + lead * rate + effort.clamp(-self.effort, self.effort) / self.stiffness;
        let idle = at + lead * speed;
        let reach = self.effort / self.stiffness;
        // what has diverged is not a number; it is told after the step
        if idle.is_finite() { wanted.clamp(idle - reach, idle + reach) } else { wanted }
    }
}
