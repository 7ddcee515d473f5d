//! `start/training.npz`: motions of the tracker's body for learning, not from the test. Arrays `fps`, `root`, `angles`
//! and `angle_names`, the frames of all motions concatenated; `lengths`, the number of frames of every motion, if there
//! are several; and `sources`, descriptions of the recordings. Sets without such motions have [`crate::StepSpread`]
//! instead.

use super::manifest::check_rate;
use super::truth_file::{push_poses, read_poses};
use crate::{SetError, StepSpread};
use skiagraph_core::body::{Humanoid, Motion};
use skiagraph_core::npz::{Array, Npz, Values};

pub(crate) const PATH: &str = "start/training.npz";

/// The training data of a tracker. It never contains the motion of the test.
#[derive(Clone, Debug, PartialEq)]
pub enum Training {
    /// Motions other than the test's.
    Motions(TrainingMotions),
    /// Only the spread of changes from frame to frame, which suffices for a proposal.
    Spread(StepSpread),
}

/// Motions of the tracker's body from other recordings, or other parts of them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TrainingMotions {
    /// Motions of the tracker's body, all at the rate of the observations.
    pub motions: Vec<Motion>,
    /// Descriptions of the recordings; empty if unknown.
    pub sources: Vec<String>,
}

impl Training {
    /// From motions other than the test's.
    pub fn new(motions: Vec<Motion>) -> Self {
        Self::Motions(TrainingMotions { motions, sources: Vec::new() })
    }

    /// No training data: no motion, and a spread of zero, which leaves proposals at their least deviations.
    pub fn none(body: &Humanoid) -> Self {
        let zeros = vec![0.0; body.step_len()];
        Self::Spread(StepSpread { change: zeros.clone(), change_of_change: zeros })
    }

    /// The motions; empty if there is only a spread.
    pub fn motions(&self) -> &[Motion] {
        match self {
            Self::Motions(training) => &training.motions,
            Self::Spread(_) => &[],
        }
    }

    /// Number of frames of all motions.
    pub fn frames(&self) -> usize {
        self.motions().iter().map(|motion| motion.poses.len()).sum()
    }

    /// Describes the training data, one entry per recording.
    pub fn describe(&self) -> Vec<String> {
        match self {
            Self::Spread(_) => {
                vec!["root mean squares of the test motion's frame-to-frame changes (no poses)".to_owned()]
            }
            Self::Motions(training) if training.sources.is_empty() => {
                vec!["training motion of the set, source not recorded".to_owned()]
            }
            Self::Motions(training) => training.sources.clone(),
        }
    }
}

impl TrainingMotions {
    pub(crate) fn to_npz(&self, body: &Humanoid) -> Result<Vec<u8>, SetError> {
        let rate = self.motions.first().map_or(f64::NAN, |motion| motion.frames_per_second);
        if self.motions.is_empty() || self.motions.iter().any(|m| m.frames_per_second != rate || m.poses.is_empty()) {
            return Err(SetError::inconsistent("all training motions need the same rate and at least one frame"));
        }
        let frames = self.motions.iter().map(|motion| motion.poses.len()).sum();
        let mut npz = Npz::from_iter([("fps", Array::new(&[], vec![rate]))]);
        push_poses(&mut npz, "", &[frames], body, self.motions.iter().flat_map(|m| &m.poses));
        if self.motions.len() > 1 {
            let lengths: Vec<i64> = self.motions.iter().map(|m| m.poses.len() as i64).collect();
            npz.push("lengths", Array::new(&[lengths.len()], lengths));
        }
        if !self.sources.is_empty() {
            npz.push("sources", Array::names(self.sources.iter().map(String::as_str)));
        }
        Ok(npz.to_bytes(PATH)?)
    }

    pub(crate) fn from_npz(bytes: &[u8], degrees: usize) -> Result<Self, SetError> {
        let npz = Npz::from_bytes(PATH, bytes)?;
        if npz.get("of_the_test").is_some() {
            let detail = "contains poses of the test, which trackers must not see (written by an older version of \
                skiagraph); render the set again";
            return Err(SetError::malformed(PATH, detail));
        }
        let mut poses = read_poses(&npz, PATH, "", Some(degrees))?;
        let frames_per_second = npz.f64s(PATH, "fps", &[])?[0];
        check_rate(frames_per_second).map_err(|e| SetError::malformed(PATH, format!("fps: {e}")))?;
        let lengths = match npz.get("lengths").map(|array| &array.values) {
            None => vec![poses.len()],
            Some(Values::I64(lengths)) => lengths.iter().filter_map(|n| usize::try_from(*n).ok()).collect(),
            Some(_) => return Err(SetError::malformed(PATH, "lengths: expected element type <i8")),
        };
        let total = lengths.iter().try_fold(0_usize, |sum, n| sum.checked_add(*n).filter(|_| *n > 0));
        if total != Some(poses.len()) {
            let detail = format!("lengths: expected positive numbers with the sum {}, the rows of root", poses.len());
            return Err(SetError::malformed(PATH, detail));
        }
        let motions = lengths.into_iter().map(|n| {
            let rest = poses.split_off(n);
            Motion { frames_per_second, poses: std::mem::replace(&mut poses, rest) }
        });
        let motions = motions.collect();
        let sources = match npz.get("sources").map(|array| &array.values) {
            None => Vec::new(),
            Some(Values::Text(sources)) => sources.clone(),
            Some(_) => return Err(SetError::malformed(PATH, "sources: expected strings")),
        };
        Ok(Self { motions, sources })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_bodies::{person, walk};

    #[test]
    fn several_motions_are_read_back_separately() {
        let body = person();
        let degrees = body.degrees_of_freedom.len();
        for sources in [vec![], vec!["walk.bvh, frames 1 to 5".to_owned(), "run.bvh".to_owned()]] {
            let training = TrainingMotions { motions: vec![walk(5), walk(3)], sources };
            assert_eq!(TrainingMotions::from_npz(&training.to_npz(&body).unwrap(), degrees).unwrap(), training);
        }
        assert!(TrainingMotions::default().to_npz(&body).is_err());
    }

    #[test]
    fn training_on_the_test_of_older_versions_and_lengths_that_do_not_add_up_are_refused() {
        let body = person();
        let of_walk = TrainingMotions { motions: vec![walk(5)], sources: Vec::new() };
        let error = |name: &str, array: Array| {
            let mut npz = Npz::from_bytes(PATH, &of_walk.to_npz(&body).unwrap()).unwrap();
            npz.push(name, array);
            let read = TrainingMotions::from_npz(&npz.to_bytes(PATH).unwrap(), body.degrees_of_freedom.len());
            read.unwrap_err().to_string()
        };
        let of_the_test = error("of_the_test", Array::new(&[], vec![true]));
        assert!(of_the_test.starts_with("start/training.npz: contains poses of the test"), "{of_the_test}");
        let lengths = error("lengths", Array::new(&[2], vec![4_i64, 2]));
        assert!(lengths.contains("lengths") && lengths.contains("the sum 5, the rows of root"), "{lengths}");
    }
}
