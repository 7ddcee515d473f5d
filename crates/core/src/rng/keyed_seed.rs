//! A public seed combined with a secret key.

use rand::{Rng, SeedableRng};
use rand_chacha::{ChaCha8Rng, ChaCha20Rng};

use super::{ObservationKey, Purpose, stream};

/// `u32` words in a block of ChaCha.
const WORDS_A_BLOCK: u128 = 16;

/// The key of an observation's random streams: a seed, and a secret known only to the generator of the ground truth.
///
/// With the public key, the streams are those of [`stream`]. With any other key, the key of a stream is derived by
/// ChaCha20 in two steps, with `(seed, purpose)` and `(frame, layer)` as nonce and block counter, under a key that is
/// never disclosed. Streams thus reveal nothing about each other, the key, or the streams of another seed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct KeyedSeed {
    /// The secret.
    pub key: ObservationKey,
    /// The seed.
    pub seed: u64,
}

impl From<u64> for KeyedSeed {
    /// The seed with the public key.
    fn from(seed: u64) -> Self {
        Self { key: ObservationKey::PUBLIC, seed }
    }
}

impl KeyedSeed {
    /// The stream for `(purpose, frame, layer)`, substream `index`.
    pub fn stream(&self, purpose: Purpose, frame: u64, layer: u64, index: u64) -> ChaCha8Rng {
        if self.key.is_public() {
            return stream(self.seed, purpose, frame, layer, index);
        }
        let mut twice = [0; 32];
        twice.chunks_exact_mut(16).for_each(|half| half.copy_from_slice(&self.key.bytes()));
        let of_purpose = derived(twice, self.seed, purpose as u64);
        let mut rng = ChaCha8Rng::from_seed(derived(of_purpose, frame, layer));
        rng.set_stream(index);
        rng
    }

    /// The same key with another seed.
    #[must_use]
    pub fn with_seed(self, seed: u64) -> Self {
        Self { seed, ..self }
    }

    /// A seed derived from all of these numbers, as secret as this one.
    #[must_use]
    pub fn of_numbers(self, purpose: Purpose, numbers: &[u64]) -> Self {
        (0..).zip(numbers).fold(self, |known, (index, number)| {
            let mut bytes = [0; 16];
            known.stream(purpose, *number, index, 0).fill_bytes(&mut bytes);
            Self { key: ObservationKey::from_bytes(bytes), seed: known.seed }
        })
    }
}

/// Derives a key from another: the block of ChaCha20 at this nonce and counter.
fn derived(key: [u8; 32], nonce: u64, counter: u64) -> [u8; 32] {
    let mut rng = ChaCha20Rng::from_seed(key);
    rng.set_stream(nonce);
    rng.set_word_pos(WORDS_A_BLOCK * u128::from(counter));
    let mut bytes = [0; 32];
    rng.fill_bytes(&mut bytes);
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::RngExt;

    fn key(last: u8) -> ObservationKey {
        let mut bytes = [0; 16];
        bytes[15] = last;
        ObservationKey::from_bytes(bytes)
    }

    #[test]
    fn the_public_key_gives_the_streams_of_the_seed_alone() {
        for (seed, frame, layer, index) in [(0, 0, 0, 0), (7, 3, 1, 42), (u64::MAX, 9, 9, 9)] {
            let keyed = KeyedSeed::from(seed).stream(Purpose::Corruption, frame, layer, index).random::<[u64; 4]>();
            assert_eq!(keyed, stream(seed, Purpose::Corruption, frame, layer, index).random::<[u64; 4]>());
        }
    }

    #[test]
    fn streams_differ_in_every_part_of_their_key_and_in_the_secret() {
        let draw = |k, s, p, f, l, i| KeyedSeed { key: key(k), seed: s }.stream(p, f, l, i).random::<u64>();
        let of_key = |key: u8| {
            [
                draw(key, 1, Purpose::Corruption, 2, 3, 4),
                draw(key, 2, Purpose::Corruption, 2, 3, 4),
                draw(key, 1, Purpose::Imaging, 2, 3, 4),
                draw(key, 1, Purpose::Corruption, 3, 3, 4),
                draw(key, 1, Purpose::Corruption, 2, 4, 4),
                draw(key, 1, Purpose::Corruption, 2, 3, 5),
                // numbers with equal sums
                draw(key, 3, Purpose::StartPose, 3, 2, 4),
                draw(key, 2, Purpose::Corruption, 3, 2, 4),
            ]
        };
        // key 0 is the public one
        let all = [0, 1, 2].map(of_key).concat();
        assert!(all.iter().enumerate().all(|(i, one)| !all[..i].contains(one)), "{all:?}");
    }

    #[test]
    fn the_derivation_matches_an_independent_chacha20() {
        // Python's `cryptography`: ChaCha20(key, counter || nonce) of zeros, for seed 7, purpose 3, frame 5, layer 9
        let expected = "8596f1e33c31558c5c8c4458c099e77881b6c4cddf67528ad7a8a3b410189e44";
        let twice: [u8; 32] = std::array::from_fn(|i| i as u8 % 16);
        let found = derived(derived(twice, 7, 3), 5, 9).map(|byte| format!("{byte:02x}")).concat();
        assert_eq!(found, expected);
    }

    #[test]
    fn numbers_make_another_seed_and_their_order_matters() {
        let known = KeyedSeed::from(1);
        let of = |numbers: &[u64]| known.of_numbers(Purpose::BodyMismatch, numbers);
        assert_eq!(of(&[]), known);
        assert_eq!(of(&[3, 4]), of(&[3, 4]));
        assert!(of(&[3, 4]) != of(&[4, 3]) && of(&[3]) != of(&[4]) && of(&[3]) != known);
        let secret = KeyedSeed { key: key(9), seed: 1 };
        assert_ne!(secret.of_numbers(Purpose::BodyMismatch, &[3]), of(&[3]));
    }
}
