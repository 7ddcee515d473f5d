//! Samples of outlines: points on a body's surface that a camera's rays graze.

use nalgebra::{Point3, Vector3};

use super::is_on_the_contour;
use skiagraph_core::camera::Pinhole;
use skiagraph_core::raster::Mask;

/// A point on a body's surface that a ray from a camera grazes.
#[derive(Clone, Copy, Debug)]
pub(in crate::tracker) struct OutlineSample {
    pub(in crate::tracker) link: usize,
    /// Position on the link's solid.
    pub(in crate::tracker) spot: SolidPlace,
    /// Position in the camera's frame, metres.
    pub(in crate::tracker) point: Point3<f64>,
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

pub(super) struct SampleSink<'a> {
    pub(super) link: usize,
    pub(super) solid: u32,
    pub(super) pinhole: &'a Pinhole,
    /// The drawn body; if given, only samples on its contour are collected.
    pub(super) drawn: Option<&'a Mask>,
    pub(super) samples: &'a mut Vec<OutlineSample>,
}

impl SampleSink<'_> {
    /// Pixel of a point in the camera's frame; `None` if it is not beyond the near plane.
    pub(super) fn project(&self, point: &Point3<f64>) -> Option<[f64; 2]> {
        let Pinhole { focal, principal_point, near, .. } = self.pinhole;
        (point.z >= *near).then(|| [0, 1].map(|i| principal_point[i] + focal[i] * point[i] / point.z))
    }

    /// Adds a sample at a share of the way between two points of the solid; `normal` is its unit normal in the image.
    pub(super) fn push(&mut self, point: Point3<f64>, normal: [f64; 2], ends: [u32; 2], share: f64) {
        if let Some(pixel) = self.project(&point) {
            let spot = SolidPlace { solid: self.solid, ends, share };
            let sample = OutlineSample { link: self.link, spot, point, pixel, normal };
            if self.drawn.is_none_or(|drawn| is_on_the_contour(&sample, drawn)) {
                self.samples.push(sample);
            }
        }
    }

    /// The unit normal in the image of points with the surface normal `normal`, which is perpendicular to their rays:
    /// the plane through the camera's centre with that normal projects to a line, whose normal in pixels it is.
    pub(super) fn grazed_normal(&self, normal: &Vector3<f64>) -> Option<[f64; 2]> {
        let [fx, fy] = self.pinhole.focal;
        unit([normal.x / fx, normal.y / fy])
    }
}

/// The unit vector in a direction; `None` for one that has none.
pub(super) fn unit(direction: [f64; 2]) -> Option<[f64; 2]> {
    let norm = (direction[0] * direction[0] + direction[1] * direction[1]).sqrt();
    let unit = direction.map(|n| n / norm);
    unit.iter().all(|n| n.is_finite()).then_some(unit)
}
