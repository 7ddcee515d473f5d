//! Fisher information of what cameras see about a pose, and the errors that no unbiased estimate can undercut
//! (the Cramér-Rao bound; of outlines as in `[Gerwe 2003]`).
//!
//! The outline of a silhouette that is displaced along its normal by noise with deviation `sigma` and correlation
//! length `l`, both in pixels, tells `sum of J^T J ds / (sigma^2 l)` about the pose, where `J` is the derivative of a
//! point of the outline along its normal. A keypoint tells `J^T J / sigma^2` for each image coordinate.

use std::collections::HashMap;

use nalgebra::{Cholesky, DMatrix, DVector, Matrix3, Point3};

use super::descent::{Accumulator, BodyOutline, OutlineResidual, OutlineSample, dot};
use skiagraph_core::body::{Humanoid, JointKind, KeypointPlace, LinkFrames, ROOT_STEP, SilhouettePainter, Solid};
use skiagraph_core::camera::{Camera, Distortion};
use skiagraph_core::raster::{Mask, contour};

/// Outlines are sampled in images whose longer side has at least this many pixels.
const FINE_PX: u32 = 1280;
/// Distance between samples in these images, pixels.
const SPACING_PX: f64 = 1.0;
/// Standard deviation of an angle of which nothing is known, radians: a uniform one of a full turn.
const UNKNOWN_RAD: f64 = std::f64::consts::PI / 1.732_050_807_568_877_2;
/// Standard deviation of a coordinate of which nothing is known, metres.
const UNKNOWN_M: f64 = 10.0;

/// Noise of the outlines of silhouettes: the sum of `sigma^2 l` over independent causes, cubic pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OutlineNoise(f64);

impl OutlineNoise {
    /// Outlines that are only cut to pixels: an error that is uniform in a pixel, new in every pixel.
    pub const PIXELS: Self = Self(1.0 / 12.0);

    /// With a displacement of the outline by `deviation_px` that is correlated over `length_px` (the integral of its
    /// correlation along the outline).
    pub fn with(self, deviation_px: f64, length_px: f64) -> Self {
        Self(self.0 + deviation_px * deviation_px * length_px)
    }
}

/// A piece of the outline of a drawn body.
struct SeenEdge {
    sample: OutlineSample,
    /// Pixels.
    length: f64,
}

/// A body whose information is computed.
pub struct InformedBody<'a> {
    body: &'a Humanoid,
    outline: BodyOutline,
}

impl<'a> InformedBody<'a> {
    /// Prepares the body's outline.
    pub fn new(body: &'a Humanoid) -> Self {
        Self { body, outline: BodyOutline::new(body) }
    }

    /// Information of one camera's silhouette about a step of the pose ([`Humanoid::step`]), for links at `frames`.
    /// Lens distortion is left out, and the body is the only thing in view. All zero if the camera does not see it.
    pub fn of_silhouette(&self, frames: &LinkFrames, camera: &Camera, noise: OutlineNoise) -> DMatrix<f64> {
        let (fine, scale) = enlarged(camera);
        // both the displacement and the length of the outline grow with the image
        let weight = 1.0 / (noise.0 * scale * scale * scale);
        let mut sums = Accumulator::new(self.body.links.len(), Point3::from(frames[0].translation.vector));
        for SeenEdge { sample, length } in self.seen_outline(frames, &fine) {
            let along = OutlineResidual { value: 0.0, gradient: sample.normal, outline: 1.0 };
            sums.add(&fine, &sample, along, 1.0, 1.0, length * weight);
        }
        sums.finish(self.body, frames).matrix
    }

