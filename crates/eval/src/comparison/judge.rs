//! Conclusions from the differences of all metrics together.

use super::compared::{ComparedMetric, Finding};
use super::difference::{Difference, DifferenceRule};
use crate::{Direction, find_metric};

/// Greatest p value of a finding, adjusted for the number of metrics.
const SIGNIFICANCE: f64 = 0.05;

/// Adjusts p values over all metrics of the estimate, and sets the findings.
pub(super) fn judge(metrics: &mut [ComparedMetric]) {
    // metrics of the actor do not test the tracker
    let of_estimate = |metric: &ComparedMetric| !metric.metric.starts_with("truth_");
    let tested: Vec<usize> =
        (0..metrics.len()).filter(|i| of_estimate(&metrics[*i]) && metrics[*i].difference.p.is_some()).collect();
    let p: Vec<f64> = tested.iter().filter_map(|i| metrics[*i].difference.p).collect();
    for (index, adjusted) in tested.into_iter().zip(holm(&p)) {
        metrics[index].p_holm = Some(adjusted);
    }
    metrics.iter_mut().for_each(|metric| metric.finding = finding(metric));
}

fn finding(metric: &ComparedMetric) -> Finding {
    let Difference { base, other, rule, difference, .. } = metric.difference;
    let is_worse = find_metric(&metric.metric).is_some_and(|m| m.is_worse(other, base));
    let direction = match (metric.direction, is_worse) {
        (Direction::Neither, _) => Finding::Differs,
        (_, true) => Finding::Worse,
        (_, false) => Finding::Better,
    };
    match rule {
        DifferenceRule::Exact if difference == 0.0 => Finding::Same,
        DifferenceRule::TooFew => Finding::TooFew,
        _ if metric.p_holm.is_some_and(|p| p <= SIGNIFICANCE) => direction,
        // all runs differ one way by the same: only their number keeps p above the limit
        DifferenceRule::Exact if metric.p_holm.is_some() => Finding::TooFew,
        _ => Finding::NotShown,
    }
}

/// Adjusted p values in the order of `p` (`[Holm 1979]`): the k-th smallest of m is multiplied by `m - k + 1`, never
/// falls below an earlier one and never exceeds 1. Rejecting if the result is at most 5 % makes any false rejection
/// among all tests happen at most 5 % of the time, whatever their dependence.
pub fn holm(p: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..p.len()).collect();
    order.sort_by(|a, b| p[*a].total_cmp(&p[*b]));
    let mut adjusted = vec![0.0; p.len()];
    let mut greatest: f64 = 0.0;
    for (rank, index) in order.into_iter().enumerate() {
        greatest = greatest.max((p.len() - rank) as f64 * p[index]).min(1.0);
        adjusted[index] = greatest;
    }
    adjusted
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn four_p_values_are_adjusted_as_by_hand() {
        // 0.01 * 4, 0.02 * 3, 0.03 * 2 (below the previous one, so raised to it), 0.5 * 1
        let adjusted = holm(&[0.03, 0.01, 0.5, 0.02]);
        let by_hand = [0.06, 0.04, 0.5, 0.06];
        assert!(adjusted.iter().zip(by_hand).all(|(a, b)| (a - b).abs() < 1e-12), "{adjusted:?}");
        // nothing exceeds 1, and a single test is unchanged
        assert_eq!(holm(&[0.6, 0.7]), [1.0, 1.0]);
        assert_eq!(holm(&[0.04]), [0.04]);
        assert!(holm(&[]).is_empty());
    }
}
