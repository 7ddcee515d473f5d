//! Faults that come in stretches.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Whether a fault is present, frame by frame: a Markov chain of two states in continuous time.
pub(super) struct Stretches {
    random: ChaCha8Rng,
    is_present: Option<bool>,
}

impl Stretches {
    pub(super) fn new(random: ChaCha8Rng) -> Self {
        Self { random, is_present: None }
    }

    /// The state `step_s` seconds later (at the first call: of the first frame), for a fault that is present in a
    /// `share` of the time, `mean_s` seconds at a time.
    pub(super) fn step(&mut self, share: f64, mean_s: f64, step_s: f64) -> bool {
        let drawn: f64 = self.random.random();
        // both rates of the chain, 1 / L and share / ((1 - share) L), make it forget at their sum, 1 / (L (1 - share))
        let forgotten = 1.0 - libm::exp(-step_s / (mean_s * (1.0 - share)));
        let chance = match self.is_present {
            None => share,
            Some(false) => share * forgotten,
            Some(true) => 1.0 - (1.0 - share) * forgotten,
        };
        let is_present = drawn < chance;
        self.is_present = Some(is_present);
        is_present
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use skiagraph_core::rng::{Purpose, stream};

    const FRAMES: usize = 100_000;

    fn states(share: f64, mean_s: f64) -> Vec<bool> {
        let mut chain = Stretches::new(stream(3, Purpose::Keypoints, 0, 0, 0));
        (0..FRAMES).map(|_| chain.step(share, mean_s, 0.02)).collect()
    }

    #[test]
    fn the_share_of_time_and_the_mean_length_of_stretches_are_those_of_the_settings() {
        for (share, mean_s) in [(0.05, 0.2), (0.3, 0.5), (0.6, 0.4)] {
            let states = states(share, mean_s);
            let present = states.iter().filter(|state| **state).count() as f64;
            let begun = states.windows(2).filter(|pair| !pair[0] && pair[1]).count() as f64;
            // stretches are correlated: the number of independent pieces is that of the stretches, some 500 or more
            assert!((present / FRAMES as f64 - share).abs() < 0.15 * share, "{share}: {present}");
            // seen at frames, a stretch lasts at least one; the chance of leaving within a step is known exactly
            let expected = 0.02 / ((1.0 - share) * (1.0 - (-0.02 / (mean_s * (1.0 - share))).exp()));
            let length = 0.02 * present / begun;
            assert!((length - expected).abs() < 0.1 * expected, "{share}: {length}, expected {expected}");
            assert!((expected - mean_s).abs() < 0.02 + 0.3 * mean_s, "{expected}");
        }
    }

    #[test]
    fn a_share_of_none_and_of_all_and_stretches_without_length_are_what_they_say() {
        assert!(states(0.0, 0.2).iter().all(|state| !state));
        assert!(states(1.0, 0.2).iter().all(|state| *state));
        let anew = states(0.4, 0.0);
        let both = anew.windows(2).filter(|pair| pair[0] && pair[1]).count() as f64 / FRAMES as f64;
        assert!((both - 0.16).abs() < 0.006, "{both}");
    }
}
