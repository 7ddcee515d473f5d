//! Sets of recordings of people: masks, cameras and keypoints of other programs, a body, and a start without truth.

mod agreement;
mod keypoints;
mod making;
mod masks;
mod start;
mod triangulation;
mod video;

pub use making::{Imported, import};
