//! The time that tracking took.

use serde::{Deserialize, Serialize};

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrackTiming {
    /// Seconds for all frames of all seeds, with reading observations and calibrating the body, without learning motion
    /// models.
    pub seconds: f64,
    /// Frames of all seeds per second.
    pub frames_per_second: f64,
    /// Likelihood evaluations of all frames and seeds.
    pub likelihood_evaluations: u64,
    pub threads: usize,
}

impl TrackTiming {
    /// The total of these seeds and the `other` ones after them.
    pub(crate) fn and(self, other: Self) -> Self {
        let frames = self.frames_per_second * self.seconds + other.frames_per_second * other.seconds;
        let seconds = self.seconds + other.seconds;
        Self {
            seconds,
            frames_per_second: frames / seconds.max(f64::MIN_POSITIVE),
            likelihood_evaluations: self.likelihood_evaluations + other.likelihood_evaluations,
            threads: other.threads,
        }
    }
}
