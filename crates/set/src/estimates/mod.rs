//! `poses.npz`: a tracker's estimates for every seed, with the truth if known. Any tracker can write it.
//!
//! | array | shape | meaning |
//! |---|---|---|
//! | `fps` | () | frames per second |
//! | `seeds` | (S) | random seed of each repetition, integers |
//! | `estimate_root`, `estimate_angles` | (S, T, 7), (S, T, n) | poses of the tracker's body (`start/body.json`) |
//! | `estimate_markers` | (S, T, M, 3) | positions of HumanEva's markers, m |
//! | `estimate_joints` | (S, T, J, 3) | positions of the joints of the tracker's body, m |
//! | `truth_root`, `truth_angles` | (T, 7), (T, m) | the actor's poses, if the truth is known |
//! | `truth_joints`, `truth_markers` | (T, K, 3), (T, 15, 3) | positions of the actor's joints and markers, m |
//!
//! Names of columns: `estimate_angle_names`, `marker_names`, `estimate_joint_names`, `truth_angle_names`,
//! `truth_joint_names`.
//!
//! This program writes all of them. For estimates of other programs (see [`Estimates::from_bytes`]):
//! - `fps` and one of poses, markers and joints suffice; positions given twice must agree to a millimetre;
//! - without `seeds` the repetitions are numbered from 0, and the arrays of a single one need no first axis;
//! - no coordinate is farther than 10^6 m from the origin;
//! - columns may be in any order, because they are matched by name. Without `estimate_angle_names` the order is that of
//!   `start/start.json`; markers and joints need names, but need not be complete;
//! - a frame without an estimate is NaN throughout, and so is a marker or joint without an estimate;
//! - joints alone give the markers at these joints; `estimate_root` alone gives the markers of the root link and its
//!   rotation.

mod reader;
mod zeros;

use nalgebra::{Isometry3, Point3};

#[doc(hidden)]
pub use self::reader::with_seed_axis;
#[doc(hidden)]
pub use self::zeros::zeros_as_missing;
use super::SetError;
use super::format::rigid;
use super::format::truth_file::{marker_numbers, push_poses};
use skiagraph_core::body::{Humanoid, LANDMARKS, Markers, Pose};
use skiagraph_core::npz::{Array, Npz};
use skiagraph_truth::scene::GroundTruth;

/// The greatest coordinate of an estimate, metres. Greater numbers are placeholders for missing values, or in another
/// unit.
pub const FARTHEST_M: f64 = 1e6;

/// A tracker's estimates: one sequence per seed.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimates {
    /// Frames per second.
    pub frames_per_second: f64,
    /// Random seed of each repetition.
    pub seeds: Vec<u64>,
    /// One per seed, all with the same number of frames.
    pub sequences: Vec<EstimatedSequence>,
    /// The bodies of the poses, one per seed, if the tracker calibrated its body; otherwise empty, and all poses are of
    /// the set's tracker body.
    pub bodies: Vec<Humanoid>,
    /// Notes about reading the file.
    pub notes: Vec<String>,
}

/// A tracker's estimates for one seed.
#[derive(Clone, Debug, PartialEq)]
pub struct EstimatedSequence {
    /// Information beyond the markers.
    pub articulation: Articulation,
    /// Positions of HumanEva's markers, metres, one entry per frame; all `None` in a frame without an estimate.
    pub markers: Vec<Markers>,
}

/// Information of an estimate beyond marker positions: one entry per frame, `None` without an estimate.
#[derive(Clone, Debug, PartialEq)]
pub enum Articulation {
    /// Poses of the tracker's body.
    Poses(Vec<Option<Pose>>),
    /// Only `world_from_root`.
    Roots(Vec<Option<Isometry3<f64>>>),
    /// Nothing.
    Unknown,
}

