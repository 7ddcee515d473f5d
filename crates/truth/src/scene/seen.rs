//! Which parts of the truth each camera sees, and when.

use super::{Distractor, GroundTruth, SceneClock, SceneError, Shot, Sight};
use skiagraph_core::body::{Humanoid, LANDMARKS, Motion, Prop};
use skiagraph_core::camera::TimedRig;
use skiagraph_core::parallel;

/// `[camera][marker]`.
type MarkerFlags = Vec<[bool; LANDMARKS.len()]>;

impl GroundTruth {
    /// The ground truth of an actor performing `motion`, seen by the cameras of `rig`; bit-identical for any number of
    /// threads. Poses, joints and markers are those at the frame times; `in_view` and `visible` hold at the cameras'
    /// exposure times, and are false for a camera without an image in a frame.
    ///
    /// # Errors
    /// [`SceneError`] if the motion is empty, belongs to another body, is not finite, or is never in view.
    pub fn from_motion(actor: Humanoid, motion: &Motion, rig: impl Into<TimedRig>) -> Result<Self, SceneError> {
        Self::among(actor, motion, rig, Vec::new(), Vec::new())
    }

    /// Like [`Self::from_motion`], with props and other people.
    ///
    /// # Errors
    /// As [`Self::from_motion`]; [`SceneError::Figure`] for a distractor without poses or with those of another body.
    pub fn among(
        actor: Humanoid,
        motion: &Motion,
        rig: impl Into<TimedRig>,
        props: Vec<Prop>,
        distractors: Vec<Distractor>,
    ) -> Result<Self, SceneError> {
        let (mut truth, rig) = (Self::without_cameras(actor, motion, props, distractors)?, rig.into());
        let clock = SceneClock::new(&truth, &rig);
        let views = parallel::map(truth.frames.len(), |frame| views(&clock, &rig, frame));
        for (frame, (in_view, visible)) in truth.frames.iter_mut().zip(views) {
            (frame.in_view, frame.visible) = (in_view, visible);
        }
        if truth.unseen_frames(&rig).len() == truth.frames.len() {
            let start: [f64; 3] = truth.frames[0].pose.world_from_root.translation.vector.into();
            return Err(SceneError::Figure(format!(
                "no camera sees the subject in any of {} frames (it starts at {start:.2?} m); move the cameras or the \
                 motion",
                truth.frames.len()
            )));
        }
        Ok(truth)
    }

    /// Frames in which no camera has any joint or marker in its field of view, whether or not it takes an image.
    pub fn unseen_frames(&self, rig: &TimedRig) -> Vec<usize> {
        let is_unseen = |frame: &usize| {
            let frame = &self.frames[*frame];
            let now = rig.rig_at(frame.time_s);
            !frame.points().any(|point| now.cameras.iter().any(|camera| camera.sees(point)))
        };
        (0..self.frames.len()).filter(is_unseen).collect()
    }
}

