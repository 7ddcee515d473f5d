//! Coverage of a body by its solids. Cameras see only the solids: a body with few solids cannot be tracked, through no
//! fault of the tracker.

use nalgebra::Point3;
use serde::Serialize;

use super::bodily_links::StandingBody;
use super::solid::vertex_bounds;
use super::{Humanoid, Landmark, Solid};
use crate::input::excerpts;

/// Least share of links with solids.
pub const LEAST_DRAWN_LINKS: f64 = 0.5;
/// Least covered share of the height from ankles to crown.
pub const LEAST_DRAWN_HEIGHT: f64 = 0.7;
/// Least covered share of the reach from wrist to wrist.
pub const LEAST_DRAWN_REACH: f64 = 0.5;

/// As a share of the stature: a solid within this distance covers a point of a bone.
const BESIDE: f64 = 0.02;
/// Joints nearer than this are hinges of one compound joint.
const SAME_JOINT: f64 = 0.02;
/// A massless link with a longer bone should have a solid.
const LONG_BONE: f64 = 0.05;
/// A smaller solid is only a marker.
const LEAST_SOLID: f64 = 0.01;
/// Landmarks of the trunk, whose bones have no adjacent links.
const TRUNK: [Landmark; 3] = [Landmark::Pelvis, Landmark::Thorax, Landmark::HeadTop];
/// Samples per bone.
const SAMPLES: usize = 50;
/// Greatest number of links named in a message.
const MOST_NAMED: usize = 12;

/// Coverage of a body by solids, standing in its zero pose.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DrawnShares {
    /// Number of links with solids, of those that should have solids.
    pub links_drawn: usize,
    /// Number of links that should have solids: those with at least a thousandth of the body's mass, and massless ones
    /// with a bone between two landmarks; hinges of a compound joint, frames of sensors and markers are not counted.
    pub links: usize,
    /// Covered share of the height from the ankles over the hips to the crown; `None` without landmarks.
    pub height: Option<f64>,
    /// Covered share of the path from wrist to wrist along the arms; `None` without landmarks.
    pub reach: Option<f64>,
    /// Names of links that should have solids but have none.
    pub missing: Vec<String>,
}

impl DrawnShares {
    /// Coverage by a body's solids; a skin is not considered.
    pub fn new(body: &Humanoid) -> Self {
        let standing = StandingBody::new(body);
        let is_drawn: Vec<bool> = body
            .links
            .iter()
            .map(|link| link.solids.iter().any(|solid| solid.extent() >= LEAST_SOLID * standing.stature))
            .collect();
        let counted: Vec<usize> =
            (0..body.links.len()).filter(|&link| should_be_drawn(&standing, &is_drawn, link)).collect();
        let missing = counted.iter().filter(|&&link| !is_drawn[link]);
        let missing: Vec<String> = missing.map(|&link| body.links[link].name.clone()).collect();
        Self {
            links_drawn: counted.len() - missing.len(),
            links: counted.len(),
            height: height_share(&standing),
            reach: reach_share(&standing),
            missing,
        }
    }

    /// Whether too little is covered for cameras to see the body.
    pub fn is_too_little(&self) -> bool {
        let short = |share: Option<f64>, least: f64| share.is_some_and(|share| share < least);
        (self.links_drawn as f64) < LEAST_DRAWN_LINKS * self.links as f64
            || short(self.height, LEAST_DRAWN_HEIGHT)
            || short(self.reach, LEAST_DRAWN_REACH)
    }

    /// Describes the shares: `18 of 20 links, 97 % of the height, 100 % of the reach`.
    pub fn describe(&self) -> String {
        let share = |share: Option<f64>, of: &str| share.map(|s| format!(", {:.0} % of the {of}", (100.0 * s).floor()));
        let (height, reach) = (share(self.height, "height"), share(self.reach, "reach"));
        let shares: String = height.into_iter().chain(reach).collect();
        format!("{} of {} links{shares}", self.links_drawn, self.links)
    }

    /// Lists the links that should have solids but have none; `None` if there are none.
    pub fn describe_missing(&self) -> Option<String> {
        (!self.missing.is_empty()).then(|| excerpts(self.missing.iter(), MOST_NAMED))
    }
}

