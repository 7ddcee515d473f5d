//! Exact silhouettes of tapered capsules.
//!
//! A pixel is set iff the ray through its centre meets the part of a solid at or beyond the near plane (z >= near).
//! Solids nearer than the near plane are invisible, and parts cut off by it are not seen; a solid that contains the
//! camera is visible wherever it extends beyond the near plane.

use nalgebra::Vector3;

use crate::camera::Pinhole;

use super::outline::{CapsuleBlock, Outline, OutlineBlock, RowSpans};
use super::strips::{ROWS, Rows, STRIP, StripImage, StripLayout};
use super::{Mask, PixelBounds, TaperedCapsule};
use crate::simd::{Dispatched, dispatch};

/// Beyond this many pixels single precision no longer resolves half pixels.
const FAR_AWAY: f32 = 65536.0;

/// Draws silhouettes of tapered capsules as seen by a pinhole camera.
pub struct CapsulePainter {
    pinhole: Pinhole,
    scratch: SilhouetteScratch,
}

impl CapsulePainter {
    /// A painter for one camera.
    pub fn new(pinhole: &Pinhole) -> Self {
        Self { pinhole: *pinhole, scratch: SilhouetteScratch::default() }
    }

    /// Adds the silhouettes of `capsules_in_camera` (metres, camera frame) to `mask`, which has the camera's size, and
    /// returns the bounds of the covered pixels. Pixels outside a smaller mask are ignored.
    pub fn paint(&mut self, capsules_in_camera: &[TaperedCapsule], mask: &mut Mask) -> PixelBounds {
        let (width, height) = (self.pinhole.width, self.pinhole.height);
        self.scratch.draw(&self.pinhole, capsules_in_camera);
        if (mask.width(), mask.height()) == (width, height) {
            return self.scratch.image.merge_into(mask);
        }
        let mut drawn = Mask::new(width, height);
        let bounds = self.scratch.image.merge_into(&mut drawn);
        *mask |= &drawn;
        bounds
    }
}

/// Reusable memory for drawing silhouettes: one per thread, for cameras of any size. It grows to the largest image so
/// far and never allocates after that.
#[derive(Default)]
pub struct SilhouetteScratch {
    pub(super) image: StripImage,
    capsules: CapsuleBlock,
    outlines: OutlineBlock,
    /// Centres of all rows, 0.5, 1.5 and so on; NaN for rows below the image that pad the last block.
    centres: Vec<Rows<f32>>,
    /// A strip's contour.
    pub(super) edge: Vec<u32>,
}

impl SilhouetteScratch {
    /// Draws the silhouettes on a cleared image with the best instruction set of this processor; the results are
    /// bit-identical on all.
    pub(super) fn draw(&mut self, pinhole: &Pinhole, capsules_in_camera: &[TaperedCapsule]) {
        dispatch(CapsuleDrawing { scratch: self, pinhole, capsules_in_camera });
    }

    /// As [`Self::draw`], with the instructions that the caller was compiled for.
    #[inline(always)]
    pub(super) fn draw_here(&mut self, pinhole: &Pinhole, capsules_in_camera: &[TaperedCapsule]) {
        self.reshape(pinhole);
        self.capsules.clear();
        for capsule in capsules_in_camera {
            let depth = |z: f64, radius: f64| z - radius;
            let nearest = depth(capsule.a.z, capsule.radius_a).min(depth(capsule.b.z, capsule.radius_b));
            if nearest >= pinhole.near {
                self.capsules.push(capsule);
                if self.capsules.is_full() {
                    self.draw_block(pinhole);
                }
            } else {
                draw_by_rays(capsule, pinhole, &mut self.image);
            }
        }
        self.draw_block(pinhole);
    }

    #[inline(always)]
    fn reshape(&mut self, pinhole: &Pinhole) {
        let layout = StripLayout::new(pinhole.width, pinhole.height);
        if self.image.layout() != layout {
            self.centres = row_centres(layout);
            self.edge.resize(layout.rows, 0);
        }
        self.image.reshape(layout);
    }

    #[inline(always)]
    fn draw_block(&mut self, pinhole: &Pinhole) {
        self.outlines.project(&self.capsules, pinhole);
        for lane in 0..self.outlines.count() {
            let outline = self.outlines.get(lane);
            if outline.is_within(FAR_AWAY) {
                draw_outline(&outline, &mut self.image, &self.centres);
            } else {
                draw_by_rays(&self.capsules.get(lane), pinhole, &mut self.image);
            }
        }
        self.capsules.clear();
    }
}

