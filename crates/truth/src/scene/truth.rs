//! Ground truth: everything that is known exactly.

use nalgebra::Point3;

use super::{Distractor, Occluders, Sight};
use crate::body::{Humanoid, LANDMARKS, LinkFrames, LinkPoint, Markers, Motion, Pose, Prop};
use crate::camera::CameraRig;
use crate::input::excerpt;
use crate::parallel;

/// The ground truth: the actor's body and its exact state in every frame.
#[derive(Clone, Debug, PartialEq)]
pub struct GroundTruth {
    /// The actor's body.
    pub actor: Humanoid,
    /// The props; they belong to the background and hide what is behind them.
    pub props: Vec<Prop>,
    /// Other people: they hide the actor, and silhouettes show them too. Nothing of them is estimated.
    pub distractors: Vec<Distractor>,
    /// Frames a second.
    pub frames_per_second: f64,
    /// One entry a frame.
    pub frames: Vec<TruthFrame>,
}

/// The truth of one instant.
#[derive(Clone, Debug, PartialEq)]
pub struct TruthFrame {
    /// Seconds from the first frame.
    pub time_s: f64,
    /// The actor's pose.
    pub pose: Pose,
    /// `world_from_link` of every link of the actor.
    pub link_frames: LinkFrames,
    /// Where each joint of the actor is in the world (origin of the link that it moves), metres.
    pub joint_positions: Vec<Point3<f64>>,
    /// HumanEva's markers on the actor.
    pub markers: Markers,
    /// `[camera][marker]`: whether the camera sees the marker inside its image and before the near plane.
    pub in_view: Vec<[bool; LANDMARKS.len()]>,
    /// `[camera][marker]`: whether the marker is in view and not hidden by the body's surface (its skin, where it has
    /// one), a prop or a distractor. Markers lie inside the body, so the geometry of a marker's own link and solids
    /// that contain the marker do not count; all other geometry that the line to the camera enters does
    /// ([`Occluders`]).
    pub visible: Vec<[bool; LANDMARKS.len()]>,
}

/// `[camera][marker]`.
pub(super) type MarkerFlags = Vec<[bool; LANDMARKS.len()]>;

/// Errors of scenes.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SceneError {
    /// The motion has no pose, or no rate.
    #[error(
        "the motion has {poses} poses at {frames_per_second} frames a second; expected at least one, and a rate above zero"
    )]
    EmptyMotion {
        /// Number of poses.
        poses: usize,
        /// The rate.
        frames_per_second: f64,
    },
    /// A pose belongs to another body.
    #[error(
        "set frame {frame} (from 0): the pose has {found} joint angles, the actor {:?} has {expected} degrees of freedom",
        excerpt(actor)
    )]
    WrongBody {
        /// Frame number.
        frame: usize,
        /// Angles of the pose.
        found: usize,
        /// The actor's name.
        actor: String,
        /// Its degrees of freedom.
        expected: usize,
    },
    /// A distractor without a pose, or with poses of another body.
    #[error("distractor {:?}: expected at least one pose, each with the {degrees} angles of its body", excerpt(name))]
    WrongDistractor {
        /// The distractor's name.
        name: String,
        /// Its body's degrees of freedom.
        degrees: usize,
    },
    /// A link's position is not finite.
    #[error(
        "set frame {frame} (from 0): the position of link {:?} is not finite; look for NaN or huge numbers in the \
        recording",
        excerpt(link)
    )]
    NotFinite {
        /// Frame number.
        frame: usize,
        /// The link's name.
        link: String,
    },
    /// No camera sees the subject.
    #[error(
        "no camera sees the subject in any of {frames} frames (it starts at {start:.2?} m); move the cameras or the motion"
    )]
    OutOfView {
        /// Number of frames.
        frames: usize,
        /// The actor's root in the first frame, world, metres.
        start: [f64; 3],
    },
}

impl GroundTruth {
    /// The ground truth of an actor that performs `motion` before the cameras of `rig`, bit-identical for any number of
    /// threads.
    ///
    /// # Errors
    /// [`SceneError`] when the motion is empty, belongs to another body, is not finite, or nowhere in view.
    pub fn from_motion(actor: Humanoid, motion: &Motion, rig: &CameraRig) -> Result<Self, SceneError> {
        Self::among_props(actor, motion, rig, Vec::new())
    }

