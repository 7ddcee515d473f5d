//! Errors of contact.

use crate::input::excerpt;

/// Errors of contact.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ContactError {
    /// The motion has no pose, or no frame rate.
    #[error(
        "the motion has {poses} poses at {frames_per_second} frames a second; expected at least one pose and a rate above 0"
    )]
    EmptyMotion {
        /// Number of poses.
        poses: usize,
        /// The rate.
        frames_per_second: f64,
    },
    /// The number of joint angles does not match the body.
    #[error(
        "frame {frame} (from 0): the pose has {found} joint angles, {:?} has {expected} degrees of freedom",
        excerpt(body)
    )]
    WrongBody {
        /// Frame number.
        frame: usize,
        /// Angles of the pose.
        found: usize,
        /// The body's name.
        body: String,
        /// Its degrees of freedom.
        expected: usize,
    },
    /// A link's position is not finite.
    #[error(
        "frame {frame} (from 0): the position of link {:?} is not finite; check the motion for NaN or huge numbers",
        excerpt(link)
    )]
    NotFinite {
        /// Frame number.
        frame: usize,
        /// The link's name.
        link: String,
    },
    /// An invalid threshold, or a foot without geometry.
    #[error("{0}")]
    Refused(String),
}

impl ContactError {
    /// An invalid value of a key.
    #[doc(hidden)]
    pub fn of_key(key: &str, expected: &str, found: f64) -> Self {
        Self::Refused(format!("{key}: expected {expected}, found {found}"))
    }
}
