//! Errors of dynamics.

use crate::contact::ContactError;
use crate::input::excerpt;

/// What has no dynamics.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DynamicsError {
    /// Contact cannot be computed, or a setting is invalid.
    #[error(transparent)]
    Contact(#[from] ContactError),
    /// A body without mass.
    #[error("no link of {:?} has mass; give them an <inertial>", excerpt(body))]
    NoMass {
        /// The body's name.
        body: String,
    },
}