struct CapsuleDrawing<'a> {
    scratch: &'a mut SilhouetteScratch,
    pinhole: &'a Pinhole,
    capsules_in_camera: &'a [TaperedCapsule],
}

impl Dispatched for CapsuleDrawing<'_> {
    type Output = ();

    #[inline(always)]
    fn work(self) {
        self.scratch.draw_here(self.pinhole, self.capsules_in_camera);
    }
}

fn row_centres(layout: StripLayout) -> Vec<Rows<f32>> {
    let centre = |row: usize| if row < layout.height as usize { row as f32 + 0.5 } else { f32::NAN };
    (0..layout.rows).step_by(ROWS).map(|first| std::array::from_fn(|i| centre(first + i))).collect()
}

/// Draws one outline in blocks of rows: its start and end in every row, and the words of all strips between.
#[inline(always)]
fn draw_outline(outline: &Outline, image: &mut StripImage, centres: &[Rows<f32>]) {
    let layout = image.layout();
    let (width, height) = (layout.width as f32, layout.height as f32);
    if outline.bottom <= 0.0 || outline.top >= height || outline.right <= 0.0 || outline.left >= width {
        return;
    }
    // Conversion to an integer saturates at zero and at the greatest value.
    let first = outline.top as usize / ROWS;
    let last = ((outline.bottom as usize + 1).div_ceil(ROWS)).min(layout.rows / ROWS);
    let first_strip = outline.left as usize / STRIP as usize;
    let last_strip = (outline.right as usize / STRIP as usize + 1).min(layout.strips);
    let spans = RowSpans::new(outline, width);
    image.mark_blocks(first_strip..last_strip, first, last);
    for (block, centres) in (first..last).zip(&centres[first..last]) {
        let [starts, ends] = spans.rows(centres);
        for (strip, words) in (first_strip..last_strip).zip(image.block_in_strips(block, first_strip)) {
            let base = STRIP * strip as u32;
            for ((word, start), end) in words.iter_mut().zip(starts).zip(ends) {
                *word |= ones_from(start.saturating_sub(base)) & !ones_from(end.saturating_sub(base));
            }
        }
    }
}

/// A word whose bits `bit..` are set; zero if `bit` is beyond the word.
#[inline(always)]
fn ones_from(bit: u32) -> u32 {
    u32::MAX.checked_shl(bit).unwrap_or(0)
}

/// Draws a solid cut by the near plane, ray by ray: slow and exact.
#[inline(never)]
fn draw_by_rays(capsule: &TaperedCapsule, pinhole: &Pinhole, image: &mut StripImage) {
    let bounds = bounds_beyond_near(capsule, pinhole);
    for y in bounds.top..bounds.bottom {
        for x in bounds.left..bounds.right {
            let (u, v) = pinhole.normalised(&nalgebra::Point2::new(f64::from(x) + 0.5, f64::from(y) + 0.5));
            // The solid is convex: the ray meets the part beyond the near plane iff it exits there.
            if capsule.exit_along(&Vector3::new(u, v, 1.0)).is_some_and(|depth| depth >= pinhole.near) {
                image.set(x, y);
            }
        }
    }
}

/// Conservative bounds of the pixels that see the part of the solid beyond the near plane.
fn bounds_beyond_near(capsule: &TaperedCapsule, pinhole: &Pinhole) -> PixelBounds {
    let TaperedCapsule { a, b, radius_a, radius_b } = capsule;
    let low = |i: usize| (a[i] - radius_a).min(b[i] - radius_b);
    let high = |i: usize| (a[i] + radius_a).max(b[i] + radius_b);
    if high(2) < pinhole.near {
        return PixelBounds::default();
    }
    let (near, far) = (low(2).max(pinhole.near), high(2));
    // x / z over the box around the part beyond the near plane.
    let least = |i: usize| low(i) / if low(i) < 0.0 { near } else { far };
    let most = |i: usize| high(i) / if high(i) > 0.0 { near } else { far };
    let (from, to) = (pinhole.pixel(least(0), least(1)), pinhole.pixel(most(0), most(1)));
    // Conversion to an integer saturates at zero and at the greatest value, and turns NaN into an empty range.
    PixelBounds {
        left: from.x as u32,
        top: from.y as u32,
        right: (to.x.ceil() as u32).min(pinhole.width),
        bottom: (to.y.ceil() as u32).min(pinhole.height),
    }
}
