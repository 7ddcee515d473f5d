//! The physics of a body's motion: balance and forces, feet planted on the ground, and simulation.
//!
//! [`Dynamics`] computes balance, support and forces of a motion; [`plant_feet`] changes a motion as little as possible
//! so that standing feet are planted and nothing is below the ground; [`simulate`] drives a body towards a motion under
//! gravity.

mod constants;
mod dynamics;
mod error;
mod planting;
mod simulation;

pub use constants::GRAVITY;
pub use dynamics::{Dynamics, DynamicsFrame, DynamicsSummary, Efforts, GROUND_FRICTION, PointForce, inverse_dynamics};
pub use error::PhysicsError;
pub use planting::{MostMoved, PlantedMotion, PlantingReport, plant_feet};
pub use simulation::{Push, Simulated, SimulationReport, SimulationSettings, simulate};
