//! Penetration of a body with the ground and itself, fast enough for every particle of a tracker.

use nalgebra::{Isometry3, Point3, Vector3};

use super::SelfCollision;
use super::bounds::{Bounds, rounding};
use super::capsule_distance::{AxisLength, CapsuleAxis, squared_distance_of_axes};
use super::self_collision::bounding_ball;
use super::solid_distance::solid_distance;
use crate::body::{Humanoid, LinkFrames, Solid};
use crate::raster::TaperedCapsule;
use crate::simd::{Dispatched, dispatch};

/// The solids of a body, prepared for many poses.
///
/// The pairs are those of [`SelfCollision::pairs`]. Boxes around links are compared first, then boxes around their
/// solids, then the axes of tapered capsules with their largest radii. Only pairs that pass all of these tests are
/// measured: in closed form if both solids are tapered capsules, else by parry.
#[derive(Clone, Debug)]
pub struct Interpenetration {
    tolerance_m: f64,
    solids: Vec<LinkSolid>,
    /// Measured quantities of the solids, in order, contiguous in memory.
    outlines: Vec<CapsuleShape>,
    parts: Vec<LinkSolids>,
    part_pairs: Vec<PartPair>,
    solid_pairs: Vec<SolidPair>,
}

#[derive(Clone, Debug)]
struct LinkSolid {
    link: usize,
    solid: Solid,
    /// The solid itself if it is a tapered capsule, else its bounding sphere.
    capsule: TaperedCapsule,
}

/// The pose-independent part of a solid's capsule.
#[derive(Clone, Debug)]
struct CapsuleShape {
    axis: CapsuleAxis,
    length: AxisLength,
    /// Whether the capsule is the solid itself.
    exact: bool,
}

#[derive(Clone, Copy, Debug)]
struct LinkSolids {
    link: u32,
    /// Index of the first solid and the index after the last.
    solids: [u32; 2],
    /// Largest distance of its solids from the link's origin, metres.
    reach: f64,
}

/// Two parts that must not touch.
#[derive(Clone, Copy, Debug)]
struct PartPair {
    parts: [u32; 2],
    /// Range of their solid pairs: the first index and the index after the last.
    pairs: [u32; 2],
}

/// Two solids that must not touch.
#[derive(Clone, Debug)]
struct SolidPair {
    solids: [u32; 2],
    /// Squared distance of their axes below which their penetration may exceed the tolerance; infinite if one of them
    /// is not a tapered capsule.
    axes_reach_squared: f64,
}

/// Penetration of a body with the ground z = 0 and with itself, beyond the tolerance, metres.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Depths {
    /// Depth of the deepest point under the ground.
    pub ground_m: f64,
    /// Depth of the deepest pair of solids.
    pub own_m: f64,
    /// Sum over all pairs of solids.
    pub own_sum_m: f64,
}

/// Per-thread scratch memory for [`Interpenetration::depths`].
#[derive(Clone, Debug, Default)]
pub struct InterpenetrationScratch {
    capsules: Vec<TaperedCapsule>,
    boxes: Vec<Bounds>,
    part_boxes: Vec<Bounds>,
}

impl Interpenetration {
    /// Prepares a body; depths up to `tolerance_m` metres, >= 0, are ignored.
    pub fn new(body: &Humanoid, tolerance_m: f64) -> Self {
        let (mut parts, mut solids) = (Vec::new(), Vec::<LinkSolid>::new());
        for (link, solid) in body.links.iter().map(|link| &link.solids).enumerate() {
            let first = solids.len();
            solids.extend(solid.iter().filter_map(|solid| LinkSolid::new(link, solid)));
            if solids.len() > first {
                parts.push(LinkSolids::new(&solids[first..], first));
            }
        }
        let outlines = solids.iter().map(CapsuleShape::new).collect();
        let mut laid_out =
            Self { tolerance_m, solids, outlines, parts, part_pairs: Vec::new(), solid_pairs: Vec::new() };
        for pair in SelfCollision::new(body).pairs() {
            laid_out.add_pair(pair);
        }
        laid_out
    }

    fn add_pair(&mut self, links: &[usize; 2]) {
        let part = |link: usize| self.parts.iter().position(|part| part.link as usize == link);
        let (Some(a), Some(b)) = (part(links[0]), part(links[1])) else { return };
        let first = self.solid_pairs.len() as u32;
        for i in within(self.parts[a].solids) {
            for j in within(self.parts[b].solids) {
                let reach = thickest(&self.solids[i].capsule) + thickest(&self.solids[j].capsule) - self.tolerance_m;
                let axes_reach_squared = if self.outlines[i].exact && self.outlines[j].exact {
                    reach.max(0.0) * reach.max(0.0)
                } else {
                    f64::INFINITY
                };
                self.solid_pairs.push(SolidPair { solids: [i as u32, j as u32], axes_reach_squared });
            }
        }
        let pairs = [first, self.solid_pairs.len() as u32];
        self.part_pairs.push(PartPair { parts: [a as u32, b as u32], pairs });
    }

