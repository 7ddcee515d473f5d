//! Seeds for the first frame: training poses similar to the start pose, and the number of particles for each (`[GPDM
//! graph]` Eqs. 11 to 14).

use nalgebra::UnitQuaternion;

use super::super::gpdm_graph::{Candidate, GpdmGraph};
use super::super::pose_chart::distance;
use super::settings::Initialisation;

/// Width of the softmax, rad^2 per anatomical joint.
const WIDTH_PER_JOINT: f64 = 0.25 / 13.0;

/// A training pose and its share of the particles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Seed {
    pub(super) at: Candidate,
    pub(super) distance: f64,
    /// Shares of all seeds sum to one.
    pub(super) share: f64,
}

/// Local minima of the distance to the start pose that are below its mean (the apparent intent of `[GPDM graph]` Eq.
/// 11: a negative derivative selects no minimum); the nearest training pose if there are none.
pub(super) fn seeds(graph: &GpdmGraph, start: &[UnitQuaternion<f64>], rule: Initialisation) -> Vec<Seed> {
    let along: Vec<(Candidate, usize, f64)> = graph
        .segments
        .iter()
        .enumerate()
        .flat_map(|(segment, s)| {
            let here =
                move |(row, r): (usize, &Vec<_>)| (Candidate { segment, row }, s.source_of(row).0, distance(start, r));
            s.rotations.iter().enumerate().map(here)
        })
        .collect();
    let mean = along.iter().map(|(.., d)| d).sum::<f64>() / along.len().max(1) as f64;
    let of_take = |here: &(Candidate, usize, f64), other: &&(Candidate, usize, f64)| other.1 == here.1;
    let is_minimum = |i: usize| {
        let here = &along[i];
        let before = i.checked_sub(1).map(|j| &along[j]).filter(|o| of_take(here, o));
        let after = along.get(i + 1).filter(|o| of_take(here, o));
        // of equal neighbours, as in a held pose, the first
        here.2 < mean && before.is_none_or(|o| o.2 > here.2) && after.is_none_or(|o| o.2 >= here.2)
    };
    let mut found: Vec<(Candidate, f64)> =
        (0..along.len()).filter(|i| is_minimum(*i)).map(|i| (along[i].0, along[i].2)).collect();
    if found.is_empty() {
        found.extend(graph.nearest(start).map(|(segment, row, d)| (Candidate { segment, row }, d)));
    }
    let joints = graph.chart.groups().len() as f64;
    let shares = match rule {
        Initialisation::Literal => literal_shares(&found.iter().map(|f| f.1).collect::<Vec<_>>()),
        Initialisation::Softmax => {
            softmax_shares(&found.iter().map(|f| f.1).collect::<Vec<_>>(), WIDTH_PER_JOINT * joints)
        }
    };
    found.into_iter().zip(shares).map(|((at, distance), share)| Seed { at, distance, share }).collect()
}

/// `[GPDM graph]` Eqs. 12 and 13: `q = exp(-dist / sum dist)`, normalised.
pub(super) fn literal_shares(distances: &[f64]) -> Vec<f64> {
    let total: f64 = distances.iter().sum();
    normalised(distances.iter().map(|d| libm::exp(-d / total.max(f64::MIN_POSITIVE))).collect())
}

fn softmax_shares(distances: &[f64], width: f64) -> Vec<f64> {
    let least = distances.iter().copied().fold(f64::INFINITY, f64::min);
    normalised(distances.iter().map(|d| libm::exp((least - d) / width)).collect())
}

fn normalised(mut shares: Vec<f64>) -> Vec<f64> {
    let total: f64 = shares.iter().sum();
    shares.iter_mut().for_each(|share| *share /= total);
    shares
}

/// The seed of particle `index` of `count`: seeds get whole numbers of particles, by largest remainders (Eq. 14).
pub(super) fn seed_of(seeds: &[Seed], index: usize, count: usize) -> Option<&Seed> {
    let mut counts: Vec<usize> = seeds.iter().map(|s| (s.share * count as f64) as usize).collect();
    let mut order: Vec<usize> = (0..seeds.len()).collect();
    let remainder = |i: usize| seeds[i].share * count as f64 - counts[i] as f64;
    order.sort_by(|a, b| remainder(*b).total_cmp(&remainder(*a)));
    let missing = count.saturating_sub(counts.iter().sum());
    order.iter().cycle().take(missing.min(count)).for_each(|i| counts[*i] += 1);
    let mut passed = 0;
    seeds.iter().zip(&counts).find_map(|(seed, n)| {
        passed += n;
        (index < passed).then_some(seed)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seed(share: f64) -> Seed {
        Seed { at: Candidate { segment: 0, row: 0 }, distance: 0.0, share }
    }

    #[test]
    fn literal_shares_are_nearly_equal_and_softmax_shares_are_not() {
        // Eq. 12 by hand: distances 1 and 3 give exp(-1/4) and exp(-3/4)
        let literal = literal_shares(&[1.0, 3.0]);
        assert!((literal[0] / literal[1] - 0.5_f64.exp()).abs() < 1e-12);
        let softmax = softmax_shares(&[1.0, 3.0], 0.5);
        assert!((softmax[0] / softmax[1] - 4.0_f64.exp()).abs() < 1e-9);
        assert!((literal.iter().sum::<f64>() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn every_particle_has_a_seed_and_counts_match_shares_to_within_one() {
        let seeds = [seed(0.5), seed(0.3), seed(0.2)];
        for count in [1, 7, 10, 1000] {
            let mut counts = [0; 3];
            for index in 0..count {
                let found = seed_of(&seeds, index, count).unwrap();
                counts[seeds.iter().position(|s| s.share == found.share).unwrap()] += 1;
            }
            assert_eq!(counts.iter().sum::<usize>(), count);
            for (n, s) in counts.iter().zip(&seeds) {
                assert!((*n as f64 - s.share * count as f64).abs() < 1.0, "{counts:?} of {count}");
            }
        }
    }
}
