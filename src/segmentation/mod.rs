//! Silhouettes from images of other cameras.

pub(crate) mod pictures;
mod segment;

pub use segment::{SEGMENT_FILE, SegmentInput, Segmented, segment};
