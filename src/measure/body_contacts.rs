//! Contacts of one body over a clip; frames without a pose are unknown.

use std::ops::Range;

use nalgebra::{Point3, Vector3};
use skiagraph_core::body::{Humanoid, LinkFrames, Motion, Pose, Prop};
use skiagraph_core::contact::{ContactRule, ContactTrack, GroundContact, GroundContacts, PropContacts, SelfCollision};
use skiagraph_core::parallel;
use skiagraph_eval::ContactMeasures;

pub(crate) struct BodyContacts {
    ground: GroundContacts,
    self_depth_m: Vec<f64>,
    /// `None` without props.
    prop_depth_m: Option<Vec<f64>>,
    /// `None` if every frame has a pose.
    known: Option<Vec<bool>>,
}

impl BodyContacts {
    /// Contacts of a motion; `None` for a body whose feet have no geometry.
    pub(crate) fn from_motion(body: &Humanoid, motion: &Motion, props: &[Prop]) -> Option<Self> {
        let rule = ContactRule::default();
        let frames: Vec<LinkFrames> = motion.poses.iter().map(|pose| body.link_frames(pose)).collect();
        let ground = GroundContacts::from_motion(body, motion, &rule).ok()?;
        let among = PropContacts::from_frames(body, props, &frames, motion.frames_per_second, &rule).ok()?;
        let prop_depth_m = (!props.is_empty()).then(|| among.deepest_m(frames.len()));
        let own = SelfCollision::new(body);
        let self_depth_m = parallel::map(frames.len(), |frame| own.deepest_m(&frames[frame]));
        Some(Self { ground, self_depth_m, prop_depth_m, known: None })
    }

    /// As [`Self::from_motion`], for poses with gaps: each stretch between gaps is measured separately. `None` without
    /// poses.
    pub(crate) fn from_poses(
        body: &Humanoid,
        poses: &[Option<Pose>],
        frames_per_second: f64,
        props: &[Prop],
    ) -> Option<Self> {
        let mut whole: Option<Self> = None;
        for stretch in stretches(poses) {
            let motion =
                Motion { frames_per_second, poses: poses[stretch.clone()].iter().flatten().cloned().collect() };
            let part = Self::from_motion(body, &motion, props)?;
            if stretch.len() == poses.len() {
                return Some(part);
            }
            whole.get_or_insert_with(|| part.unknown_frames(poses.len())).put(stretch.start, part);
        }
        whole
    }

    /// The contacts as evaluation takes them.
    pub(crate) fn touching(&self) -> ContactMeasures<'_> {
        ContactMeasures {
            ground: &self.ground,
            self_depth_m: &self.self_depth_m,
            prop_depth_m: self.prop_depth_m.as_deref(),
            known: self.known.as_deref(),
        }
    }

    /// The same tracks over `frames` frames, all unknown.
    fn unknown_frames(&self, frames: usize) -> Self {
        let track = |track: &ContactTrack| ContactTrack {
            frames: vec![UNKNOWN_CONTACT; frames],
            links: track.links.clone(),
            name: track.name.clone(),
        };
        Self {
            ground: GroundContacts {
                frames_per_second: self.ground.frames_per_second,
                links: self.ground.links.iter().map(track).collect(),
                feet: self.ground.feet.each_ref().map(track),
                rule: self.ground.rule,
            },
            self_depth_m: vec![0.0; frames],
            prop_depth_m: self.prop_depth_m.as_ref().map(|_| vec![0.0; frames]),
            known: Some(vec![false; frames]),
        }
    }

    /// Copies the frames of a stretch that begins at frame `start`.
    fn put(&mut self, start: usize, part: Self) {
        let frames = start..start + part.self_depth_m.len();
        let tracks = self.ground.links.iter_mut().chain(&mut self.ground.feet);
        for (track, part) in tracks.zip(part.ground.links.into_iter().chain(part.ground.feet)) {
            track.frames[frames.clone()].copy_from_slice(&part.frames);
        }
        self.self_depth_m[frames.clone()].copy_from_slice(&part.self_depth_m);
        if let (Some(depths), Some(part)) = (&mut self.prop_depth_m, part.prop_depth_m) {
            depths[frames.clone()].copy_from_slice(&part);
        }
        if let Some(known) = &mut self.known {
            known[frames].fill(true);
        }
    }
}

const UNKNOWN_CONTACT: GroundContact = GroundContact {
    gap_m: 0.0,
    point: Point3::new(0.0, 0.0, 0.0),
    link: 0,
    velocity: Vector3::new(0.0, 0.0, 0.0),
    in_contact: false,
};

/// Runs of consecutive frames with a pose.
fn stretches(poses: &[Option<Pose>]) -> Vec<Range<usize>> {
    let mut found: Vec<Range<usize>> = Vec::new();
    for frame in (0..poses.len()).filter(|frame| poses[*frame].is_some()) {
        match found.last_mut() {
            Some(last) if last.end == frame => last.end += 1,
            _ => found.push(frame..frame + 1),
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use skiagraph_core::body::shipped;

    /// A body that slides along x by 10 mm per frame and sinks.
    fn poses(body: &Humanoid) -> Vec<Option<Pose>> {
        let pose = |frame: usize| {
            let mut pose = body.zero_pose();
            pose.world_from_root.translation.vector =
                Vector3::new(0.01 * frame as f64, 0.0, 1.0 - 0.002 * frame as f64);
            Some(pose)
        };
        (0..40).map(pose).collect()
    }

    #[test]
    fn a_gap_is_unknown_and_does_not_change_distant_frames() {
        let body = shipped("tracker25").unwrap();
        let all = poses(&body);
        let whole = BodyContacts::from_poses(&body, &all, 60.0, &[]).unwrap();
        assert!(whole.known.is_none());
        let mut gappy = all.clone();
        gappy[20] = None;
        gappy[0] = None;
        let found = BodyContacts::from_poses(&body, &gappy, 60.0, &[]).unwrap();
        let touching = found.touching();
        let unknown: Vec<usize> = (0..40).filter(|frame| !touching.is_known(*frame, 1)).collect();
        assert_eq!(unknown, [0, 1, 19, 20, 21]);
        for frame in (0..40).filter(|frame| touching.is_known(*frame, 4)) {
            assert_eq!(found.self_depth_m[frame], whole.self_depth_m[frame]);
            for (a, b) in found.ground.feet.iter().zip(&whole.ground.feet) {
                assert_eq!(
                    (a.frames[frame].gap_m, a.frames[frame].velocity),
                    (b.frames[frame].gap_m, b.frames[frame].velocity)
                );
            }
        }
        assert!(BodyContacts::from_poses(&body, &vec![None; 5], 60.0, &[]).is_none());
    }
}
