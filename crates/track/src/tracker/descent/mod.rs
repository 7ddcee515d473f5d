//! Descent of a pose on silhouettes' outlines: where the model's outline runs beside the observed one, the pose is
//! moved so that the two fall together.
//!
//! Points on the model's surface at which a camera's rays graze it ([`outline`]) are held against the outline that was
//! observed ([`observed`]), in both directions, and the squared distances are brought down by Gauss-Newton steps
//! ([`normal_equations`]). Point-to-plane distances go back to `[Chen 1992]`; optimising a pose on silhouettes
//! between filter steps to `[Gall 2010]`.

mod mesh_outline;
mod normal_equations;
mod observed;
mod outline;
mod samples;

pub(super) use normal_equations::{Accumulator, slide, wrench};
pub(super) use observed::{ObservedOutline, OutlineAgreement, OutlineResidual};
pub(super) use outline::{BodyOutline, sides};
pub(super) use samples::{OutlineSample, SolidPlace};

use crate::body::{Humanoid, LinkFrames, SilhouettePainter};
use crate::camera::Camera;
use crate::raster::Mask;

/// A *length* is this share of the image's height; distances of the descent are counted in it, so that settings do not
/// depend on the number of pixels.
const LENGTH: f64 = 1.0 / 240.0;
/// Distance between samples along the model's outline, lengths.
const SAMPLE_SPACING: f64 = 2.0;
/// Distance between points along the observed outline, lengths.
const OBSERVED_SPACING: f64 = 3.0;
/// Parts of a silhouette, and holes in it, of fewer square lengths are taken for noise.
const SPECK: f64 = 25.0;
/// How far from a silhouette its distance field reaches, lengths.
const REACH: f64 = 20.0;
/// How far an observed point may lie from the model's outline, lengths.
const NEAREST: f64 = 30.0;
/// Least cosine between the directions in which a sample and the distance field inside the silhouette point.
const SAME_SIDE: f64 = 0.2;
/// Width of the robust weight by which outlines agree, lengths: wider than what separates bodies of other lengths and
/// girths, narrower than what separates limbs.
const AGREEMENT_WIDTH: f64 = 4.0;
/// The least such width, pixels: outlines of small images are known to half a pixel.
const LEAST_AGREEMENT_WIDTH_PX: f64 = 4.0;
/// Least cosine between the normals of an observed point and of its sample.
const SAME_NORMAL: f64 = 0.5;

/// Pixels of a length in the images of a camera.
pub(super) fn length_px(camera: &Camera) -> f64 {
    LENGTH * f64::from(camera.pinhole.height)
}

/// The robust weight of `[Geman 1987]`, `1 / (1 + (r / width)^2)^2`.
pub(super) fn robust_weight(residual: f64, width: f64) -> f64 {
    let ratio = residual / width;
    let falloff = 1.0 / (1.0 + ratio * ratio);
    falloff * falloff
}

/// Buffers of one thread.
pub(super) struct DescentScratch {
    painters: Vec<SilhouettePainter>,
    drawn: Vec<Mask>,
    samples: Vec<OutlineSample>,
}

impl DescentScratch {
    /// Buffers for views of `cameras`, which are ideal.
    pub(super) fn new<'a>(cameras: impl Iterator<Item = &'a Camera> + Clone) -> Self {
        let mask = |camera: &Camera| Mask::new(camera.pinhole.width, camera.pinhole.height);
        let drawn = cameras.clone().map(mask).collect();
        Self { painters: cameras.map(SilhouettePainter::new).collect(), drawn, samples: Vec::new() }
    }
}

/// Calls `add` with the residuals of one view at a pose whose links are at `frames`; how far the outlines agree.
#[expect(clippy::too_many_arguments, reason = "one view's data, the pose and the memory to work in")]
pub(super) fn each_residual(
    body: &Humanoid,
    frames: &LinkFrames,
    outline: &BodyOutline,
    camera: &Camera,
    view: usize,
    observed: &ObservedOutline,
    scratch: &mut DescentScratch,
    add: impl FnMut(&OutlineSample, OutlineResidual),
) -> OutlineAgreement {
    let DescentScratch { painters, drawn, samples } = scratch;
    let (Some(painter), Some(mask)) = (painters.get_mut(view), drawn.get_mut(view)) else {
        return OutlineAgreement::default();
    };
    mask.clear();
    painter.place(&camera.camera_from_world);
    painter.paint(body, frames, mask);
    let length = length_px(camera);
    samples.clear();
    outline.sample(body, frames, camera, SAMPLE_SPACING * length, samples);
    samples.retain(|sample| is_on_the_contour(sample, mask));
    observed.each_residual(samples, length, add)
}

/// Whether the pixel just outside a sample is in the image and not of the body itself: else the sample lies within the
/// body's silhouette, or the picture ends there.
fn is_on_the_contour(sample: &OutlineSample, drawn: &Mask) -> bool {
    let [u, v] = [0, 1].map(|i| sample.pixel[i] + sample.normal[i]);
    let inside = u >= 0.0 && v >= 0.0 && u < f64::from(drawn.width()) && v < f64::from(drawn.height());
    inside && !drawn.get(u as u32, v as u32)
}

#[cfg(test)]
mod tests;