    /// As [`Self::from_motion`], with props.
    ///
    /// # Errors
    /// As [`Self::from_motion`].
    pub fn among_props(
        actor: Humanoid,
        motion: &Motion,
        rig: &CameraRig,
        props: Vec<Prop>,
    ) -> Result<Self, SceneError> {
        Self::among(actor, motion, rig, props, Vec::new())
    }

    /// As [`Self::from_motion`], with props and other people.
    ///
    /// # Errors
    /// As [`Self::from_motion`], and [`SceneError::WrongDistractor`].
    pub fn among(
        actor: Humanoid,
        motion: &Motion,
        rig: &CameraRig,
        props: Vec<Prop>,
        distractors: Vec<Distractor>,
    ) -> Result<Self, SceneError> {
        let mut truth = Self::unwatched(actor, motion, props, distractors)?;
        let views = parallel::map(truth.frames.len(), |frame| truth.views(rig, frame));
        for (frame, (in_view, visible)) in truth.frames.iter_mut().zip(views) {
            (frame.in_view, frame.visible) = (in_view, visible);
        }
        match truth.unseen_frames(rig).len() == truth.frames.len() {
            true => Err(truth.out_of_view()),
            false => Ok(truth),
        }
    }

    /// The truth of what happens, whoever sees it: `in_view` and `visible` are of no camera.
    pub(super) fn unwatched(
        actor: Humanoid,
        motion: &Motion,
        props: Vec<Prop>,
        distractors: Vec<Distractor>,
    ) -> Result<Self, SceneError> {
        for Distractor { name, body, poses } in &distractors {
            let degrees = body.degrees_of_freedom.len();
            if poses.is_empty() || poses.iter().any(|pose| pose.joint_angles.len() != degrees) {
                return Err(SceneError::WrongDistractor { name: name.clone(), degrees });
            }
        }
        let frames_per_second = motion.frames_per_second;
        let positive_rate = frames_per_second > 0.0 && frames_per_second.is_finite();
        if motion.poses.is_empty() || !positive_rate {
            return Err(SceneError::EmptyMotion { poses: motion.poses.len(), frames_per_second });
        }
        let frame = |frame| TruthFrame::new(&actor, frame, frames_per_second, &motion.poses[frame]);
        let frames = parallel::map(motion.poses.len(), frame).into_iter().collect::<Result<Vec<_>, _>>()?;
        Ok(Self { actor, props, distractors, frames_per_second, frames })
    }

    /// No camera sees the subject.
    pub(super) fn out_of_view(&self) -> SceneError {
        let start = self.frames.first().map(|frame| frame.pose.world_from_root.translation.vector.into());
        SceneError::OutOfView { frames: self.frames.len(), start: start.unwrap_or_default() }
    }

    /// Which markers the cameras have in view in a frame, and which they see.
    fn views(&self, rig: &CameraRig, frame: usize) -> (MarkerFlags, MarkerFlags) {
        let (actor, occluders) = (&self.actor, self.occluders(frame));
        let markers = &self.frames[frame].markers;
        let in_view = rig.cameras.iter().map(|camera| markers.map(|m| m.is_some_and(|m| camera.sees(&m)))).collect();
        let visible = rig.cameras.iter().map(|camera| {
            let lines = occluders.seen_by(camera);
            let is_seen = |(marker, own): (&Point3<f64>, LinkPoint)| lines.to(marker, &[own.link]) == Sight::InView;
            std::array::from_fn(|i| markers[i].as_ref().zip(actor.markers[i]).is_some_and(is_seen))
        });
        (in_view, visible.collect())
    }

    /// Numbers of the frames in which no camera has any joint or marker in its image.
    pub fn unseen_frames(&self, rig: &CameraRig) -> Vec<usize> {
        let seen = |p: &Point3<f64>| rig.cameras.iter().any(|camera| camera.sees(p));
        let unseen = |frame: &TruthFrame| !frame.points().any(&seen);
        (0..self.frames.len()).filter(|&frame| unseen(&self.frames[frame])).collect()
    }

    /// What may hide points of the actor in a frame, which the truth must have.
    pub fn occluders(&self, frame: usize) -> Occluders<'_> {
        let occluders = Occluders::new(&self.actor, &self.frames[frame].link_frames, &self.props);
        occluders.with_distractors(&self.distractors, frame)
    }

    /// The actor's poses.
    pub fn motion(&self) -> Motion {
        let poses = self.frames.iter().map(|frame| frame.pose.clone()).collect();
        Motion { frames_per_second: self.frames_per_second, poses }
    }
}

