//! Drawing the survivors of a layer.

/// Systematic resampling (`[Kitagawa 1996]`): as many ancestors as weights, in order. `weights` sum to one, `offset`
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
    // Rounding can leave the sum of the weights just below one and the last draw open.
    ancestors.resize(count, heaviest(weights));
    ancestors
}

/// The first particle that none outweighs; 0 without any.
pub(super) fn heaviest(weights: &[f64]) -> usize {
    weights.iter().enumerate().fold(0, |best, (i, w)| if *w > weights[best] { i } else { best })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_certain_particle_takes_every_place() {
        assert_eq!(systematic(&[0.0, 1.0, 0.0], 0.999), [1, 1, 1]);
    }

    #[test]
    fn equal_weights_keep_every_particle() {
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
