//! Errors of contact.

use crate::input::excerpt;

/// Errors of contact.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ContactError {
    /// The motion has no pose, or no rate.
    #[error(
        "the motion has {poses} poses at {frames_per_second} frames a second; expected at least one, and a rate above zero"
    )]
    EmptyMotion {
        /// Number of poses.
        poses: usize,
        /// The rate.
        frames_per_second: f64,
    },
    /// A pose belongs to another body.
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
        "frame {frame} (from 0): the position of link {:?} is not finite; look for NaN or huge numbers in the motion",
        excerpt(link)
    )]
    NotFinite {
        /// Frame number.
        frame: usize,
        /// The link's name.
        link: String,
    },
    /// A foot has no geometry.
    #[error(
        "{:?} has no {foot}: its link with the marker of the ankle and all links below have no geometry; give them a \
         <visual>, or the robot links named marker_left_ankle and marker_right_ankle",
        excerpt(body)
    )]
    NoFoot {
        /// The body's name.
        body: String,
        /// Which foot.
        foot: &'static str,
    },
    /// A threshold is invalid.
    #[error("{key}: expected {expected}, found {found}")]
    Rule {
        /// Which threshold.
        key: &'static str,
        /// What it must be.
        expected: &'static str,
        /// What it is.
        found: f64,
    },
}
