//! What one camera saw, ready to be compared with thousands of poses.

use super::placed_body::PlacedBody;
use super::{ContourTerm, SilhouetteSettings};
use crate::body::{Humanoid, SilhouettePainter, capsules_in_camera};
use crate::camera::Camera;
use crate::raster::{DistanceMap, Mask, MaskComparison, SilhouetteComparer, SilhouetteScratch, contour, overlap};

/// An observed silhouette in an ideal pinhole's pixels, and what it takes to compare it.
#[derive(Debug)]
pub(super) enum ObservedView {
    /// For bodies of tapered capsules and one-sided contours.
    Capsules(SilhouetteComparer),
    /// For any solids: the model is drawn into a mask.
    Masks {
        observed: Mask,
        /// What the contour term needs; `None` where it weighs nothing.
        edge: Option<ObservedEdge>,
    },
}

/// The contour of an observed silhouette.
#[derive(Debug)]
pub(super) struct ObservedEdge {
    contour: Mask,
    distances: DistanceMap,
    term: ContourTerm,
    /// Saturation distance, pixels.
    tau: f64,
}

/// Buffers of one thread for all views.
pub(super) struct ViewScratch {
    silhouette: SilhouetteScratch,
    /// One per view of [`ObservedView::Masks`].
    painters: Vec<(SilhouettePainter, Mask)>,
}

impl ViewScratch {
    /// Buffers; `painted` lists the cameras of the views that are drawn into masks.
    pub(super) fn new<'a>(painted: impl Iterator<Item = &'a Camera>) -> Self {
        let painter = |camera: &Camera| {
            let mask = Mask::new(camera.pinhole.width, camera.pinhole.height);
            (SilhouettePainter::new(camera), mask)
        };
        Self { silhouette: SilhouetteScratch::default(), painters: painted.map(painter).collect() }
    }
}

impl ObservedView {
    /// Prepares what `camera`, an ideal one, saw.
    pub(super) fn new(camera: &Camera, observed: Mask, fast: bool, settings: &SilhouetteSettings) -> Self {
        let tau = settings.contour_reach * f64::from(camera.pinhole.height);
        let with_contour = settings.contour_weight > 0.0;
        if fast {
            let tau = with_contour.then_some(tau);
            return Self::Capsules(SilhouetteComparer::new(&camera.pinhole, &observed, tau));
        }
        let edge = with_contour.then(|| ObservedEdge::new(&observed, settings.contour, tau));
        Self::Masks { observed, edge }
    }

    /// Compares the body as it is placed; `view` is this view's number. [`ObservedView::Capsules`] leaves its capsules
    /// in the frame of `camera`.
    pub(super) fn compare(
        &self,
        body: &Humanoid,
        PlacedBody { frames, capsules }: &mut PlacedBody,
        camera: &Camera,
        view: usize,
        scratch: &mut ViewScratch,
    ) -> MaskComparison {
        match self {
            Self::Capsules(comparer) => {
                capsules_in_camera(body, frames, camera, capsules);
                comparer.compare(&mut scratch.silhouette, capsules)
            }
            Self::Masks { observed, edge } => {
                let (painter, model) = &mut scratch.painters[view];
                model.clear();
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
        let distances = DistanceMap::new(&contour);
        Self { contour, distances, term, tau }
    }

    /// `[Skinned APF]`'s `D_c` of a drawn model.
    fn distance_of(&self, model: &Mask) -> f64 {
        let edge = contour(model);
        let there = truncated_mean(&edge, &self.contour, &self.distances, self.tau);
        match self.term {
            ContourTerm::OneSided => there,
            ContourTerm::TwoSided => {
                0.5 * (there + truncated_mean(&self.contour, &edge, &DistanceMap::new(&edge), self.tau))
            }
        }
    }
}

/// Mean over the pixels of `from` of `min(d, tau) / tau`, `distances` being those to `to`. No pixels score 0 against
/// none, else 1.
fn truncated_mean(from: &Mask, to: &Mask, distances: &DistanceMap, tau: f64) -> f64 {
    let count = from.count();
    if count == 0 {
        return if to.is_empty() { 0.0 } else { 1.0 };
    }
    from.pixels().map(|(x, y)| distances.distance(x, y).min(tau) / tau).sum::<f64>() / count as f64
}
