//! Control of the simulated body: springs in its joints, efforts for balance, and a bounded wrench at its root.

use super::balance::{Balance, Balanced};
use super::moving::BodyState;
use super::reference::Reference;
use super::settings::SimulationSettings;
use super::simulated_body::SimulatedBody;
use super::stepping::Stepping;
use super::wrench::Wrench;
use skiagraph_core::body::{DegreeOfFreedom, Humanoid, ROOT_STEP};
use skiagraph_core::dynamics::GRAVITY;

/// Deflection of a joint's spring under the joint's greatest effort, radians (metres).
const YIELD: f64 = 0.08;
/// Damping divided by stiffness, seconds.
const DAMPING_S: f64 = 0.05;
/// Cap on effort per kilogram of body mass, that of a strong adult's hip, N m/kg.
const GREATEST_EFFORT: f64 = 4.0;
/// Approximate rate of balance control, Hz.
const BALANCE_RATE: f64 = 120.0;

pub(super) struct Control<'a> {
    body: &'a Humanoid,
    springs: Vec<Spring>,
    balance: Balance<'a>,
    stepping: Stepping<'a>,
    balanced: Balanced,
    mass: f64,
    /// Lever for converting moments to forces: height of the centre of mass at the start, metres.
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
                missing: Wrench::default(),
                recovery: Wrench::default(),
            },
            mass,
            lever: reference.height(0).max(0.1),
            bound: settings.root_wrench * mass * GRAVITY,
        }
    }

    /// Sets the springs and the root's wrench for the step that ends at `step`; returns the wrench's magnitude, body
    /// weights.
    pub(super) fn drive(&mut self, simulated: &mut SimulatedBody, reference: &Reference<'_>, step: usize) -> f64 {
        let (pose, rates) = (simulated.pose(), simulated.rates());
        let every = libm::round(reference.steps_per_second() / BALANCE_RATE).max(1.0) as usize;
        if (step - 1).is_multiple_of(every) {
            let now = BodyState::new(self.body, pose.clone(), rates.clone());
            let wanted = BodyState::new(self.body, reference.pose(step).clone(), reference.rate(step));
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

    /// Applies the missing wrench at the root, and uses the rest of the bound to return the root to its margins.
    fn help(&self, simulated: &mut SimulatedBody) -> f64 {
        let Balanced { missing, recovery, .. } = &self.balanced;
        let size = missing.size(self.lever);
        let help = if size > self.bound {
            missing.scaled(self.bound / size)
        } else {
            missing.and(&recovery.scaled(missing.room(recovery, self.lever, self.bound)))
        };
        simulated.add_wrench(0, &help.force, &help.moment);
        help.size(self.lever) / (self.mass * GRAVITY)
    }
}

impl Spring {
    /// Rest angle of the spring that drives an angle and a speed towards targets (each target, current) and adds an
    /// effort, limited by the greatest effort.
    fn rest(&self, [to, at]: [f64; 2], [rate, speed]: [f64; 2], effort: f64) -> f64 {
        // the damper brakes towards rest; the spring compensates for this at the target speed
        let lead = self.damping / self.stiffness;
        let wanted = to + lead * rate + effort.clamp(-self.effort, self.effort) / self.stiffness;
        let idle = at + lead * speed;
        let reach = self.effort / self.stiffness;
        // divergence gives NaN; it is reported after the step
        if idle.is_finite() { wanted.clamp(idle - reach, idle + reach) } else { wanted }
    }
}
