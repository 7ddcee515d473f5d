//! Links of a robot that are parts of its body, as opposed to sensor frames and hinges of compound joints.

use super::{Humanoid, JointKind, Landmark, LinkFrames, Markers};

/// A link with less than this share of the body's mass is a sensor, a screw or a placeholder.
const LEAST_MASS_SHARE: f64 = 0.001;
/// Height of the ankles as a share of the stature (`[Drillis 1966]`).
pub(super) const ANKLE: f64 = 0.039;
/// Stature of a body whose landmarks do not define one, metres.
const USUAL_STATURE: f64 = 1.75;

/// A body standing in its zero pose: X forward, Y left, Z up.
pub(super) struct StandingBody<'a> {
    pub(super) body: &'a Humanoid,
    pub(super) frames: LinkFrames,
    pub(super) markers: Markers,
    /// Height from the soles to the crown, metres.
    pub(super) stature: f64,
    /// For every link, whether it is a part of the body: it has mass, or is between two landmarks.
    pub(super) is_bodily: Vec<bool>,
    /// For every link, whether it or a descendant is a part of the body.
    leads_on: Vec<bool>,
}

impl<'a> StandingBody<'a> {
    pub(super) fn new(body: &'a Humanoid) -> Self {
        let frames = body.link_frames(&body.standing_pose());
        let markers = body.markers(&frames);
        let stature = stature(&markers, &frames);
        let (mass, between) = (body.total_mass(), between_landmarks(body));
        let has_mass = |link: usize| {
            body.links[link].inertia.as_ref().is_some_and(|inertia| inertia.mass > LEAST_MASS_SHARE * mass)
        };
        let is_bodily: Vec<bool> = (0..body.links.len()).map(|link| has_mass(link) || between[link]).collect();
        let mut leads_on = is_bodily.clone();
        for link in (1..body.links.len()).rev() {
            let parent = body.joints[link - 1].parent;
            leads_on[parent] |= leads_on[link];
        }
        Self { body, frames, markers, stature, is_bodily, leads_on }
    }

    pub(super) fn has_mass(&self, link: usize) -> bool {
        self.body.links[link].inertia.is_some()
    }

    pub(super) fn origin(&self, link: usize) -> nalgebra::Point3<f64> {
        self.frames[link].translation.vector.into()
    }

    /// Child links connected by a moving joint that lead to parts of the body.
    pub(super) fn children(&self, link: usize) -> impl Iterator<Item = usize> {
        let joints = self.body.joints.iter().enumerate();
        joints.filter(move |(_, joint)| joint.parent == link).map(|(joint, _)| joint + 1).filter(|&l| self.leads_on[l])
    }

    /// Distance from a link's joint to that of one of its children, as a share of the stature.
    pub(super) fn bone(&self, link: usize, child: usize) -> f64 {
        (self.origin(child) - self.origin(link)).norm() / self.stature
    }

    pub(super) fn is_fixed_to_parent(&self, link: usize) -> bool {
        link.checked_sub(1).is_some_and(|joint| self.body.joints[joint].kind == JointKind::Fixed)
    }
}

/// Height from the soles to the crown: from ankles and crown, else the extent of all joints.
fn stature(markers: &Markers, frames: &LinkFrames) -> f64 {
    let height = |landmark: Landmark| markers[landmark as usize].map(|place| place.z);
    let ankles: Vec<f64> = [Landmark::LeftAnkle, Landmark::RightAnkle].into_iter().filter_map(height).collect();
    let lowest = ankles.iter().copied().reduce(f64::min);
    let of_landmarks = height(Landmark::HeadTop).zip(lowest).map(|(crown, ankle)| (crown - ankle) / (1.0 - ANKLE));
    let heights = || frames.0.iter().map(|frame| frame.translation.vector.z);
    let of_joints = heights().fold(f64::NEG_INFINITY, f64::max) - heights().fold(f64::INFINITY, f64::min);
    let usable = |length: &f64| length.is_finite() && *length > 1e-6;
    of_landmarks.filter(usable).or(Some(of_joints).filter(usable)).unwrap_or(USUAL_STATURE)
}

/// For every link, whether it is on the path from one landmark to another.
fn between_landmarks(body: &Humanoid) -> Vec<bool> {
    let mut below = vec![0_usize; body.links.len()];
    body.markers.iter().flatten().for_each(|marker| below[marker.link] += 1);
    for link in (1..body.links.len()).rev() {
        below[body.joints[link - 1].parent] += below[link];
    }
    let all = below.first().copied().unwrap_or(0);
    // the link where all paths meet is the last one that leads to all landmarks
    let meeting = below.iter().rposition(|count| *count == all);
    let is_between = |(link, count): (usize, &usize)| *count > 0 && (*count < all || Some(link) == meeting);
    below.iter().enumerate().map(is_between).collect()
}