impl EstimatedSequence {
    /// A pose of `body` for every frame.
    pub fn from_poses(body: &Humanoid, poses: Vec<Pose>) -> Self {
        let markers = poses.iter().map(|pose| body.markers(&body.link_frames(pose))).collect();
        let articulation = Articulation::Poses(poses.into_iter().map(Some).collect());
        Self { articulation, markers }
    }

    /// The poses, if known.
    pub fn poses(&self) -> Option<&[Option<Pose>]> {
        match &self.articulation {
            Articulation::Poses(poses) => Some(poses),
            _ => None,
        }
    }

    /// The pose of a frame, if there is one.
    pub fn pose(&self, frame: usize) -> Option<&Pose> {
        self.poses()?.get(frame)?.as_ref()
    }

    /// `world_from_root`, one entry per frame, if known.
    pub fn roots(&self) -> Option<Vec<Option<Isometry3<f64>>>> {
        match &self.articulation {
            Articulation::Poses(poses) => Some(poses.iter().map(|pose| Some(pose.as_ref()?.world_from_root)).collect()),
            Articulation::Roots(roots) => Some(roots.clone()),
            Articulation::Unknown => None,
        }
    }

    /// Number of frames, with or without an estimate.
    pub fn frames(&self) -> usize {
        self.markers.len()
    }

    /// Whether any frame has an estimate.
    pub fn has_any(&self) -> bool {
        self.markers.iter().flatten().any(Option::is_some)
    }
}

impl Estimates {
    /// Number of frames of every sequence.
    pub fn frames(&self) -> usize {
        self.sequences.first().map_or(0, EstimatedSequence::frames)
    }

    /// The body of the poses of sequence `index`; `body` is the set's tracker body.
    pub fn body<'a>(&'a self, index: usize, body: &'a Humanoid) -> &'a Humanoid {
        self.bodies.get(index).unwrap_or(body)
    }

    /// The bytes of `poses.npz`; `body` is the tracker's. Unknown arrays are left out, without a truth the `truth_`
    /// arrays; a frame without an estimate is NaN.
    ///
    /// # Errors
    /// [`SetError::Inconsistent`] unless all seeds have the same number of frames (that of the truth), the same kind of
    /// articulation and the angles of `body`; [`SetError::Malformed`] beyond 4 GiB.
    pub fn to_bytes(&self, file: &str, body: &Humanoid, truth: Option<&GroundTruth>) -> Result<Vec<u8>, SetError> {
        self.check(file, body, truth)?;
        let seeds = self.seeds.iter().map(|seed| i64::try_from(*seed)).collect::<Result<Vec<_>, _>>();
        let seeds = seeds.map_err(|_| SetError::inconsistent("a seed is above 2^63 - 1"))?;
        let mut npz = Npz::from_iter([
            ("fps", Array::new(&[], vec![self.frames_per_second])),
            ("seeds", Array::new(&[seeds.len()], seeds)),
            ("marker_names", Array::names(LANDMARKS.map(|l| l.name()))),
        ]);
        self.push(&mut npz, body);
        if let Some(truth) = truth {
            let poses = truth.frames.iter().map(|f| &f.pose);
            let shape = [truth.frames.len()];
            push_poses(&mut npz, "truth_", &shape, &truth.actor, poses.clone());
            let actor = &truth.actor;
            push_joints(&mut npz, "truth_", &shape, actor, poses.map(|pose| (actor, Some(pose.clone()))));
            push_markers(&mut npz, "truth_", &shape, truth.frames.iter().map(|f| &f.markers));
        }
        Ok(npz.to_bytes(file)?)
    }

