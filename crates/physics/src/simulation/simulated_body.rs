//! A humanoid as a multibody of rapier, in reduced coordinates, on the ground z = 0.

use std::collections::BTreeSet;

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};
use rapier3d::prelude::*;

use super::joints::{axes, is_tag, no_joint, rapier_joint};
use super::masses::{check_masses, mass};
use super::solids::{colliders, ground, pose, prop_colliders, vector};
use crate::PhysicsError;
use skiagraph_core::body::{Humanoid, Pose as BodyPose, Prop, ROOT_STEP};
use skiagraph_core::contact::SelfCollision;
use skiagraph_core::dynamics::GRAVITY;

/// The body in the world. Links and degrees of freedom keep the humanoid's indices; a link that only marks a position
/// is merged with its parent.
pub(super) struct SimulatedBody {
    world: PhysicsWorld,
    bodies: Vec<RigidBodyHandle>,
    multibody: MultibodyIndex,
    /// For every degree of freedom, the index of the rapier link that it moves and the row of its coordinate.
    axes: Vec<(usize, usize)>,
    /// The root link's centre of mass in its frame.
    root_centre: Vector3<f64>,
    filter: TouchingPairs,
}

/// Which links may collide.
struct TouchingPairs(BTreeSet<[usize; 2]>);

impl PhysicsHooks for TouchingPairs {
    fn filter_contact_pair(&self, context: &PairFilterContext<'_>) -> Option<SolverFlags> {
        let of = |collider: ColliderHandle| context.colliders.get(collider);
        let (first, second) = (of(context.collider1)?, of(context.collider2)?);
        let on_ground = first.parent().is_none() || second.parent().is_none();
        let links = [first.user_data as usize, second.user_data as usize];
        let pair = [links[0].min(links[1]), links[0].max(links[1])];
        (on_ground || self.0.contains(&pair)).then_some(SolverFlags::COMPUTE_RIGID_IMPULSES)
    }
}

impl SimulatedBody {
    /// The body at rest in the zero pose; `steps_per_second` steps a second. A `fixed` root does not move.
    ///
    /// # Errors
    /// [`PhysicsError`] for a body without mass, with joints that move no mass, or with joints that cannot be
    /// simulated.
    pub(super) fn new(
        body: &Humanoid,
        friction: f64,
        steps_per_second: f64,
        fixed: bool,
    ) -> Result<Self, PhysicsError> {
        let mut axes = axes(body)?;
        axes.iter_mut().for_each(|(link, _)| *link -= (0..*link).filter(|&before| is_tag(body, before)).count());
        check_masses(body, fixed)?;
        let mut world = PhysicsWorld::new();
        world.gravity = Vector::Z * -(GRAVITY as Real);
        world.integration_parameters.dt = (1.0 / steps_per_second) as Real;
        world.integration_parameters.num_solver_iterations = 1;
        world.insert_collider(ground(friction), None);
        // rapier integrates a free root as if its frame's origin were its centre of mass, so the origin is moved there
        let root_centre =
            body.links[0].inertia.as_ref().map_or(Vector3::zeros(), |inertia| inertia.centre_of_mass.coords);
        let centre = |link: usize| if link == 0 { root_centre } else { Vector3::zeros() };
        let mut bodies = Vec::with_capacity(body.links.len());
        for (index, link) in body.links.iter().enumerate() {
            if let Some(parent) = body.parent(index).filter(|_| is_tag(body, index)) {
                bodies.push(bodies[parent]);
                continue;
            }
            let builder = if fixed && index == 0 { RigidBodyBuilder::fixed() } else { RigidBodyBuilder::dynamic() };
            let mass = mass(&link.inertia, &centre(index));
            let handle = world.insert_body(builder.can_sleep(false).additional_mass_properties(mass));
            let body_from_link = Pose::from_translation(-vector(&centre(index)));
            for mut collider in link.solids.iter().flat_map(|solid| colliders(solid, friction, index)) {
                collider.set_position(body_from_link * *collider.position());
                world.insert_collider(collider, Some(handle));
            }
            bodies.push(handle);
        }
        let unjoined = |joint: &str| no_joint(joint, "of an unsupported kind");
        for (index, joint) in body.joints.iter().enumerate().filter(|(index, _)| !is_tag(body, index + 1)) {
            let built = rapier_joint(body, joint, &centre(joint.parent));
            let joined = world.multibody_joints.insert(bodies[joint.parent], bodies[index + 1], built, true);
            joined.ok_or_else(|| unjoined(&joint.name))?;
        }
        if (1..body.links.len()).all(|link| is_tag(body, link)) {
            // a single body is not a multibody for rapier: attach an empty body
            let nothing = world.insert_body(RigidBodyBuilder::dynamic().can_sleep(false));
            let rigid = FixedJointBuilder::new().build();
            world.multibody_joints.insert(bodies[0], nothing, rigid, true).ok_or_else(|| unjoined(&body.name))?;
        }
        let link = world.multibody_joints.rigid_body_link(bodies[0]).copied();
        let multibody = link.ok_or_else(|| unjoined(&body.name))?.multibody;
        let pairs = SelfCollision::new(body).pairs().iter().copied().collect();
        let mut simulated = Self { world, bodies, multibody, axes, root_centre, filter: TouchingPairs(pairs) };
        simulated.with_multibody(|multibody, bodies| {
            multibody.forward_kinematics(bodies, true);
            multibody.damping_mut().fill(0.0);
        });
        Ok(simulated)
    }

