//! Motions that happen: a body driven towards a recorded motion in a simulation, on the ground, under gravity.

mod clearance;
mod control;
mod reference;
mod report;
mod settings;
mod simulated_body;
mod solids;
#[cfg(test)]
pub(super) mod tests;

pub use report::{Simulated, SimulationReport};
pub use settings::{Push, SimulationSettings};
pub(super) use simulated_body::GRAVITY;

use control::Control;
use reference::Reference;
use simulated_body::SimulatedBody;

use super::ground_contacts::link_frames;
use super::{ContactError, ContactRule, Dynamics, GroundContacts, GroundQuality, fix};
use crate::body::{Humanoid, LinkFrames, Motion, Pose};

/// Least number of steps a second.
const LEAST_RATE: f64 = 480.0;
/// Deeper than this no motion may start under the ground, metres.
const DEEPEST_START: f64 = 0.1;
/// A body has fallen whose centre of mass is below this share of the motion's height.
const FALLEN: f64 = 0.75;
/// No part of a body moves faster unless the simulation has diverged, m/s.
const GREATEST_SPEED: f64 = 100.0;

/// Simulates `body` as it is driven towards `motion`: a multibody in reduced coordinates on the ground z = 0, with
/// friction and self-collision ([`super::SelfCollision`] says between which links), props if there are any, springs and dampers in its
/// joints that pull towards the motion with about each joint's effort at most ([`Dynamics`] says beforehand what they will need), and
/// a wrench at the root if asked. What
/// it is driven towards is the motion settled on the ground ([`fix`]), with feet that swing lifted to clear it. It starts in that
/// motion's first pose with its speed. The same bits on any number of threads.
///
/// The wrench is bounded by what it would be at the beginning of a step; as its springs and dampers are integrated implicitly,
/// an impact within the step can take it further. [`SimulationReport`] says how far.
///
/// # Errors
/// [`ContactError`] for settings that make no sense, a motion that is empty, belongs to another body, is not finite or starts
/// deep under the ground, a body without mass, feet or hinges, and a simulation that diverges.
pub fn simulate(body: &Humanoid, motion: &Motion, settings: &SimulationSettings) -> Result<Simulated, ContactError> {
    settings.check(body)?;
    let recorded = link_frames(body, motion)?;
    let all: Vec<usize> = (0..body.links.len()).collect();
    let depth_at_start = |frames: &[LinkFrames]| {
        frames.first().and_then(|frame| body.lowest_point(frame, &all)).map_or(0.0, |lowest| (-lowest.z).max(0.0))
    };
    if depth_at_start(&recorded) > DEEPEST_START {
        return Err(ContactError::Underground { depth_mm: 1000.0 * depth_at_start(&recorded) });
    }
    let rule = ContactRule::default();
    let settled = fix(body, motion, &rule)?.motion;
    let frames = link_frames(body, &settled)?;
    let contacts = GroundContacts::of_frames(body, body, &frames, motion.frames_per_second, &rule)?;
    let cleared = clearance::cleared(body, &settled, &frames, &contacts);
    let contacts = GroundContacts::of_motion(body, &cleared, &rule)?;
    let needed = Dynamics::of_motion(body, &cleared, &contacts, settings.friction)?;
    let efforts = needed.frames.into_iter().map(|frame| frame.efforts).collect();
    let reference = Reference::new(body, &cleared, efforts, LEAST_RATE)
        .ok_or(ContactError::EmptyMotion { poses: motion.poses.len(), frames_per_second: motion.frames_per_second })?;
    let mut run = Run::new(body, &reference, settings)?;
    run.start(depth_at_start(&frames));
    let mut poses = vec![run.last.clone()];
    for frame in 1..reference.frames() {
        poses.push(run.advance(frame)?);
    }
    let simulated = Motion { frames_per_second: motion.frames_per_second, poses };
    let (moved_mm, moved_most_mm) = distances_mm(body, motion, &simulated)?;
    let contacts = GroundContacts::of_motion(body, &simulated, &rule)?;
    let steps = run.wrenches.len().max(1) as f64;
    let report = SimulationReport {
        duration_s: motion.duration_s(),
        fell_at_s: run.fell_at_s,
        root_wrench_mean: run.wrenches.iter().sum::<f64>() / steps,
        root_wrench_most: run.wrenches.iter().copied().fold(0.0, f64::max),
        moved_mm,
        moved_most_mm,
        quality: GroundQuality::of(&contacts),
    };
    Ok(Simulated { motion: simulated.made_continuous(body), report })
}

