//! Rotations of the parts of a body, for angle errors.

use nalgebra::{UnitQuaternion, Vector3};

use skiagraph_core::body::{Humanoid, Landmark, LinkFrames, Pose};
use skiagraph_eval::PARTS;

/// One frame: rotation of every part in the world, relative to its rotation at the zero pose.
pub(crate) type Parts = [Option<UnitQuaternion<f64>>; PARTS];

/// Proximal and distal end of every part but the root.
const LIMBS: [[Landmark; 2]; PARTS - 1] = [
    [Landmark::LeftHip, Landmark::LeftKnee],
    [Landmark::RightHip, Landmark::RightKnee],
    [Landmark::LeftKnee, Landmark::LeftAnkle],
    [Landmark::RightKnee, Landmark::RightAnkle],
    [Landmark::LeftShoulder, Landmark::LeftElbow],
    [Landmark::RightShoulder, Landmark::RightElbow],
    [Landmark::LeftElbow, Landmark::LeftWrist],
    [Landmark::RightElbow, Landmark::RightWrist],
];
/// Limbs of two bodies are comparable if their directions at the zero pose differ by at most 10 degrees (this cosine).
const SAME_DIRECTION: f64 = 0.985;

/// The parts of two bodies whose rotations can be compared.
pub(crate) struct ComparableParts {
    comparable: [bool; PARTS],
}

impl ComparableParts {
    /// The comparable parts of two bodies: those with the same direction at the zero pose.
    pub(crate) fn new(a: &Humanoid, b: &Humanoid) -> Self {
        let [a, b] = [a, b].map(zero_directions);
        let mut comparable = [true; PARTS];
        for (index, pair) in a.iter().zip(&b).enumerate() {
            comparable[index + 1] = matches!(pair, (Some(a), Some(b)) if a.dot(b) > SAME_DIRECTION);
        }
        Self { comparable }
    }

    /// Whether only the root can be compared.
    pub(crate) fn is_root_alone(&self) -> bool {
        !self.comparable[1..].contains(&true)
    }

    /// The rotations of the parts for poses; `None` is a frame without a pose.
    pub(crate) fn rotations<'p>(&self, body: &Humanoid, poses: impl Iterator<Item = Option<&'p Pose>>) -> Vec<Parts> {
        let zero_from_links: Vec<_> = body.body_from_links().iter().map(UnitQuaternion::inverse).collect();
        let mut frames = LinkFrames::default();
        let mut of_pose = |pose: Option<&Pose>| {
            let Some(pose) = pose else { return [None; PARTS] };
            body.link_frames_into(pose, &mut frames);
            std::array::from_fn(|part| {
                let link =
                    part.checked_sub(1).map_or(Some(0), |limb| Some(body.markers[LIMBS[limb][0] as usize]?.link))?;
                self.comparable[part].then(|| frames.0[link].rotation * zero_from_links[link])
            })
        };
        poses.map(&mut of_pose).collect()
    }
}

/// Directions of the limbs at the zero pose, in the body's axes.
fn zero_directions(body: &Humanoid) -> [Option<Vector3<f64>>; PARTS - 1] {
    let markers = body.markers(&body.link_frames(&body.zero_pose()));
    let body_from_root = body.root_from_body().inverse();
    LIMBS.map(|[from, to]| {
        (markers[to as usize]? - markers[from as usize]?).try_normalize(1e-6).map(|d| body_from_root * d)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use skiagraph_core::body::shipped;

    #[test]
    fn built_in_bodies_share_all_parts_and_a_bent_knee_turns_only_its_shank() {
        let (actor, tracker) = (shipped("actor").unwrap(), shipped("tracker25").unwrap());
        let parts = ComparableParts::new(&actor, &tracker);
        assert!(!parts.is_root_alone() && parts.comparable == [true; PARTS]);
        let mut pose = tracker.zero_pose();
        let knee = tracker.degrees_of_freedom.iter().position(|d| d.name.contains("left_knee")).unwrap();
        pose.joint_angles[knee] = 0.5;
        let found = parts.rotations(&tracker, [Some(&pose), None].into_iter());
        let angles: Vec<f64> = found[0].iter().map(|rotation| rotation.unwrap().angle()).collect();
        for (part, angle) in angles.iter().enumerate() {
            let expected = if part == 3 { 0.5 } else { 0.0 };
            assert!((angle - expected).abs() < 1e-9, "part {part}: {angle}");
        }
        assert_eq!(found[1], [None; PARTS]);
    }
}