    /// Penetration of the body with the ground and itself when its links are at `frames`.
    pub fn depths(&self, frames: &LinkFrames, scratch: &mut InterpenetrationScratch) -> Depths {
        let InterpenetrationScratch { capsules, boxes, part_boxes } = scratch;
        capsules.clear();
        capsules.extend(self.solids.iter().map(|solid| solid.capsule.transformed(&frames[solid.link])));
        let ground = GroundPlane { up: Vector3::z(), height: 0.0 };
        dispatch(Measuring { body: self, capsules, ground, frames, boxes, part_boxes })
    }

    /// The same for a body whose solids are all tapered capsules, already placed in a camera's frame by a silhouette
    /// ([`crate::body::capsules_in_camera`]): depths do not depend on the frame, and placing capsules again costs as
    /// much as measuring.
    pub fn depths_in_camera(
        &self,
        frames: &LinkFrames,
        capsules: &[TaperedCapsule],
        camera_from_world: &Isometry3<f64>,
        scratch: &mut InterpenetrationScratch,
    ) -> Depths {
        debug_assert_eq!(capsules.len(), self.solids.len());
        let up = camera_from_world.rotation * Vector3::z();
        let ground = GroundPlane { up, height: -up.dot(&camera_from_world.translation.vector) };
        let InterpenetrationScratch { boxes, part_boxes, .. } = scratch;
        dispatch(Measuring { body: self, capsules, ground, frames, boxes, part_boxes })
    }
}

/// The ground: points `p` with `up . p + height = 0`.
struct GroundPlane {
    up: Vector3<f64>,
    height: f64,
}

impl GroundPlane {
    #[inline(always)]
    fn height(&self, point: &Vector3<f64>) -> f64 {
        self.up.dot(point) + self.height
    }
}

/// Work for [`dispatch`]: solids placed in some frame.
struct Measuring<'a> {
    body: &'a Interpenetration,
    capsules: &'a [TaperedCapsule],
    ground: GroundPlane,
    frames: &'a LinkFrames,
    boxes: &'a mut Vec<Bounds>,
    part_boxes: &'a mut Vec<Bounds>,
}

impl Dispatched for Measuring<'_> {
    type Output = Depths;

    #[inline(always)]
    fn work(self) -> Depths {
        let reach = self.reach();
        let Self { body, capsules, boxes, part_boxes, .. } = self;
        boxes.resize(capsules.len(), Bounds::NOTHING);
        part_boxes.resize(body.parts.len(), Bounds::NOTHING);
        let more = rounding(reach) - 0.5 * body.tolerance_m;
        bound(&body.parts, capsules, more as f32, boxes, part_boxes);
        let standing = BoxedSolids { boxes, part_boxes, body, capsules, ground: self.ground, frames: self.frames };
        let mut depths = Depths { ground_m: standing.ground_depth() - body.tolerance_m, ..Depths::default() };
        for PartPair { parts: [a, b], pairs } in &body.part_pairs {
            if standing.part_boxes[*a as usize].meets(&standing.part_boxes[*b as usize]) {
                standing.add_depths(&body.solid_pairs[within(*pairs)], &mut depths);
            }
        }
        depths
    }
}

impl Measuring<'_> {
    /// Bound on the coordinates of all capsules, metres, for a body of at most 10 m.
    fn reach(&self) -> f64 {
        10.0 + self.capsules.first().map_or(0.0, |capsule| capsule.a.coords.amax())
    }
}

/// Computes boxes around solids and parts, with capsule radii enlarged by `more`.
#[inline(always)]
fn bound(
    parts: &[LinkSolids],
    capsules: &[TaperedCapsule],
    more: f32,
    boxes: &mut [Bounds],
    part_boxes: &mut [Bounds],
) {
    for (around, part) in part_boxes.iter_mut().zip(parts) {
        // computed here, not read back: a vector load after scalar stores stalls (no store forwarding)
        let mut whole = Bounds::NOTHING;
        for (bounds, capsule) in boxes[within(part.solids)].iter_mut().zip(&capsules[within(part.solids)]) {
            let own = Bounds::around(capsule, more);
            whole.add(&own);
            *bounds = own;
        }
        *around = whole;
    }
}

