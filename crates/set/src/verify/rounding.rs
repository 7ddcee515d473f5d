//! Pixels that rounding may decide: those that another silhouette has when the camera is moved by next to nothing.
//!
//! `cameras.json` counts pixels from another corner than this program, which rounds a camera's numbers once; rows of
//! solids are drawn in single precision. Both can decide a pixel whose centre lies on an outline, and no other.

use std::sync::OnceLock;

use crate::camera::TimedRig;
use crate::observing::{ObservationFacts, SilhouetteObserver, SilhouetteSource};
use crate::raster::Mask;
use crate::rng::KeyedSeed;
use crate::scene::GroundTruth;

/// How far the image is moved, pixels: more than rounding does, and so little that next to no pixel changes.
const SHIFT_PX: f64 = 1e-4;

/// Greatest number of pixels of a silhouette that rounding is asked about.
pub(super) const MOST_ROUNDED_PX: u64 = 64;

/// How far around a pixel that rounding decides segmentation may decide otherwise, pixels.
const REACH_PX: u32 = 4;

const DIRECTIONS: [[f64; 2]; 4] = [[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]];

/// Looks at a scene through cameras that are moved by next to nothing. They are set up when the first silhouette
/// differs: for most sets never.
pub(super) struct Rounding<'a> {
    truth: &'a GroundTruth,
    filming: &'a TimedRig,
    facts: ObservationFacts,
    seed: KeyedSeed,
    /// How far around a pixel more may differ.
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
        // what images are cut out by takes memory and time: the clean silhouettes say where rounding decides
        let is_segmented = facts.silhouette == SilhouetteSource::Segmented;
        let silhouette = if is_segmented { SilhouetteSource::Exact } else { facts.silhouette };
        let (facts, reach_px) =
            (ObservationFacts { silhouette, ..facts.clone() }, if is_segmented { REACH_PX } else { 0 });
        Self { truth, filming, facts, seed, reach_px, moved: OnceLock::new() }
    }

    /// Whether all pixels in which two masks of a camera and frame differ may be decided by rounding.
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
