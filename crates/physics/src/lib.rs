//! The physics of a body's motion: feet planted on the ground, and simulation.
//!
//! [`plant_feet`] changes a motion as little as possible so that standing feet are planted and nothing is below the
//! ground; [`simulate`] drives a body towards a motion under gravity, by rapier. Balance and the forces that a motion
//! requires are in `skiagraph_core::dynamics`, contacts in `skiagraph_core::contact`: neither needs a simulation.
//!
//! ```
//! use skiagraph_core::body::{Motion, shipped};
//! use skiagraph_core::contact::ContactRule;
//! use skiagraph_physics::plant_feet;
//!
//! let body = shipped("actor")?;
//! let mut pose = body.zero_pose();
//! // the soles 20 mm below the ground
//! let links: Vec<usize> = (0..body.links.len()).collect();
//! let lowest = body.lowest_point(&body.link_frames(&pose), &links).ok_or("no geometry")?;
//! pose.world_from_root.translation.z -= lowest.z + 0.02;
//! let motion = Motion { frames_per_second: 60.0, poses: vec![pose; 30] };
//! let planted = plant_feet(&body, &motion, &ContactRule::default())?;
//! let penetration = |motion: &Motion| {
//!     let frames = body.link_frames(&motion.poses[15]);
//!     body.lowest_point(&frames, &links).map_or(0.0, |point| -point.z)
//! };
//! assert!(penetration(&motion) > 0.019 && penetration(&planted.motion) < 0.002);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![cfg_attr(
    not(test),
    warn(
        clippy::unwrap_used,
        clippy::expect_used,
        clippy::panic,
        clippy::todo,
        clippy::unimplemented,
        clippy::dbg_macro,
        clippy::print_stdout,
        clippy::print_stderr
    )
)]

mod error;
mod planting;
mod simulation;
#[cfg(test)]
#[path = "../../test_support/bodies.rs"]
pub mod test_bodies;

pub use error::PhysicsError;
pub use planting::{PlantedMotion, PlantingReport, plant_feet};
pub use simulation::{Push, Simulated, SimulationReport, SimulationSettings, simulate};

// Variants for the application, and parts of reports.
#[doc(hidden)]
pub use self::planting::{MostMoved, plant_feet_at_pace};
