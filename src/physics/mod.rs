//! The physics of a body's motion: feet planted on the ground, and simulation.
//!
//! [`plant_feet`] changes a motion as little as possible
//! so that standing feet are planted and nothing is below the ground; [`simulate`] drives a body towards a motion under
//! gravity.
//!
//! ```
//! use skiagraph::body::{Motion, shipped};
//! use skiagraph::contact::ContactRule;
//! use skiagraph::physics::plant_feet;
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

mod error;
mod planting;
mod simulation;

pub use error::PhysicsError;
pub use planting::{MostMoved, PlantedMotion, PlantingReport, plant_feet, plant_feet_at_pace};
pub use simulation::{Push, Simulated, SimulationReport, SimulationSettings, simulate};
