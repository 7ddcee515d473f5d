//! Keyed random streams: every random number comes from a ChaCha8 stream that is keyed by its purpose.
//!
//! A stream is keyed by `(seed, purpose, frame, layer, index)`, so results do not depend on the order in which threads
//! draw numbers. [`normal`] draws a normal deviate. Streams of an observation are also keyed by a secret:
//! [`KeyedSeed`].

mod keyed_seed;
mod observation_key;

pub use keyed_seed::KeyedSeed;
pub use observation_key::{KeyError, ObservationKey};

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// What a random stream is used for; streams of different purposes never share numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u64)]
pub enum Purpose {
    /// Lengths and girths of a mismatched tracker body.
    BodyMismatch = 1,
    /// Errors added to a start pose.
    StartPose = 2,
    /// Corruption of observations.
    Corruption = 3,
    /// Initial spread of particles.
    Initialisation = 4,
    /// Diffusion of particles between frames and between annealing layers.
    Perturbation = 5,
    /// The offset of systematic resampling.
    Resampling = 6,
    /// Errors added by the oracle.
    Oracle = 7,
    /// Random choices of a motion model (inter-transitions, latent noise).
    MotionModel = 9,
    /// Candidate poses of a refinement.
    Refinement = 10,
    /// Slow drifts of a motion's tempo, amplitude and posture.
    MotionVariation = 11,
    /// Sampling of a body from a population.
    BodyShape = 12,
    /// Appearance of a scene and sensor noise.
    Imaging = 13,
    /// Errors in lengths and girths of a tracker's body in addition to its mismatch.
    BodyCorruption = 14,
    /// Errors of detected keypoints.
    Keypoints = 15,
    /// Randomly sampled settings of a sweep.
    Sweep = 20,
}

/// The stream for `(seed, purpose, frame, layer)`, substream `index` (a particle, a camera).
pub fn stream(seed: u64, purpose: Purpose, frame: u64, layer: u64, index: u64) -> ChaCha8Rng {
    let mut key = [0_u8; 32];
    for (slot, word) in key.chunks_exact_mut(8).zip([seed, purpose as u64, frame, layer]) {
        slot.copy_from_slice(&word.to_le_bytes());
    }
    let mut rng = ChaCha8Rng::from_seed(key);
    rng.set_stream(index);
    rng
}

/// A standard normal deviate (uses libm: the same bits on every machine).
#[inline]
pub fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}
