//! The physics of a body's motion: balance and forces, feet planted on the ground, and simulation.
//!
//! [`Dynamics`] tells of a motion where its weight is, what it stands on and which forces it takes; [`fix`] moves a motion as
//! little as planted feet and a ground that nothing sinks into ask for; [`simulate`] drives a body towards a motion under gravity.

mod constants;
mod dynamics;
mod error;
mod planting;
mod simulation;

pub use constants::GRAVITY;
pub use dynamics::{Dynamics, DynamicsFrame, DynamicsSummary, Efforts, GROUND_FRICTION, PointForce, inverse_dynamics};
pub use error::PhysicsError;
pub use planting::{FixReport, Fixed, MostMoved, fix};
pub use simulation::{Push, Simulated, SimulationReport, SimulationSettings, simulate};
