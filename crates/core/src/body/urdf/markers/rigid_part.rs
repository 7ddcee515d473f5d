//! A body as rigid parts: links connected by fixed joints form one part; every part except the first is moved by a
//! joint.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};

use super::names::{BodyPart, BodySide, side_and_part};
use crate::body::{Humanoid, JointKind, LinkFrames};

/// Links that move together.
#[derive(Debug)]
pub(super) struct RigidPart {
    /// All links, parents first; the first is the child of the moving joint, or the root.
    pub(super) links: Vec<usize>,
    pub(super) parent: Option<usize>,
    /// Number of moving joints above.
    pub(super) depth: usize,
    /// Position of its joint at the zero pose, in the root's frame.
    pub(super) origin: Point3<f64>,
    /// The joint's axis there; `None` for a ball joint or a slider.
    pub(super) axis: Option<Vector3<f64>>,
    /// From the name of its first link, else of its joint, else of another of its links.
    pub(super) side: Option<BodySide>,
    pub(super) part: Option<BodyPart>,
    /// Side and part of the other links.
    pub(super) fixed: Vec<(usize, Option<BodySide>, BodyPart)>,
}

/// All rigid parts of a body at its zero pose, parents first.
pub(super) struct RigidParts<'a> {
    pub(super) body: &'a Humanoid,
    pub(super) frames: LinkFrames,
    pub(super) parts: Vec<RigidPart>,
}

impl<'a> RigidParts<'a> {
    pub(super) fn new(body: &'a Humanoid) -> Self {
        let frames = body.link_frames(&body.zero_pose());
        let mut parts: Vec<RigidPart> = Vec::new();
        let mut part_of = Vec::with_capacity(body.links.len());
        for (link, own) in body.links.iter().enumerate() {
            let joint = link.checked_sub(1).map(|j| &body.joints[j]);
            let fixed_to = joint.filter(|j| j.kind == JointKind::Fixed).map(|j| part_of[j.parent]);
            if let Some(part) = fixed_to {
                part_of.push(part);
                let whole: &mut RigidPart = &mut parts[part];
                whole.links.push(link);
                if let (side, Some(name)) = side_and_part(&own.name) {
                    whole.fixed.push((link, side, name));
                }
                continue;
            }
            let parent = joint.map(|j| part_of[j.parent]);
            let by_joint = joint.map_or((None, None), |j| side_and_part(&j.name));
            let by_link = side_and_part(&own.name);
            let (side, part) = if by_link.1.is_some() { by_link } else { by_joint };
            part_of.push(parts.len());
            parts.push(RigidPart {
                links: vec![link],
                depth: parent.map_or(0, |p: usize| parts[p].depth + 1),
                parent,
                origin: frames[link].translation.vector.into(),
                axis: joint.and_then(|j| match &j.kind {
                    JointKind::Revolute { axis, .. } => Some(frames[link].rotation * axis.into_inner()),
                    _ => None,
                }),
                side,
                part,
                fixed: Vec::new(),
            });
        }
        Self { body, frames, parts }
    }

    /// The parts from the root to `part`.
    pub(super) fn path(&self, part: usize) -> Vec<usize> {
        let mut path: Vec<usize> = std::iter::successors(Some(part), |&p| self.parts[p].parent).collect();
        path.reverse();
        path
    }

    /// The lowest common ancestor of two parts.
    pub(super) fn meeting(&self, a: usize, b: usize) -> usize {
        let both = self.path(a).into_iter().zip(self.path(b));
        both.take_while(|(x, y)| x == y).last().map_or(0, |(x, _)| x)
    }

    /// Whether `part` is `other` or its descendant.
    pub(super) fn hangs_on(&self, part: usize, other: usize) -> bool {
        std::iter::successors(Some(part), |&p| self.parts[p].parent).any(|p| p == other)
    }

    /// Parts without descendants.
    pub(super) fn ends(&self) -> impl Iterator<Item = usize> {
        (0..self.parts.len()).filter(|&part| self.parts.iter().all(|p| p.parent != Some(part)))
    }

    /// Extent of the geometry of these links along a direction of the root's frame, metres from its origin; `None`
    /// without geometry.
    pub(super) fn reach(&self, links: &[usize], direction: &Vector3<f64>) -> Option<f64> {
        let down = -Vector3::z();
        let turn = UnitQuaternion::rotation_between(direction, &down)
            .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI));
        let turned = Isometry3::from_parts(Default::default(), turn);
        let frames = LinkFrames(self.frames.0.iter().map(|frame| turned * frame).collect());
        self.body.lowest_point(&frames, links).map(|point| -point.z)
    }

    /// The centre of the geometry of these links, root's frame; `None` without geometry.
    pub(super) fn middle(&self, links: &[usize]) -> Option<Point3<f64>> {
        let solids = links.iter().flat_map(|&l| self.body.links[l].solids.iter().map(move |f| (l, f)));
        let middles: Vec<Point3<f64>> = solids.filter_map(|(l, f)| Some(self.frames[l] * f.middle()?)).collect();
        let sum = middles.iter().fold(Vector3::zeros(), |sum, p| sum + p.coords);
        (!middles.is_empty()).then(|| (sum / middles.len() as f64).into())
    }
}
