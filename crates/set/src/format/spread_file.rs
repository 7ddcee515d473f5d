//! `start/spread.npz`: the spread of changes from frame to frame, for sets without training motion. It reveals no pose,
//! because it contains only root mean squares over all frames of the test, one per coordinate of a step.
//!
//! | array | shape | meaning |
//! |---|---|---|
//! | `change` | (6 + n) | root mean square of the difference between successive frames, m and rad |
//! | `change_of_change` | (6 + n) | the same for the difference between successive differences |
//! | `names` | (6 + n) | root x y z (world), root rotation about its own x y z, then the angles |
//!
//! The two horizontal directions share one value, so the direction of travel is not revealed.

use crate::SetError;
use skiagraph_core::body::{Humanoid, Motion, Prediction, ProposalScales, ROOT_STEP, TooFewFrames};
use skiagraph_core::npz::{Array, Npz};

pub(crate) const PATH: &str = "start/spread.npz";

/// Names of the first coordinates of a step.
const ROOT_NAMES: [&str; ROOT_STEP] =
    ["root_x", "root_y", "root_z", "root_turn_about_x", "root_turn_about_y", "root_turn_about_z"];

/// Root mean squares of changes from frame to frame, in the order of a step of the tracker's body: root
/// translation (world x y z, metres), root rotation (about its own x y z, radians), then one per degree of freedom.
#[derive(Clone, Debug, PartialEq)]
pub struct StepSpread {
    /// Root mean squares of the difference between successive frames.
    pub change: Vec<f64>,
    /// Root mean squares of the difference between successive differences.
    pub change_of_change: Vec<f64>,
}

/// Greatest root mean square, m or rad from frame to frame.
const MOST: f64 = 1e4;

/// Least number of differences for a spread; a root mean square of fewer would reveal the differences.
const LEAST_DIFFERENCES: usize = 10;

impl StepSpread {
    /// The spread of the test's own motion, the only information about it that trackers may have. For a motion of very
    /// few frames it is replaced by a typical human spread.
    ///
    /// # Errors
    /// [`TooFewFrames`] if the motion has too few frames.
    pub fn of_motion(body: &Humanoid, motion: &Motion) -> Result<Self, TooFewFrames> {
        let of = |prediction: Prediction| {
            if motion.poses.len() > LEAST_DIFFERENCES + 1 {
                ProposalScales::root_mean_squares(body, std::slice::from_ref(motion), prediction)
            } else {
                Ok(ProposalScales::for_human(body, motion.frames_per_second).in_step_order())
            }
        };
        Ok(Self { change: of(Prediction::None)?, change_of_change: of(Prediction::ConstantVelocity)? })
    }

    pub(crate) fn to_npz(&self, body: &Humanoid) -> Result<Vec<u8>, SetError> {
        self.check(body.step_len()).map_err(SetError::inconsistent)?;
        let angles = body.degrees_of_freedom.iter().map(|d| d.name.as_str());
        let npz = Npz::from_iter([
            ("change", Array::new(&[self.change.len()], self.change.clone())),
            ("change_of_change", Array::new(&[self.change_of_change.len()], self.change_of_change.clone())),
            ("names", Array::names(ROOT_NAMES.into_iter().chain(angles))),
        ]);
        Ok(npz.to_bytes(PATH)?)
    }

    pub(crate) fn from_npz(bytes: &[u8], body: &Humanoid) -> Result<Self, SetError> {
        let npz = Npz::from_bytes(PATH, bytes)?;
        let numbers = |name: &str| Ok::<_, SetError>(npz.f64s(PATH, name, &[Some(body.step_len())])?.to_vec());
        let spread = Self { change: numbers("change")?, change_of_change: numbers("change_of_change")? };
        spread.check(body.step_len()).map_err(|detail| SetError::malformed(PATH, detail))?;
        Ok(spread)
    }

    fn check(&self, length: usize) -> Result<(), String> {
        let sound = |values: &[f64]| values.len() == length && values.iter().all(|v| (0.0..=MOST).contains(v));
        if sound(&self.change) && sound(&self.change_of_change) {
            Ok(())
        } else {
            Err(format!("the spread needs {length} root mean squares, each a number >= 0 and <= {MOST}"))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_bodies::person;

    #[test]
    fn negative_spreads_are_not_written() {
        let numbers = vec![-1.0; person().step_len()];
        let spread = StepSpread { change: numbers.clone(), change_of_change: numbers };
        assert!(spread.to_npz(&person()).unwrap_err().to_string().contains("each a number >= 0"));
    }
}
