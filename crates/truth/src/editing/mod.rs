//! Motion editing on a body: joining takes at similar poses, repetition, path following, random variation.
//!
//! A [`Take`] is a motion of a robot scaled to a subject. [`carried_over`] transfers it to the same robot at another
//! size, [`joined`] finds transitions between takes and blends them, [`repeated`] does the same with a single take,
//! [`along_path`] bends a motion along waypoints, [`varied`] lets tempo, amplitude and posture drift slowly, as those
//! of people do.
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
