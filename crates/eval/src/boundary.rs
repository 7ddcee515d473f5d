//! Agreement of outlines, in which thin limbs count as much as the trunk.

use super::Sequence;
use super::metric::{Direction, Measurement, Metric, Unit};
use super::statistics::mean_of;

pub(super) const F: Metric = Metric {
    name: "boundary_f",
    title: "Outline agreement (boundary F)",
    meaning: "How much of the outlines of the estimate and of the observed silhouette lie within 2 px of each other",
    unit: Unit::Fraction,
    direction: Direction::HigherIsBetter,
    needs: "poses of the tracker's body (estimate_root and estimate_angles)",
    protocol: "harmonic mean of the share of the estimate's outline within 2 px of the observed one and the share of the \
               observed outline within 2 px of the estimate's, silhouettes drawn with the tracker's body; mean over cameras, \
               then over frames; frames in which both are empty are skipped",
    measure: boundary_f,
};

fn boundary_f(sequence: &Sequence<'_>) -> Option<Measurement> {
    let views = sequence.view_boundaries?;
    Some(Measurement::PerFrame(sequence.per_scored_frame(|frame| mean_of(views[frame].iter().flatten().copied()))))
}

#[cfg(test)]
mod tests {
    use crate::test_figure::standing;
    use crate::{Sequence, SilhouetteOutline, evaluate};
    use skiagraph_core::raster::Mask;

    #[test]
    fn a_missing_limb_costs_more_outline_than_area() {
        let trunk = |x: u32, y: u32| (40..80).contains(&x) && (20..100).contains(&y);
        let whole = Mask::from_fn(160, 120, |x, y| trunk(x, y) || ((80..140).contains(&x) && (50..54).contains(&y)));
        let without = Mask::from_fn(160, 120, trunk);
        let found = SilhouetteOutline::new(&without).agreement(&SilhouetteOutline::new(&whole)).unwrap();
        let overlap = crate::intersection_over_union(&without, &whole).unwrap();
        assert!(overlap > 0.9 && found < 0.85, "{overlap} {found}");
        let markers = vec![standing(); 3];
        let views = [vec![], vec![Some(0.5), None, Some(1.0)], vec![None]];
        let mut sequence = Sequence::from_markers(60.0, &markers, &markers);
        sequence.view_boundaries = Some(&views);
        assert_eq!(evaluate(&sequence).unwrap().metrics["boundary_f"].per_frame, [None, Some(0.75), None]);
    }
}
