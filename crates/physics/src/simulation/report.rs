//! Results of a simulation.

use std::fmt;

use skiagraph_core::body::Motion;
use skiagraph_core::contact::GroundQuality;

/// A simulated motion.
#[derive(Clone, Debug, PartialEq)]
pub struct Simulated {
    /// The simulated motion, at the rate of the target motion.
    pub motion: Motion,
    /// The report.
    pub report: SimulationReport,
}

/// Report of a simulation.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct SimulationReport {
    /// Duration, seconds.
    pub duration_s: f64,
    /// Time of the fall, seconds: the first time at which the centre of mass was below three quarters of its height in
    /// the motion. `None` if the body stayed up.
    pub fell_at_s: Option<f64>,
    /// The frame of the motion, from 0, at that time; the body was last up in the previous frame.
    pub fell_at_frame: Option<usize>,
    /// Mean magnitude of the residual wrench at the root, in body weights: the norm of its force, at the root link's
    /// centre of mass, and of its moment divided by the initial height of the body's centre of mass, divided by the
    /// body's weight.
    pub root_wrench_mean: f64,
    /// Greatest magnitude; never above the allowed bound.
    pub root_wrench_most: f64,
    /// Mean distance of joints from their positions in the recorded motion, over all joints and frames, mm.
    pub moved_mm: f64,
    /// Mean distance over the frames before the fall, mm; equal to `moved_mm` if the body stayed up.
    pub moved_until_fall_mm: f64,
    /// Greatest such distance, mm.
    pub moved_most_mm: f64,
    /// Quality of the feet's ground contact.
    pub quality: GroundQuality,
}

impl fmt::Display for SimulationReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.fell_at_s.zip(self.fell_at_frame) {
            Some((at, frame)) => write!(
                f,
                "the body FELL after {at:.2} s of {:.2} s (frame {frame}, from 0): from there on the truth is a fall, not the recorded \
                 motion; allow more root_wrench or cut the clip; until then joints were {:.1} mm from the recording on average; ",
                self.duration_s, self.moved_until_fall_mm
            )?,
            None => write!(f, "the body stayed up for {:.2} s; ", self.duration_s)?,
        }
        write!(
            f,
            "residual root wrench {:.1} % of body weight on average, {:.1} % at most; joints {:.1} mm from the recording \
             on average, {:.1} mm at most; {}",
            100.0 * self.root_wrench_mean,
            100.0 * self.root_wrench_most,
            self.moved_mm,
            self.moved_most_mm,
            self.quality
        )
    }
}
