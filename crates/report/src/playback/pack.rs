//! Run-length encoding of the two silhouettes of a view.

use skiagraph_core::raster::{Mask, PixelBounds};
use skiagraph_eval::intersection_over_union;

/// How large the views of a page may be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PlaybackBudget {
    /// Maximum size of all views, bytes.
    all: usize,
    /// Maximum mean size of a view, bytes, before the resolution of silhouettes is reduced.
    view: usize,
}

impl PlaybackBudget {
    /// Of a page of its own.
    pub const PAGE: Self = Self { all: 7_000_000, view: 3_000 };
    /// Of a page within another, which a notebook stores.
    pub const CELL: Self = Self { all: 60_000, view: 300 };
}
/// Maximum number of image pixels per stored pixel, in each direction.
const COARSEST: u32 = 8;
/// Longest run in a byte, whose upper two bits are the label.
const LONGEST: usize = 64;

/// Resolution and frequency of stored views.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PlaybackPlan {
    /// Image pixels per stored pixel, in each direction.
    pub reduction: u32,
    /// Step between stored frames, from frame 0.
    pub stride: usize,
    /// Number of frames of the run.
    pub frames: usize,
}

/// One view of one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct PackedView {
    /// Left, top, width and height of the box around both silhouettes in stored pixels, and the number of bytes that
    /// follow (16, 16, 16, 16 and 32 bits, little-endian); then runs of equal labels row by row: the label in the upper
    /// two bits, the length minus one in the lower six. Labels: 0 neither, 1 observed only, 2 estimated only, 3 both.
    pub bytes: Vec<u8>,
    /// Overlap of the two silhouettes at the image's resolution.
    pub overlap: Option<f64>,
    /// The box in pixels of the image.
    pub bounds: PixelBounds,
}

impl PlaybackPlan {
    /// A plan for `frames` frames in `cameras` cameras whose views are like the `samples`: observed and estimated
    /// silhouettes.
    pub fn new(frames: usize, cameras: usize, samples: &[(&Mask, Option<&Mask>)], budget: PlaybackBudget) -> Self {
        let mean = |reduction: u32| {
            let plan = Self { reduction, stride: 1, frames };
            let bytes: usize =
                samples.iter().map(|(observed, estimated)| plan.pack(observed, *estimated).bytes.len()).sum();
            bytes.div_ceil(samples.len().max(1))
        };
        let fits = |reduction: &u32| mean(*reduction) <= budget.view;
        let reduction = (1..COARSEST).find(fits).unwrap_or(COARSEST);
        let all = frames.saturating_mul(cameras).saturating_mul(mean(reduction));
        Self { reduction, stride: all.div_ceil(budget.all).max(1), frames }
    }

    /// The stored frames.
    pub fn kept(&self) -> impl ExactSizeIterator<Item = usize> + Clone + use<> {
        (0..self.frames).step_by(self.stride.max(1))
    }

    /// Packs one view; without an estimated silhouette, observed pixels are labelled as both.
    pub fn pack(&self, observed: &Mask, estimated: Option<&Mask>) -> PackedView {
        let seen = observed.bounds();
        let found = estimated.map_or(seen, |estimated| seen.union(&estimated.bounds()));
        let bounds = if found.is_empty() { PixelBounds { left: 0, top: 0, right: 0, bottom: 0 } } else { found };
        let step = self.reduction.max(1);
        let (left, top) = (bounds.left / step, bounds.top / step);
        let (width, height) = (bounds.right.div_ceil(step) - left, bounds.bottom.div_ceil(step) - top);
        let mut runs = Runs::default();
        for row in top..top + height {
            let one = covered(observed, step, row, left, width);
            let other = estimated.map_or_else(|| one.clone(), |mask| covered(mask, step, row, left, width));
            one.iter().zip(&other).for_each(|(one, other)| runs.push(u8::from(*one) | u8::from(*other) << 1));
        }
        runs.close();
        let corner = [left, top, width, height].map(|number| (number as u16).to_le_bytes());
        let mut bytes = corner.concat();
        bytes.extend((runs.bytes.len() as u32).to_le_bytes());
        bytes.extend(runs.bytes);
        let overlap = estimated.and_then(|estimated| intersection_over_union(estimated, observed));
        PackedView { bytes, overlap, bounds }
    }
}

