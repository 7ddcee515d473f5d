//! Keypoints of the actor as a 2D detector gives them: exact projections, or with the errors of a detector.
//!
//! [`KeypointSettings`] has the layout and one strength per axis of [`KEYPOINT_AXES`]; zero changes nothing. Every
//! random number comes from a stream keyed by secret, seed, use, camera and point
//! ([`skiagraph_core::rng::Purpose::Keypoints`]), so a camera's errors do not depend on the other cameras, on threads,
//! or on the strengths of the other axes.

mod axes;
mod detector;
mod other_person;
mod point_draws;
mod settings;
mod stretches;

pub use axes::{KEYPOINT_AXES, KeypointAxis};
pub use detector::{KeypointDetector, KeypointView, SequenceKeypoints};
pub use settings::KeypointSettings;

use rand_chacha::ChaCha8Rng;

use skiagraph_core::rng::{KeyedSeed, Purpose};

/// Use of a random stream; part of its key.
#[derive(Clone, Copy, Debug)]
#[repr(u64)]
enum KeypointDraw {
    Slow = 1,
    White = 2,
    Gross = 3,
    GrossOffset = 4,
    Missing = 5,
    Confidence = 6,
    Inversion = 7,
    Bias = 8,
    OtherPerson = 9,
}

/// `point` is a number of what is drawn: a keypoint has the same one in all layouts.
fn draws(seed: KeyedSeed, draw: KeypointDraw, camera: usize, point: u64) -> ChaCha8Rng {
    seed.stream(Purpose::Keypoints, draw as u64, camera as u64, point)
}