/// Which markers are in view of each camera in a frame, and which are visible.
fn views(clock: &SceneClock<'_>, rig: &TimedRig, frame: usize) -> (MarkerFlags, MarkerFlags) {
    let mut shot = Shot::new(clock, rig, frame);
    let mut sight = |camera, marker| {
        let point = shot.marker(camera, marker);
        point.map_or(Sight::OutOfView, |point| shot.sight(camera, &point))
    };
    let mut sights = |camera| std::array::from_fn::<Sight, { LANDMARKS.len() }, _>(|marker| sight(camera, marker));
    let flags = |sights: [Sight; LANDMARKS.len()]| {
        (sights.map(|sight| sight != Sight::OutOfView), sights.map(|sight| sight == Sight::InView))
    };
    (0..rig.cameras()).map(|camera| flags(sights(camera))).unzip()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_bodies::{person, walk};
    use crate::test_cameras::rig;
    use approx::assert_relative_eq;
    use nalgebra::{Isometry3, Point3};
    use skiagraph_core::camera::{CameraRig, CameraTiming};

    #[test]
    fn truth_agrees_with_kinematics_and_projection() {
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
    fn invalid_motions_are_refused_with_the_frame() {
        let refused = |motion: &Motion, message: &str| {
            let error = GroundTruth::from_motion(person(), motion, &rig()).unwrap_err();
            assert!(error.to_string().contains(message), "{error}");
        };
        let mut motion = walk(3);
        motion.poses[2].joint_angles[0] = f64::NAN;
        refused(&motion, "frame 2 (from 0): the position of link");
        let mut motion = walk(3);
        motion.poses[1].joint_angles = nalgebra::DVector::zeros(9);
        refused(&motion, "frame 1 (from 0): the pose has 9 joint angles");
        for empty in [walk(0), Motion { frames_per_second: 0.0, ..walk(1) }] {
            refused(&empty, "expected at least one pose and a rate above 0");
        }
    }

    #[test]
    fn a_subject_never_in_view_is_an_error_and_one_that_leaves_is_reported() {
        let mut motion = walk(4);
        motion.poses[3].world_from_root = Isometry3::translation(300.0, 0.0, 0.0);
        let truth = GroundTruth::from_motion(person(), &motion, &rig()).unwrap();
        assert_eq!(truth.unseen_frames(&TimedRig::from(&rig())), [3]);
        for pose in &mut motion.poses {
            pose.world_from_root = Isometry3::translation(1e300, 0.0, 0.0);
        }
        let error = GroundTruth::from_motion(person(), &motion, &rig()).unwrap_err();
        assert!(error.to_string().contains("no camera sees the subject in any of 4 frames"), "{error}");
    }

    #[test]
    fn a_late_camera_sees_the_next_frame_and_a_slow_one_nothing_without_an_image() {
        let still = GroundTruth::from_motion(person(), &walk(8), &rig()).unwrap();
        let late = CameraTiming { offset_s: 1.0 / 60.0, ..CameraTiming::default() };
        let slow = CameraTiming { every: 3, ..CameraTiming::default() };
        let filming = TimedRig::new(rig(), Vec::new(), vec![late, slow]).unwrap();
        let truth = GroundTruth::from_motion(person(), &walk(8), &filming).unwrap();
        for frame in 0..7 {
            let (own, later) = (&truth.frames[frame], &still.frames[frame + 1]);
            assert_eq!((&own.in_view[0], &own.visible[0]), (&later.in_view[0], &later.visible[0]));
            assert_eq!(own.visible[2], still.frames[frame].visible[2]);
            match frame % 3 {
                0 => assert_eq!(own.visible[1], still.frames[frame].visible[1]),
                _ => assert_eq!((own.in_view[1], own.visible[1]), ([false; 15], [false; 15])),
            }
            assert_eq!((&own.pose, &own.markers), (&still.frames[frame].pose, &still.frames[frame].markers));
        }
    }

    #[test]
    fn a_rolling_shutter_shows_a_point_in_the_row_exposed_at_that_time() {
        let rolling = CameraTiming { line_delay_s: 1e-4, ..CameraTiming::default() };
        let filming = TimedRig::new(rig(), Vec::new(), vec![rolling; 3]).unwrap();
        let truth = GroundTruth::from_motion(person(), &walk(8), &rig()).unwrap();
        let clock = SceneClock::new(&truth, &filming);
        let CameraRig { cameras } = rig();
        let motion = truth.motion().made_continuous(&truth.actor);
        for (index, camera) in cameras.iter().enumerate() {
            let mut shot = Shot::new(&clock, &filming, 3);
            for joint in 0..truth.actor.joints.len() {
                let seen = shot.joint(index, joint).unwrap();
                let row = seen.pixel.unwrap().y.floor();
                // independently: the pose at that row's time
                let pose = motion.at_frame(&truth.actor, 3.0 + 60.0 * 1e-4 * row).unwrap();
                let place = truth.actor.link_frames(&pose)[joint + 1].translation.vector.into();
                let pixel = camera.project(&place).unwrap();
                assert!((pixel - seen.pixel.unwrap()).norm() < 0.01, "{pixel} {seen:?}");
            }
        }
    }
}
