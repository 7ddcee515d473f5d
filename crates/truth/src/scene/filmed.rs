//! The truth before cameras that move, or that take their images at times of their own.

use super::truth::MarkerFlags;
use super::{Distractor, GroundTruth, SceneClock, SceneError, Shot, Sight};
use crate::body::{Humanoid, LANDMARKS, Motion, Prop};
use crate::camera::TimedRig;
use crate::parallel;

impl GroundTruth {
    /// As [`Self::among`], before cameras that may move and take their images at times of their own. Poses, joints and
    /// markers are those of the frames; `in_view` and `visible` are of the moments at which the cameras expose what
    /// they see, and false of a camera that takes no image in a frame.
    ///
    /// # Errors
    /// As [`Self::among`].
    pub fn filmed(
        actor: Humanoid,
        motion: &Motion,
        filming: &TimedRig,
        props: Vec<Prop>,
        distractors: Vec<Distractor>,
    ) -> Result<Self, SceneError> {
        if filming.is_still() {
            return Self::among(actor, motion, filming.rig(), props, distractors);
        }
        let mut truth = Self::unwatched(actor, motion, props, distractors)?;
        let clock = SceneClock::new(&truth, filming);
        let views = parallel::map(truth.frames.len(), |frame| views(&clock, filming, frame));
        for (frame, (in_view, visible)) in truth.frames.iter_mut().zip(views) {
            (frame.in_view, frame.visible) = (in_view, visible);
        }
        match truth.unfilmed_frames(filming).len() == truth.frames.len() {
            true => Err(truth.out_of_view()),
            false => Ok(truth),
        }
    }

    /// Numbers of the frames in which no camera has any joint or marker in its image; whether it takes an image then or
    /// not.
    pub fn unfilmed_frames(&self, filming: &TimedRig) -> Vec<usize> {
        if filming.is_still() {
            return self.unseen_frames(filming.rig());
        }
        let unseen = |frame: &usize| {
            let frame = &self.frames[*frame];
            let rig = filming.rig_at(frame.time_s);
            !frame.points().any(|point| rig.cameras.iter().any(|camera| camera.sees(point)))
        };
        (0..self.frames.len()).filter(unseen).collect()
    }
}

fn views(clock: &SceneClock<'_>, filming: &TimedRig, frame: usize) -> (MarkerFlags, MarkerFlags) {
    let of_camera = |camera: usize| {
        let mut shot = Shot::new(clock, filming, camera, frame);
        let mut sight = |marker| shot.as_mut().and_then(|shot| shot.marker(marker)).map(|seen| seen.sight);
        let sights: [Sight; LANDMARKS.len()] = std::array::from_fn(|marker| sight(marker).unwrap_or(Sight::OutOfView));
        (sights.map(|sight| sight != Sight::OutOfView), sights.map(|sight| sight == Sight::InView))
    };
    (0..filming.cameras()).map(of_camera).unzip()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{CameraRig, CameraTiming};
    use crate::test_bodies::{person, walk};
    use crate::test_cameras::rig;

    fn filmed(timings: Vec<CameraTiming>) -> GroundTruth {
        let filming = TimedRig::new(rig(), Vec::new(), timings).unwrap();
        GroundTruth::filmed(person(), &walk(8), &filming, Vec::new(), Vec::new()).unwrap()
    }

    #[test]
    fn a_camera_that_is_a_frame_late_sees_what_is_seen_a_frame_later_and_one_without_an_image_sees_nothing() {
        let still = GroundTruth::from_motion(person(), &walk(8), &rig()).unwrap();
        let late = CameraTiming { offset_s: 1.0 / 60.0, ..CameraTiming::default() };
        let slow = CameraTiming { every: 3, ..CameraTiming::default() };
        let truth = filmed(vec![late, slow]);
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
        assert_eq!(filmed(Vec::new()), still);
    }

    #[test]
    fn a_rolling_shutter_shows_a_point_in_the_row_that_is_exposed_when_the_point_is_in_it() {
        let rolling = CameraTiming { line_delay_s: 1e-4, ..CameraTiming::default() };
        let filming = TimedRig::new(rig(), Vec::new(), vec![rolling; 3]).unwrap();
        let truth = GroundTruth::from_motion(person(), &walk(8), &rig()).unwrap();
        let clock = SceneClock::new(&truth, &filming);
        let CameraRig { cameras } = rig();
        let motion = truth.motion().made_continuous(&truth.actor);
        for (index, camera) in cameras.iter().enumerate() {
            let mut shot = Shot::new(&clock, &filming, index, 3).unwrap();
            for joint in 0..truth.actor.joints.len() {
                let seen = shot.joint(joint);
                let row = seen.pixel.unwrap().y.floor();
                // the other road: the pose of that row's time
                let pose = motion.at_frame(&truth.actor, 3.0 + 60.0 * 1e-4 * row).unwrap();
                let place = truth.actor.link_frames(&pose)[joint + 1].translation.vector.into();
                let pixel = camera.project(&place).unwrap();
                assert!((pixel - seen.pixel.unwrap()).norm() < 0.01, "{pixel} {seen:?}");
            }
        }
    }
}
