//! Silhouettes from images of other cameras.

mod pictures;
mod segment;

pub use segment::{SEGMENT_FILE, SegmentInput, Segmented, segment};
