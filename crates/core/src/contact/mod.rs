//! Contact of a body with the ground, with props and with itself.
//!
//! [`GroundContacts`] has the gap, stance and slip of every link and foot in every frame; [`SelfCollision`] finds
//! parts of a body that penetrate each other. Everything is computed from the surface of the body, its skin or its
//! solids, exact up to rounding; nothing is estimated from joint speeds.
//!
//! ```
//! use skiagraph_core::body::{Motion, shipped};
//! use skiagraph_core::contact::{ContactRule, GroundContacts};
//! // a body 3 mm above the ground
//! let body = shipped("actor")?;
//! let mut pose = body.zero_pose();
//! let links: Vec<usize> = (0..body.links.len()).collect();
//! let sole = body.lowest_point(&body.link_frames(&pose), &links).ok_or("no solids")?;
//! pose.world_from_root.translation.vector.z = 0.003 - sole.z;
//! let standing = Motion { frames_per_second: 60.0, poses: vec![pose; 30] };
//! let contacts = GroundContacts::from_motion(&body, &standing, &ContactRule::default())?;
//! assert!(contacts.feet.iter().all(|foot| foot.stances().len() == 1));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod bounds;
mod capsule_distance;
mod error;
mod ground_contacts;
mod ground_quality;
mod interpenetration;
mod prop_contacts;
mod rule;
mod self_collision;
mod solid_distance;

pub use error::ContactError;
pub use ground_contacts::{ContactTrack, GroundContacts};
pub use rule::{ContactRule, Stance};

// Parts of the measurement of contacts, for the other crates.
#[doc(hidden)]
pub use self::{
    ground_contacts::{GroundContact, GroundTrackInput, check_feet, link_frames},
    ground_quality::GroundQuality,
    interpenetration::{Depths, Interpenetration, InterpenetrationScratch},
    prop_contacts::{PropContact, PropContacts, PropTrack},
    rule::{FOOT_NAMES, Pace, stances},
    self_collision::{Collision, LeftOut, LinkPair, SelfCollision},
    solid_distance::solid_distance,
};
