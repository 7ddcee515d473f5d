//! Simulation: a body driven towards a recorded motion, on the ground, under gravity.

#[cfg(test)]
mod against_inverse_dynamics;
mod balance;
mod clearance;
mod control;
mod joints;
mod masses;
mod moving;
mod reference;
mod report;
mod run;
mod settings;
mod simulated_body;
mod slowed;
mod solids;
mod stepping;
#[cfg(test)]
pub(super) mod tests;
mod wrench;

pub use report::{Simulated, SimulationReport};
pub use settings::{Push, SimulationSettings};

use reference::Reference;
use run::SimulationRun;
use slowed::slowed;

use super::planting::foot_paths::planted_in_recorded_stances;
use super::planting::plant_on_paths;
use crate::PhysicsError;
use skiagraph_core::body::{Humanoid, LinkFrames, Motion, Pose, Prop};
use skiagraph_core::contact::{
    ContactError, ContactRule, GroundContacts, GroundQuality, Pace, link_frames, solid_distance,
};
use skiagraph_core::input::excerpt;

/// Least number of steps a second.
const LEAST_RATE: f64 = 480.0;
/// Greatest depth at which a motion may start in the ground or a prop, metres.
const DEEPEST_START: f64 = 0.1;
/// A body has fallen when its centre of mass is below this share of the motion's height.
const FALLEN: f64 = 0.75;

/// Simulates `body` driven towards `motion`: a multibody in reduced coordinates on the ground z = 0, with friction and
/// self-collision (between the links given by [`skiagraph_core::contact::SelfCollision`]), optional props, springs and
/// dampers in its joints that pull towards the motion with at most about each joint's effort, and an optional wrench at
/// the root. The target motion is planted as by [`crate::plant_feet`], but feet are held only in their recorded
/// stances, and stances are labelled without look-ahead ([`ContactRule::looks_ahead`]): the control was tuned on these,
/// and feet that are held longer swing faster, which made it stumble. Swinging feet are lifted to clear the ground, and
/// no joint is faster than its greatest speed. The body starts in that motion's first pose with the mean velocity of
/// its first 1/15 s. Results are bit-identical on any number of threads.
///
/// Balance control: 120 times a second, inverse dynamics of the current body gives the wrench that returns its root to
/// the motion, and the part of it that the ground can supply at the feet, or at other links that touch the ground in
/// the motion. The joints add the efforts for these forces; the wrench at the root is the remainder, within its bound.
/// Swinging feet are steered below the current centre of mass. The control has no advance knowledge of pushes.
///
/// # Errors
/// [`PhysicsError`] for invalid settings, a motion that is empty, belongs to another body, is not finite or starts
/// deep under the ground or inside a prop, a push after its end, a body without mass, feet or hinges, and a simulation
/// that diverges.
pub fn simulate(body: &Humanoid, motion: &Motion, settings: &SimulationSettings) -> Result<Simulated, PhysicsError> {
    let recorded = link_frames(body, motion)?;
    settings.check(body, motion.duration_s())?;
    let all: Vec<usize> = (0..body.links.len()).collect();
    let depth_at_start = |frames: &[LinkFrames]| {
        frames.first().and_then(|frame| body.lowest_point(frame, &all)).map_or(0.0, |lowest| (-lowest.z).max(0.0))
    };
    if depth_at_start(&recorded) > DEEPEST_START {
        return Err(PhysicsError::Refused(format!(
            "the motion starts {:.0} mm under the ground (z = 0); expected at most 100 mm: check `up` and \
             `metres_per_unit` of the recording, or use contact = \"off\"",
            1000.0 * depth_at_start(&recorded)
        )));
    }
    check_props(body, &recorded[0], &settings.props)?;
    let rule = ContactRule { looks_ahead: false, ..ContactRule::default() };
    let pace = Pace(&settings.pace);
    let planted = plant_on_paths(body, motion, &rule, pace, planted_in_recorded_stances)?.motion;
    let frames = link_frames(body, &planted)?;
    let contacts = GroundContacts::from_motion_at_pace(body, &planted, &rule, pace)?;
    let cleared = slowed(body, clearance::cleared(body, &planted, &frames, &contacts));
    let reference =
        Reference::new(body, &cleared, &contacts, LEAST_RATE).ok_or_else(|| ContactError::of_empty(motion))?;
    let mut run = SimulationRun::new(body, &reference, settings, depth_at_start(&frames))?;
    let mut poses = vec![run.last.clone()];
    for frame in 1..reference.frames() {
        poses.push(run.advance(frame)?);
    }
    let fell = |&(frame, pose): &(usize, &Pose)| {
        let height = body.centre_of_mass(&body.link_frames(pose)).map_or(0.0, |centre| centre.z);
        height < FALLEN * reference.height(frame * reference.steps_per_frame)
    };
    let fell_at_frame = poses.iter().enumerate().find(fell).map(|(frame, _)| frame);
    let simulated = Motion { frames_per_second: motion.frames_per_second, poses };
    let (moved_mm, moved_most_mm) = distances_mm(body, motion, &simulated)?;
    let upright = Motion {
        poses: simulated.poses[..fell_at_frame.unwrap_or(simulated.poses.len()).max(1)].to_vec(),
        ..simulated
    };
    let (moved_until_fall_mm, _) = distances_mm(body, motion, &upright)?;
    let contacts = GroundContacts::from_motion_at_pace(body, &simulated, &ContactRule::default(), pace)?;
    let report = SimulationReport {
        duration_s: motion.duration_s(),
        fell_at_s: fell_at_frame.map(|frame| frame as f64 / motion.frames_per_second),
        fell_at_frame,
        root_wrench_mean: run.wrenches.iter().sum::<f64>() / run.wrenches.len().max(1) as f64,
        root_wrench_most: run.wrenches.iter().copied().fold(0.0, f64::max),
        moved_mm,
        moved_until_fall_mm,
        moved_most_mm,
        quality: GroundQuality::from_contacts(&contacts),
    };
    Ok(Simulated { motion: simulated.made_continuous(body), report })
}

