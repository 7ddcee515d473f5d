//! Errors of planting and simulation.

use skiagraph_core::contact::ContactError;

/// Errors of planting and simulation.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PhysicsError {
    /// Contact cannot be computed, or a setting is invalid.
    #[error(transparent)]
    Contact(#[from] ContactError),
    /// A body or a motion that cannot be simulated, or a simulation that diverged.
    #[error("{0}")]
    Refused(String),
}