    fn check(&self, file: &str, body: &Humanoid, truth: Option<&GroundTruth>) -> Result<(), SetError> {
        let (frames, degrees) = (self.frames(), body.degrees_of_freedom.len());
        let truth_fits = truth.is_none_or(|t| t.frames.len() == frames);
        let whole = |sequence: &EstimatedSequence| {
            let of_body = |poses: &[Option<Pose>]| {
                poses.len() == frames && poses.iter().flatten().all(|p| p.joint_angles.len() == degrees)
            };
            let alike = self.sequences.iter().all(|other| {
                std::mem::discriminant(&other.articulation) == std::mem::discriminant(&sequence.articulation)
            });
            alike && sequence.frames() == frames && sequence.poses().is_none_or(of_body)
        };
        if self.seeds.len() == self.sequences.len() && truth_fits && self.sequences.iter().all(whole) {
            return Ok(());
        }
        let detail = format!("{file} needs {frames} poses of {degrees} angles for each of {} seeds", self.seeds.len());
        Err(SetError::inconsistent(detail))
    }

    fn push(&self, npz: &mut Npz, body: &Humanoid) {
        let shape = [self.seeds.len(), self.frames()];
        let (first, degrees) = (self.sequences.first(), body.degrees_of_freedom.len());
        let has_poses = first.is_none_or(|sequence| sequence.poses().is_some());
        if first.is_none_or(|sequence| sequence.roots().is_some()) {
            let roots = self.sequences.iter().flat_map(|sequence| sequence.roots().unwrap_or_default());
            let rows = roots.flat_map(|root| root.map_or([f64::NAN; 7], |root| rigid::to_row(&root)));
            npz.push("estimate_root", Array::new(&[shape[0], shape[1], 7], rows.collect::<Vec<f64>>()));
        }
        let of_seed = |(index, sequence): (usize, &'_ EstimatedSequence)| {
            let poses = sequence.poses().unwrap_or_default().to_vec();
            poses.into_iter().map(move |pose| (self.body(index, body), pose))
        };
        let poses = || self.sequences.iter().enumerate().flat_map(of_seed);
        if has_poses {
            let rows = poses().flat_map(|(_, pose)| match pose {
                Some(pose) => pose.joint_angles.as_slice().to_vec(),
                None => vec![f64::NAN; degrees],
            });
            npz.push("estimate_angles", Array::new(&[shape[0], shape[1], degrees], rows.collect::<Vec<f64>>()));
            let names = body.degrees_of_freedom.iter().map(|d| d.name.as_str());
            npz.push("estimate_angle_names", Array::names(names));
            push_joints(npz, "estimate_", &shape, body, poses());
        }
        push_markers(npz, "estimate_", &shape, self.sequences.iter().flat_map(|sequence| &sequence.markers));
    }
}

/// Adds the joint positions along the axes `shape`, NaN without a pose, and the joint names. Each pose comes with its
/// body.
fn push_joints<'a>(
    npz: &mut Npz,
    prefix: &str,
    shape: &[usize],
    body: &Humanoid,
    poses: impl Iterator<Item = (&'a Humanoid, Option<Pose>)>,
) {
    let place = |(body, pose): (&Humanoid, Option<Pose>)| match pose {
        Some(pose) => {
            body.link_frames(&pose).0.iter().skip(1).flat_map(|f| <[f64; 3]>::from(f.translation.vector)).collect()
        }
        None => vec![f64::NAN; 3 * body.joints.len()],
    };
    let joints: Vec<f64> = poses.flat_map(place).collect();
    npz.push(&format!("{prefix}joints"), Array::new(&[shape, &[body.joints.len(), 3]].concat(), joints));
    npz.push(&format!("{prefix}joint_names"), Array::names(body.joints.iter().map(|j| j.name.as_str())));
}

fn push_markers<'a>(npz: &mut Npz, prefix: &str, shape: &[usize], markers: impl Iterator<Item = &'a Markers>) {
    let numbers: Vec<f64> = markers.flat_map(marker_numbers).collect();
    npz.push(&format!("{prefix}markers"), Array::new(&[shape, &[LANDMARKS.len(), 3]].concat(), numbers));
}

