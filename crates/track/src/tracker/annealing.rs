//! Particle weights of an annealing layer (`[Skinned APF]` Eq. 2 and 4) and systematic resampling.

/// The weights of one layer's particles.
#[derive(Clone, Debug, PartialEq)]
pub struct Selection {
    /// `[Skinned APF]`'s lambda_m; 0 if all valid particles have the same weight.
    pub lambda: f64,
    /// Normalised weights, one per particle, 0 for invalid ones.
    pub weights: Vec<f64>,
    /// `1 / sum w^2`.
    pub effective_sample_size: f64,
    /// Whether Eq. 4 has no regular solution; see [`select`].
    pub degenerate: bool,
}

/// Solves `[Skinned APF]` Eq. 4 for lambda and returns the weights of Eq. 2, `w_i = exp(-lambda E_i)`, normalised.
///
/// With alpha the `survival_rate` in (0, 1] and N the number of all particles, including invalid ones (energy not
/// finite, weight 0), Eq. 4 reads `f(lambda) = (sum w)^2 / (N sum w^2) = alpha`: the effective sample size is alpha N.
/// f is continuous and non-increasing, from n/N at lambda = 0 (n valid particles) to k/N (k particles share the lowest
/// energy), so bracketing and geometric bisection find the root to 1e-4 in f. Energies are shifted by their minimum, so
/// that no weight overflows.
///
/// There is no root, and the result is marked degenerate, if
/// * n <= alpha N: too many particles are invalid; lambda = 0.
/// * all energies are equal: there is nothing to select; lambda = 0.
/// * k >= alpha N: there are ties; lambda is capped at the value where all other weights vanish.
///
/// `None` if no energy is finite.
pub fn select(energies: &[f64], survival_rate: f64) -> Option<Selection> {
    let valid: Vec<f64> = energies.iter().copied().filter(|e| e.is_finite()).collect();
    let least = valid.iter().copied().reduce(f64::min)?;
    let excess: Vec<f64> = valid.iter().map(|e| e - least).collect();
    let target = survival_rate * energies.len() as f64;
    let (lambda, degenerate) = solve(&excess, target, valid.len() == energies.len());
    let mut weights: Vec<f64> =
        energies.iter().map(|e| if e.is_finite() { libm::exp(-lambda * (e - least)) } else { 0.0 }).collect();
    let sum: f64 = weights.iter().sum();
    weights.iter_mut().for_each(|w| *w /= sum);
    let effective_sample_size = 1.0 / weights.iter().map(|w| w * w).sum::<f64>();
    Some(Selection { lambda, weights, effective_sample_size, degenerate })
}

/// Lambda for which the effective sample size is `target`, and whether it is a fallback.
fn solve(excess: &[f64], target: f64, all_valid: bool) -> (f64, bool) {
    let count = excess.len() as f64;
    let ties = excess.iter().filter(|e| **e == 0.0).count() as f64;
    if ties == count {
        return (0.0, true);
    }
    if count <= target {
        return (0.0, !all_valid);
    }
    if ties >= target {
        return (extinction(excess), true);
    }
    let mean = excess.iter().sum::<f64>() / count;
    let (mut low, mut high) = bracket(excess, target, 1.0 / mean);
    for _ in 0..200 {
        let middle = low.sqrt() * high.sqrt();
        let size = effective_sample_size(excess, middle);
        if (size - target).abs() < 1e-4 * target || middle <= low || middle >= high {
            return (middle, false);
        }
        if size > target { low = middle } else { high = middle }
    }
    (low.sqrt() * high.sqrt(), false)
}

/// Two lambdas, a factor of two apart, that bracket the effective sample size `target`.
fn bracket(excess: &[f64], target: f64, guess: f64) -> (f64, f64) {
    let mut high = guess.clamp(f64::MIN_POSITIVE, f64::MAX);
    while high < f64::MAX && effective_sample_size(excess, high) > target {
        high = (2.0 * high).min(f64::MAX);
    }
    let mut low = 0.5 * high;
    while low > f64::MIN_POSITIVE && effective_sample_size(excess, low) < target {
        (low, high) = (0.5 * low, low);
    }
    (low, high)
}