/// Checks that no link is deep inside a prop.
fn check_props(body: &Humanoid, frames: &LinkFrames, props: &[Prop]) -> Result<(), PhysicsError> {
    let links = || body.links.iter().enumerate();
    let depths = props.iter().flat_map(|prop| {
        links().flat_map(move |(index, link)| {
            link.solids.iter().map(move |solid| (-solid_distance(&prop.solid, solid, &frames[index]), link, prop))
        })
    });
    match depths.max_by(|a, b| a.0.total_cmp(&b.0)).filter(|(depth, ..)| *depth > DEEPEST_START) {
        Some((depth, link, prop)) => Err(PhysicsError::Refused(format!(
            "the motion starts with link {:?} {:.0} mm inside the prop {:?}; expected at most 100 mm: move the prop or \
             use contact = \"off\"",
            excerpt(&link.name),
            1000.0 * depth,
            excerpt(&prop.name)
        ))),
        None => Ok(()),
    }
}

/// Mean and greatest distance of joints between two motions, over their common frames, mm.
fn distances_mm(body: &Humanoid, recorded: &Motion, simulated: &Motion) -> Result<(f64, f64), PhysicsError> {
    let (mut sum, mut most, mut count) = (0.0, 0.0_f64, 0_usize);
    for (a, b) in link_frames(body, recorded)?.iter().zip(&link_frames(body, simulated)?) {
        for (a, b) in a.0.iter().zip(&b.0) {
            let apart = 1000.0 * (a.translation.vector - b.translation.vector).norm();
            (sum, most, count) = (sum + apart, most.max(apart), count + 1);
        }
    }
    Ok((sum / count.max(1) as f64, most))
}
