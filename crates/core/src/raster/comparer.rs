//! Compares one observed silhouette with thousands of modelled ones.

use nalgebra::Isometry3;

use crate::camera::Pinhole;

use super::contour_distance::ContourDistance;
use super::strips::StripImage;
use super::{Mask, MeshScratch, MeshTopology, MeshVertices, Overlap, SilhouetteScratch, TaperedCapsule};
use crate::simd::{Dispatched, dispatch};

/// Comparison of an observed silhouette with a model's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MaskComparison {
    /// Exact pixel counts of the overlap of the two masks.
    pub overlap: Overlap,
    /// Mean over all pixels of the model's contour ([`super::contour()`]) of `min(d, tau) / tau`, where `d` is the
    /// distance to the nearest pixel of the observed contour; in `[0, 1]`. A model without a contour scores 0 if the
    /// observation has none either, else 1. `None` if the comparer was created without `tau`.
    pub contour: Option<f64>,
}

/// Compares silhouettes of tapered capsules, or of meshes, with one observed mask: created once per view and frame,
/// used once per particle.
///
/// A comparison draws the model as [`super::CapsulePainter`] or [`MeshTopology::paint`] does, and counts only the
/// words that were drawn: the pixels shared by both masks, and those of the model; the observed mask is counted once.
/// With a [`SilhouetteScratch`] or a [`MeshScratch`] per thread it does not allocate. Results do not depend on the
/// processor or on previous uses of the scratch memory.
#[derive(Clone, Debug)]
pub struct SilhouetteComparer {
    pinhole: Pinhole,
    observed: StripImage,
    observed_count: u64,
    contour: Option<ContourDistance>,
}

impl SilhouetteComparer {
    /// A comparer for one view. `observed` has the camera's size and is in its ideal pixels (pixels outside the
    /// camera's image are ignored); `contour_tau` is the distance in pixels, > 0, beyond which a contour pixel counts
    /// as missed, or `None` to omit the contour, which halves the time.
    pub fn new(pinhole: &Pinhole, observed: &Mask, contour_tau: Option<f64>) -> Self {
        let mut inside = Mask::new(pinhole.width, pinhole.height);
        inside |= observed;
        Self {
            pinhole: *pinhole,
            observed: StripImage::from_mask(&inside),
            observed_count: inside.count(),
            contour: contour_tau.map(|tau| ContourDistance::new(&inside, tau)),
        }
    }

    /// Number of pixels of the observed mask.
    #[inline]
    pub fn observed_count(&self) -> u64 {
        self.observed_count
    }

    /// Compares the silhouette of `capsules_in_camera` (camera frame, metres) with the observed one.
    pub fn compare(&self, scratch: &mut SilhouetteScratch, capsules_in_camera: &[TaperedCapsule]) -> MaskComparison {
        dispatch(Comparing { comparer: self, scratch, capsules_in_camera })
    }

    /// The comparison of a drawn image, which is cleared, with the instructions that the caller was compiled for.
    #[inline(always)]
    fn compare_drawn(&self, image: &mut StripImage, edge: &mut [u32]) -> MaskComparison {
        // not a closure: it would be a separate function without the selected instructions
        let mut mean = None;
        if let Some(contour) = &self.contour {
            mean = Some(contour.mean(image, edge));
        }
        let [both, model] = image.count_and_clear(&self.observed);
        MaskComparison { overlap: Overlap::from_counts(both, model, self.observed_count), contour: mean }
    }

    /// Compares the silhouette of a mesh with the observed one. If there are fewer `vertices` (world, metres) than the
    /// triangles require, nothing is drawn.
    pub fn compare_mesh(
        &self,
        scratch: &mut MeshScratch,
        mesh: &MeshTopology,
        camera_from_world: &Isometry3<f64>,
        vertices: &MeshVertices,
    ) -> MaskComparison {
        dispatch(ComparingMesh { comparer: self, scratch, mesh, camera_from_world, vertices })
    }
}

struct ComparingMesh<'a> {
    comparer: &'a SilhouetteComparer,
    scratch: &'a mut MeshScratch,
    mesh: &'a MeshTopology,
    camera_from_world: &'a Isometry3<f64>,
    vertices: &'a MeshVertices,
}

