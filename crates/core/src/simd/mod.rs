//! Loops that are compiled for several instruction sets, the best of which is chosen when they run.
//!
//! Sums run in lanes of a fixed number and nothing is fused, so that all builds give the same bits.

mod dispatch;
mod lanes;

pub use dispatch::{Dispatched, dispatch};
pub use lanes::{add_scaled, dot, scaled_exponentials, sum};