/// A lambda at which all weights but those of the lowest energy are below 1e-21.
fn extinction(excess: &[f64]) -> f64 {
    let gap = excess.iter().copied().filter(|e| *e > 0.0).fold(f64::MAX, f64::min);
    (50.0 / gap).min(f64::MAX)
}

fn effective_sample_size(excess: &[f64], lambda: f64) -> f64 {
    let (mut sum, mut squares) = (0.0, 0.0);
    for e in excess {
        let w = libm::exp(-lambda * e);
        sum += w;
        squares += w * w;
    }
    sum * sum / squares
}

/// Systematic resampling (`[Kitagawa 1996]`): returns one ancestor per weight, in order. `weights` sum to one; `offset`
/// is uniform in [0, 1). Particle i is drawn `floor(N w_i)` or `ceil(N w_i)` times.
pub fn systematic(weights: &[f64], offset: f64) -> Vec<usize> {
    let count = weights.len();
    let mut ancestors = Vec::with_capacity(count);
    let mut cumulative = 0.0;
    for (i, weight) in weights.iter().enumerate() {
        cumulative += weight;
        while ancestors.len() < count && (ancestors.len() as f64 + offset) < cumulative * count as f64 {
            ancestors.push(i);
        }
    }
    // Rounding can leave the sum of the weights just below one, so that the last draw finds no particle.
    ancestors.resize(count, heaviest(weights));
    ancestors
}