    pub(super) fn insert_props(&mut self, props: &[Prop], friction: f64) {
        for collider in props.iter().flat_map(|prop| prop_colliders(&prop.solid, friction)) {
            self.world.insert_collider(collider, None);
        }
    }

    fn with_multibody(&mut self, change: impl FnOnce(&mut Multibody, &mut RigidBodySet)) {
        if let Some(multibody) = self.world.multibody_joints.get_multibody_mut(self.multibody) {
            change(multibody, &mut self.world.bodies);
        }
    }

    fn multibody(&self) -> Option<&Multibody> {
        self.world.multibody_joints.get_multibody(self.multibody)
    }

    /// Puts the body into a pose, moving with `speeds`: the root's velocity in the world and its angular velocity
    /// about its own axes, then one number per degree of freedom, in the order of [`Humanoid::difference`].
    pub(super) fn place(&mut self, place: &BodyPose, speeds: &[f64]) {
        let centre = place.world_from_root * Translation3::from(self.root_centre);
        if let Some(root) = self.world.bodies.get_mut(self.bodies[0]) {
            root.set_position(pose(&centre), true);
        }
        let axes = self.axes.clone();
        let turning = place.world_from_root.rotation * Vector3::new(speeds[3], speeds[4], speeds[5]);
        let lever = place.world_from_root.rotation * self.root_centre;
        let along = Vector3::new(speeds[0], speeds[1], speeds[2]) + turning.cross(&lever);
        self.with_multibody(|multibody, bodies| {
            multibody.forward_kinematics(bodies, true);
            let mut displacement = vec![0.0; multibody.ndofs()];
            let mut velocity = vec![0.0; multibody.ndofs()];
            if velocity.len() == axes.len() + ROOT_STEP {
                velocity[..3].copy_from_slice(&[along.x, along.y, along.z].map(|v| v as Real));
                velocity[3..ROOT_STEP].copy_from_slice(&[turning.x, turning.y, turning.z].map(|v| v as Real));
            }
            for (dof, &(link, row)) in axes.iter().enumerate() {
                if let Some(link) = multibody.link(link) {
                    let at = link.assembly_id();
                    displacement[at] = place.joint_angles[dof] as Real - link.joint.coords()[row];
                    velocity[at] = speeds[ROOT_STEP + dof] as Real;
                }
            }
            multibody.apply_displacements(&displacement);
            multibody.generalized_velocity_mut().copy_from_slice(&velocity);
            multibody.forward_kinematics(bodies, false);
            multibody.update_rigid_bodies(bodies, true);
        });
        self.world.bodies.propagate_modified_body_positions_to_colliders(&mut self.world.colliders);
    }

    /// The current pose, in single precision.
    pub(super) fn pose(&self) -> BodyPose {
        let mut found = BodyPose {
            world_from_root: Isometry3::identity(),
            joint_angles: nalgebra::DVector::zeros(self.axes.len()),
        };
        if let Some(multibody) = self.multibody() {
            found.world_from_root = isometry(multibody.root().local_to_world()) * Translation3::from(-self.root_centre);
            for (angle, &(link, row)) in found.joint_angles.iter_mut().zip(&self.axes) {
                *angle = multibody.link(link).map_or(f64::NAN, |link| f64::from(link.joint.coords()[row]));
            }
        }
        found
    }