/// The stored pixels of a row: set if at least half of their image pixels are set.
fn covered(mask: &Mask, step: u32, row: u32, left: u32, width: u32) -> Vec<bool> {
    let mut counts = vec![0_u32; width as usize];
    let rows = row * step..((row + 1) * step).min(mask.height());
    for run in rows.clone().flat_map(|y| mask.runs(y)) {
        let kept = (run.start / step).max(left)..run.end.div_ceil(step).min(left + width);
        for x in kept {
            let inside = run.end.min((x + 1) * step) - run.start.max(x * step);
            counts[(x - left) as usize] += inside;
        }
    }
    let half = |x: u32| {
        let columns = ((x + 1) * step).min(mask.width()).saturating_sub(x * step);
        (columns * rows.len() as u32).div_ceil(2).max(1)
    };
    (left..left + width).zip(counts).map(|(x, count)| count >= half(x)).collect()
}

#[derive(Default)]
struct Runs {
    bytes: Vec<u8>,
    label: u8,
    length: usize,
}

impl Runs {
    fn push(&mut self, label: u8) {
        if self.length == LONGEST || (self.length > 0 && label != self.label) {
            self.close();
        }
        self.label = label;
        self.length += 1;
    }

    fn close(&mut self) {
        if self.length > 0 {
            self.bytes.push(self.label << 6 | (self.length - 1) as u8);
        }
        self.length = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Unpacks a view like the page's script.
    fn unpacked(view: &PackedView) -> (u32, u32, u32, Vec<u8>) {
        let number = |at: usize| u32::from(u16::from_le_bytes([view.bytes[at], view.bytes[at + 1]]));
        let labels = view.bytes[12..].iter().flat_map(|byte| vec![byte >> 6; usize::from(byte & 63) + 1]).collect();
        (number(0), number(2), number(4), labels)
    }

    fn masks() -> (Mask, Mask) {
        let disc = |cx: i64, cy: i64| {
            Mask::from_fn(160, 120, move |x, y| (i64::from(x) - cx).pow(2) + (i64::from(y) - cy).pow(2) < 900)
        };
        (disc(60, 50), disc(72, 54))
    }

    #[test]
    fn at_full_size_every_pixel_comes_back() {
        let (observed, estimated) = masks();
        let plan = PlaybackPlan { reduction: 1, stride: 1, frames: 1 };
        let view = plan.pack(&observed, Some(&estimated));
        let (left, top, width, labels) = unpacked(&view);
        assert_eq!(labels.len() as u32 % width, 0);
        for (index, label) in labels.iter().enumerate() {
            let (x, y) = (left + index as u32 % width, top + index as u32 / width);
            assert_eq!(*label, u8::from(observed.get(x, y)) | u8::from(estimated.get(x, y)) << 1, "{x} {y}");
        }
        let set = |bit: u8| labels.iter().filter(|label| **label & bit != 0).count() as u64;
        assert_eq!((set(1), set(2)), (observed.count(), estimated.count()), "nothing is outside the box");
        assert_eq!(view.overlap, intersection_over_union(&estimated, &observed));
    }

    #[test]
    fn a_reduced_view_covers_the_same_area_and_takes_less() {
        let (observed, estimated) = masks();
        let [fine, coarse] =
            [1, 3].map(|reduction| PlaybackPlan { reduction, stride: 1, frames: 1 }.pack(&observed, Some(&estimated)));
        assert!(coarse.bytes.len() < fine.bytes.len() / 2);
        let (.., labels) = unpacked(&coarse);
        let area = 9 * labels.iter().filter(|label| **label & 1 != 0).count() as i64;
        assert!((area - observed.count() as i64).abs() < 150, "{area} {}", observed.count());
    }

    #[test]
    fn without_an_estimate_all_is_both_and_an_empty_view_has_no_run() {
        let (observed, _) = masks();
        let plan = PlaybackPlan { reduction: 1, stride: 1, frames: 1 };
        let (.., labels) = unpacked(&plan.pack(&observed, None));
        assert!(labels.iter().all(|label| *label == 0 || *label == 3));
        let nothing = plan.pack(&Mask::new(160, 120), None);
        assert_eq!((nothing.bytes.len(), nothing.overlap), (12, None));
    }

    #[test]
    fn noise_reduces_the_resolution_and_long_runs_the_frequency() {
        let (observed, estimated) = masks();
        let noise = Mask::from_fn(640, 480, |x, y| (x * 7919 + y * 104_729) % 5 == 0);
        let clean = PlaybackPlan::new(529, 4, &[(&observed, Some(&estimated))], PlaybackBudget::PAGE);
        assert_eq!((clean.reduction, clean.stride), (1, 1));
        let rough = PlaybackPlan::new(529, 4, &[(&noise, Some(&noise))], PlaybackBudget::PAGE);
        assert!(rough.reduction > 1 && rough.stride == 1, "{rough:?}");
        let long = PlaybackPlan::new(100_000, 4, &[(&observed, Some(&estimated))], PlaybackBudget::PAGE);
        assert!(long.stride > 5 && long.kept().len() * long.stride >= 100_000, "{long:?}");
    }
}
