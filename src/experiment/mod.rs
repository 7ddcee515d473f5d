//! Scenarios and what is done with them: the only room that knows every other.

mod error;
mod partial_directory;
mod scenario;

pub use error::ExperimentError;
pub use scenario::*;