/// Index of the largest weight, the first one if tied; 0 for no weights.
pub(super) fn heaviest(weights: &[f64]) -> usize {
    weights.iter().enumerate().fold(0, |best, (i, w)| if *w > weights[best] { i } else { best })
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;
    use proptest::prelude::*;

    use super::*;

    /// `good` of n particles have energy 0, the others `gap`: with q = exp(-lambda gap), Eq. 4 is a quadratic in q.
    fn two_level_lambda(good: f64, n: f64, gap: f64, alpha: f64) -> f64 {
        let bad = n - good;
        // (good + bad q)^2 = alpha n (good + bad q^2)
        let (a, b, c) = (bad * bad - alpha * n * bad, 2.0 * good * bad, good * good - alpha * n * good);
        let root = (b * b - 4.0 * a * c).sqrt();
        let q = [(-b + root) / (2.0 * a), (-b - root) / (2.0 * a)].into_iter().find(|q| (0.0..1.0).contains(q));
        -q.unwrap().ln() / gap
    }

    #[test]
    fn two_energy_levels_give_the_root_of_a_quadratic() {
        for (good, gap, alpha) in [(10_u8, 0.3, 0.5), (1, 1e-5, 0.3), (40, 7.0, 0.75), (99, 2.0, 0.995)] {
            let energies: Vec<f64> = (0..100).map(|i| if i < good { 0.2 } else { 0.2 + gap }).collect();
            let found = select(&energies, alpha).unwrap();
            let expected = two_level_lambda(f64::from(good), 100.0, energies[99] - energies[0], alpha);
            assert!(!found.degenerate);
            assert_relative_eq!(found.effective_sample_size, 100.0 * alpha, max_relative = 2e-4);
            assert_relative_eq!(found.lambda, expected, max_relative = 5e-2);
            let weight_ratio = found.weights[99] / found.weights[0];
            assert_relative_eq!(weight_ratio, libm::exp(-expected * gap), max_relative = 1e-2);
        }
    }

    #[test]
    fn linear_energies_of_many_particles_approach_the_integral() {
        // E uniform on [0, 1]: f = 2 (1 - q) / (lambda (1 + q)), q = exp(-lambda).
        let n = 4000;
        let energies: Vec<f64> = (0..n).map(|i| (f64::from(i) + 0.5) / f64::from(n)).collect();
        let found = select(&energies, 0.5).unwrap();
        let q = (-found.lambda).exp();
        assert_relative_eq!(2.0 * (1.0 - q) / (found.lambda * (1.0 + q)), 0.5, max_relative = 1e-3);
    }

    #[test]
    fn equal_tied_and_invalid_energies_are_degenerate_and_the_survival_of_all_selects_nothing() {
        let invalid = [1.0, f64::NAN, f64::INFINITY, 2.0, f64::NAN];
        let third = 1.0 / 3.0;
        for (energies, rate, degenerate, weights) in [
            (&[3.0; 8][..], 0.5, true, &[0.125; 8][..]),
            (&[1.0, 1.0, 1.0, 2.0][..], 0.5, true, &[third, third, third, 0.0][..]),
            (&invalid[..], 0.5, true, &[0.5, 0.0, 0.0, 0.5, 0.0][..]),
            (&[1.0, 2.0, 3.0][..], 1.0, false, &[third; 3][..]),
        ] {
            let found = select(energies, rate).unwrap();
            assert_eq!(found.degenerate, degenerate, "{energies:?}");
            assert!(found.weights.iter().zip(weights).all(|(a, b)| (a - b).abs() < 1e-12), "{found:?}");
        }
    }

    #[test]
    fn no_valid_particle_gives_nothing() {
        assert!(select(&[f64::NAN, f64::INFINITY], 0.5).is_none());
        assert!(select(&[], 0.5).is_none());
    }

    proptest! {
        #[test]
        fn effective_sample_size_never_rises_with_lambda(
            energies in proptest::collection::vec(0.0_f64..5.0, 2..60), lambda in 1e-3_f64..1e3, factor in 1.0_f64..10.0,
        ) {
            let least = energies.iter().copied().fold(f64::MAX, f64::min);
            let excess: Vec<f64> = energies.iter().map(|e| e - least).collect();
            let sharper = effective_sample_size(&excess, lambda * factor);
            prop_assert!(sharper <= effective_sample_size(&excess, lambda) * (1.0 + 1e-12));
        }

        #[test]
        fn a_regular_solution_keeps_the_survival_rate_at_any_scale(
            energies in proptest::collection::vec(0.1_f64..1.0, 5..80),
            alpha in 0.05_f64..0.95, exponent in -12_i32..12, offset in -1e3_f64..1e3,
        ) {
            let scaled: Vec<f64> = energies.iter().map(|e| (e + offset) * 10_f64.powi(exponent)).collect();
            let found = select(&scaled, alpha).unwrap();
            prop_assert!(found.weights.iter().all(|w| w.is_finite()));
            if !found.degenerate {
                let rate = found.effective_sample_size / scaled.len() as f64;
                prop_assert!((rate - alpha).abs() < 2e-4, "{rate} is not {alpha}");
            }
        }
    }

    #[test]
    fn a_particle_of_weight_one_is_drawn_every_time_and_equal_weights_keep_all() {
        assert_eq!(systematic(&[0.0, 1.0, 0.0], 0.999), [1, 1, 1]);
        assert_eq!(systematic(&[0.25; 4], 0.5), [0, 1, 2, 3]);
    }

    proptest! {
        #[test]
        fn every_particle_is_drawn_within_one_of_its_share(
            raw in proptest::collection::vec(0.0_f64..1.0, 1..50), offset in 0.0_f64..1.0,
        ) {
            let sum: f64 = raw.iter().sum::<f64>() + 1e-9;
            let mut weights: Vec<f64> = raw.iter().map(|w| w / sum).collect();
            weights[0] += 1e-9 / sum;
            let ancestors = systematic(&weights, offset);
            prop_assert_eq!(ancestors.len(), weights.len());
            for (i, w) in weights.iter().enumerate() {
                let drawn = ancestors.iter().filter(|a| **a == i).count() as f64;
                let share = w * weights.len() as f64;
                prop_assert!((drawn - share).abs() < 1.0 + 1e-9, "particle {i}: {drawn} draws for a share of {share}");
            }
        }
    }
}
