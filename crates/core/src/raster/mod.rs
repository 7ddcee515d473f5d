//! Bit-packed silhouettes and measurements on them.
//!
//! [`CapsulePainter`] draws [`TaperedCapsule`]s as seen by a [`crate::camera::Pinhole`] into a [`Mask`];
//! [`SilhouetteComparer`] does the same thousands of times per frame against one observed mask. [`paint_polygon`] and
//! [`paint_triangles`] fill everything else, [`MeshTopology`] fine meshes by their outline. Everything is in the ideal
//! (undistorted) pixels of a pinhole.
//!
//! ```
//! use nalgebra::Point3;
//! use skiagraph_core::camera::Pinhole;
//! use skiagraph_core::raster::{CapsulePainter, Mask, TaperedCapsule, overlap};
//! let pinhole = Pinhole { focal: [100.0; 2], principal_point: [80.0, 60.0], width: 160, height: 120, near: 0.05 };
//! let arm = |x: f64| TaperedCapsule {
//!     a: Point3::new(x, -0.3, 2.0),
//!     b: Point3::new(x, 0.3, 2.0),
//!     radius_a: 0.05,
//!     radius_b: 0.04,
//! };
//! let [here, beside] = [0.0, 0.02].map(|x| {
//!     let mut mask = Mask::new(160, 120);
//!     CapsulePainter::new(&pinhole).paint(&[arm(x)], &mut mask);
//!     mask
//! });
//! assert!(overlap(&here, &beside).iou() < 1.0);
//! ```

mod bounds;
mod capsules;
mod comparer;
mod contour;
mod contour_distance;
mod distance;
mod mask;
mod mesh_silhouette;
mod mesh_topology;
mod morphology;
mod outline;
mod overlap;
mod polygon;
mod ray_strip;
mod signed_distance;
mod specks;
mod strips;
mod tapered_capsule;
mod triangles;

pub use mask::Mask;
pub(crate) use ray_strip::{RayStrip, STRIP_RAYS, entries_of_rays, rays_that_meet};
#[cfg(test)]
pub(crate) use tapered_capsule::tests::distance_by_search;

// How silhouettes are drawn and compared, for the other crates, benches and tests: it changes with every speed-up.
#[doc(hidden)]
pub use self::{
    bounds::PixelBounds,
    capsules::{CapsulePainter, SilhouetteScratch},
    comparer::{MaskComparison, SilhouetteComparer},
    contour::contour,
    distance::DistanceMap,
    mesh_silhouette::{MeshScratch, MeshVertices},
    mesh_topology::{MeshEdge, MeshTopology},
    morphology::{closed, grown_by_disc, opened},
    overlap::{Overlap, overlap},
    polygon::paint_polygon,
    signed_distance::{DistanceSample, SignedDistance},
    specks::{connected_regions, without_specks},
    tapered_capsule::TaperedCapsule,
    triangles::paint_triangles,
};
