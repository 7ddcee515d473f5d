//! What touches: the ground under a body, the props about it, and the body itself.
//!
//! [`GroundContacts`] says for every link and foot, frame by frame, how far it is from the ground, whether it stands there and
//! how it slips; [`SelfCollision`] which parts of a body are inside each other. All of it comes from the solids of the body and
//! is exact up to rounding: nothing is guessed from the speed of a joint. Another surface, such as a skin, takes the solids'
//! place by implementing [`Surface`].

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
pub(crate) use ground_contacts::{Clip, link_frames};
pub use ground_contacts::{ContactTrack, GroundContact, GroundContacts, check_feet};
pub use ground_quality::GroundQuality;
pub use interpenetration::{Depths, Interpenetration, InterpenetrationScratch};
pub use prop_contacts::{PropContact, PropContacts, PropTrack};
pub use rule::ContactRule;
pub use self_collision::{Collision, LeftOut, LinkPair, SelfCollision};
pub use solid_distance::solid_distance;
pub use stance::{FOOT_NAMES, Stance, stances};
pub use surface::{Surface, SurfacePoint};