struct BoxedSolids<'a> {
    body: &'a Interpenetration,
    capsules: &'a [TaperedCapsule],
    ground: GroundPlane,
    frames: &'a LinkFrames,
    boxes: &'a [Bounds],
    part_boxes: &'a [Bounds],
}

impl BoxedSolids<'_> {
    #[inline(always)]
    fn add_depths(&self, pairs: &[SolidPair], depths: &mut Depths) {
        for pair in pairs {
            let [i, j] = pair.solids.map(|solid| solid as usize);
            if self.boxes[i].meets(&self.boxes[j]) {
                let depth = -self.distance(pair) - self.body.tolerance_m;
                if depth > 0.0 {
                    depths.own_m = depths.own_m.max(depth);
                    depths.own_sum_m += depth;
                }
            }
        }
    }

    /// Signed distance of two solids; infinite if their axes show that the penetration is within the tolerance.
    #[inline(always)]
    fn distance(&self, pair: &SolidPair) -> f64 {
        let [i, j] = pair.solids.map(|solid| solid as usize);
        if pair.axes_reach_squared == f64::INFINITY {
            let (first, second) = (&self.body.solids[i], &self.body.solids[j]);
            let first_from_second: Isometry3<f64> = self.frames[first.link].inverse() * self.frames[second.link];
            return solid_distance(&first.solid, &second.solid, &first_from_second);
        }
        let (first, second) = (&self.body.outlines[i], &self.body.outlines[j]);
        let (a, b) = (&self.capsules[i], &self.capsules[j]);
        if squared_distance_of_axes([a, b], [&first.length, &second.length]) >= pair.axes_reach_squared {
            return f64::INFINITY;
        }
        first.axis.moved_to(a).distance(&second.axis.moved_to(b))
    }

    /// Depth of the deepest point below the ground, at least the tolerance.
    #[inline(always)]
    fn ground_depth(&self) -> f64 {
        let mut lowest = -self.body.tolerance_m;
        for LinkSolids { link, solids, reach } in &self.body.parts {
            if self.frames[*link as usize].translation.z - reach < lowest {
                lowest = lesser(self.lowest_height(*solids), lowest);
            }
        }
        -lowest
    }

    #[inline(always)]
    fn lowest_height(&self, solids: [u32; 2]) -> f64 {
        let mut lowest = f64::INFINITY;
        for solid in within(solids) {
            let capsule = &self.capsules[solid];
            let height = if self.body.outlines[solid].exact {
                let (a, b) = (self.ground.height(&capsule.a.coords), self.ground.height(&capsule.b.coords));
                lesser(a - capsule.radius_a, b - capsule.radius_b)
            } else {
                let LinkSolid { link, solid, .. } = &self.body.solids[solid];
                solid.lowest_point(&self.frames[*link]).map_or(f64::INFINITY, |point| point.z)
            };
            lowest = lesser(height, lowest);
        }
        lowest
    }
}

/// `f64::min` without NaN handling: one instruction.
#[inline(always)]
fn lesser(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// The index range `first..end`.
#[inline(always)]
fn within([first, end]: [u32; 2]) -> std::ops::Range<usize> {
    first as usize..end as usize
}

impl LinkSolids {
    fn new(solids: &[LinkSolid], first: usize) -> Self {
        let end = |centre: &Point3<f64>, radius: f64| centre.coords.norm() + radius;
        let reach = |c: &TaperedCapsule| end(&c.a, c.radius_a).max(end(&c.b, c.radius_b));
        Self {
            link: solids[0].link as u32,
            solids: [first as u32, (first + solids.len()) as u32],
            reach: solids.iter().map(|solid| reach(&solid.capsule)).fold(0.0, f64::max),
        }
    }
}

impl LinkSolid {
    /// `None` for an empty mesh.
    fn new(link: usize, solid: &Solid) -> Option<Self> {
        let capsule = match solid {
            Solid::TaperedCapsule(capsule) => *capsule,
            _ => {
                let (centre, radius) = bounding_ball(solid)?;
                TaperedCapsule { a: centre, b: centre, radius_a: radius, radius_b: radius }
            }
        };
        Some(Self { link, solid: solid.clone(), capsule })
    }
}

impl CapsuleShape {
    fn new(LinkSolid { solid, capsule, .. }: &LinkSolid) -> Self {
        let exact = matches!(solid, Solid::TaperedCapsule(_));
        Self { axis: CapsuleAxis::from_capsule(capsule), length: AxisLength::from_capsule(capsule), exact }
    }
}

fn thickest(capsule: &TaperedCapsule) -> f64 {
    capsule.radius_a.max(capsule.radius_b)
}

#[cfg(test)]
mod tests;
