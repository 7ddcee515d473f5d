//! Motion editing on a body: joining takes at similar poses, repetition, path following, random variation.
//!
//! A [`Take`] is a motion of a robot scaled to a subject. [`carried_over`] transfers it to the same robot at another
//! size, [`joined`] finds transitions between takes and blends them, [`repeated`] does the same with a single take,
//! [`along_path`] bends a motion along waypoints, [`varied`] lets tempo, amplitude and posture drift slowly, as those
//! of people do.
//!
//! ```
//! use skiagraph_core::body::shipped;
//! use skiagraph_truth::editing::{JoinSettings, Take, repeated};
//! use skiagraph_truth::mocap::{ReadOptions, parse_deepmimic};
//! use skiagraph_truth::retarget::{RetargetOptions, retarget};
//! # let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenarios/motions/humanoid3d_walk.txt");
//! let text = std::fs::read_to_string(file)?;
//! let clip = parse_deepmimic(&text, "walk", &ReadOptions::default())?;
//! let walk = retarget(&clip, &shipped("actor")?, &RetargetOptions::default())?;
//! let take = Take { name: clip.name, motion: walk.motion };
//! // a single stride has no close transition: accept poses 0.15 m apart
//! let settings = JoinSettings { within_mm: 150.0, ..JoinSettings::default() };
//! let longer = repeated(&walk.humanoid, &take, 3.0, &settings)?;
//! assert_eq!(longer.motion.poses.len(), 91);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Feet slide slightly during blends and on bent paths: plant them afterwards (`physics::plant_feet`).

mod blending;
mod curve;
mod error;
mod joining;
mod path;
mod pose_distance;
mod transfer;
mod variation;

pub use error::EditError;
pub use joining::{JoinSettings, Joined, Seam, Take, joined, repeated};
pub use path::{GREATEST_TURN_IN_A_STANCE, along_path};
use pose_distance::{Closest, PoseClouds};
pub use transfer::carried_over;
pub use variation::{Variation, Varied, varied};
