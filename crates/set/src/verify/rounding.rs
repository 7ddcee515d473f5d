//! Pixels that may differ by rounding: those that change when the image is shifted by a tiny amount.
//!
//! `cameras.json` has another pixel origin than this program, so the numbers of a camera are rounded once, and rows of
//! solids are rendered in single precision. Both can change only pixels whose centre is on an outline.

use std::sync::OnceLock;

use crate::camera::TimedRig;
use crate::observing::{ObservationFacts, SilhouetteObserver, SilhouetteSource};
use crate::raster::Mask;
use crate::rng::KeyedSeed;
use crate::scene::GroundTruth;

/// Shift of the image, pixels: more than rounding, and so small that almost no pixel changes.
const SHIFT_PX: f64 = 1e-4;

/// Greatest number of pixels of a silhouette that may be explained by rounding.
pub(super) const MOST_ROUNDED_PX: u64 = 64;

/// Distance from a pixel changed by rounding within which segmentation may differ, pixels.
const REACH_PX: u32 = 4;

const DIRECTIONS: [[f64; 2]; 4] = [[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]];

/// Renders a scene through cameras with slightly shifted images. They are set up when the first silhouette differs,
/// which never happens for most sets.
pub(super) struct Rounding<'a> {
    truth: &'a GroundTruth,
    filming: &'a TimedRig,
    facts: ObservationFacts,
    seed: KeyedSeed,
    /// Distance from a changed pixel within which others may differ, pixels.
    reach_px: u32,
    moved: OnceLock<Vec<SilhouetteObserver<'a>>>,
}

impl<'a> Rounding<'a> {
    pub(super) fn new(
        truth: &'a GroundTruth,
        filming: &'a TimedRig,
        facts: &ObservationFacts,
        seed: KeyedSeed,
    ) -> Self {
        // segmentation takes memory and time; the clean silhouettes suffice to find pixels changed by rounding
        let is_segmented = facts.silhouette == SilhouetteSource::Segmented;
        let silhouette = if is_segmented { SilhouetteSource::Exact } else { facts.silhouette };
        let (facts, reach_px) =
            (ObservationFacts { silhouette, ..facts.clone() }, if is_segmented { REACH_PX } else { 0 });
        Self { truth, filming, facts, seed, reach_px, moved: OnceLock::new() }
    }

    /// Whether rounding explains all pixels in which two masks of a camera and frame differ.
    pub(super) fn explains(&self, expected: &Mask, found: &Mask, camera: usize, frame: usize) -> bool {
        let masks: Vec<Mask> =
            self.moved().iter().map(|observer| observer.observe(frame).silhouettes.swap_remove(camera)).collect();
        let Some((first, others)) = masks.split_first() else { return false };
        let is_undecided = |x: u32, y: u32| others.iter().any(|other| other.get(x, y) != first.get(x, y));
        let around = |at: u32, size: u32| at.saturating_sub(self.reach_px)..=(at + self.reach_px).min(size - 1);
        let (width, height) = (expected.width(), expected.height());
        let differs = |x: &u32, y: u32| expected.get(*x, y) != found.get(*x, y);
        (0..height).all(|y| {
            (0..width)
                .filter(|x| differs(x, y))
                .all(|x| around(y, height).any(|v| around(x, width).any(|u| is_undecided(u, v))))
        })
    }

    fn moved(&self) -> &[SilhouetteObserver<'a>] {
        self.moved.get_or_init(|| {
            let moved = DIRECTIONS.map(|direction| self.filming.with_shifted_images(direction.map(|d| d * SHIFT_PX)));
            let observers =
                moved.iter().map(|filming| SilhouetteObserver::new(self.truth, filming, &self.facts, self.seed));
            observers.filter_map(Result::ok).collect()
        })
    }
}
