//! Errors of contact.

use crate::body::Motion;

/// Errors of contact.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ContactError {
    /// A motion that is empty, not finite or of another body, an invalid threshold, or a foot without geometry.
    #[error("{0}")]
    Refused(String),
}

impl ContactError {
    /// The motion has no pose, or no frame rate.
    #[doc(hidden)]
    pub fn of_empty(motion: &Motion) -> Self {
        Self::Refused(format!(
            "the motion has {} poses at {} frames a second; expected at least one pose and a rate above 0",
            motion.poses.len(),
            motion.frames_per_second
        ))
    }

    /// An invalid value of a key.
    #[doc(hidden)]
    pub fn of_key(key: &str, expected: &str, found: f64) -> Self {
        Self::Refused(format!("{key}: expected {expected}, found {found}"))
    }
}
