//! Samples of outlines: points of a body's surface that a camera's rays graze.

use nalgebra::{Point3, Vector3};

use crate::camera::Pinhole;

/// A point of a body's surface at which the ray from a camera grazes it.
#[derive(Clone, Copy, Debug)]
pub(in crate::tracker) struct OutlineSample {
    /// The link that it belongs to.
    pub(in crate::tracker) link: usize,
    /// Where on the link's solid it is.
    pub(in crate::tracker) spot: SolidPlace,
    /// In the camera's frame, metres.
    pub(in crate::tracker) point: Point3<f64>,
    /// Where the camera sees it.
    pub(in crate::tracker) pixel: [f64; 2],
    /// Unit vector in the image, away from the solid.
    pub(in crate::tracker) normal: [f64; 2],
}

impl OutlineSample {
    /// The surface's outward unit normal at the sample, in the camera's frame: that of the plane through the camera's
    /// centre which touches the surface there.
    pub(in crate::tracker) fn surface_normal(&self, pinhole: &Pinhole) -> Vector3<f64> {
        let ([fx, fy], [cx, cy]) = (pinhole.focal, pinhole.principal_point);
        let ([nu, nv], [u, v]) = (self.normal, self.pixel);
        Vector3::new(nu * fx, nv * fy, nu * (cx - u) + nv * (cy - v)).normalize()
    }
}

/// Where on the solid of a link a sample is: what a change of the body's shape moves it with.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(in crate::tracker) struct SolidPlace {
    /// Number of the solid on its link.
    pub(in crate::tracker) solid: u32,
    /// Between which two of the solid's points: the ends of a capsule's axis (0 and 1), else vertices of its surface.
    pub(in crate::tracker) ends: [u32; 2],
    /// Share of the way between them.
    pub(in crate::tracker) share: f64,
}

/// Where samples of one link go.
pub(super) struct SampleSink<'a> {
    pub(super) link: usize,
    pub(super) solid: u32,
    pub(super) pinhole: &'a Pinhole,
    pub(super) samples: &'a mut Vec<OutlineSample>,
}

impl SampleSink<'_> {
    /// Pixel of a point of the camera's frame; `None` before the near plane.
    pub(super) fn project(&self, point: &Point3<f64>) -> Option<[f64; 2]> {
        let Pinhole { focal, principal_point, near, .. } = self.pinhole;
        (point.z >= *near).then(|| [0, 1].map(|i| principal_point[i] + focal[i] * point[i] / point.z))
    }

    /// Adds a sample at a share of the way between two of the solid's points, whose normal in the image is along
    /// `normal`, of any length.
    pub(super) fn push(&mut self, point: Point3<f64>, normal: [f64; 2], ends: [u32; 2], share: f64) {
        let norm = (normal[0] * normal[0] + normal[1] * normal[1]).sqrt();
        let normal = normal.map(|n| n / norm);
        if let (Some(pixel), true) = (self.project(&point), normal[0].is_finite() && normal[1].is_finite()) {
            let spot = SolidPlace { solid: self.solid, ends, share };
            self.samples.push(OutlineSample { link: self.link, spot, point, pixel, normal });
        }
    }

    /// Adds a sample at which the surface's own normal is `normal`, perpendicular to the ray through it: the plane
    /// through the camera's centre with that normal is seen as a line whose normal in pixels is this.
    pub(super) fn push_grazed(&mut self, point: Point3<f64>, normal: &Vector3<f64>, ends: [u32; 2], share: f64) {
        let [fx, fy] = self.pinhole.focal;
        self.push(point, [normal.x / fx, normal.y / fy], ends, share);
    }
}
