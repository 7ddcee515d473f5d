//! The links of any robot that correspond to segments of a person, from the landmarks recognised on its joints.
//!
//! A segment's link is the last one along a limb whose joint is nearer to the segment's upper end than to its lower
//! one: for a joint with several hinges, the last hinge.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use crate::body::landmark::{ARMS, LEGS};
use crate::body::{Humanoid, JointKind, Landmark, LinkFrames};

/// Hinges of a wrist or an ankle are nearer to its landmark than this share of the segment above.
const NEAR: f64 = 0.2;
/// Joints of toes and collar bones are farther from ankle and shoulder than this share of the shank and of the upper
/// arm.
const APART: f64 = 0.25;
/// Joints up to this share of the distance from hips to neck move the abdomen.
const LOW_IN_TRUNK: f64 = 0.3;
/// Hinges of one joint are nearer to each other than this, metres.
const SAME_JOINT_M: f64 = 0.02;

/// Links of segments, by the segments' names.
pub(in crate::body) fn links_of_segments(body: &Humanoid) -> BTreeMap<String, usize> {
    let robot = RobotAtZero { body, frames: body.link_frames(&body.zero_pose()) };
    let mut links: BTreeMap<String, usize> = BTreeMap::new();
    let mut put = |side: &str, part: &str, link: Option<usize>| {
        let name = if side.is_empty() { part.to_owned() } else { format!("{side}_{part}") };
        links.extend(link.map(|link| (name, link)));
    };
    for (part, link) in robot.trunk() {
        put("", part, link);
    }
    for (side, (arm, leg)) in ["left", "right"].into_iter().zip(ARMS.into_iter().zip(LEGS)) {
        if let Some(limb) = robot.limb(arm) {
            let [upper, fore, hand] = limb.links;
            put(side, "upper_arm", Some(upper));
            put(side, "forearm", Some(fore));
            put(side, "hand", Some(hand));
            put(side, "clavicle", robot.clavicle(&limb));
        }
        if let Some(limb) = robot.limb(leg) {
            let [thigh, shank, foot] = limb.links;
            put(side, "thigh", Some(thigh));
            put(side, "shank", Some(shank));
            put(side, "foot", Some(foot));
            put(side, "toes", Some(robot.toes(&limb)));
        }
    }
    links
}

struct RobotAtZero<'a> {
    body: &'a Humanoid,
    frames: LinkFrames,
}

struct LimbLinks {
    links: [usize; 3],
    /// Its upper, middle and lower joint, root's frame, metres.
    joints: [Vector3<f64>; 3],
}

