//! Body parts for partitioned sampling.

use super::refinement::arms_and_legs;
use skiagraph_core::body::{Humanoid, ROOT_STEP};

/// Partitioned sampling (`[MacCormick 2000]`): assigns each component of a pose step to a body part.
///
/// The layers of a frame are divided evenly: the first ones spread and select particles in the trunk (root, spine and
/// head), the next ones in an arm given the selected trunk, and so on, limb by limb. Each part starts with its own P_0,
/// which shrinks from layer to layer as in annealing.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Partition {
    /// For each part, whether it contains each component of a step.
    parts: Vec<Vec<bool>>,
}

impl Partition {
    /// Trunk, left arm, right arm, left leg and right leg, if the body has them.
    pub fn of_body(body: &Humanoid) -> Self {
        let numbers = body.step_len();
        let limbs = arms_and_legs(body).into_iter().filter(|limb| !limb.is_empty());
        let limbs: Vec<Vec<bool>> = limbs
            .map(|limb| (0..numbers).map(|n| n >= ROOT_STEP && limb.contains(&(n - ROOT_STEP))).collect())
            .collect();
        let trunk = (0..numbers).map(|number| limbs.iter().all(|limb| !limb[number])).collect();
        Self { parts: [vec![trunk], limbs].concat() }
    }

    /// Number of parts.
    pub fn count(&self) -> usize {
        self.parts.len()
    }

    /// Deviations of the noise before layer `layer` (from 0) of `layers`, which is at least the number of parts.
    /// `whole` are the square roots of P_0.
    pub(super) fn deviations(&self, whole: &[f64], layer: usize, layers: usize, survival_rate: f64) -> Vec<f64> {
        let part = layer * self.parts.len() / layers;
        let first = (part * layers).div_ceil(self.parts.len());
        let shrunk = (first..layer).fold(1.0, |factor, _| factor * survival_rate.sqrt());
        whole.iter().zip(&self.parts[part]).map(|(d, has)| if *has { shrunk * d } else { 0.0 }).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_component_of_a_step_belongs_to_one_part_and_the_root_to_the_trunk() {
        for (robot, trunk) in [("tracker25", 6 + 3), ("tracker40", 6 + 3 + 3)] {
            let body = skiagraph_core::body::shipped(robot).unwrap();
            let partition = Partition::of_body(&body);
            assert_eq!(partition.count(), 5, "{robot}");
            for number in 0..body.step_len() {
                assert_eq!(partition.parts.iter().filter(|part| part[number]).count(), 1, "{robot} {number}");
            }
            assert!((0..ROOT_STEP).all(|number| partition.parts[0][number]));
            assert!(partition.parts[0].iter().filter(|has| **has).count() >= trunk, "{robot}");
        }
    }

    #[test]
    fn layers_are_divided_evenly_and_every_part_starts_with_its_full_noise() {
        let partition = Partition::of_body(&skiagraph_core::body::shipped("tracker25").unwrap());
        let whole = vec![1.0; 25];
        // 12 layers for 5 parts: 3, 2, 3, 2, 2
        let found: Vec<f64> =
            (0..12).map(|k| partition.deviations(&whole, k, 12, 0.25).iter().copied().fold(0.0, f64::max)).collect();
        assert_eq!(found, [1.0, 0.5, 0.25, 1.0, 0.5, 1.0, 0.5, 0.25, 1.0, 0.5, 1.0, 0.5]);
        let moved: f64 = (0..5).map(|k| partition.deviations(&whole, k, 5, 0.5).iter().sum::<f64>()).sum();
        assert_eq!(moved, 25.0, "five layers: every number once");
    }
}