    /// Information of one camera's keypoints: `deviation_px(index, height)` is the standard deviation in each image
    /// coordinate of the point with this index, where a standing person would be `height` pixels high. Points outside
    /// the image tell nothing; hidden ones count.
    pub fn of_keypoints(
        &self,
        frames: &LinkFrames,
        camera: &Camera,
        points: &[KeypointPlace],
        deviation_px: impl Fn(usize, f64) -> f64,
    ) -> DMatrix<f64> {
        let stature = self.body.stature_or_usual();
        let mut sums = Accumulator::new(self.body.links.len(), Point3::from(frames[0].translation.vector));
        for (index, place) in points.iter().enumerate() {
            let point = camera.camera_from_world * (frames[place.point.link] * place.point.point_in_link);
            let in_image = |pixel: &nalgebra::Point2<f64>| camera.pinhole.contains(pixel);
            let Some(pixel) = ideal(camera).project(&(camera.camera_from_world.inverse() * point)).filter(in_image)
            else {
                continue;
            };
            let deviation = deviation_px(index, camera.pinhole.focal[1] * stature / point.z);
            for gradient in [[1.0, 0.0], [0.0, 1.0]] {
                let sample = OutlineSample {
                    link: place.point.link,
                    spot: Default::default(),
                    point,
                    pixel: [pixel.x, pixel.y],
                    normal: gradient,
                };
                let residual = OutlineResidual { value: 0.0, gradient, outline: 1.0 };
                sums.add(camera, &sample, residual, 1.0, 1.0, deviation.powi(-2));
            }
        }
        sums.finish(self.body, frames).matrix
    }

    /// Precision of a pose of which nothing is known: an angle that may be anything, a place within tens of metres. It
    /// keeps bounds finite where the cameras tell nothing.
    pub fn ignorance(&self) -> DVector<f64> {
        let mut deviations = DVector::from_element(self.body.step_len(), UNKNOWN_RAD);
        deviations.rows_mut(0, 3).fill(UNKNOWN_M);
        for joint in &self.body.joints {
            match &joint.kind {
                JointKind::Prismatic { drive, .. } => deviations[ROOT_STEP + drive.degree_of_freedom] = UNKNOWN_M,
                JointKind::Floating { first } => deviations.rows_mut(ROOT_STEP + first, 3).fill(UNKNOWN_M),
                JointKind::Fixed | JointKind::Revolute { .. } | JointKind::Spherical { .. } => {}
            }
        }
        deviations.map(|deviation| deviation.powi(-2))
    }

    /// Whether the body has anything that a silhouette shows.
    pub fn is_visible(&self) -> bool {
        let has_solids = |solids: &Vec<Solid>| !solids.is_empty();
        self.body.skin.is_some() || self.body.links.iter().any(|link| has_solids(&link.solids))
    }

    /// The outline of the drawn body: for every edge between a pixel of the body and one beside it, the nearest sample
    /// that faces the same way. Its length is the share of the outline that the edge stands for: over a line with the
    /// normal n, the components of n along the edges' normals add up to the line's length. Samples alone would count
    /// outlines twice where limbs meet.
    fn seen_outline(&self, frames: &LinkFrames, camera: &Camera) -> Vec<SeenEdge> {
        let mut drawn = Mask::new(camera.pinhole.width, camera.pinhole.height);
        SilhouettePainter::new(camera).paint(self.body, frames, &mut drawn);
        let mut samples = Vec::new();
        self.outline.sample(self.body, frames, camera, SPACING_PX, Some(&drawn), &mut samples);
        let mut cells: HashMap<[i64; 2], Vec<OutlineSample>> = HashMap::new();
        samples.into_iter().for_each(|sample| cells.entry(sample.pixel.map(cell)).or_default().push(sample));
        let edges = contour(&drawn).pixels().flat_map(|pixel| edges(pixel, &drawn)).collect::<Vec<_>>();
        let nearest = |(place, normal): ([f64; 2], [f64; 2])| {
            let [column, row] = place.map(cell);
            let around = (-1..=1).flat_map(|i| (-1..=1).map(move |j| [column + i, row + j]));
            let faces = |sample: &&OutlineSample| dot(sample.normal, normal) > 0.0;
            let apart = |sample: &&OutlineSample| {
                let offset = [0, 1].map(|i| sample.pixel[i] - place[i]);
                dot(offset, offset)
            };
            let near = around.filter_map(|key| cells.get(&key)).flatten().filter(faces);
            let found = near.min_by(|a, b| apart(a).total_cmp(&apart(b)))?;
            Some(SeenEdge { sample: *found, length: dot(found.normal, normal) })
        };
        edges.into_iter().filter_map(nearest).collect()
    }
}

