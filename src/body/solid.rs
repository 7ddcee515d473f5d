//! The solids of a body, as cameras see them.

use nalgebra::{Isometry3, Point3};

use crate::raster::TaperedCapsule;

/// One solid on a link, in the link's frame; metres.
#[derive(Clone, Debug, PartialEq)]
pub enum Solid {
    /// A sphere, a capsule or a tapered capsule.
    TaperedCapsule(TaperedCapsule),
    /// A box.
    Box {
        /// The box's centred frame.
        link_from_box: Isometry3<f64>,
        /// Half its edge lengths.
        half_extents: [f64; 3],
    },
    /// A cylinder along its own z axis.
    Cylinder {
        /// The cylinder's centred frame.
        link_from_cylinder: Isometry3<f64>,
        /// Radius.
        radius: f64,
        /// Half its length.
        half_length: f64,
    },
    /// A triangle mesh.
    Mesh {
        /// Vertices in the link's frame.
        vertices: Vec<Point3<f64>>,
        /// Indices into `vertices`.
        triangles: Vec<[u32; 3]>,
    },
}
