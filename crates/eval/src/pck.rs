//! Share of markers within a threshold (PCK), and its curve over thresholds.

use serde::{Deserialize, Serialize};

use super::Sequence;
use super::metric::{Direction, Measurement, Metric, Unit};
use super::statistics::mean_of;

const PCK_THRESHOLD_MM: f64 = 150.0;

pub(super) const PCK: Metric = Metric {
    name: "pck150",
    title: "Markers within 150 mm (PCK)",
    meaning: "Share of the markers that are at most 150 mm off",
    unit: Unit::Fraction,
    direction: Direction::HigherIsBetter,
    needs: "markers of the truth",
    protocol: "share of the 15 virtual markers at most 150 mm from the truth in the world, no alignment; a marker missing \
               in the estimate counts as wrong; mean of frame means",
    measure: |sequence| {
        let correct = |frame| MarkerDistances::new(sequence, frame).correct(PCK_THRESHOLD_MM);
        Some(Measurement::PerFrame(sequence.per_scored_frame(correct)))
    },
};

pub(super) const AUC: Metric = Metric {
    name: "auc150",
    title: "Area under the PCK curve",
    meaning: "Share of the markers within a distance, averaged over 0 to 150 mm: small errors count too",
    unit: Unit::Fraction,
    direction: Direction::HigherIsBetter,
    needs: "markers of the truth",
    protocol: "mean of PCK at the 31 thresholds 0, 5, ... 150 mm (as for MPI-INF-3DHP, but in the world, no alignment); a \
               marker missing in the estimate counts as wrong; mean of frame means",
    measure: |sequence| {
        let area = |frame| {
            let distances = MarkerDistances::new(sequence, frame);
            mean_of(thresholds().filter_map(|threshold| distances.correct(threshold)))
        };
        Some(Measurement::PerFrame(sequence.per_scored_frame(area)))
    },
};

/// One point of the PCK curve.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CurvePoint {
    /// Threshold, millimetres.
    pub threshold_mm: f64,
    /// Share of markers with at most that error.
    pub fraction: f64,
}

fn thresholds() -> impl Iterator<Item = f64> {
    (0..=30).map(|step| 5.0 * f64::from(step))
}

/// Distances of one frame, computed once for all thresholds.
struct MarkerDistances {
    asked: usize,
    distances_mm: Vec<f64>,
}

impl MarkerDistances {
    fn new(sequence: &Sequence<'_>, frame: usize) -> Self {
        Self { asked: sequence.truth_markers.count(frame), distances_mm: sequence.distances_mm(frame).collect() }
    }

    /// Share of the truth's markers with at most that distance; `None` if the truth has none.
    fn correct(&self, threshold_mm: f64) -> Option<f64> {
        let met = self.distances_mm.iter().filter(|distance| **distance <= threshold_mm).count();
        (self.asked > 0).then(|| met as f64 / self.asked as f64)
    }
}

/// The curve whose area is [`AUC`]: mean over scored frames at every threshold.
pub(super) fn curve(sequence: &Sequence<'_>) -> Vec<CurvePoint> {
    let mut sums: Vec<(f64, f64)> = thresholds().map(|threshold| (threshold, 0.0)).collect();
    let mut frames = 0_usize;
    for frame in sequence.scored() {
        let distances = MarkerDistances::new(sequence, frame);
        frames += usize::from(distances.asked > 0);
        for (threshold, sum) in &mut sums {
            *sum += distances.correct(*threshold).unwrap_or(0.0);
        }
    }
    let point = |(threshold_mm, sum)| CurvePoint { threshold_mm, fraction: sum / frames as f64 };
    if frames == 0 { vec![] } else { sums.into_iter().map(point).collect() }
}

#[cfg(test)]
mod tests {
    use crate::mean;
    use crate::test_figure::{evaluate_markers, standing};
    use nalgebra::Vector3;
    use skiagraph_core::body::Markers;

    #[test]
    fn the_area_is_the_mean_of_the_curve() {
        // marker 0 is right, marker `k` is `10 k` mm off
        let mut estimate: Markers = standing();
        for (k, marker) in estimate.iter_mut().enumerate() {
            *marker = marker.map(|p| p + Vector3::new(0.0, 0.010 * k as f64, 0.0));
        }
        let evaluation = evaluate_markers(&[standing(); 3], &[estimate; 3]);
        let fractions: Vec<f64> = evaluation.pck_curve.iter().map(|point| point.fraction).collect();
        assert_eq!(fractions.len(), 31);
        assert!((mean(&fractions).unwrap() - evaluation.metrics["auc150"].mean).abs() < 1e-12);
        assert!(fractions.is_sorted());
    }
}
