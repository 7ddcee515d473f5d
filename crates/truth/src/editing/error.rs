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
    /// A path that turns too fast for the feet.
    #[error(
        "the path turns faster than feet can follow: by {turn_deg:.0} degrees at ({x:.2}, {y:.2}) m during the stance of \
         the {foot} from {from_s:.2} s to {to_s:.2} s, expected at most {limit_deg:.0} degrees; widen the curve there"
    )]
    TurnsTooFast {
        /// Turn during the stance, degrees.
        turn_deg: f64,
        /// Largest accepted turn, degrees.
        limit_deg: f64,
        /// Position along X, metres.
        x: f64,
        /// Position along Y, metres.
        y: f64,
        /// The foot in stance.
        foot: &'static str,
        /// Start of the stance, seconds.
        from_s: f64,
        /// End of the stance, seconds.
        to_s: f64,
    },
    /// A recording whose own path bends during a stance while the given path does not.
    #[error(
        "the recording itself turns, reverses or stands from {from_s:.2} s to {to_s:.2} s: relative to the path it turns by \
         {turn_deg:.0} degrees during the stance of the {foot} (the path by {path_deg:.0}), expected at most \
         {limit_deg:.0} degrees; use another part of it (`first_frame`, `last_frame`), or join the parts before and after \
         (`motion.then`)"
    )]
    RecordingTurns {
        /// Turn of the body needed during the stance, degrees.
        turn_deg: f64,
        /// Turn of the path during the stance, degrees.
        path_deg: f64,
        /// Largest accepted turn, degrees.
        limit_deg: f64,
        /// The foot in stance.
        foot: &'static str,
        /// Start of the stance, seconds.
        from_s: f64,
        /// End of the stance, seconds.
        to_s: f64,
    },
    /// A motion that stays in place.
    #[error("a path requires a motion that travels at least {least_m} m; this one travels {travelled_m:.2} m")]
    StaysInPlace {
        /// Distance travelled, metres.
        travelled_m: f64,
        /// Least distance, metres.
        least_m: f64,
    },
    /// Waypoints that do not define a path.
    #[error("expected at least two waypoints, each at least {least_m} m from the previous one, found {found}")]
    Waypoints {
        /// What is wrong with them.
        found: String,
        /// Least distance, metres.
        least_m: f64,
    },
    /// The stances of the feet cannot be determined.
    #[error(transparent)]
    Contact(#[from] ContactError),
}