/// A simulation under way.
struct Run<'a> {
    body: &'a Humanoid,
    reference: &'a Reference<'a>,
    settings: &'a SimulationSettings,
    simulated: SimulatedBody,
    control: Control,
    /// Size of the root's wrench at every step, body weights.
    wrenches: Vec<f64>,
    fell_at_s: Option<f64>,
    /// The pose of the frame before.
    last: Pose,
}

impl<'a> Run<'a> {
    fn new(
        body: &'a Humanoid,
        reference: &'a Reference<'a>,
        settings: &'a SimulationSettings,
    ) -> Result<Self, ContactError> {
        let mut simulated = SimulatedBody::new(body, settings.friction, reference.steps_per_second(), false)?;
        simulated.insert_props(&settings.props, settings.friction);
        let control = Control::new(body, reference.height(0), settings.root_wrench);
        Ok(Self {
            body,
            reference,
            settings,
            simulated,
            control,
            wrenches: Vec::new(),
            fell_at_s: None,
            last: body.zero_pose(),
        })
    }

    fn start(&mut self, lifted: f64) {
        let mut start = self.reference.pose(0).clone();
        start.world_from_root.translation.vector.z += lifted;
        self.simulated.place(&start, &self.reference.rate(0));
        self.last = self.simulated.pose();
    }

    /// On to this frame.
    fn advance(&mut self, frame: usize) -> Result<Pose, ContactError> {
        let per_frame = self.reference.steps_per_frame;
        let step_s = 1.0 / self.reference.steps_per_second();
        for step in (frame - 1) * per_frame + 1..=frame * per_frame {
            self.simulated.clear_forces();
            let hold = self.control.drive(&mut self.simulated, self.reference, step);
            let ends = step as f64 * step_s;
            for push in &self.settings.pushes {
                if ends > push.at_s + 1e-9 && ends <= push.at_s + Push::DURATION_S + 1e-9 {
                    let force = push.direction.into_inner() * (push.impulse_ns / Push::DURATION_S);
                    self.simulated.add_force(push.link, &force);
                }
            }
            self.simulated.step();
            self.wrenches.push(self.control.exerted(&self.simulated, &hold));
        }
        let pose = self.simulated.pose();
        self.check(frame, &pose)?;
        self.last = pose.clone();
        let height = self.body.centre_of_mass(&self.body.link_frames(&pose)).map_or(0.0, |centre| centre.z);
        if self.fell_at_s.is_none() && height < FALLEN * self.reference.height(frame * per_frame) {
            self.fell_at_s = Some((frame * per_frame) as f64 * step_s);
        }
        Ok(pose)
    }

    fn check(&self, frame: usize, pose: &Pose) -> Result<(), ContactError> {
        let (frames, before) = (self.body.link_frames(pose), self.body.link_frames(&self.last));
        // rapier stops what it has lost: places tell where speeds do not
        let reach = GREATEST_SPEED * self.reference.steps_per_frame as f64 / self.reference.steps_per_second();
        let sound = |link: &usize| {
            let [velocity, turning] = self.simulated.link_velocity(*link);
            let place = &frames[*link];
            let placed = place.translation.vector.iter().chain(place.rotation.coords.iter()).all(|x| x.is_finite());
            let moved = (place.translation.vector - before[*link].translation.vector).norm();
            placed && moved < reach && velocity.norm() < GREATEST_SPEED && turning.norm().is_finite()
        };
        match (0..self.body.links.len()).find(|link| !sound(link)) {
            Some(link) => Err(ContactError::Diverged { frame, link: self.body.links[link].name.clone() }),
            None => Ok(()),
        }
    }
}

/// Mean and greatest distance of joints between two motions, mm.
fn distances_mm(body: &Humanoid, recorded: &Motion, simulated: &Motion) -> Result<(f64, f64), ContactError> {
    let (mut sum, mut most, mut count) = (0.0, 0.0_f64, 0_usize);
    for (a, b) in link_frames(body, recorded)?.iter().zip(&link_frames(body, simulated)?) {
        for (a, b) in a.0.iter().zip(&b.0) {
            let apart = 1000.0 * (a.translation.vector - b.translation.vector).norm();
            (sum, most, count) = (sum + apart, most.max(apart), count + 1);
        }
    }
    Ok((sum / count.max(1) as f64, most))
}
