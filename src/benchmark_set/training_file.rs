//! `start/training.npz`: how the tracker's body has been seen to move. Arrays `fps`, `root`, `angles` and `angle_names`, the frames
//! of all motions one after another; `lengths`, frames of every motion, where there are several; and `of_the_test` where the
//! motion is that of the test itself.

use super::manifest::check_rate;
use super::truth_file::{push_poses, read_poses};
use super::{Array, Npz, SetError, Values};
use crate::body::{Humanoid, Motion};

pub(super) const PATH: &str = "start/training.npz";

/// How a tracker's body has been seen to move: what proposals and motion models learn from.
#[derive(Clone, Debug, PartialEq)]
pub struct Training {
    /// Motions of the tracker's body, all at one rate, that of the observations.
    pub motions: Vec<Motion>,
    /// Whether the motion is that of the test frames themselves: good for the spread of a proposal, but no motion model may be
    /// learned from it.
    pub of_the_test: bool,
}

impl Training {
    /// Of motions other than the test's.
    pub fn new(motions: Vec<Motion>) -> Self {
        Self { motions, of_the_test: false }
    }

    /// Of the test's own motion.
    pub fn of_the_test(motion: Motion) -> Self {
        Self { motions: vec![motion], of_the_test: true }
    }

    /// Number of frames of all motions.
    pub fn frames(&self) -> usize {
        self.motions.iter().map(|motion| motion.poses.len()).sum()
    }

    pub(super) fn to_npz(&self, body: &Humanoid) -> Result<Vec<u8>, SetError> {
        let rate = self.motions.first().map_or(f64::NAN, |motion| motion.frames_per_second);
        if self.motions.is_empty() || self.motions.iter().any(|m| m.frames_per_second != rate || m.poses.is_empty()) {
            return Err(SetError::inconsistent("training needs motions of one rate, none without a frame"));
        }
        let mut npz = Npz::from_iter([("fps", Array::new(&[], vec![rate]))]);
        push_poses(&mut npz, "", &[self.frames()], body, self.motions.iter().flat_map(|m| &m.poses));
        if self.motions.len() > 1 {
            let lengths: Vec<i64> = self.motions.iter().map(|m| m.poses.len() as i64).collect();
            npz.push("lengths", Array::new(&[lengths.len()], lengths));
        }
        if self.of_the_test {
            npz.push("of_the_test", Array::new(&[], vec![true]));
        }
        npz.to_bytes(PATH)
    }

    pub(super) fn from_npz(bytes: &[u8], degrees: usize) -> Result<Self, SetError> {
        let npz = Npz::from_bytes(PATH, bytes)?;
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
            let detail = format!("lengths: expected numbers above 0 whose sum is the {} rows of root", poses.len());
            return Err(SetError::malformed(PATH, detail));
        }
        let motions = lengths.into_iter().map(|n| {
            let rest = poses.split_off(n);
            Motion { frames_per_second, poses: std::mem::replace(&mut poses, rest) }
        });
        let motions = motions.collect();
        let of_the_test = match npz.get("of_the_test") {
            None => false,
            Some(_) => npz.bools(PATH, "of_the_test", &[])?.contains(&true),
        };
        Ok(Self { motions, of_the_test })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::fixture::{person, walk};

    #[test]
    fn several_motions_are_read_back_apart() {
        let body = person();
        let degrees = body.degrees_of_freedom.len();
        for training in [Training::new(vec![walk(5), walk(3)]), Training::of_the_test(walk(4))] {
            assert_eq!(Training::from_npz(&training.to_npz(&body).unwrap(), degrees).unwrap(), training);
        }
        assert!(Training::new(vec![]).to_npz(&body).is_err());
    }

    #[test]
    fn lengths_that_do_not_add_up_are_refused() {
        let body = person();
        let mut npz = Npz::from_bytes(PATH, &Training::new(vec![walk(5)]).to_npz(&body).unwrap()).unwrap();
        npz.push("lengths", Array::new(&[2], vec![4_i64, 2]));
        let bytes = npz.to_bytes(PATH).unwrap();
        let error = Training::from_npz(&bytes, body.degrees_of_freedom.len()).unwrap_err().to_string();
        assert!(error.contains("lengths") && error.contains("5 rows"), "{error}");
    }
}
