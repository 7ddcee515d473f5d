//! What meshes of every format are read into.

use nalgebra::Point3;

/// Vertices, and triangles that index them.
pub(super) type Mesh = (Vec<Point3<f64>>, Vec<[u32; 3]>);
