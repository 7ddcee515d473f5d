//! `poses.npz` of a run: estimates of every seed beside the truth.
//!
//! | array | shape | meaning |
//! |---|---|---|
//! | `fps` | () | frames a second |
//! | `seeds` | (S) | random seed of each repetition |
//! | `estimate_root`, `estimate_angles` | (S, T, 7), (S, T, n) | poses of the tracker's body |
//! | `estimate_joints`, `estimate_markers` | (S, T, J, 3), (S, T, 15, 3) | where they put it, m; NaN for missing markers |
//! | `truth_root`, `truth_angles` | (T, 7), (T, m) | the actor's poses, where the truth is known |
//! | `truth_joints`, `truth_markers` | (T, K, 3), (T, 15, 3) | where they put it, m |
//!
//! Names of columns: `estimate_angle_names`, `estimate_joint_names`, `truth_angle_names`, `truth_joint_names`, `marker_names`.

use super::truth_file::{marker_numbers, poses_of, push_poses};
use super::{Array, Npz, SetError, Values};
use crate::body::{Humanoid, LANDMARKS, Pose};
use crate::scene::GroundTruth;

/// What a tracker answered: one sequence of poses for every seed.
#[derive(Clone, Debug, PartialEq)]
pub struct RunPoses {
    /// Frames a second.
    pub frames_per_second: f64,
    /// Random seed of each repetition.
    pub seeds: Vec<u64>,
    /// `[seed][frame]`: poses of the tracker's body; the same number of frames for every seed.
    pub estimates: Vec<Vec<Pose>>,
}

impl RunPoses {
    /// The bytes of `poses.npz`; `body` is the tracker's. Without a truth, the `truth_` arrays are left out.
    ///
    /// # Errors
    /// [`SetError::Inconsistent`] unless every seed has as many poses of that body as every other (and as the truth);
    /// [`SetError::Malformed`] beyond 4 GiB.
    pub fn to_bytes(&self, file: &str, body: &Humanoid, truth: Option<&GroundTruth>) -> Result<Vec<u8>, SetError> {
        let frames = self.estimates.first().map_or(0, Vec::len);
        let degrees = body.degrees_of_freedom.len();
        let truth_fits = truth.is_none_or(|t| t.frames.len() == frames);
        let whole = |poses: &Vec<Pose>| poses.len() == frames && poses.iter().all(|p| p.joint_angles.len() == degrees);
        if self.seeds.len() != self.estimates.len() || !truth_fits || !self.estimates.iter().all(whole) {
            let detail =
                format!("{file} needs {frames} poses of {degrees} angles for each of {} seeds", self.seeds.len());
            return Err(SetError::inconsistent(detail));
        }
        let seeds = self.seeds.iter().map(|seed| i64::try_from(*seed)).collect::<Result<Vec<_>, _>>();
        let seeds = seeds.map_err(|_| SetError::inconsistent("a seed is above 2^63 - 1"))?;
        let mut npz = Npz::from_iter([
            ("fps", Array::new(&[], vec![self.frames_per_second])),
            ("seeds", Array::new(&[seeds.len()], seeds)),
            ("marker_names", Array::names(LANDMARKS.map(|l| l.name()))),
        ]);
        push_body(&mut npz, "estimate_", &[self.seeds.len(), frames], body, self.estimates.iter().flatten());
        if let Some(truth) = truth {
            push_body(&mut npz, "truth_", &[frames], &truth.actor, truth.frames.iter().map(|f| &f.pose));
        }
        npz.to_bytes(file)
    }

