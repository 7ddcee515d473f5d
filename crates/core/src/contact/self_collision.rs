//! Self-collision: parts of a body that penetrate each other.

use nalgebra::{Isometry3, Point3};

use super::solid_distance::solid_distance;
use crate::body::{BoundingBall, Humanoid, LinkFrames, Solid};

/// Two links, the lower index first.
pub type LinkPair = [usize; 2];

/// The reason why a pair of links is not tested.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LeftOut {
    /// One is the ancestor of the other, with only links without geometry between them.
    Adjacent,
    /// They touch when every joint is at zero.
    TouchesInBindPose,
}

/// Two links that penetrate each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Collision {
    /// The links.
    pub links: LinkPair,
    /// Depth, metres, > 0: the deepest overlap of any of their solids.
    pub depth_m: f64,
}

/// The pairs of links of a body that must not touch.
#[derive(Clone, Debug)]
pub struct SelfCollision<'a> {
    body: &'a Humanoid,
    pairs: Vec<LinkPair>,
    left_out: Vec<(LinkPair, LeftOut)>,
    /// Per link, the solids with their bounding spheres: centre in the link's frame, radius.
    solids: Vec<Vec<(&'a Solid, Point3<f64>, f64)>>,
}

impl<'a> SelfCollision<'a> {
    /// All pairs of links with geometry, except those that are adjacent or touch in the bind pose (all angles zero).
    pub fn new(body: &'a Humanoid) -> Self {
        let around = |solid: &'a Solid| bounding_ball(solid).map(|(centre, radius)| (solid, centre, radius));
        let solids = body.links.iter().map(|link| link.solids.iter().filter_map(around).collect()).collect();
        let mut found = Self { body, pairs: Vec::new(), left_out: Vec::new(), solids };
        let bind = body.link_frames(&body.zero_pose());
        let solid_links: Vec<usize> = (0..body.links.len()).filter(|&link| !found.solids[link].is_empty()).collect();
        for (i, &first) in solid_links.iter().enumerate() {
            for &second in &solid_links[i + 1..] {
                let pair = [first, second];
                if solid_parent(body, second) == Some(first) {
                    found.left_out.push((pair, LeftOut::Adjacent));
                } else if found.depth(&bind, pair) > 0.0 {
                    found.left_out.push((pair, LeftOut::TouchesInBindPose));
                } else {
                    found.pairs.push(pair);
                }
            }
        }
        found
    }

    /// The tested pairs.
    pub fn pairs(&self) -> &[LinkPair] {
        &self.pairs
    }

    /// The pairs that are not tested, with the reason.
    pub fn left_out(&self) -> &[(LinkPair, LeftOut)] {
        &self.left_out
    }

    /// The links that penetrate each other in these link frames, in the order of [`Self::pairs`].
    pub fn collisions(&self, frames: &LinkFrames) -> Vec<Collision> {
        let collision = |&links: &LinkPair| Collision { links, depth_m: self.depth(frames, links) };
        self.pairs.iter().map(collision).filter(|collision| collision.depth_m > 0.0).collect()
    }

    /// Depth of every pair of [`Self::pairs`], metres; 0 if apart.
    pub fn depths_m(&self, frames: &LinkFrames) -> Vec<f64> {
        self.pairs.iter().map(|&pair| self.depth(frames, pair)).collect()
    }

    /// Depth of the deepest collision, metres; 0 if there is none.
    pub fn deepest_m(&self, frames: &LinkFrames) -> f64 {
        self.pairs.iter().map(|&pair| self.depth(frames, pair)).fold(0.0, f64::max)
    }

    /// Names of a pair of links.
    pub fn names(&self, pair: LinkPair) -> [&'a str; 2] {
        pair.map(|link| self.body.links[link].name.as_str())
    }

    fn depth(&self, frames: &LinkFrames, [first, second]: LinkPair) -> f64 {
        let first_from_second: Isometry3<f64> = frames[first].inverse() * frames[second];
        let mut deepest = 0.0_f64;
        for (a, centre, radius) in &self.solids[first] {
            for (b, other_centre, other_radius) in &self.solids[second] {
                let reach = radius + other_radius;
                if (first_from_second * other_centre - centre).norm_squared() < reach * reach {
                    deepest = deepest.max(-solid_distance(a, b, &first_from_second));
                }
            }
        }
        deepest
    }
}

/// The nearest ancestor with geometry.
fn solid_parent(body: &Humanoid, link: usize) -> Option<usize> {
    let mut above = body.parent(link)?;
    while body.links[above].solids.is_empty() {
        above = body.parent(above)?;
    }
    Some(above)
}

/// The bounding sphere of the solid; `None` for an empty mesh.
pub(super) fn bounding_ball(solid: &Solid) -> Option<(Point3<f64>, f64)> {
    let is_empty = matches!(solid, Solid::Mesh { vertices, .. } if vertices.is_empty());
    let BoundingBall { centre, radius } = solid.ball();
    (!is_empty).then_some((centre, radius))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::shipped;

    #[test]
    fn nothing_touches_in_the_bind_pose_and_neighbours_are_left_out() {
        for name in ["actor", "tracker25"] {
            let body = shipped(name).unwrap();
            let collision = SelfCollision::new(&body);
            assert!(collision.collisions(&body.link_frames(&body.zero_pose())).is_empty());
            let solid_links = body.links.iter().filter(|link| !link.solids.is_empty()).count();
            assert_eq!(collision.pairs().len() + collision.left_out().len(), solid_links * (solid_links - 1) / 2);
            let adjacent = collision.left_out().iter().filter(|(_, why)| *why == LeftOut::Adjacent).count();
            assert_eq!(adjacent, solid_links - 1, "{name}: every part except the root has one parent");
            let thigh_and_shank = ["left_thigh", "left_shank"].map(|n| body.find_link(n).unwrap());
            assert!(collision.left_out().contains(&(thigh_and_shank, LeftOut::Adjacent)));
        }
    }

    #[test]
    fn crossed_legs_collide_as_deep_as_their_distance() {
        let body = shipped("actor").unwrap();
        let collision = SelfCollision::new(&body);
        let mut pose = body.zero_pose();
        // legs crossed: one hip adducted until the shanks meet
        let hip = body.find_degree_of_freedom("left_hip_abduction").unwrap();
        let shanks = ["left_shank", "right_shank"].map(|n| body.find_link(n).unwrap());
        let depth = |pose: &crate::body::Pose| {
            let found = collision.collisions(&body.link_frames(pose));
            found.iter().find(|c| c.links == shanks).map_or(0.0, |c| c.depth_m)
        };
        let mut met = 0.0;
        for step in 0..40 {
            pose.joint_angles[hip] = -0.01 * f64::from(step);
            let frames = body.link_frames(&pose);
            let distance =
                |a: &Solid, b: &Solid| solid_distance(a, b, &(frames[shanks[0]].inverse() * frames[shanks[1]]));
            let pairs = body.links[shanks[0]]
                .solids
                .iter()
                .flat_map(|a| body.links[shanks[1]].solids.iter().map(move |b| (a, b)));
            let nearest = pairs.map(|(a, b)| distance(a, b)).fold(f64::INFINITY, f64::min);
            assert!((depth(&pose) - (-nearest).max(0.0)).abs() < 1e-12);
            met = depth(&pose).max(met);
        }
        assert!(met > 0.01, "the legs never crossed: {met}");
    }
}
