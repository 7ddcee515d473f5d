//! Holm's adjustment of p values for the number of tests.

/// Adjusted p values in the order of `p` (`[Holm 1979]`): the k-th smallest of m is multiplied by `m - k + 1`, never
/// falls below an earlier one and never exceeds 1. Rejecting where the result is at most 5 % makes any false rejection
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
        // 0.01 * 4, 0.02 * 3, 0.03 * 2 (below the one before, so raised to it), 0.5 * 1
        let adjusted = holm(&[0.03, 0.01, 0.5, 0.02]);
        let by_hand = [0.06, 0.04, 0.5, 0.06];
        assert!(adjusted.iter().zip(by_hand).all(|(a, b)| (a - b).abs() < 1e-12), "{adjusted:?}");
    }

    #[test]
    fn nothing_exceeds_one_and_one_test_stays_as_it_is() {
        assert_eq!(holm(&[0.6, 0.7]), [1.0, 1.0]);
        assert_eq!(holm(&[0.04]), [0.04]);
        assert!(holm(&[]).is_empty());
    }
}
