//! What touches: the ground under a body, the body itself, and whether a motion could have happened.
//!
//! [`GroundContacts`] says for every link and foot, frame by frame, how far it is from the ground, whether it stands there and
//! how it slips; [`SelfCollision`] which parts of a body are inside each other. All of it comes from the solids of the body and
//! is exact up to rounding: nothing is guessed from the speed of a joint. Another surface, such as a skin, takes the solids'
//! place by implementing [`Surface`].

mod bounds;
mod capsule_distance;
mod dynamics;
mod error;
mod fix;
mod fix_report;
mod foot_paths;
mod ground_contacts;
mod ground_quality;
mod interpenetration;
mod lifts;
mod out_of_ground;
mod placing;
mod prop_contacts;
mod rule;
mod self_collision;
mod simulation;
mod solid_distance;
mod stance;
mod surface;

pub use capsule_distance::tapered_capsule_distance;
pub use dynamics::{Dynamics, DynamicsFrame, DynamicsSummary, Efforts, GROUND_FRICTION, PointForce, inverse_dynamics};
pub use error::ContactError;
pub use fix::{Fixed, fix};
pub use fix_report::{FixReport, MostMoved};
pub use ground_contacts::{ContactTrack, GroundContact, GroundContacts, check_feet};
pub use ground_quality::GroundQuality;
pub use interpenetration::{Depths, Interpenetration, InterpenetrationScratch};
pub use prop_contacts::{PropContact, PropContacts, PropTrack};
pub use rule::ContactRule;
pub use self_collision::{Collision, LeftOut, LinkPair, SelfCollision};
pub use simulation::{GRAVITY, Push, Simulated, SimulationReport, SimulationSettings, simulate};
pub use solid_distance::solid_distance;
pub use stance::{FOOT_NAMES, Stance, stances};
pub use surface::{Surface, SurfacePoint};
