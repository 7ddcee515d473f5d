//! Motions edited on a body: takes joined where their poses are alike, motions repeated, led along a path, varied.
//!
//! A [`Take`] is a motion of one robot that was scaled to one subject. [`carried_over`] gives it to the same robot of
//! another size, [`joined`] finds the instants at which takes can follow each other and blends them there, [`repeated`]
//! does the same with one take and itself, [`along_path`] turns a motion along waypoints, [`varied`] lets tempo,
//! amplitude and posture drift slowly, as those of people do.
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
//! // one stride, which has no second one to go over into: poses 0.15 m apart will do
//! let settings = JoinSettings { within_mm: 150.0, ..JoinSettings::default() };
//! let longer = repeated(&walk.humanoid, &take, 3.0, &settings)?;
//! assert_eq!(longer.motion.poses.len(), 91);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Feet slide a little through a blend and on a bent path: plant them afterwards (`physics::plant_feet`).

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
pub use pose_distance::{Closest, PoseClouds};
pub use transfer::carried_over;
pub use variation::{Variation, Varied, varied};