/// A position; `None` if all its coordinates are NaN.
pub(super) type Position = Option<Point3<f64>>;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_bodies::{person, walk};
    use crate::test_cameras::rig;

    fn sample() -> Estimates {
        let poses = walk(7).poses;
        let sequence = |range: std::ops::Range<usize>| EstimatedSequence::from_poses(&person(), poses[range].to_vec());
        Estimates {
            frames_per_second: 60.0,
            seeds: vec![4, 9],
            sequences: vec![sequence(1..4), sequence(4..7)],
            bodies: vec![],
            notes: vec![],
        }
    }

    #[test]
    fn estimates_are_read_back_and_the_truth_is_written_with_them() {
        let truth = GroundTruth::from_motion(person(), &walk(3), &rig()).unwrap();
        let bytes = sample().to_bytes("poses.npz", &person(), Some(&truth)).unwrap();
        assert_eq!(Estimates::from_bytes("poses.npz", &bytes, &person()).unwrap(), sample());
        let npz = Npz::from_bytes("poses.npz", &bytes).unwrap();
        let markers = npz.f64s("poses.npz", "truth_markers", &[Some(3), Some(15), Some(3)]).unwrap();
        assert_eq!(markers[45..48], *truth.frames[1].markers[0].unwrap().coords.as_slice());
        assert!(npz.f64s("poses.npz", "estimate_joints", &[Some(2), Some(3), Some(7), Some(3)]).is_ok());
    }

    #[test]
    fn markers_and_joints_of_calibrated_bodies_are_those_of_their_own_bodies() {
        let longer = person().reshaped(&skiagraph_core::body::BodyShape::random_mismatch(&person(), 3, 0.2, 0.1));
        let mut estimates = sample();
        estimates.bodies = vec![person(), longer.clone()];
        estimates.sequences[1] = EstimatedSequence::from_poses(&longer, walk(7).poses[4..7].to_vec());
        let bytes = estimates.to_bytes("poses.npz", &person(), None).unwrap();
        let read = Estimates::from_bodies("poses.npz", &bytes, &person(), estimates.bodies.clone()).unwrap();
        assert_eq!(read, estimates);
        // with another body the markers of the file do not agree
        let error = Estimates::from_bytes("poses.npz", &bytes, &person()).unwrap_err().to_string();
        assert!(error.contains("mm from its position by"), "{error}");
        let error = Estimates::from_bodies("poses.npz", &bytes, &person(), vec![longer]).unwrap_err().to_string();
        assert!(error.contains("1 bodies for 2 seeds"), "{error}");
    }

    #[test]
    fn a_frame_without_an_estimate_is_nan_and_is_read_back() {
        let mut lost = sample();
        if let Articulation::Poses(poses) = &mut lost.sequences[1].articulation {
            poses[2] = None;
        }
        lost.sequences[1].markers[2] = [None; 15];
        let read_back = |lost: &Estimates| {
            let bytes = lost.to_bytes("p", &person(), None).unwrap();
            assert_eq!(Estimates::from_bytes("p", &bytes, &person()).unwrap(), *lost);
        };
        read_back(&lost);
        lost.sequences.iter_mut().for_each(|own| own.articulation = Articulation::Roots(own.roots().unwrap()));
        read_back(&lost);
        lost.sequences.iter_mut().for_each(|own| own.articulation = Articulation::Unknown);
        read_back(&lost);
    }

    #[test]
    fn seeds_of_different_length_and_other_bodies_are_refused() {
        let mut ragged = sample();
        ragged.sequences[1] = EstimatedSequence::from_poses(&person(), walk(2).poses);
        assert!(matches!(ragged.to_bytes("p", &person(), None), Err(SetError::Inconsistent { .. })));
        let mut mixed = sample();
        mixed.sequences[1].articulation = Articulation::Unknown;
        assert!(matches!(mixed.to_bytes("p", &person(), None), Err(SetError::Inconsistent { .. })));
        let truth = GroundTruth::from_motion(person(), &walk(2), &rig()).unwrap();
        assert!(matches!(sample().to_bytes("p", &person(), Some(&truth)), Err(SetError::Inconsistent { .. })));
    }
}