/// The edges of a pixel of a mask to pixels beside it that are in the image and not in the mask: middle and normal.
fn edges((x, y): (u32, u32), mask: &Mask) -> Vec<([f64; 2], [f64; 2])> {
    let beside = [[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]].into_iter().filter_map(|normal: [f64; 2]| {
        let [u, v] = [f64::from(x) + normal[0], f64::from(y) + normal[1]];
        let inside = u >= 0.0 && v >= 0.0 && u < f64::from(mask.width()) && v < f64::from(mask.height());
        let is_edge = inside && !mask.get(u as u32, v as u32);
        is_edge.then(|| ([f64::from(x) + 0.5 + 0.5 * normal[0], f64::from(y) + 0.5 + 0.5 * normal[1]], normal))
    });
    beside.collect()
}

/// The cell of a coordinate in the grid in which nearest samples are searched.
fn cell(coordinate: f64) -> i64 {
    (0.5 * coordinate).floor() as i64
}

/// The inverse of information plus the diagonal `precision` of what is known before; `None` if it is singular.
pub fn covariance(information: &DMatrix<f64>, precision: &DVector<f64>) -> Option<DMatrix<f64>> {
    Cholesky::new(information + DMatrix::from_diagonal(precision)).map(|known| known.inverse())
}

/// The covariance of a filter after the next frame: `before` grows by the squared scales of a change of pose, and the
/// frame adds its information (the posterior bound of `[Tichavsky 1998]` for a random walk).
pub fn filtered(before: &DMatrix<f64>, scales: &[f64], information: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let squares = DVector::from_iterator(scales.len(), scales.iter().map(|scale| scale * scale));
    let known = Cholesky::new(before + DMatrix::from_diagonal(&squares))?.inverse();
    Cholesky::new(information + known).map(|known| known.inverse())
}

/// The mean length of a normal deviate with mean zero and this covariance.
///
/// From `sqrt(x) = integral of (1 - exp(-t^2 x)) / (t^2 sqrt(pi))` over positive `t`, and the mean of the exponential,
/// which is the product of `(1 + 2 t^2 v)^(-1/2)` over the eigenvalues `v`.
pub fn mean_length(covariance: &Matrix3<f64>) -> f64 {
    const STEPS: u32 = 400;
    let variances = covariance.symmetric_eigenvalues().map(|variance| variance.max(0.0));
    let scale = variances.sum().sqrt();
    if scale == 0.0 {
        return 0.0;
    }
    // t = u / (1 - u) / scale, by the midpoint rule in u
    let value = |step: u32| {
        let u = (f64::from(step) + 0.5) / f64::from(STEPS);
        let t = u / (1.0 - u) / scale;
        let product: f64 = variances.iter().map(|variance| 1.0 / (1.0 + 2.0 * t * t * variance).sqrt()).product();
        (1.0 - product) / (u * u)
    };
    let sum: f64 = (0..STEPS).map(value).sum();
    scale * sum / (f64::from(STEPS) * std::f64::consts::PI.sqrt())
}

fn ideal(camera: &Camera) -> Camera {
    Camera { distortion: Distortion::default(), ..camera.clone() }
}

/// The camera without its lens and with a larger image, and by how much it is larger.
fn enlarged(camera: &Camera) -> (Camera, f64) {
    let mut fine = ideal(camera);
    let pinhole = &mut fine.pinhole;
    let factor = FINE_PX.div_ceil(pinhole.width.max(pinhole.height).max(1));
    (pinhole.width, pinhole.height) = (pinhole.width * factor, pinhole.height * factor);
    let scale = f64::from(factor);
    pinhole.focal = pinhole.focal.map(|focal| focal * scale);
    pinhole.principal_point = pinhole.principal_point.map(|at| at * scale);
    (fine, scale)
}

#[cfg(test)]
mod tests;
