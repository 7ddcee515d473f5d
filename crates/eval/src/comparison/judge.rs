//! What can be said of the differences of all metrics together.

use super::compared::{ComparedMetric, Finding};
use super::difference::{Difference, DifferenceRule};
use super::holm::holm;
use crate::{Direction, find_metric};

/// A finding holds where its p value, adjusted for the number of metrics, is at most this.
const SIGNIFICANCE: f64 = 0.05;

/// Adjusts p values over all metrics of the estimate, and says what holds.
pub(super) fn judge(metrics: &mut [ComparedMetric]) {
    // what is said of the actor is no test of the tracker
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
        _ => Finding::NotShown,
    }
}
