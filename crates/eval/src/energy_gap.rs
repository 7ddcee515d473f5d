//! Whether search or model causes the error: energy of the truth against energy of the estimate.

use super::Sequence;
use super::metric::{Direction, Measurement, Metric, Unit};

pub(super) const GAP: Metric = Metric {
    name: "energy_gap",
    title: "Energy gap, truth minus estimate",
    meaning: "Above 0, the images prefer the estimate to the truth; below 0, the search missed a better pose",
    unit: Unit::Energy,
    direction: Direction::Neither,
    needs: "a tracker with a likelihood, or another program's poses of the set's body (estimate_root and \
        estimate_angles)",
    protocol: "energy of the true pose refitted to the tracker's body minus energy of the estimate, under \
               {likelihood}; positive: the likelihood prefers the estimate, so the likelihood or the body model \
               causes the error; zero or negative with a large error: the search causes it; mean over frames",
    measure: gap,
};

fn gap(sequence: &Sequence<'_>) -> Option<Measurement> {
    let energies = sequence.energies?;
    Some(Measurement::PerFrame(
        sequence.per_scored_frame(|frame| Some(energies.truth[frame]? - energies.estimate[frame]?)),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_figure::standing;
    use crate::{Energies, evaluate};

    #[test]
    fn the_gap_is_positive_if_the_likelihood_prefers_the_estimate() {
        let markers = vec![standing(); 4];
        let (truth, estimate) =
            ([Some(9.0), Some(0.5), Some(0.3), None], [Some(0.0), Some(0.25), Some(0.5), Some(1.0)]);
        let mut sequence = Sequence::from_markers(60.0, &markers, &markers);
        sequence.energies = Some(Energies { truth: &truth, estimate: &estimate, is_own: true });
        let metrics = evaluate(&sequence).unwrap().metrics;
        assert_eq!(metrics["energy_gap"].per_frame, [None, Some(0.25), Some(-0.2), None]);
        assert!((metrics["energy_gap"].mean - 0.025).abs() < 1e-12);
    }
}