impl TruthFrame {
    fn new(actor: &Humanoid, frame: usize, frames_per_second: f64, pose: &Pose) -> Result<Self, SceneError> {
        let expected = actor.degrees_of_freedom.len();
        if pose.joint_angles.len() != expected {
            let (found, actor) = (pose.joint_angles.len(), actor.name.clone());
            return Err(SceneError::WrongBody { frame, found, actor, expected });
        }
        let link_frames = actor.link_frames(pose);
        let finite = |f: &nalgebra::Isometry3<f64>| {
            f.translation.vector.iter().chain(f.rotation.coords.iter()).all(|x| x.is_finite())
        };
        if let Some(lost) = link_frames.0.iter().position(|f| !finite(f)) {
            return Err(SceneError::NotFinite { frame, link: actor.links[lost].name.clone() });
        }
        let markers = actor.markers(&link_frames);
        Ok(Self {
            time_s: frame as f64 / frames_per_second,
            pose: pose.clone(),
            joint_positions: link_frames.0.iter().skip(1).map(|f| f.translation.vector.into()).collect(),
            link_frames,
            markers,
            in_view: Vec::new(),
            visible: Vec::new(),
        })
    }

    /// All joints and markers.
    pub(super) fn points(&self) -> impl Iterator<Item = &Point3<f64>> {
        self.joint_positions.iter().chain(self.markers.iter().flatten())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_bodies::{person, walk};
    use crate::test_cameras::rig;
    use approx::assert_relative_eq;
    use nalgebra::Isometry3;

    #[test]
    fn truth_is_what_kinematics_and_projection_say() {
        let truth = GroundTruth::from_motion(person(), &walk(5), &rig()).unwrap();
        assert_eq!(truth.motion(), walk(5));
        assert_relative_eq!(truth.frames[3].time_s, 3.0 / 60.0);
        for frame in &truth.frames {
            assert_eq!(frame.link_frames, person().link_frames(&frame.pose));
            assert_eq!(frame.joint_positions.len(), person().joints.len());
            assert_eq!(frame.joint_positions[1], Point3::from(frame.link_frames[2].translation.vector));
            assert_eq!(frame.in_view.len(), rig().cameras.len());
        }
    }

    #[test]
    fn the_same_truth_comes_from_any_number_of_threads() {
        let with_threads = |n| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
            pool.install(|| GroundTruth::from_motion(person(), &walk(40), &rig()).unwrap())
        };
        assert_eq!(with_threads(1), with_threads(3));
    }

    #[test]
    fn motions_that_make_no_truth_are_refused_with_the_frame() {
        let refused = |motion: &Motion| GroundTruth::from_motion(person(), motion, &rig()).unwrap_err();
        let mut motion = walk(3);
        motion.poses[2].joint_angles[0] = f64::NAN;
        assert!(matches!(refused(&motion), SceneError::NotFinite { frame: 2, .. }));
        let mut motion = walk(3);
        motion.poses[1].joint_angles = nalgebra::DVector::zeros(9);
        assert!(matches!(refused(&motion), SceneError::WrongBody { frame: 1, found: 9, .. }));
        assert!(matches!(refused(&walk(0)), SceneError::EmptyMotion { .. }));
        assert!(matches!(refused(&Motion { frames_per_second: 0.0, ..walk(1) }), SceneError::EmptyMotion { .. }));
    }

    #[test]
    fn a_subject_that_no_camera_sees_is_an_error_and_one_that_leaves_is_reported() {
        let mut motion = walk(4);
        motion.poses[3].world_from_root = Isometry3::translation(300.0, 0.0, 0.0);
        let truth = GroundTruth::from_motion(person(), &motion, &rig()).unwrap();
        assert_eq!(truth.unseen_frames(&rig()), [3]);
        for pose in &mut motion.poses {
            pose.world_from_root = Isometry3::translation(1e300, 0.0, 0.0);
        }
        let error = GroundTruth::from_motion(person(), &motion, &rig()).unwrap_err();
        assert!(error.to_string().contains("no camera sees the subject in any of 4 frames"), "{error}");
    }
}
