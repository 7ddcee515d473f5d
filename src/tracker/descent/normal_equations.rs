//! Weighted squares of residuals, gathered link by link and then spread over the numbers of a step.

use nalgebra::{DMatrix, DVector, Matrix6, Point3, Vector3, Vector6};

use super::OutlineSample;
use super::observed::Residual;
use crate::body::{Humanoid, LinkFrames};
use crate::camera::Camera;
use crate::motion_model::NormalEquations;

/// Sums per link, in twists about a common point.
pub(in crate::tracker) struct Accumulator {
    about: Point3<f64>,
    links: Vec<(Matrix6<f64>, Vector6<f64>)>,
    cost: f64,
    weight: f64,
    residuals: usize,
}

impl Accumulator {
    /// Nothing yet; `about` is any point near the body.
    pub(in crate::tracker) fn new(links: usize, about: Point3<f64>) -> Self {
        Self { about, links: vec![(Matrix6::zeros(), Vector6::zeros()); links], cost: 0.0, weight: 0.0, residuals: 0 }
    }

    /// Adds a residual with the robust weight of Geman and McClure, `1 / (1 + (r / width)^2)^2`; `width` and residual in lengths of
    /// `length` pixels. The sample is taken as fixed to its link.
    pub(in crate::tracker) fn add(
        &mut self,
        camera: &Camera,
        sample: &OutlineSample,
        residual: Residual,
        length: f64,
        width: f64,
    ) {
        let ratio = residual.value / width;
        let falloff = 1.0 / (1.0 + ratio * ratio);
        let weight = falloff * falloff;
        let ([fx, fy], p) = (camera.pinhole.focal, &sample.point);
        let [gu, gv] = residual.gradient.map(|g| g / length);
        let (du, dv) = (gu * fx / p.z, gv * fy / p.z);
        let in_camera = Vector3::new(du, dv, -(du * p.x + dv * p.y) / p.z);
        let camera_from_world = &camera.camera_from_world;
        let slide = camera_from_world.inverse_transform_vector(&in_camera);
        let arm = camera_from_world.inverse_transform_point(p) - self.about;
        let turn = arm.cross(&slide);
        let row = Vector6::new(slide.x, slide.y, slide.z, turn.x, turn.y, turn.z);
        let (matrix, gradient) = &mut self.links[sample.link];
        for j in 0..6 {
            let weighted = weight * row[j];
            for i in 0..=j {
                matrix[(i, j)] += row[i] * weighted;
            }
            gradient[j] += residual.value * weighted;
        }
        self.cost += weight * residual.value * residual.value;
        self.weight += weight;
        self.residuals += 1;
    }

    /// Spreads the sums over the numbers of a step of `body`, whose links are at `frames`.
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
        NormalEquations { matrix, gradient, cost, weight, residuals }
    }
}