fn should_be_drawn(standing: &StandingBody<'_>, is_drawn: &[bool], link: usize) -> bool {
    if !standing.is_bodily[link] {
        return false;
    }
    if is_drawn[link] {
        return true;
    }
    if standing.children(link).any(|child| standing.bone(link, child) < SAME_JOINT) {
        return false;
    }
    if standing.has_mass(link) {
        return true;
    }
    let is_carried = standing.is_fixed_to_parent(link) && standing.body.parent(link).is_some_and(|up| is_drawn[up]);
    let carries = standing.children(link).any(|child| standing.is_fixed_to_parent(child) && is_drawn[child]);
    let has_bone = standing.children(link).any(|child| standing.bone(link, child) > LONG_BONE);
    has_bone && !is_carried && !carries
}

/// Each leg counts half.
fn height_share(standing: &StandingBody<'_>) -> Option<f64> {
    use Landmark as L;
    let legs = [[L::LeftAnkle, L::LeftKnee, L::LeftHip], [L::RightAnkle, L::RightKnee, L::RightHip]];
    let mut sum = ShareSum::default();
    for leg in legs {
        sum.add(standing, &leg, 0.5, |bone| bone.z.abs())?;
    }
    sum.add(standing, &[L::Pelvis, L::Thorax, L::HeadTop], 1.0, |bone| bone.z.abs())?;
    sum.share()
}

fn reach_share(standing: &StandingBody<'_>) -> Option<f64> {
    use Landmark as L;
    let arms = [L::LeftWrist, L::LeftElbow, L::LeftShoulder, L::Thorax, L::RightShoulder, L::RightElbow, L::RightWrist];
    let mut sum = ShareSum::default();
    sum.add(standing, &arms, 1.0, |bone| bone.norm())?;
    sum.share()
}

#[derive(Default)]
struct ShareSum {
    drawn: f64,
    all: f64,
}

impl ShareSum {
    /// Adds the bones between landmarks; `None` if the body lacks one.
    fn add(
        &mut self,
        standing: &StandingBody<'_>,
        landmarks: &[Landmark],
        weight: f64,
        length: impl Fn(nalgebra::Vector3<f64>) -> f64,
    ) -> Option<()> {
        for pair in landmarks.windows(2) {
            let (from, to) = (standing.markers[pair[0] as usize]?, standing.markers[pair[1] as usize]?);
            let own = links_of_bone(standing, [pair[0], pair[1]])?;
            let sample = |i: usize| from + (to - from) * ((i as f64 + 0.5) / SAMPLES as f64);
            let drawn = (0..SAMPLES).filter(|&i| is_beside_a_solid(standing, &own, &sample(i))).count();
            let length = weight * length(to - from);
            self.drawn += length * (drawn as f64 / SAMPLES as f64);
            self.all += length;
        }
        Some(())
    }

    fn share(&self) -> Option<f64> {
        (self.all > 0.0).then(|| self.drawn / self.all)
    }
}

/// For every link, whether it belongs to a bone between two landmarks: links on the path from one to the other, and
/// links fixed to them. Arms hanging beside a trunk do not cover it: the link at the end of the bone, where a limb's
/// bone begins, is not counted.
fn links_of_bone(standing: &StandingBody<'_>, landmarks: [Landmark; 2]) -> Option<Vec<bool>> {
    let body = standing.body;
    if landmarks.iter().all(|landmark| TRUNK.contains(landmark)) {
        return Some(vec![true; body.links.len()]);
    }
    let ways: Vec<Vec<usize>> = landmarks
        .iter()
        .map(|landmark| {
            let link = body.markers[*landmark as usize]?.link;
            Some(std::iter::successors(Some(link), |&link| body.parent(link)).collect())
        })
        .collect::<Option<_>>()?;
    let upper = ways[0].iter().copied().find(|link| ways[1].contains(link))?;
    let mut own = vec![false; body.links.len()];
    for way in &ways {
        way.iter().take_while(|&&link| link != upper).for_each(|&link| own[link] = true);
    }
    let ends_here = |landmark: &Landmark| {
        let is_on_it = body.markers[*landmark as usize].is_some_and(|marker| marker.link == upper);
        let place = standing.markers[*landmark as usize];
        is_on_it && place.is_some_and(|p| (p - standing.origin(upper)).norm() > SAME_JOINT * standing.stature)
    };
    let begins_at_its_end = ways[0] != ways[1] && landmarks.iter().any(ends_here);
    let is_girdle = landmarks.iter().any(|landmark| TRUNK.contains(landmark));
    own[upper] = !begins_at_its_end || is_girdle;
    for link in 1..own.len() {
        own[link] |= standing.is_fixed_to_parent(link) && body.parent(link).is_some_and(|parent| own[parent]);
    }
    Some(own)
}

