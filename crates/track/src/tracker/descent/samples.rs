//! Samples of outlines: points on a body's surface that a camera's rays graze.

use nalgebra::{Point3, Vector3};

use crate::camera::Pinhole;

/// A point on a body's surface that a ray from a camera grazes.
#[derive(Clone, Copy, Debug)]
pub(in crate::tracker) struct OutlineSample {
    /// Index of its link.
    pub(in crate::tracker) link: usize,
    /// Position on the link's solid.
    pub(in crate::tracker) spot: SolidPlace,
    /// Position in the camera's frame, metres.
    pub(in crate::tracker) point: Point3<f64>,
    /// Position in the image.
    pub(in crate::tracker) pixel: [f64; 2],
    /// Unit vector in the image, pointing away from the solid.
    pub(in crate::tracker) normal: [f64; 2],
}

impl OutlineSample {
    /// The surface's outward unit normal at the sample, in the camera's frame: the normal of the plane through the
    /// camera's centre that touches the surface there.
    pub(in crate::tracker) fn surface_normal(&self, pinhole: &Pinhole) -> Vector3<f64> {
        let ([fx, fy], [cx, cy]) = (pinhole.focal, pinhole.principal_point);
        let ([nu, nv], [u, v]) = (self.normal, self.pixel);
        Vector3::new(nu * fx, nv * fy, nu * (cx - u) + nv * (cy - v)).normalize()
    }
}

/// Position of a sample on a link's solid, which determines how it moves when the body's shape changes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(in crate::tracker) struct SolidPlace {
    /// Index of the solid on its link.
    pub(in crate::tracker) solid: u32,
    /// Two points of the solid: the ends of a capsule's axis (0 and 1), or vertices of its surface.
    pub(in crate::tracker) ends: [u32; 2],
    /// Share of the way between them.
    pub(in crate::tracker) share: f64,
}

/// Collects the samples of one link.
pub(super) struct SampleSink<'a> {
    pub(super) link: usize,
    pub(super) solid: u32,
    pub(super) pinhole: &'a Pinhole,
    pub(super) samples: &'a mut Vec<OutlineSample>,
}

impl SampleSink<'_> {
    /// Pixel of a point in the camera's frame; `None` if it is not beyond the near plane.
    pub(super) fn project(&self, point: &Point3<f64>) -> Option<[f64; 2]> {
        let Pinhole { focal, principal_point, near, .. } = self.pinhole;
        (point.z >= *near).then(|| [0, 1].map(|i| principal_point[i] + focal[i] * point[i] / point.z))
    }

    /// Adds a sample at a share of the way between two points of the solid; `normal` is the direction of its normal in
    /// the image and may have any length.
    pub(super) fn push(&mut self, point: Point3<f64>, normal: [f64; 2], ends: [u32; 2], share: f64) {
        let norm = (normal[0] * normal[0] + normal[1] * normal[1]).sqrt();
        let normal = normal.map(|n| n / norm);
        if let (Some(pixel), true) = (self.project(&point), normal[0].is_finite() && normal[1].is_finite()) {
            let spot = SolidPlace { solid: self.solid, ends, share };
            self.samples.push(OutlineSample { link: self.link, spot, point, pixel, normal });
        }
    }

    /// Adds a sample with the surface normal `normal`, which is perpendicular to its ray: the plane through the
    /// camera's centre with that normal projects to a line, and the normal of that line in pixels is the sample's.
    pub(super) fn push_grazed(&mut self, point: Point3<f64>, normal: &Vector3<f64>, ends: [u32; 2], share: f64) {
        let [fx, fy] = self.pinhole.focal;
        self.push(point, [normal.x / fx, normal.y / fy], ends, share);
    }
}
