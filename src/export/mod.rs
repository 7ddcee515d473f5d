//! Sets in the formats of other tools.

mod export_set;
mod video;

pub use export_set::{ExportTo, export_set};