fn is_beside_a_solid(standing: &StandingBody<'_>, own: &[bool], point: &Point3<f64>) -> bool {
    let margin = BESIDE * standing.stature;
    let links = standing.body.links.iter().zip(&standing.frames.0).zip(own);
    links.filter(|(_, own)| **own).any(|((link, frame), _)| {
        let in_link = frame.inverse_transform_point(point);
        link.solids.iter().any(|solid| solid.is_within(&in_link, margin))
    })
}

impl Solid {
    /// Whether a point of the link's frame is in the solid or within `margin` of it; for a mesh, its bounding box is
    /// used.
    fn is_within(&self, point: &Point3<f64>, margin: f64) -> bool {
        match self {
            Self::TaperedCapsule(c) => {
                let axis = c.b - c.a;
                let along = ((point - c.a).dot(&axis) / axis.norm_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
                let radius = c.radius_a + along * (c.radius_b - c.radius_a);
                (point - (c.a + axis * along)).norm() <= radius + margin
            }
            Self::Box { link_from_box, half_extents } => {
                let own = link_from_box.inverse_transform_point(point);
                (0..3).all(|axis| own[axis].abs() <= half_extents[axis] + margin)
            }
            Self::Cylinder { link_from_cylinder, radius, half_length } => {
                let own = link_from_cylinder.inverse_transform_point(point);
                libm::hypot(own.x, own.y) <= radius + margin && own.z.abs() <= half_length + margin
            }
            Self::Mesh { vertices, .. } if vertices.is_empty() => false,
            Self::Mesh { vertices, .. } => {
                let (low, high) = vertex_bounds(vertices);
                (0..3).all(|axis| (low[axis] - margin..=high[axis] + margin).contains(&point[axis]))
            }
        }
    }

    /// Greatest length along one of its own axes, metres.
    fn extent(&self) -> f64 {
        match self {
            Self::TaperedCapsule(c) => (c.b - c.a).norm() + c.radius_a + c.radius_b,
            Self::Box { half_extents, .. } => 2.0 * half_extents.iter().copied().fold(0.0, f64::max),
            Self::Cylinder { radius, half_length, .. } => 2.0 * radius.max(*half_length),
            Self::Mesh { vertices, .. } => {
                let (low, high) = vertex_bounds(vertices);
                (high - low).amax()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::{SHIPPED_ROBOTS, shipped};
    use nalgebra::{Isometry3, Vector3};

    fn drawn_only(keep: impl Fn(&str) -> bool) -> DrawnShares {
        let mut body = shipped("actor").unwrap();
        body.links.iter_mut().filter(|link| !keep(&link.name)).for_each(|link| link.solids.clear());
        DrawnShares::new(&body)
    }

    #[test]
    fn built_in_robots_are_fully_covered() {
        // The trackers leave a part of the bones from thorax to shoulders without a solid: the ends of their trunks
        // and arms are too far apart. Nothing else is missing.
        for ((name, _), (links, reach)) in SHIPPED_ROBOTS.into_iter().zip([(10, 0.9644), (21, 1.0), (17, 0.9746)]) {
            let shares = DrawnShares::new(&shipped(name).unwrap());
            assert_eq!((shares.links_drawn, shares.links), (links, links), "{name}: {shares:?}");
            assert_eq!(shares.height, Some(1.0), "{name}");
            assert!((shares.reach.unwrap() - reach).abs() < 5e-5, "{name}: {shares:?}");
            assert!(!shares.is_too_little() && shares.describe_missing().is_none());
        }
    }

    #[test]
    fn a_body_with_only_a_trunk_is_insufficient_and_its_shares_match_its_bones() {
        let shares = drawn_only(|name| ["pelvis", "abdomen", "thorax"].contains(&name));
        assert_eq!((shares.links_drawn, shares.links), (3, 21));
        // Pelvis to neck is 0.85 - 0.53 of the stature of 1.75 m, ankles to crown 1 - 0.039. The chest ends in two
        // balls, 68 mm aside and 0.185 m above the thorax, with a radius of 106 mm plus the margin: the bone's end at
        // 0.3275 m is outside.
        let radius = 0.106 + BESIDE * 1.75;
        let beyond = 0.3275 - (0.185 + (radius * radius - 0.068_f64 * 0.068).sqrt());
        let expected = (0.32 - beyond / 1.75) / 0.961;
        let half_a_sample = 0.5 * 0.32 / SAMPLES as f64 / 0.961;
        let height = shares.height.unwrap();
        assert!((height - expected).abs() <= half_a_sample, "{height}, expected {expected}");
        assert!(shares.is_too_little());
        assert_eq!(shares.missing.len(), 18);
        assert!(shares.describe_missing().unwrap().ends_with(" and 6 more"));
    }

    #[test]
    fn a_body_without_arms_has_its_height_and_too_little_reach() {
        let shares = drawn_only(|name| !["arm", "hand", "clavicle"].iter().any(|part| name.contains(part)));
        // the shoulders' solids cover two centimetres of the neck
        assert!(shares.height.unwrap() > 0.97, "{shares:?}");
        assert!(shares.reach.unwrap() < LEAST_DRAWN_REACH && shares.is_too_little(), "{shares:?}");
        let words = shares.describe();
        assert!(words.starts_with("13 of 21 links, ") && words.ends_with(" of the reach"), "{words}");
    }

    #[test]
    fn only_hands_and_feet_may_be_missing() {
        let shares = drawn_only(|name| !["hand", "foot", "toes"].iter().any(|part| name.contains(part)));
        assert_eq!(shares.missing, ["left_hand", "right_hand", "left_foot", "left_toes", "right_foot", "right_toes"]);
        assert!(!shares.is_too_little(), "{shares:?}");
    }

    /// Shares do not depend on the file's unit.
    #[test]
    fn a_body_scaled_by_four_has_the_same_shares() {
        let mut body = shipped("actor").unwrap();
        body.links.iter_mut().filter(|link| link.name.contains("shank")).for_each(|link| link.solids.clear());
        let shape = crate::body::LinkShape { length: Vector3::repeat(4.0), girth: 4.0 };
        let large = body.reshaped(&crate::body::BodyShape { links: vec![shape; body.links.len()] });
        let (small, large) = (DrawnShares::new(&body), DrawnShares::new(&large));
        assert_eq!(small, large);
        assert!(small.height.unwrap() < 0.9);
    }

    #[test]
    fn points_in_solids_are_found_for_every_shape() {
        let here = Isometry3::translation(0.0, 0.0, 1.0);
        let corners = [[-0.1, -0.2, 0.7], [0.1, 0.2, 1.3]].map(Point3::from).to_vec();
        let solids = [
            (Solid::Box { link_from_box: here, half_extents: [0.1, 0.2, 0.3] }, [0.09, 0.19, 1.29], [0.12, 0.0, 1.0]),
            (
                Solid::Cylinder { link_from_cylinder: here, radius: 0.1, half_length: 0.3 },
                [0.07, 0.07, 1.29],
                [0.09, 0.09, 1.0],
            ),
            (Solid::Mesh { vertices: corners, triangles: vec![] }, [0.09, 0.19, 1.29], [0.0, 0.0, 1.4]),
        ];
        for (solid, inside, outside) in solids {
            assert!(solid.is_within(&inside.into(), 0.0) && !solid.is_within(&outside.into(), 0.01), "{solid:?}");
            assert!(solid.is_within(&outside.into(), 0.2) && (solid.extent() - 0.6).abs() < 1e-12);
        }
    }
}
