//! A tracker checked by relations between its answers to a set and to a changed one.

mod check;
mod relations;

pub use check::{RelationCheck, TrackerCheck, check_tracker};
pub use relations::Relation;
