//! The solids of a body, as cameras see them.

use nalgebra::{Isometry3, Point3};

use crate::raster::TaperedCapsule;

/// Least radius or half edge of a solid after shrinking, metres.
const LEAST: f64 = 0.001;

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

impl Solid {
    /// The solid with its surface moved outwards by `by` metres (inwards if negative): radii and half lengths of edges
    /// grow by it. A mesh is scaled about its middle so that its extents do.
    #[doc(hidden)]
    pub fn inflated(&self, by: f64) -> Self {
        let grown = |size: f64| (size + by).max(LEAST);
        match self {
            Self::TaperedCapsule(capsule) => Self::TaperedCapsule(TaperedCapsule {
                radius_a: grown(capsule.radius_a),
                radius_b: grown(capsule.radius_b),
                ..*capsule
            }),
            Self::Box { link_from_box, half_extents } => {
                Self::Box { link_from_box: *link_from_box, half_extents: half_extents.map(grown) }
            }
            Self::Cylinder { link_from_cylinder, radius, half_length } => Self::Cylinder {
                link_from_cylinder: *link_from_cylinder,
                radius: grown(*radius),
                half_length: grown(*half_length),
            },
            Self::Mesh { vertices, triangles } => {
                let (low, high) = vertex_bounds(vertices);
                let middle = nalgebra::center(&low, &high);
                let factors = (0.5 * (high - low)).map(|half| grown(half) / half.max(LEAST));
                let vertices = vertices.iter().map(|v| middle + (v - middle).component_mul(&factors)).collect();
                Self::Mesh { vertices, triangles: triangles.clone() }
            }
        }
    }
}

/// Opposite corners of the axis-aligned box around vertices.
pub(super) fn vertex_bounds(vertices: &[Point3<f64>]) -> (Point3<f64>, Point3<f64>) {
    let first = vertices.first().copied().unwrap_or(Point3::origin());
    vertices.iter().fold((first, first), |(low, high), v| (low.inf(v), high.sup(v)))
}

/// A solid fixed in the world.
#[derive(Clone, Debug, PartialEq)]
pub struct Prop {
    /// Its name.
    pub name: String,
    /// Its shape and position; the link frame of [`Solid`] is the world frame here.
    pub solid: Solid,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_solid_grows_equally_on_every_side() {
        let ball =
            TaperedCapsule { a: Point3::origin(), b: Point3::new(0.0, 0.0, 0.3), radius_a: 0.05, radius_b: 0.04 };
        let Solid::TaperedCapsule(grown) = Solid::TaperedCapsule(ball).inflated(0.01) else {
            panic!("a capsule stays one")
        };
        assert!((grown.radius_a - 0.06).abs() < 1e-12 && (grown.radius_b - 0.05).abs() < 1e-12 && grown.b == ball.b);
        let corners = [[0.0, 0.0, 0.0], [0.2, 0.0, 0.0], [0.0, 0.4, 0.0], [0.0, 0.0, 0.6]].map(Point3::from);
        let mesh = Solid::Mesh { vertices: corners.to_vec(), triangles: vec![[0, 1, 2]] };
        let Solid::Mesh { vertices, .. } = mesh.inflated(0.01) else { panic!("a mesh stays one") };
        let (low, high) = vertex_bounds(&vertices);
        assert!((low - Point3::new(-0.01, -0.01, -0.01)).norm() < 1e-12, "{low}");
        assert!((high - Point3::new(0.21, 0.41, 0.61)).norm() < 1e-12, "{high}");
        let Solid::TaperedCapsule(gone) = Solid::TaperedCapsule(ball).inflated(-1.0) else {
            panic!("a capsule stays one")
        };
        assert!(gone.radius_a > 0.0, "radii remain positive");
    }
}
