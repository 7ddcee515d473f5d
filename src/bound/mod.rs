//! The least error that any tracker can have from given observations, and the cameras that make it small.

mod least_error;
mod noise;
mod output;
mod placement;
mod placement_picture;
mod scene;
mod unseen;

pub use least_error::{BoundOptions, BoundReport, ComparedRun, ErrorBound, FrameBound, JointBound, SourceBound, bound};
pub use output::write_bound;
pub use placement::{Candidates, ChosenCamera, Placement, PlacementOptions, place, write_placement};
pub use scene::BoundScene;
