//! One camera's observation, prepared for comparison with many poses.

use super::placed_body::PlacedBody;
use super::{ContourTerm, SilhouetteSettings};
use skiagraph_core::body::{Humanoid, SilhouettePainter, Solid, capsules_in_camera};
use skiagraph_core::camera::Camera;
use skiagraph_core::raster::{
    DistanceMap, Mask, MaskComparison, MeshScratch, MeshTopology, PixelBounds, SilhouetteComparer, SilhouetteScratch,
    contour, overlap,
};

/// How a body is compared with the observation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ComparisonStrategy {
    /// For bodies of tapered capsules only.
    Capsules,
    /// For bodies with a skin.
    Skin,
    /// For any body and any contour term.
    Masks,
}

impl ComparisonStrategy {
    /// The fastest strategy that supports the body and settings.
    pub(super) fn of(body: &Humanoid, settings: &SilhouetteSettings) -> Self {
        let is_capsule = |solid: &Solid| matches!(solid, Solid::TaperedCapsule(_));
        let one_sided = settings.contour_weight == 0.0 || settings.contour == ContourTerm::OneSided;
        match (one_sided, &body.skin) {
            (true, Some(_)) => Self::Skin,
            (true, None) if body.links.iter().flat_map(|link| &link.solids).all(is_capsule) => Self::Capsules,
            _ => Self::Masks,
        }
    }
}

/// An observed silhouette in ideal pinhole pixels, prepared for comparison.
#[derive(Debug)]
pub(super) enum ObservedView {
    /// For bodies of tapered capsules and one-sided contours.
    Capsules(SilhouetteComparer),
    /// For bodies with a skin and one-sided contours.
    Skin(SilhouetteComparer),
    /// For any solids: the model is rendered into a mask.
    Masks {
        observed: Mask,
        /// Data of the contour term; `None` if its weight is 0.
        edge: Option<ObservedEdge>,
    },
}

#[derive(Debug)]
pub(super) struct ObservedEdge {
    contour: Mask,
    bounds: PixelBounds,
    distances: DistanceMap,
    term: ContourTerm,
    /// Saturation distance, pixels.
    tau: f64,
}

pub(super) struct ViewScratch {
    silhouette: SilhouetteScratch,
    mesh: MeshScratch,
    /// One per view with [`ObservedView::Masks`].
    painters: Vec<(SilhouettePainter, Mask)>,
}

impl ViewScratch {
    /// New buffers; `painted` lists the cameras of the views that render masks.
    pub(super) fn new<'a>(painted: impl Iterator<Item = &'a Camera>) -> Self {
        let painter = |camera: &Camera| {
            let mask = Mask::new(camera.pinhole.width, camera.pinhole.height);
            (SilhouettePainter::new(camera), mask)
        };
        let (silhouette, mesh) = (SilhouetteScratch::default(), MeshScratch::default());
        Self { silhouette, mesh, painters: painted.map(painter).collect() }
    }
}

impl ObservedView {
    /// Prepares the observed mask of `camera`, which is ideal.
    pub(super) fn new(
        camera: &Camera,
        observed: Mask,
        strategy: ComparisonStrategy,
        settings: &SilhouetteSettings,
    ) -> Self {
        let tau = settings.contour_reach * f64::from(camera.pinhole.height);
        let with_contour = settings.contour_weight > 0.0;
        let comparer = || SilhouetteComparer::new(&camera.pinhole, &observed, with_contour.then_some(tau));
        match strategy {
            ComparisonStrategy::Capsules => Self::Capsules(comparer()),
            ComparisonStrategy::Skin => Self::Skin(comparer()),
            ComparisonStrategy::Masks => {
                let edge = with_contour.then(|| ObservedEdge::new(&observed, settings.contour, tau));
                Self::Masks { observed, edge }
            }
        }
    }

    /// Compares the placed body, whose skin is already deformed; `view` is the index of this view.
    /// [`ObservedView::Capsules`] leaves the body's capsules in the frame of `camera`.
    pub(super) fn compare(
        &self,
        body: &Humanoid,
        PlacedBody { frames, capsules, skin: vertices, .. }: &mut PlacedBody,
        camera: &Camera,
        view: usize,
        scratch: &mut ViewScratch,
    ) -> MaskComparison {
        match self {
            Self::Capsules(comparer) => {
                capsules_in_camera(body, frames, camera, capsules);
                comparer.compare(&mut scratch.silhouette, capsules)
            }
            Self::Skin(comparer) => {
                let nothing = MeshTopology::default();
                let mesh = body.skin.as_ref().map_or(&nothing, |skin| skin.topology());
                comparer.compare_mesh(&mut scratch.mesh, mesh, &camera.camera_from_world, vertices)
            }
            Self::Masks { observed, edge } => {
                let (painter, model) = &mut scratch.painters[view];
                model.clear();
                painter.place(&camera.camera_from_world);
                painter.paint(body, frames, model);
                let contour = edge.as_ref().map(|edge| edge.distance_of(model));
                MaskComparison { overlap: overlap(model, observed), contour }
            }
        }
    }
}

