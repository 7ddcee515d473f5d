//! Share of each part of the body that observed silhouettes show.

use std::collections::BTreeMap;

use super::statistics::mean_of;
use skiagraph_core::body::{BODY_REGIONS, BodyRegion, DepthImage};
use skiagraph_core::raster::Mask;

/// Greatest interval of the frames in which the recall of parts is measured. Finding the part of every pixel takes as
/// long as all other measures of a frame; in every 25th frame it takes a twentieth.
const MAX_INTERVAL: usize = 25;
/// Number of frames in which it is measured at least, if there are as many.
const LEAST_FRAMES: usize = 24;
/// Least number of visible pixels of a part in an image that counts.
const LEAST_PIXELS: u32 = 20;

/// Whether the recall of parts is measured in a frame, of so many: in 24 or more, at equal intervals of at most 25.
pub fn is_part_sampled(frame: usize, frames: usize) -> bool {
    frame.is_multiple_of((frames / LEAST_FRAMES).clamp(1, MAX_INTERVAL))
}

/// Share of the visible pixels of each part that one observed silhouette has set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PartRecall {
    /// In the order of [`BODY_REGIONS`]; `None` with fewer than 20 visible pixels.
    shares: [Option<f64>; BODY_REGIONS.len()],
}

impl PartRecall {
    /// Compares an observed mask with the links that the exact image of the same size shows; `regions` has the region
    /// of every link.
    pub fn new(observed: &Mask, exact: &DepthImage, regions: &[BodyRegion]) -> Self {
        let (mut visible, mut set) = ([0_u32; BODY_REGIONS.len()], [0_u32; BODY_REGIONS.len()]);
        for (y, row) in (0..).zip(exact.part.chunks_exact(exact.width as usize)) {
            for (x, link) in (0..).zip(row).filter(|(_, link)| **link > 0) {
                let region = regions[*link as usize - 1] as usize;
                visible[region] += 1;
                set[region] += u32::from(observed.get(x, y));
            }
        }
        let share = |region: usize| f64::from(set[region]) / f64::from(visible[region]);
        Self { shares: std::array::from_fn(|region| (visible[region] >= LEAST_PIXELS).then(|| share(region))) }
    }

    /// The share of a part.
    pub fn share(&self, region: BodyRegion) -> Option<f64> {
        self.shares[region as usize]
    }

    /// Means over the images that show the part.
    pub(super) fn mean(images: &[Self]) -> BTreeMap<BodyRegion, f64> {
        let mean = |region: BodyRegion| mean_of(images.iter().filter_map(|image| image.share(region)));
        BODY_REGIONS.into_iter().filter_map(|region| Some((region, mean(region)?))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Point3, Vector3};
    use skiagraph_core::body::{Humanoid, LinkFrames, SilhouettePainter, SurfacePixel, shipped};
    use skiagraph_core::camera::{Camera, FieldOfView};

    struct Seen {
        body: Humanoid,
        regions: Vec<BodyRegion>,
        depth: DepthImage,
        surface: Vec<SurfacePixel>,
    }

    /// The actor in its zero pose from the front, arms beside the trunk.
    fn seen() -> Seen {
        let body = shipped("actor").unwrap();
        let mut pose = body.standing_pose();
        pose.world_from_root.translation.z = 0.95;
        let frames: LinkFrames = body.link_frames(&pose);
        let (centre, target) = (Point3::new(3.0, 0.0, 1.0), Point3::new(0.0, 0.0, 0.9));
        let view = FieldOfView::Vertical(0.8);
        let camera = Camera::look_at("front", centre, target, Vector3::z(), view, 320, 240).unwrap();
        let mut painter = SilhouettePainter::new(&camera);
        let (depth, surface) = (painter.depth(&body, &frames), painter.surface(&body, &frames));
        Seen { regions: BodyRegion::of_links(&body), body, depth, surface }
    }

    impl Seen {
        fn of(&self, observed: &Mask) -> PartRecall {
            PartRecall::new(observed, &self.depth, &self.regions)
        }

        /// The exact silhouette without the links whose names end in one of `parts`, and the number of other and of
        /// removed pixels, counted in the surface.
        fn without(&self, parts: &[&str]) -> (Mask, u64, u64) {
            let mut mask = self.depth.mask();
            let is_gone =
                |pixel: &&SurfacePixel| parts.iter().any(|part| self.body.links[pixel.part].name.ends_with(part));
            let gone = self.surface.iter().filter(is_gone);
            let gone = gone.map(|pixel| mask.set(pixel.x, pixel.y, false)).count() as u64;
            (mask, self.surface.len() as u64 - gone, gone)
        }
    }

    #[test]
    fn a_mask_without_forearms_has_none_of_them_and_all_of_the_rest() {
        let seen = seen();
        let (mask, left, gone) = seen.without(&["_forearm", "_hand"]);
        assert!(gone > 100 && mask.count() == left, "{left} {gone}");
        for region in BODY_REGIONS {
            let expected = if region == BodyRegion::ForearmsAndHands { 0.0 } else { 1.0 };
            assert_eq!(seen.of(&mask).share(region), Some(expected), "{}", region.name());
        }
    }

    #[test]
    fn a_mask_without_one_forearm_has_the_share_found_by_counting_the_surface() {
        let seen = seen();
        let (mask, _, one) = seen.without(&["left_forearm", "left_hand"]);
        let (_, _, both) = seen.without(&["_forearm", "_hand"]);
        let share = (both - one) as f64 / both as f64;
        assert!(share > 0.4 && share < 0.6, "{share}");
        assert_eq!(seen.of(&mask).share(BodyRegion::ForearmsAndHands), Some(share));
        assert_eq!(seen.of(&mask).share(BodyRegion::UpperArms), Some(1.0));
    }

    #[test]
    fn parts_that_are_hardly_seen_do_not_count() {
        let mut seen = seen();
        let (whole, nothing) = (seen.depth.mask(), Mask::new(320, 240));
        let of_head = |pixel: &&mut u32| **pixel > 0 && seen.regions[**pixel as usize - 1] == BodyRegion::Head;
        seen.depth.part.iter_mut().filter(of_head).skip(LEAST_PIXELS as usize).for_each(|pixel| *pixel = 0);
        assert_eq!(seen.of(&whole).share(BodyRegion::Head), Some(1.0));
        assert_eq!(seen.of(&nothing).share(BodyRegion::Head), Some(0.0));
        let of_head = |pixel: &&mut u32| **pixel > 0 && seen.regions[**pixel as usize - 1] == BodyRegion::Head;
        seen.depth.part.iter_mut().find(of_head).map(|pixel| *pixel = 0).unwrap();
        assert_eq!(seen.of(&whole).share(BodyRegion::Head), None);
        let images = [seen.of(&whole), seen.of(&nothing), seen.of(&nothing), seen.of(&whole)];
        let mean = PartRecall::mean(&images);
        assert_eq!((mean.get(&BodyRegion::Head), mean.get(&BodyRegion::Trunk)), (None, Some(&0.5)));
    }
}
