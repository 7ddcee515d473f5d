//! Whether most of an estimate's error would go away if its numbers were read in another way.
//!
//! If a file's vertical axis, unit, sides, frames, origin or names differ from those assumed, the error is as large as
//! a poor tracker's. [`find_misreading`] searches a small family of explanations: the 48 signed orders of the axes,
//! known units of length, left and right exchanged, frames shifted by up to a second, another origin, names of other
//! markers, and combinations of these. `rule.rs` has the conditions that an explanation must meet, because poor
//! trackers must not be taken for misread files. The main conditions are:
//!
//! - the error of a misread file is present from its first frame on and in nearly every frame, whereas a tracker starts
//!   from a given pose and is lost later;
//! - every part of a combination must remove much of the error that remains without it;
//! - rotations and mirrors that keep the vertical must correct the path of the body, not only its pose: a body that
//!   faces the other way or is mirrored in depth can have the same silhouettes;
//! - a delay is reported only if all parts of the body have the same delay in all parts of the clip, without smoothing.

mod assignment;
mod axis_order;
mod case;
mod correction;
mod evidence;
mod lateness;
mod naming;
mod rule;
mod search;
#[cfg(test)]
mod tests;

pub use axis_order::AxisOrder;
pub use case::{Misreading, MisreadingCase};
pub use correction::{Correction, GivenPositions, MisreadingKind, marker_of_other_side, with_sides_exchanged};
pub use search::find_misreading;