impl ObservedEdge {
    fn new(observed: &Mask, term: ContourTerm, tau: f64) -> Self {
        let contour = contour(observed);
        let (bounds, distances) = (contour.bounds(), DistanceMap::new(&contour));
        Self { contour, bounds, distances, term, tau }
    }

    /// `[Skinned APF]`'s `D_c` of a rendered model.
    fn distance_of(&self, model: &Mask) -> f64 {
        let edge = contour(model);
        let there = truncated_mean(&edge, &self.contour, &self.distances, self.tau);
        match self.term {
            ContourTerm::OneSided => there,
            ContourTerm::TwoSided => {
                // of nothing but what lies between both contours
                let distances = DistanceMap::within(&edge, self.bounds.union(&edge.bounds()));
                0.5 * (there + truncated_mean(&self.contour, &edge, &distances, self.tau))
            }
        }
    }
}

/// Mean of `min(d, tau) / tau` over the pixels of `from`; `distances` are those to `to`. If `from` is empty: 0 if `to`
/// is empty too, else 1.
fn truncated_mean(from: &Mask, to: &Mask, distances: &DistanceMap, tau: f64) -> f64 {
    let count = from.count();
    if count == 0 {
        return if to.is_empty() { 0.0 } else { 1.0 };
    }
    from.pixels().map(|(x, y)| distances.distance(x, y).min(tau) / tau).sum::<f64>() / count as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tracker::fixture::{March, ring, seen, skinned};

    const MARCH: March = March { cycle: 8, advance: 0.05, hip: 0.1, knee: 0.6, abduction: 0.3, elbow: 0.5 };

    #[test]
    fn skin_and_mask_comparisons_agree_up_to_fixed_point_distances() {
        let (body, rig) = (skinned(), ring(3, 4.0, [320, 240]));
        let settings = SilhouetteSettings::default();
        assert_eq!(ComparisonStrategy::of(&body, &settings), ComparisonStrategy::Skin);
        let seen = seen(&body, &MARCH.pose(&body, 0), &rig, 0);
        let mut scratch = ViewScratch::new(rig.cameras.iter());
        for frame in 0..8 {
            let mut placed = PlacedBody::default();
            placed.place(&body, &MARCH.pose(&body, frame)).unwrap();
            placed.deform(&body);
            for (view, (camera, mask)) in rig.cameras.iter().zip(&seen.silhouettes).enumerate() {
                let mut by = |strategy| {
                    let observed = ObservedView::new(camera, mask.clone(), strategy, &settings);
                    observed.compare(&body, &mut placed, camera, view, &mut scratch)
                };
                let (fast, drawn) = (by(ComparisonStrategy::Skin), by(ComparisonStrategy::Masks));
                assert!(fast.overlap.union() > 1000 && fast.overlap == drawn.overlap, "{fast:?} {drawn:?}");
                let (fast, drawn) = (fast.contour.unwrap(), drawn.contour.unwrap());
                assert!((fast - drawn).abs() < 1e-5, "{fast} {drawn}");
                assert!(frame > 0 || drawn == 0.0);
            }
        }
    }

    #[test]
    fn two_sided_distances_in_the_bounds_of_both_contours_are_those_of_the_whole_image() {
        let at = |left: u32, top: u32| {
            Mask::from_fn(120, 90, |x, y| (left..left + 20).contains(&x) && (top..top + 30).contains(&y))
        };
        for (observed, model) in [(at(10, 20), at(60, 40)), (at(30, 30), at(35, 28)), (at(0, 0), Mask::new(120, 90))] {
            let (from, to) = (contour(&observed), contour(&model));
            let expected = 0.5
                * (truncated_mean(&to, &from, &DistanceMap::new(&from), 12.0)
                    + truncated_mean(&from, &to, &DistanceMap::new(&to), 12.0));
            let edge = ObservedEdge::new(&observed, ContourTerm::TwoSided, 12.0);
            assert_eq!(edge.distance_of(&model), expected);
        }
    }
}
