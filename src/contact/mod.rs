//! Contact of a body with the ground, with props and with itself.
//!
//! [`GroundContacts`] has the gap, stance and slip of every link and foot in every frame; [`SelfCollision`] finds parts
//! of a body that penetrate each other. Everything is computed from the solids of the body and is exact up to rounding;
//! nothing is guessed from joint speeds. Another surface, such as a skin, can replace the solids by implementing
//! [`Surface`].

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
mod stance;
mod surface;

pub use capsule_distance::tapered_capsule_distance;
pub use error::ContactError;
pub use ground_contacts::{ContactTrack, GroundContact, GroundContacts, check_feet};
pub(crate) use ground_contacts::{TrackInput, link_frames};
pub use ground_quality::GroundQuality;
pub use interpenetration::{Depths, Interpenetration, InterpenetrationScratch};
pub use prop_contacts::{PropContact, PropContacts, PropTrack};
pub use rule::ContactRule;
pub use self_collision::{Collision, LeftOut, LinkPair, SelfCollision};
pub use solid_distance::solid_distance;
pub use stance::{FOOT_NAMES, Stance, stances};
pub use surface::{Surface, SurfacePoint};
