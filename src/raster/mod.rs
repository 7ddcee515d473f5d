//! Bit-packed silhouettes and what is measured on them.
//!
//! [`CapsulePainter`] draws what a [`crate::camera::Pinhole`] sees of [`TaperedCapsule`]s into a [`Mask`];
//! [`SilhouetteComparer`] does the same thousands of times a frame against one observed mask. [`paint_polygon`] and
//! [`paint_triangles`] fill everything else, [`MeshTopology`] fine meshes by their outline. Everything is in the ideal
//! (undistorted) pixels of a pinhole.

mod bounds;
mod capsules;
mod comparer;
mod contour;
mod contour_distance;
mod distance;
mod mask;
mod mesh_silhouette;
mod outline;
mod overlap;
mod polygon;
mod signed_distance;
mod specks;
mod strips;
mod tapered_capsule;
mod triangles;

pub use bounds::PixelBounds;
pub use capsules::{CapsulePainter, SilhouetteScratch};
pub use comparer::{Comparison, SilhouetteComparer};
pub use contour::contour;
pub use distance::DistanceMap;
pub use mask::Mask;
pub use mesh_silhouette::{MeshScratch, MeshTopology};
pub use overlap::{Overlap, overlap};
pub use polygon::paint_polygon;
pub use signed_distance::{DistanceSample, SignedDistance};
pub use specks::without_specks;
pub use tapered_capsule::TaperedCapsule;
pub use triangles::paint_triangles;
