//! Whether most of an estimate's error would go away if its numbers were read in another way.
//!
//! [`find_misreading`] is one search over a table of explanations: other readings (sides exchanged, angles in another
//! unit, differences between frames), names, times, roots, turns, scales and origins, alone and combined. Each is
//! scored by the error that remains, and the best one wins; every further part must halve the error. An explanation is
//! reported if it removes at least 90 % of the error. Explanations that a tracker's own errors resemble have further
//! conditions (`search.rs`).

mod axis_order;
mod correction;
mod fit;
mod search;
#[cfg(test)]
mod tests;

pub use axis_order::AxisOrder;
pub use correction::{Correction, FileTime, MisreadingKind, Root, Turn, marker_of_other_side, with_sides_exchanged};
pub use search::{Misreading, MisreadingCase, Reading, find_misreading};
