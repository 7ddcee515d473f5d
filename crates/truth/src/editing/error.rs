//! Errors of editing.

use crate::contact::ContactError;
use crate::input::plain;

/// Why a motion cannot be edited as asked.
#[derive(Debug, thiserror::Error)]
pub enum EditError {
    /// Two takes are nowhere alike.
    #[error(
        "`{}` cannot follow `{}`: their closest poses, at {leaves_s:.2} s of `{}` and {enters_s:.2} s of `{}`, are \
         {closest_mm:.0} mm apart, and at most {limit_mm:.0} mm are joined; use takes, or parts of them, that are more \
         alike, put one between them, or raise `join.within_mm`",
        plain(to),
        plain(from),
        plain(from),
        plain(to)
    )]
    Apart {
        /// Which of the takes that one is that should follow, from 0; 0 for a take that should follow itself.
        index: usize,
        /// The take that is left.
        from: String,
        /// The take that should follow.
        to: String,
        /// The least distance between their poses, mm.
        closest_mm: f64,
        /// Where that is in the take that is left, seconds from its beginning.
        leaves_s: f64,
        /// Where that is in the take that follows, seconds from its beginning.
        enters_s: f64,
        /// The greatest distance that is joined, mm.
        limit_mm: f64,
    },
    /// A take that a blend does not fit into.
    #[error(
        "`{}` is too short to be joined: expected at least {:.2} s ({needed} frames at {frames_per_second} Hz), twice the \
         time of a blend, found {:.2} s ({frames} frames); use more of it, or a shorter `join.blend_s`",
        plain(take),
        *needed as f64 / frames_per_second,
        *frames as f64 / frames_per_second
    )]
    Short {
        /// Which of the takes that is, from 0.
        index: usize,
        /// The take.
        take: String,
        /// Frames a second.
        frames_per_second: f64,
        /// Its frames.
        frames: usize,
        /// The least number of frames.
        needed: usize,
    },
    /// A path that feet cannot follow.
    #[error(
        "the path turns faster than feet can follow: by {turn_deg:.0} degrees at ({x:.2}, {y:.2}) m while the {foot} \
         stands from {from_s:.2} s to {to_s:.2} s, and a hip allows {limit_deg:.0} degrees; widen the curve there"
    )]
    TurnsTooFast {
        /// The turn during the stance, degrees.
        turn_deg: f64,
        /// The greatest turn, degrees.
        limit_deg: f64,
        /// Where, metres.
        x: f64,
        /// Where, metres.
        y: f64,
        /// Which foot stands.
        foot: &'static str,
        /// When its stance begins, seconds.
        from_s: f64,
        /// When it ends, seconds.
        to_s: f64,
    },
    /// A recording whose own way bends while a foot stands, where the path does not.
    #[error(
        "the recording itself turns, reverses or stands from {from_s:.2} s to {to_s:.2} s: its own way bends by \
         {turn_deg:.0} degrees while the {foot} stands, the path by only {path_deg:.0}, and a hip allows {limit_deg:.0} \
         degrees; lead another part of it (`first_frame`, `last_frame`), or the parts before and after it one after the \
         other (`motion.then`)"
    )]
    RecordingTurns {
        /// By how much the body would have to turn during the stance, degrees.
        turn_deg: f64,
        /// The turn of the path there, degrees.
        path_deg: f64,
        /// The greatest turn, degrees.
        limit_deg: f64,
        /// Which foot stands.
        foot: &'static str,
        /// When its stance begins, seconds.
        from_s: f64,
        /// When it ends, seconds.
        to_s: f64,
    },
    /// A motion that does not get anywhere.
    #[error("a path needs a motion that travels; this one travels {travelled_m:.2} m, expected at least {least_m} m")]
    StaysInPlace {
        /// How far it travels, metres.
        travelled_m: f64,
        /// The least distance, metres.
        least_m: f64,
    },
    /// Waypoints that are no path.
    #[error("expected at least two waypoints, each at least {least_m} m from the one before, found {found}")]
    Waypoints {
        /// What is wrong with them.
        found: String,
        /// The least distance, metres.
        least_m: f64,
    },
    /// The stances of the feet cannot be found.
    #[error(transparent)]
    Contact(#[from] ContactError),
}