    /// Seeds and estimates out of a `poses.npz`; only `fps`, `seeds`, `estimate_root` and `estimate_angles` are needed.
    ///
    /// # Errors
    /// [`SetError::Malformed`] naming the array that is missing or not what it should be.
    pub fn from_bytes(file: &str, bytes: &[u8]) -> Result<Self, SetError> {
        let npz = Npz::from_bytes(file, bytes)?;
        let seeds = match npz.get("seeds").map(|array| &array.values) {
            Some(Values::I64(seeds)) => seeds.iter().map(|seed| u64::try_from(*seed)).collect(),
            _ => return Err(SetError::malformed(file, "has no array \"seeds\" of type <i8")),
        };
        let seeds: Vec<u64> = Result::map_err(seeds, |_| SetError::malformed(file, "seeds: one is below zero"))?;
        let roots = npz.f64s(file, "estimate_root", &[Some(seeds.len()), None, Some(7)])?.as_chunks::<7>().0;
        let frames = roots.len().checked_div(seeds.len()).unwrap_or(0);
        let angles = npz.f64s(file, "estimate_angles", &[Some(seeds.len()), Some(frames), None])?;
        let mut poses =
            poses_of(roots, angles).map_err(|e| SetError::malformed(file, format!("estimate_root: {e}")))?.into_iter();
        let estimates = seeds.iter().map(|_| poses.by_ref().take(frames).collect()).collect();
        Ok(Self { frames_per_second: npz.f64s(file, "fps", &[])?[0], seeds, estimates })
    }
}

/// Adds the poses of a body along the axes `shape`, and where they put its joints and markers.
fn push_body<'a>(
    npz: &mut Npz,
    prefix: &str,
    shape: &[usize],
    body: &Humanoid,
    poses: impl Iterator<Item = &'a Pose> + Clone,
) {
    push_poses(npz, prefix, shape, body, poses.clone());
    let (mut joints, mut markers) = (Vec::new(), Vec::new());
    for pose in poses {
        let frames = body.link_frames(pose);
        joints.extend(frames.0.iter().skip(1).flat_map(|f| <[f64; 3]>::from(f.translation.vector)));
        markers.extend(marker_numbers(&body.markers(&frames)));
    }
    let with = |rest: &[usize]| [shape, rest].concat();
    npz.push(&format!("{prefix}joints"), Array::new(&with(&[body.joints.len(), 3]), joints));
    npz.push(&format!("{prefix}joint_names"), Array::names(body.joints.iter().map(|j| j.name.as_str())));
    npz.push(&format!("{prefix}markers"), Array::new(&with(&[LANDMARKS.len(), 3]), markers));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::fixture::{person, walk};
    use crate::scene::fixture::rig;

    fn sample() -> RunPoses {
        let poses = walk(7).poses;
        RunPoses {
            frames_per_second: 60.0,
            seeds: vec![4, 9],
            estimates: vec![poses[1..4].to_vec(), poses[4..].to_vec()],
        }
    }

    #[test]
    fn estimates_are_read_back_and_the_truth_stands_beside_them() {
        let truth = GroundTruth::from_motion(person(), &walk(3), &rig()).unwrap();
        let bytes = sample().to_bytes("poses.npz", &person(), Some(&truth)).unwrap();
        assert_eq!(RunPoses::from_bytes("poses.npz", &bytes).unwrap(), sample());
        let npz = Npz::from_bytes("poses.npz", &bytes).unwrap();
        let markers = npz.f64s("poses.npz", "truth_markers", &[Some(3), Some(15), Some(3)]).unwrap();
        assert_eq!(markers[45..48], *truth.frames[1].markers[0].unwrap().coords.as_slice());
        assert!(npz.f64s("poses.npz", "estimate_joints", &[Some(2), Some(3), Some(7), Some(3)]).is_ok());
    }

    #[test]
    fn seeds_of_different_length_and_other_bodies_are_refused() {
        let mut ragged = sample();
        ragged.estimates[1].pop();
        assert!(matches!(ragged.to_bytes("p", &person(), None), Err(SetError::Inconsistent { .. })));
        let truth = GroundTruth::from_motion(person(), &walk(2), &rig()).unwrap();
        assert!(matches!(sample().to_bytes("p", &person(), Some(&truth)), Err(SetError::Inconsistent { .. })));
    }

    #[test]
    fn no_seeds_make_an_empty_file_that_can_be_read() {
        let none = RunPoses { frames_per_second: 60.0, seeds: vec![], estimates: vec![] };
        let bytes = none.to_bytes("p", &person(), None).unwrap();
        assert_eq!(RunPoses::from_bytes("p", &bytes).unwrap(), none);
    }
}
