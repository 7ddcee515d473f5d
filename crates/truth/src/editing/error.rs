//! Errors of motion editing.

use skiagraph_core::contact::ContactError;
use skiagraph_core::input::plain;

/// Why a motion cannot be edited.
#[derive(Debug, thiserror::Error)]
pub enum EditError {
    /// Two takes have no similar poses.
    #[error(
        "`{}` cannot follow `{}`: their closest poses, at {leaves_s:.2} s of `{}` and {enters_s:.2} s of `{}`, are \
         {closest_mm:.0} mm apart, expected at most {limit_mm:.0} mm; use more similar takes or parts of takes, insert \
         another take between them, or increase `join.within_mm`",
        plain(to),
        plain(from),
        plain(from),
        plain(to)
    )]
    Apart {
        /// Index of the following take, from 0; 0 for a take that follows itself.
        index: usize,
        /// Name of the first take.
        from: String,
        /// Name of the following take.
        to: String,
        /// Least distance between their poses, mm.
        closest_mm: f64,
        /// Time of that pose in the first take, seconds from its start.
        leaves_s: f64,
        /// Time of that pose in the following take, seconds from its start.
        enters_s: f64,
        /// Largest accepted distance, mm.
        limit_mm: f64,
    },
    /// A take shorter than a blend needs.
    #[error(
        "`{}` is too short to be joined: expected at least {:.2} s ({needed} frames at {frames_per_second} Hz), twice the \
         duration of a blend, found {:.2} s ({frames} frames); use a longer part of it, or reduce `join.blend_s`",
        plain(take),
        *needed as f64 / frames_per_second,
        *frames as f64 / frames_per_second
    )]
    Short {
        /// Index of the take, from 0.
        index: usize,
        /// Name of the take.
        take: String,
        /// Frames per second.
        frames_per_second: f64,
        /// Number of frames.
        frames: usize,
        /// Least number of frames.
        needed: usize,
    },
    /// A path that feet cannot follow or that has too few waypoints, or a motion that stays in place, or whose own path
    /// bends during a stance while the given one does not.
    #[error("{0}")]
    Path(String),
    /// The stances of the feet cannot be determined.
    #[error(transparent)]
    Contact(#[from] ContactError),
}
