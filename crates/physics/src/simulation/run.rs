//! A running simulation.

use super::control::Control;
use super::reference::Reference;
use super::settings::{Push, SimulationSettings};
use super::simulated_body::SimulatedBody;
use crate::PhysicsError;
use skiagraph_core::body::{Humanoid, Pose};
use skiagraph_core::input::excerpt;

/// No part of a body moves faster than this unless the simulation has diverged, m/s.
const GREATEST_SPEED: f64 = 100.0;

pub(super) struct SimulationRun<'a> {
    body: &'a Humanoid,
    reference: &'a Reference<'a>,
    settings: &'a SimulationSettings,
    simulated: SimulatedBody,
    control: Control<'a>,
    /// Magnitude of the root's wrench at every step, body weights.
    pub(super) wrenches: Vec<f64>,
    /// The pose of the last frame.
    pub(super) last: Pose,
}

impl<'a> SimulationRun<'a> {
    /// The body in the motion's first pose with its velocity, lifted by this many metres.
    pub(super) fn new(
        body: &'a Humanoid,
        reference: &'a Reference<'a>,
        settings: &'a SimulationSettings,
        lifted: f64,
    ) -> Result<Self, PhysicsError> {
        let mut simulated = SimulatedBody::new(body, settings.friction, reference.steps_per_second(), false)?;
        simulated.insert_props(&settings.props, settings.friction);
        let control = Control::new(body, reference, settings);
        let mut start = reference.pose(0).clone();
        start.world_from_root.translation.vector.z += lifted;
        simulated.place(&start, &reference.rate(0));
        let last = simulated.pose();
        Ok(Self { body, reference, settings, simulated, control, wrenches: Vec::new(), last })
    }

    pub(super) fn advance(&mut self, frame: usize) -> Result<Pose, PhysicsError> {
        let per_frame = self.reference.steps_per_frame;
        for step in (frame - 1) * per_frame + 1..=frame * per_frame {
            self.simulated.clear_forces();
            self.wrenches.push(self.control.drive(&mut self.simulated, self.reference, step));
            self.push(step);
            self.simulated.step();
        }
        let pose = self.simulated.pose();
        self.check(frame, &pose)?;
        self.last = pose.clone();
        Ok(pose)
    }

    fn push(&mut self, step: usize) {
        let ends = step as f64 / self.reference.steps_per_second();
        for push in &self.settings.pushes {
            if ends > push.at_s + 1e-9 && ends <= push.at_s + Push::DURATION_S + 1e-9 {
                let force = push.direction.into_inner() * (push.impulse_ns / Push::DURATION_S);
                self.simulated.add_force(push.link, &force);
            }
        }
    }

    fn check(&self, frame: usize, pose: &Pose) -> Result<(), PhysicsError> {
        let (frames, before) = (self.body.link_frames(pose), self.body.link_frames(&self.last));
        // rapier stops diverged bodies, so positions reveal divergence if speeds do not
        let reach = GREATEST_SPEED * self.reference.steps_per_frame as f64 / self.reference.steps_per_second();
        let valid = |link: &usize| {
            let [velocity, turning] = self.simulated.link_velocity(*link);
            let place = &frames[*link];
            let placed = place.translation.vector.iter().chain(place.rotation.coords.iter()).all(|x| x.is_finite());
            let moved = (place.translation.vector - before[*link].translation.vector).norm();
            placed && moved < reach && velocity.norm() < GREATEST_SPEED && turning.norm().is_finite()
        };
        match (0..self.body.links.len()).find(|link| !valid(link)) {
            Some(link) => Err(PhysicsError::Refused(format!(
                "frame {frame} (from 0): the simulation diverged at link {:?}; lower the push or the friction, or use \
                 contact = \"fix\"",
                excerpt(&self.body.links[link].name)
            ))),
            None => Ok(()),
        }
    }
}