impl Dispatched for ComparingMesh<'_> {
    type Output = MaskComparison;

    #[inline(always)]
    fn work(self) -> MaskComparison {
        let Self { comparer, scratch, mesh, camera_from_world, vertices } = self;
        scratch.draw_here(mesh, &comparer.pinhole, camera_from_world, vertices);
        comparer.compare_drawn(&mut scratch.image, &mut scratch.edge)
    }
}

struct Comparing<'a> {
    comparer: &'a SilhouetteComparer,
    scratch: &'a mut SilhouetteScratch,
    capsules_in_camera: &'a [TaperedCapsule],
}

impl Dispatched for Comparing<'_> {
    type Output = MaskComparison;

    #[inline(always)]
    fn work(self) -> MaskComparison {
        self.scratch.draw_here(&self.comparer.pinhole, self.capsules_in_camera);
        self.comparer.compare_drawn(&mut self.scratch.image, &mut self.scratch.edge)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::{CapsulePainter, DistanceMap, contour, overlap};
    use crate::rng::{Purpose, stream};
    use nalgebra::{Point3, Vector3};
    use rand::RngExt;

    const TAU: f64 = 12.5;

    fn pinhole(width: u32, height: u32) -> Pinhole {
        let principal_point = [0.5 * f64::from(width), 0.5 * f64::from(height)];
        Pinhole { focal: [f64::from(width); 2], principal_point, width, height, near: 0.05 }
    }

    fn body(seed: u64) -> Vec<TaperedCapsule> {
        let mut random = stream(seed, Purpose::Corruption, 0, 0, 0);
        let middle = Point3::new(0.0, 0.0, if seed.is_multiple_of(7) { 0.3 } else { 2.5 });
        let mut point = move || middle + Vector3::from_fn(|_, _| random.random_range(-0.9..0.9));
        let mut capsule = || TaperedCapsule { a: point(), b: point(), radius_a: 0.12, radius_b: 0.05 };
        (0..18).map(|_| capsule()).collect()
    }

    fn painted(pinhole: &Pinhole, body: &[TaperedCapsule]) -> Mask {
        let mut mask = Mask::new(pinhole.width, pinhole.height);
        CapsulePainter::new(pinhole).paint(body, &mut mask);
        mask
    }

    fn mean_by_pixel(model: &Mask, observed: &Mask) -> f64 {
        let map = DistanceMap::new(&contour(observed));
        let edge = contour(model);
        edge.pixels().map(|(x, y)| map.distance(x, y).min(TAU) / TAU).sum::<f64>() / edge.count() as f64
    }

    #[test]
    fn a_comparison_equals_the_comparison_of_masks_pixel_by_pixel() {
        let mut scratch = SilhouetteScratch::default();
        for (width, height) in [(160, 120), (64, 64), (33, 50), (200, 31)] {
            let pinhole = pinhole(width, height);
            for seed in 0..20 {
                let (model, observed) = (body(seed), painted(&pinhole, &body(seed + 1)));
                let comparison = SilhouetteComparer::new(&pinhole, &observed, Some(TAU)).compare(&mut scratch, &model);
                let model = painted(&pinhole, &model);
                assert_eq!(comparison.overlap, overlap(&model, &observed));
                let (mean, expected) = (comparison.contour.unwrap(), mean_by_pixel(&model, &observed));
                assert!((mean - expected).abs() < 1e-5, "{mean} against {expected}");
            }
        }
    }

    #[test]
    fn every_instruction_set_gives_the_same_bits() {
        let (mut here, mut best) = (SilhouetteScratch::default(), SilhouetteScratch::default());
        for (width, height) in [(640, 480), (160, 120), (97, 61)] {
            let pinhole = pinhole(width, height);
            let comparer = SilhouetteComparer::new(&pinhole, &painted(&pinhole, &body(3)), Some(TAU));
            for seed in 0..60 {
                let body = body(seed);
                here.draw_here(&pinhole, &body);
                best.draw(&pinhole, &body);
                assert_eq!(here.image.words(), best.image.words());
                let own = Comparing { comparer: &comparer, scratch: &mut here, capsules_in_camera: &body };
                assert_eq!(own.work(), comparer.compare(&mut best, &body));
            }
        }
    }

    /// Random tetrahedra in the world; for some seeds the near plane cuts one.
    fn tetrahedra(seed: u64) -> (MeshTopology, Vec<Point3<f64>>) {
        let mut random = stream(seed, Purpose::Corruption, 0, 1, 0);
        let middle = Point3::new(0.0, 0.0, if seed.is_multiple_of(7) { 0.3 } else { 2.5 });
        let vertices: Vec<_> =
            (0..40).map(|_| middle + Vector3::from_fn(|_, _| random.random_range(-0.9..0.9))).collect();
        let sides = (0..10).flat_map(|k| [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]].map(|t| t.map(|i| 4 * k + i)));
        (MeshTopology::new(40, &sides.collect::<Vec<_>>()), vertices)
    }

    #[test]
    fn a_mesh_is_compared_like_its_mask_pixel_by_pixel() {
        let mut scratch = MeshScratch::default();
        let camera_from_world = nalgebra::Isometry3::translation(0.1, -0.05, 0.2);
        for (width, height) in [(160, 120), (64, 64), (33, 50), (200, 31)] {
            let pinhole = pinhole(width, height);
            for seed in 0..20 {
                let observed = painted(&pinhole, &body(seed + 1));
                let (mesh, vertices) = tetrahedra(seed);
                let mut columns = MeshVertices::default();
                columns.replace(&vertices);
                let comparer = SilhouetteComparer::new(&pinhole, &observed, Some(TAU));
                let comparison = comparer.compare_mesh(&mut scratch, &mesh, &camera_from_world, &columns);
                let in_camera: Vec<_> = vertices.iter().map(|vertex| camera_from_world * vertex).collect();
                let mut model = Mask::new(width, height);
                mesh.paint(&pinhole, &in_camera, &mut MeshScratch::default(), &mut model);
                assert_eq!(comparison.overlap, overlap(&model, &observed), "{seed}");
                // a mask that fills the image has no contour
                let expected = match (contour(&model).is_empty(), contour(&observed).is_empty()) {
                    (true, true) => 0.0,
                    (true, false) => 1.0,
                    _ => mean_by_pixel(&model, &observed),
                };
                let mean = comparison.contour.unwrap();
                assert!((mean - expected).abs() < 1e-5, "{mean} against {expected}");
                let again = comparer.compare_mesh(&mut scratch, &mesh, &camera_from_world, &columns);
                assert_eq!(again, comparison);
            }
        }
        let comparer = SilhouetteComparer::new(&pinhole(64, 64), &Mask::new(64, 64), Some(TAU));
        let nothing =
            comparer.compare_mesh(&mut scratch, &tetrahedra(1).0, &camera_from_world, &MeshVertices::default());
        assert_eq!(nothing, MaskComparison { overlap: Overlap::default(), contour: Some(0.0) });
    }

    #[test]
    fn a_model_out_of_sight_overlaps_nothing() {
        let pinhole = pinhole(160, 120);
        let observed = painted(&pinhole, &body(1));
        let away = Vector3::new(100.0, 0.0, 0.0);
        let gone: Vec<_> = body(2).iter().map(|c| TaperedCapsule { a: c.a + away, b: c.b + away, ..*c }).collect();
        let mut scratch = SilhouetteScratch::default();
        let missed = SilhouetteComparer::new(&pinhole, &observed, Some(TAU)).compare(&mut scratch, &gone);
        assert_eq!(missed.overlap, Overlap { both: 0, only_model: 0, only_observed: observed.count() });
        assert_eq!(missed.contour, Some(1.0));
        let nothing = SilhouetteComparer::new(&pinhole, &Mask::new(160, 120), Some(TAU)).compare(&mut scratch, &[]);
        assert_eq!(nothing, MaskComparison { overlap: Overlap::default(), contour: Some(0.0) });
        assert_eq!(SilhouetteComparer::new(&pinhole, &observed, None).compare(&mut scratch, &gone).contour, None);
    }
}
