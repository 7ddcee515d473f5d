//! Divides an error among its causes.
//!
//! With `E(S)` the error with the inputs of `S` true, the part of input `k` of `n` is its Shapley value (`[Shapley
//! 1953]`): the mean over all orders of correcting the inputs of how much the correction of `k` reduces the error:
//!
//! `phi_k = sum over S without k of |S|! (n - |S| - 1)! / n! (E(S) - E(S and k))`.
//!
//! The parts add up to `E(nothing) - E(all inputs)`. The search comes after all inputs (the asymmetric values of `[Frye
//! 2020]`): it is led astray by its inputs, a wrong start pose above all, and would otherwise be charged with half of
//! their effect. Its part is `E(all inputs) - E(all inputs, descent from the truth)`.

use super::errors::ErrorProfile;

/// A set of inputs: bit `k` is set if input `k` is true.
pub(super) type Subset = u32;

/// The subsets whose errors are needed, with `quick` only the single inputs and all together; the empty one first.
pub(super) fn subsets(inputs: usize, quick: bool) -> Vec<Subset> {
    let all: Subset = (1 << inputs) - 1;
    let is_needed = |subset: &Subset| !quick || subset.count_ones() <= 1 || *subset == all;
    (0..=all).filter(is_needed).collect()
}

/// Shapley values of the inputs of one seed; `error(S)` must be known for every subset.
pub(super) fn shapley<'a>(inputs: usize, error: impl Fn(Subset) -> &'a ErrorProfile) -> Vec<ErrorProfile> {
    let frames = error(0).frames.len();
    let part = |input: usize| {
        let mut sum = ErrorProfile::zero(frames);
        let own = 1 << input;
        for subset in (0..1 << inputs).filter(|subset: &Subset| subset & own == 0) {
            let weight = weight(inputs, subset.count_ones() as usize);
            sum.add(weight, error(subset));
            sum.add(-weight, error(subset | own));
        }
        sum
    };
    (0..inputs).map(part).collect()
}

/// `s! (n - s - 1)! / n!`.
fn weight(inputs: usize, size: usize) -> f64 {
    let factorial = |n: usize| (1..=n).map(|k| k as f64).product::<f64>();
    factorial(size) * factorial(inputs - size - 1) / factorial(inputs)
}

/// The effects of single inputs of one seed, and what their sum lacks or exceeds: the interaction.
pub(super) fn single<'a>(
    inputs: usize,
    error: impl Fn(Subset) -> &'a ErrorProfile,
) -> (Vec<ErrorProfile>, ErrorProfile) {
    let parts: Vec<ErrorProfile> = (0..inputs).map(|input| error(0).minus(error(1 << input))).collect();
    let mut interaction = error(0).minus(error((1 << inputs) - 1));
    parts.iter().for_each(|part| interaction.add(-1.0, part));
    (parts, interaction)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error(total: f64) -> ErrorProfile {
        ErrorProfile { total, ..ErrorProfile::zero(0) }
    }

    #[test]
    fn shapley_values_of_the_glove_game_and_their_sum() {
        // one left glove (input 0) and two right ones: the value of a pair is 1, and the values are 2/3, 1/6, 1/6
        let errors: Vec<ErrorProfile> =
            (0..8).map(|s: u32| error(if s & 1 == 1 && s & 6 != 0 { 0.0 } else { 1.0 })).collect();
        let parts: Vec<f64> = shapley(3, |s| &errors[s as usize]).iter().map(|part| part.total).collect();
        for (part, expected) in parts.iter().zip([2.0 / 3.0, 1.0 / 6.0, 1.0 / 6.0]) {
            assert!((part - expected).abs() < 1e-12, "{parts:?}");
        }
        let (single, interaction) = single(3, |s| &errors[s as usize]);
        assert!(single.iter().all(|part| part.total == 0.0) && interaction.total == 1.0, "no input alone helps");
    }

    #[test]
    fn parts_of_an_additive_error_are_its_terms_in_both_ways() {
        let terms = [3.0, 5.0, 11.0];
        let rest = |s: u32| (0..3).filter(|k| s & (1 << k) == 0).map(|k| terms[k as usize]).sum::<f64>();
        let errors: Vec<ErrorProfile> = (0..8).map(|s| error(1.0 + rest(s))).collect();
        let (single, interaction) = single(3, |s| &errors[s as usize]);
        assert!(interaction.total.abs() < 1e-12);
        for (parts, term) in shapley(3, |s| &errors[s as usize]).iter().zip(&single).zip(terms) {
            assert!((parts.0.total - term).abs() < 1e-12 && (parts.1.total - term).abs() < 1e-12);
        }
    }

    #[test]
    fn quick_needs_single_inputs_and_all_together() {
        assert_eq!(subsets(3, true), [0, 1, 2, 4, 7]);
        assert_eq!(subsets(3, false).len(), 8);
        assert_eq!(subsets(1, true), [0, 1]);
        assert_eq!(subsets(0, false), [0]);
    }
}
