//! Weighted normal equations of outline residuals, summed by link and then projected onto the components of a step.

use nalgebra::{DMatrix, DVector, Matrix6, Point3, Vector3, Vector6};

use super::observed::OutlineResidual;
use super::{OutlineSample, robust_weight};
use crate::motion_model::NormalEquations;
use skiagraph_core::body::{Humanoid, LinkFrames};
use skiagraph_core::camera::Camera;

/// Derivative of a residual, in lengths of `length` pixels, with respect to the world position of `point`, which is
/// given in the camera's frame; `gradient` is that in pixels with respect to the point's pixel.
pub(in crate::tracker) fn slide(camera: &Camera, point: &Point3<f64>, gradient: [f64; 2], length: f64) -> Vector3<f64> {
    let [fx, fy] = camera.pinhole.focal;
    let [gu, gv] = gradient.map(|g| g / length);
    let (du, dv) = (gu * fx / point.z, gv * fy / point.z);
    let in_camera = Vector3::new(du, dv, -(du * point.x + dv * point.y) / point.z);
    camera.camera_from_world.inverse_transform_vector(&in_camera)
}

/// Converts a derivative with respect to position into one with respect to a twist about a point at distance `arm`.
pub(in crate::tracker) fn wrench(slide: &Vector3<f64>, arm: &Vector3<f64>) -> Vector6<f64> {
    let turn = arm.cross(slide);
    Vector6::new(slide.x, slide.y, slide.z, turn.x, turn.y, turn.z)
}

/// A weighted residual of a point that is fixed to a link.
#[derive(Clone, Copy, Debug)]
pub(in crate::tracker) struct ImageResidual {
    pub(in crate::tracker) link: usize,
    /// Position in the camera's frame, metres.
    pub(in crate::tracker) point: Point3<f64>,
    /// Lengths.
    pub(in crate::tracker) value: f64,
    /// Derivative of the residual in pixels with respect to the point's pixel.
    pub(in crate::tracker) gradient: [f64; 2],
    /// Pixels per length.
    pub(in crate::tracker) length: f64,
    /// Weight of its square.
    pub(in crate::tracker) weight: f64,
}

/// Sums per link, for twists about a common point.
pub(in crate::tracker) struct Accumulator {
    about: Point3<f64>,
    links: Vec<(Matrix6<f64>, Vector6<f64>)>,
    cost: f64,
    weight: f64,
    residuals: usize,
}

impl Accumulator {
    /// Empty sums; `about` is any point near the body.
    pub(in crate::tracker) fn new(links: usize, about: Point3<f64>) -> Self {
        Self { about, links: vec![(Matrix6::zeros(), Vector6::zeros()); links], cost: 0.0, weight: 0.0, residuals: 0 }
    }

    /// Adds a residual with the robust weight of `width`, times `importance`; `width` and the residual are in lengths
    /// of `length` pixels. The sample is treated as fixed to its link.
    pub(in crate::tracker) fn add(
        &mut self,
        camera: &Camera,
        sample: &OutlineSample,
        residual: OutlineResidual,
        length: f64,
        width: f64,
        importance: f64,
    ) {
        let OutlineResidual { value, gradient, outline } = residual;
        let weight = importance * outline * robust_weight(value, width);
        let row = ImageResidual { link: sample.link, point: sample.point, value, gradient, length, weight };
        self.add_row(camera, &row);
    }

    pub(in crate::tracker) fn add_row(&mut self, camera: &Camera, residual: &ImageResidual) {
        let ImageResidual { link, point, value, gradient, length, weight } = *residual;
        let slide = slide(camera, &point, gradient, length);
        let arm = camera.camera_from_world.inverse_transform_point(&point) - self.about;
        let row = wrench(&slide, &arm);
        let (matrix, gradient) = &mut self.links[link];
        for j in 0..6 {
            let weighted = weight * row[j];
            for i in 0..=j {
                matrix[(i, j)] += row[i] * weighted;
            }
            gradient[j] += value * weighted;
        }
        self.cost += weight * value * value;
        self.weight += weight;
        self.residuals += 1;
    }

    /// Projects the sums onto the components of a step of `body`, whose links are at `frames`.
    pub(in crate::tracker) fn finish(self, body: &Humanoid, frames: &LinkFrames) -> NormalEquations {
        let numbers = body.step_len();
        let (mut matrix, mut gradient) = (DMatrix::zeros(numbers, numbers), DVector::zeros(numbers));
        let mut twists = Vec::new();
        for (link, (mut own, force)) in self.links.into_iter().enumerate() {
            own.fill_lower_triangle_with_upper_triangle();
            if own.trace() <= 0.0 {
                continue;
            }
            body.step_twists(frames, link, &self.about, &mut twists);
            let twists: Vec<(usize, Vector6<f64>)> =
                twists.iter().map(|(i, [v, w])| (*i, Vector6::new(v.x, v.y, v.z, w.x, w.y, w.z))).collect();
            for (i, twist) in &twists {
                let pushed = own * twist;
                gradient[*i] += force.dot(twist);
                for (j, other) in &twists {
                    matrix[(*i, *j)] += pushed.dot(other);
                }
            }
        }
        let Self { cost, weight, residuals, .. } = self;
        NormalEquations { matrix, gradient, cost, weight, residuals, prior_weight: 1.0 }
    }
}