impl RobotAtZero<'_> {
    fn origin(&self, link: usize) -> Vector3<f64> {
        self.frames[link].translation.vector
    }

    fn landmark(&self, landmark: Landmark) -> Option<(usize, Vector3<f64>)> {
        let marker = self.body.markers[landmark as usize]?;
        Some((marker.link, (self.frames[marker.link] * marker.point_in_link).coords))
    }

    /// The links from the root to this one.
    fn path(&self, link: usize) -> Vec<usize> {
        let mut path: Vec<usize> = std::iter::successors(Some(link), |&link| self.body.parent(link)).collect();
        path.reverse();
        path
    }

    /// Links moved by a joint relative to this one.
    fn moved_by(&self, link: usize) -> impl Iterator<Item = usize> {
        let joints = self.body.joints.iter().enumerate();
        let moving = joints.filter(move |(_, joint)| joint.parent == link && joint.kind != JointKind::Fixed);
        moving.map(|(joint, _)| joint + 1)
    }

    fn limb(&self, landmarks: [Landmark; 3]) -> Option<LimbLinks> {
        let [(_, upper), (_, middle), (end, lower)] =
            [self.landmark(landmarks[0])?, self.landmark(landmarks[1])?, self.landmark(landmarks[2])?];
        let reach = NEAR * (lower - middle).norm();
        let mut path = self.path(end);
        let mut last = end;
        while let Some(next) = self.moved_by(last).find(|&next| (self.origin(next) - lower).norm() <= reach) {
            path.push(next);
            last = next;
        }
        let nearer = |link: usize, to: &Vector3<f64>, than: &Vector3<f64>| {
            (self.origin(link) - to).norm() < (self.origin(link) - than).norm()
        };
        let is_end = |link: usize| (self.origin(link) - lower).norm() <= reach;
        let first = path.iter().rposition(|&link| nearer(link, &upper, &middle))?;
        let second = path.iter().rposition(|&link| nearer(link, &middle, &lower) && !is_end(link))?;
        let third = path.iter().rposition(|&link| is_end(link)).filter(|third| *third > second).unwrap_or(second);
        let links = [path[first], path[second], path[third]];
        (first < second).then_some(LimbLinks { links, joints: [upper, middle, lower] })
    }

    /// Pelvis, abdomen, thorax, neck and head.
    fn trunk(&self) -> [(&'static str, Option<usize>); 5] {
        let [pelvis, thorax, head] = [Landmark::Pelvis, Landmark::Thorax, Landmark::HeadTop].map(|l| self.landmark(l));
        let abdomen = || {
            let ((low, hips), (high, neck)) = (pelvis?, thorax?);
            let up = neck - hips;
            let is_low = |link: usize| (self.origin(link) - hips).dot(&up) <= LOW_IN_TRUNK * up.norm_squared();
            let path = self.path(high);
            let own = path.iter().position(|&link| link == low).map_or(&[][..], |at| &path[at + 1..]);
            Some(own.iter().copied().rfind(|&link| is_low(link)).unwrap_or(low))
        };
        let neck = || {
            let ((low, _), (high, _)) = (thorax?, head?);
            let path = self.path(high);
            let own = path.iter().position(|&link| link == low).map_or(&[][..], |at| &path[at + 1..]);
            let is_apart = |link: &usize| (self.origin(*link) - self.origin(high)).norm() > SAME_JOINT_M;
            Some(own.iter().copied().rfind(is_apart).unwrap_or(low))
        };
        let link = |found: Option<(usize, Vector3<f64>)>| found.map(|(link, _)| link);
        [
            ("pelvis", link(pelvis)),
            ("abdomen", abdomen()),
            ("thorax", link(thorax)),
            ("neck", neck()),
            ("head", link(head)),
        ]
    }

    /// The last link between thorax and upper arm that begins well before the shoulder, else the thorax.
    fn clavicle(&self, arm: &LimbLinks) -> Option<usize> {
        let (thorax, _) = self.landmark(Landmark::Thorax)?;
        let [shoulder, elbow, _] = arm.joints;
        let path = self.path(arm.links[0]);
        let at = path.iter().position(|&link| link == thorax);
        // also empty if the thorax itself carries the upper arm
        let above = at.and_then(|at| path.get(at + 1..path.len() - 1)).unwrap_or_default();
        let begins_before = |link: &usize| (self.origin(*link) - shoulder).norm() > APART * (elbow - shoulder).norm();
        Some(above.iter().copied().rfind(begins_before).unwrap_or(thorax))
    }

    /// The first link below the foot that begins well away from the ankle, else the foot.
    fn toes(&self, leg: &LimbLinks) -> usize {
        let [_, knee, ankle] = leg.joints;
        let begins_away = |link: &usize| (self.origin(*link) - ankle).norm() > APART * (knee - ankle).norm();
        self.moved_by(leg.links[2]).find(begins_away).unwrap_or(leg.links[2])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::shipped;

    /// A built-in robot with renamed links: they must be found by its landmarks.
    #[test]
    fn the_links_of_the_actor_are_found_without_their_names() {
        let actor = shipped("actor").unwrap();
        let found = links_of_segments(&actor);
        for segment in ["pelvis", "abdomen", "thorax", "neck", "head"] {
            assert_eq!(actor.links[found[segment]].name, segment);
        }
        for side in ["left", "right"] {
            for part in ["clavicle", "upper_arm", "forearm", "hand", "thigh", "shank", "foot", "toes"] {
                let segment = format!("{side}_{part}");
                assert_eq!(actor.links[found[&segment]].name, segment);
            }
        }
    }

    #[test]
    fn segments_without_a_joint_are_carried_by_the_next_link_and_unknown_limbs_by_none() {
        let mut tracker = shipped("tracker25").unwrap();
        let found = links_of_segments(&tracker);
        assert_eq!(tracker.links[found["left_hand"]].name, "left_forearm");
        assert_eq!(tracker.links[found["right_toes"]].name, "right_shank");
        tracker.markers[Landmark::LeftKnee as usize] = None;
        let found = links_of_segments(&tracker);
        assert!(!found.contains_key("left_shank") && found.contains_key("right_shank"));
    }
}
