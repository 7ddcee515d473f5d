//! Descent of a pose on silhouette outlines: moves the pose until the model's outline coincides with the observed one.
//!
//! Points on the model's surface that a camera's rays graze ([`outline`]) are compared with the observed outline
//! ([`observed`]) in both directions, and the squared distances are minimised by Gauss-Newton steps
//! ([`normal_equations`]). Point-to-plane distances are those of `[Chen 1992]`; optimising a pose on silhouettes
//! between filter steps follows `[Gall 2010]`.

mod mesh_outline;
mod normal_equations;
mod observed;
mod outline;
mod samples;

pub(super) use normal_equations::{Accumulator, ImageResidual, slide, wrench};
pub(super) use observed::{ObservedOutline, OutlineAgreement, OutlineResidual, dot};
pub(super) use outline::{BodyOutline, sides};
pub(super) use samples::{OutlineSample, SolidPlace};

use super::mask_trust::MaskTrust;
use skiagraph_core::body::{Humanoid, LinkFrames, SilhouettePainter};
use skiagraph_core::camera::Camera;
use skiagraph_core::raster::Mask;

/// A *length* is this share of the image height. Descent measures distances in lengths, so that settings do not depend
/// on the image resolution.
const LENGTH: f64 = 1.0 / 240.0;
/// Distance between samples along the model's outline, sparse and dense, lengths.
const SAMPLE_SPACING: [f64; 2] = [2.0, 1.0];
/// Distance between points along the observed outline, sparse and dense, lengths.
const OBSERVED_SPACING: [f64; 2] = [3.0, 1.5];
/// Residuals with a narrower robust weight than this are dense, lengths.
const NARROW: f64 = 3.0;
/// Outline for which a residual counts once, lengths: of the model's and of the observed outline. A residual counts as
/// much as the outline that it stands for, so that a prior weighs the same whatever the density.
const MODEL_UNIT: f64 = 2.0;
const OBSERVED_UNIT: f64 = 3.0;
/// Parts of a silhouette, and holes in it, smaller than this are treated as noise, square lengths.
const SPECK: f64 = 25.0;
/// Range of a silhouette's distance field, lengths.
const REACH: f64 = 20.0;
/// Maximum distance of an observed point from the model's outline, lengths.
const NEAREST: f64 = 30.0;
/// Minimum cosine between the normal of a sample and the gradient of the distance field inside the silhouette.
const SAME_SIDE: f64 = 0.2;
/// Width of the robust weight in the agreement of outlines, lengths: wider than the differences between bodies of
/// different lengths and girths, narrower than the distance between limbs.
const AGREEMENT_WIDTH: f64 = 4.0;
/// Minimum of that width, pixels: outlines of small images are accurate to half a pixel.
const LEAST_AGREEMENT_WIDTH_PX: f64 = 4.0;
/// Minimum cosine between the normals of an observed point and of its sample.
const SAME_NORMAL: f64 = 0.5;

/// Pixels per length in a camera's images.
pub(super) fn length_px(camera: &Camera) -> f64 {
    LENGTH * f64::from(camera.pinhole.height)
}

/// How dense residuals are along outlines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Density {
    /// In the first steps of a descent, far from the observed outline.
    Sparse,
    /// Where the noise of the pixels has to be averaged over many.
    Dense,
}

impl Density {
    /// The density for residuals of a robust `width`, lengths.
    pub(super) fn of_width(width: f64) -> Self {
        if width < NARROW { Self::Dense } else { Self::Sparse }
    }
}

/// The Geman-McClure weight (`[Geman 1987]`), `1 / (1 + (r / width)^2)^2`.
pub(super) fn robust_weight(residual: f64, width: f64) -> f64 {
    let ratio = residual / width;
    let falloff = 1.0 / (1.0 + ratio * ratio);
    falloff * falloff
}

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

/// Calls `add` with the residuals of one view for links at `frames`; returns the samples of the body's outline.
#[expect(clippy::too_many_arguments, reason = "one view's data, the pose and scratch buffers")]
pub(super) fn each_residual<'s>(
    body: &Humanoid,
    frames: &LinkFrames,
    outline: &BodyOutline,
    camera: &Camera,
    view: usize,
    observed: &ObservedOutline,
    density: Density,
    trust: MaskTrust,
    scratch: &'s mut DescentScratch,
    add: impl FnMut(&OutlineSample, OutlineResidual),
) -> &'s [OutlineSample] {
    let DescentScratch { painters, drawn, samples } = scratch;
    let (Some(painter), Some(mask)) = (painters.get_mut(view), drawn.get_mut(view)) else {
        return &[];
    };
    mask.clear();
    painter.place(&camera.camera_from_world);
    painter.paint(body, frames, mask);
    let length = length_px(camera);
    samples.clear();
    outline.sample(body, frames, camera, SAMPLE_SPACING[density as usize] * length, Some(mask), samples);
    observed.each_residual(samples, density, length, trust, add);
    samples
}

/// Whether the pixel just outside a sample is in the image and outside the drawn body. If not, the sample lies inside
/// the body's silhouette or at the edge of the image.
fn is_on_the_contour(sample: &OutlineSample, drawn: &Mask) -> bool {
    let [u, v] = [0, 1].map(|i| sample.pixel[i] + sample.normal[i]);
    let inside = u >= 0.0 && v >= 0.0 && u < f64::from(drawn.width()) && v < f64::from(drawn.height());
    inside && !drawn.get(u as u32, v as u32)
}

#[cfg(test)]
mod tests;