    /// Speed of every degree of freedom, rad/s or m/s.
    pub(super) fn joint_speeds(&self) -> Vec<f64> {
        let Some(multibody) = self.multibody() else { return Vec::new() };
        let speeds = multibody.generalized_velocity();
        let at = |link: usize| multibody.link(link).map_or(f64::NAN, |link| f64::from(speeds[link.assembly_id()]));
        self.axes.iter().map(|&(link, _)| at(link)).collect()
    }

    /// Velocity of a link's centre of mass and its angular velocity, world.
    pub(super) fn link_velocity(&self, link: usize) -> [Vector3<f64>; 2] {
        let body = self.world.bodies.get(self.bodies[link]);
        body.map_or([Vector3::repeat(f64::NAN); 2], |body| [from_rapier(body.linvel()), from_rapier(body.angvel())])
    }

    /// Gives a degree of freedom a spring and a damper, both integrated implicitly (stable PD, `[Tan 2011]`):
    /// `stiffness (rest - q) - damping dq/dt`, N m or N.
    pub(super) fn set_spring(&mut self, dof: usize, stiffness: f64, damping: f64, rest: f64) {
        let (link, row) = self.axes[dof];
        self.with_multibody(|multibody, _| {
            let Some(link) = multibody.link_mut(link) else { return };
            link.joint.set_spring(row, stiffness as Real, rest as Real);
            let at = link.assembly_id();
            multibody.damping_mut()[at] = damping as Real;
        });
    }

    /// Velocity of the root link's centre of mass and its angular velocity, world.
    pub(super) fn root_velocity(&self) -> [Vector3<f64>; 2] {
        let Some(multibody) = self.multibody() else { return [Vector3::zeros(); 2] };
        let speeds = multibody.generalized_velocity();
        let triple = |first: usize| Vector3::from_fn(|row, _| f64::from(speeds[first + row]));
        [triple(0), triple(3)]
    }

    /// Rates of change, in the order of [`Humanoid::difference`], per second.
    pub(super) fn rates(&self) -> Vec<f64> {
        let root = self.pose().world_from_root.rotation;
        let [along, turning] = self.root_velocity();
        let origin = along - turning.cross(&(root * self.root_centre));
        let own = root.inverse() * turning;
        origin.iter().chain(own.iter()).copied().chain(self.joint_speeds()).collect()
    }

    /// Adds a force at a link's centre of mass until [`Self::clear_forces`], world, newtons.
    pub(super) fn add_force(&mut self, link: usize, force: &Vector3<f64>) {
        if let Some(body) = self.world.bodies.get_mut(self.bodies[link]) {
            body.add_force(vector(force), true);
        }
    }

    /// Adds a force at a link's centre of mass and a moment until [`Self::clear_forces`], world, N and N m.
    pub(super) fn add_wrench(&mut self, link: usize, force: &Vector3<f64>, moment: &Vector3<f64>) {
        self.add_force(link, force);
        if let Some(body) = self.world.bodies.get_mut(self.bodies[link]) {
            body.add_torque(vector(moment), true);
        }
    }

    /// Removes all forces except gravity.
    pub(super) fn clear_forces(&mut self) {
        for &body in &self.bodies {
            if let Some(body) = self.world.bodies.get_mut(body) {
                body.reset_forces(true);
                body.reset_torques(true);
            }
        }
    }

    pub(super) fn step(&mut self) {
        self.world.step_with_events(&self.filter, &());
    }

    /// The ground's force on the body in the last step, upwards, newtons.
    #[cfg(test)]
    pub(super) fn ground_normal_force(&self) -> f64 {
        let ground = |pair: &&ContactPair| {
            [pair.collider1, pair.collider2].iter().any(|c| self.world.colliders[*c].parent().is_none())
        };
        let manifolds = self.world.contact_pairs().filter(ground).flat_map(|pair| pair.manifolds().iter());
        let impulses = manifolds.flat_map(|manifold| manifold.contacts().iter().map(|contact| contact.data.impulse));
        impulses.map(f64::from).sum::<f64>() / f64::from(self.world.integration_parameters.dt)
    }
}

fn from_rapier(v: Vector) -> Vector3<f64> {
    Vector3::new(f64::from(v.x), f64::from(v.y), f64::from(v.z))
}

fn isometry(pose: &Pose) -> Isometry3<f64> {
    let [x, y, z, w] = pose.rotation.to_array().map(f64::from);
    let rotation = UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z));
    Isometry3::from_parts(from_rapier(pose.translation).into(), rotation)
}
