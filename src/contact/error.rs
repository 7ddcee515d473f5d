//! Why contact cannot be told.

/// Why contact cannot be told.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
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
    #[error("frame {frame}: the pose has {found} joint angles, {body:?} has {expected} degrees of freedom")]
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
    /// A link has no place.
    #[error(
        "frame {frame}: link {link:?} is at a place that is not finite; look for NaN or huge numbers in the motion"
    )]
    NotFinite {
        /// Frame number.
        frame: usize,
        /// The link's name.
        link: String,
    },
    /// Nothing can stand.
    #[error(
        "{body:?} has no {foot}: its link with the marker of the ankle and all links below have no geometry; give them a \
         <visual>, or the robot links named marker_left_ankle and marker_right_ankle"
    )]
    NoFoot {
        /// The body's name.
        body: String,
        /// Which foot.
        foot: &'static str,
    },
    /// A threshold makes no sense.
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
