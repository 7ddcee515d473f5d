//! What moves the simulated body: springs in its joints, and a bounded hold of its root.

use nalgebra::Vector3;

use super::reference::Reference;
use super::simulated_body::{GRAVITY, RootHold, SimulatedBody};
use crate::body::{DegreeOfFreedom, Humanoid, Pose, ROOT_STEP, rotation_vector};

/// A joint's spring yields this much under the greatest effort of its joint, radians (metres).
const YIELD: f64 = 0.05;
/// Dampers are this many seconds of the springs.
const DAMPING_S: f64 = 0.05;
/// Efforts beyond what a strong adult's hip gives are none that a body would hold with, N m per kg of body.
const GREATEST_EFFORT: f64 = 4.0;
/// Angular frequency of the hold of the root, rad/s; it is critically damped.
const HOLD: f64 = 12.0;
/// Radius of gyration that the hold of the root's rotation reckons with, of the height of the centre of mass: between that of the
/// body about its centre of mass and that about its feet.
const GYRATION: f64 = 0.7;

/// Springs and the root's wrench for one body.
pub(super) struct Control {
    springs: Vec<Spring>,
    mass: f64,
    /// Lever that makes a force of a moment: height of the centre of mass, metres.
    lever: f64,
    /// Greatest wrench, newtons.
    bound: f64,
}

struct Spring {
    stiffness: f64,
    damping: f64,
    effort: f64,
}

impl Control {
    /// `lever` is the height of the centre of mass at the start, `bound` the greatest root wrench in body weights.
    pub(super) fn new(body: &Humanoid, lever: f64, bound: f64) -> Self {
        let mass = body.total_mass();
        let spring = |dof: &DegreeOfFreedom| {
            let most = GREATEST_EFFORT * mass;
            let effort = if dof.max_effort > 0.0 { dof.max_effort.min(most) } else { most };
            let stiffness = effort / YIELD;
            Spring { stiffness, damping: DAMPING_S * stiffness, effort }
        };
        let springs = body.degrees_of_freedom.iter().map(spring).collect();
        Self { springs, mass, lever: lever.max(0.1), bound: bound * mass * GRAVITY }
    }

    /// Sets the springs for the step that ends at `step`, and returns how the root is held in it.
    pub(super) fn drive(&self, simulated: &mut SimulatedBody, reference: &Reference<'_>, step: usize) -> RootHold {
        let (target, rate, efforts) = (reference.pose(step), reference.rate(step), reference.effort(step));
        let (now, speeds) = (simulated.pose(), simulated.joint_speeds());
        for (dof, spring) in self.springs.iter().enumerate() {
            // the damper brakes towards rest; what it takes from the wanted speed, the spring gives back, and the effort that
            // the motion needs besides
            let lead = spring.damping / spring.stiffness;
            let fed = efforts[dof].clamp(-spring.effort, spring.effort) / spring.stiffness;
            let wanted = target.joint_angles[dof] + lead * rate[ROOT_STEP + dof] + fed;
            let idle = now.joint_angles[dof] + lead * speeds[dof];
            let reach = spring.effort / spring.stiffness;
            simulated.set_spring(dof, spring.stiffness, spring.damping, wanted.clamp(idle - reach, idle + reach));
        }
        let hold = self.hold(simulated.root_velocity(), [&now, target], &rate);
        simulated.hold_root(&hold);
        hold
    }

    /// Springs towards the wanted root, made softer where they would exert more than the bound.
    fn hold(&self, velocity: [Vector3<f64>; 2], [now, target]: [&Pose; 2], rate: &[f64]) -> RootHold {
        let (root, wanted) = (&now.world_from_root, &target.world_from_root);
        let apart = [
            wanted.translation.vector - root.translation.vector,
            rotation_vector(&(wanted.rotation * root.rotation.inverse())),
        ];
        let inertia = [self.mass, self.mass * (GYRATION * self.lever) * (GYRATION * self.lever)];
        let stiffness = inertia.map(|inertia| inertia * HOLD * HOLD);
        let damping = inertia.map(|inertia| 2.0 * inertia * HOLD);
        let along = Vector3::new(rate[0], rate[1], rate[2]);
        let faster = [along, wanted.rotation * Vector3::new(rate[3], rate[4], rate[5])];
        let pull = [0, 1].map(|i| apart[i] * stiffness[i] + faster[i] * damping[i]);
        let exerted = [0, 1].map(|i| pull[i] - velocity[i] * damping[i]);
        let share = if self.bound > 0.0 { (self.bound / self.size(&exerted)).min(1.0) } else { 0.0 };
        RootHold {
            stiffness: stiffness.map(|k| k * share),
            damping: damping.map(|d| d * share),
            pull: pull.map(|p| p * share),
        }
    }

    /// Size of a wrench, newtons.
    fn size(&self, [force, moment]: &[Vector3<f64>; 2]) -> f64 {
        libm::hypot(force.norm(), moment.norm() / self.lever)
    }

    /// Size of the wrench that held the root in the last step, body weights.
    pub(super) fn exerted(&self, simulated: &SimulatedBody, hold: &RootHold) -> f64 {
        self.size(&simulated.held(hold)) / (self.mass * GRAVITY)
    }
}
