//! Whether most of an estimate's error would go away if its numbers were read in another way.
//!
//! A file whose vertical axis, unit, sides, frames, origin or names are not what they are taken for gives a large error
//! that looks like a poor tracker's. [`find_misreading`] searches a small family of explanations: the 48 orders of the
//! axes with their signs, known units of length, left and right exchanged, frames shifted by up to a second, another
//! origin, names given to other markers, and what can be combined of these. `rule.rs` has the limits that an
//! explanation must keep; poor trackers must not be accused. The main guards are these:
//!
//! - what is wrong with a file is wrong from its first frame on and in nearly every frame, whereas a tracker starts
//!   from a pose that it was given and is lost later;
//! - of a combination every part must remove much of the error that is left without it;
//! - turns and mirrors that keep the vertical must mend the path of the body, not its pose alone: silhouettes can be
//!   explained by a body that faces the other way or is mirrored in depth;
//! - a delay is only told where all parts of the body have the same in all parts of the clip, and it does not smooth.

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
