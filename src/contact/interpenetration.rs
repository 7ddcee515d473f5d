//! How deep a body is in the ground and in itself, fast enough for every particle of a tracker.

use std::ops::Range;

use nalgebra::{Isometry3, Vector3};

use super::SelfCollision;
use super::capsule_distance::{Axis, AxisLength, squared_distance_of_axes};
use super::self_collision::bounding_ball;
use super::solid_distance::solid_distance;
use crate::body::{Flesh, Humanoid, LinkFrames};
use crate::raster::{Dispatched, TaperedCapsule, dispatch};

/// The solids of a body, laid out for looking at many poses.
///
/// The pairs are those of [`SelfCollision::pairs`]. Boxes around links are compared first, then boxes around their solids, then the
/// axes of tapered capsules as if they were as thick everywhere as at their thickest; only what all of these let through is
/// measured: in closed form where both solids are tapered capsules, by parry elsewhere.
#[derive(Clone, Debug)]
pub struct Interpenetration {
    tolerance_m: f64,
    solids: Vec<Solid>,
    parts: Vec<Part>,
    part_pairs: Vec<PartPair>,
    solid_pairs: Vec<SolidPair>,
}

/// One solid, in its link.
#[derive(Clone, Debug)]
struct Solid {
    link: usize,
    flesh: Flesh,
    /// Itself where it is a tapered capsule, else a ball around it.
    capsule: TaperedCapsule,
    /// Of that capsule, in the link.
    axis: Axis,
    length: AxisLength,
    /// Whether the capsule is the solid itself.
    exact: bool,
}

/// The solids of one link.
type Part = Range<usize>;

/// Two parts that must not touch.
#[derive(Clone, Debug)]
struct PartPair {
    parts: [usize; 2],
    /// Of their solids.
    pairs: Range<usize>,
}

/// Two solids that must not touch.
#[derive(Clone, Debug)]
struct SolidPair {
    solids: [usize; 2],
    /// Squared distance of their axes below which they may be deeper in each other than the tolerance; infinite where one of them is
    /// no tapered capsule.
    axes_reach_squared: f64,
}

/// How deep a body is in the ground z = 0 and in itself, each beyond the tolerance, metres.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Depths {
    /// Of the deepest point under the ground.
    pub ground_m: f64,
    /// Of the deepest pair of solids.
    pub own_m: f64,
    /// Sum over all pairs of solids.
    pub own_sum_m: f64,
}

/// Memory of one thread for [`Interpenetration::depths`].
#[derive(Clone, Debug, Default)]
pub struct InterpenetrationScratch {
    capsules: Vec<TaperedCapsule>,
    boxes: Vec<Bounds>,
    part_boxes: Vec<Bounds>,
}

impl Interpenetration {
    /// Of a body; depths up to `tolerance_m` metres, >= 0, do not count.
    pub fn new(body: &Humanoid, tolerance_m: f64) -> Self {
        let (mut parts, mut solids) = (Vec::new(), Vec::<Solid>::new());
        for (link, flesh) in body.links.iter().map(|link| &link.flesh).enumerate() {
            let first = solids.len();
            solids.extend(flesh.iter().filter_map(|flesh| Solid::new(link, flesh)));
            if solids.len() > first {
                parts.push(first..solids.len());
            }
        }
        let mut laid_out = Self { tolerance_m, solids, parts, part_pairs: Vec::new(), solid_pairs: Vec::new() };
        for pair in SelfCollision::new(body).pairs() {
            laid_out.add_pair(pair);
        }
        laid_out
    }

    fn add_pair(&mut self, links: &[usize; 2]) {
        let part = |link: usize| self.parts.iter().position(|part| self.solids[part.start].link == link);
        let (Some(a), Some(b)) = (part(links[0]), part(links[1])) else { return };
        let first = self.solid_pairs.len();
        for i in self.parts[a].clone() {
            for j in self.parts[b].clone() {
                let (one, other) = (&self.solids[i], &self.solids[j]);
                let reach = thickest(&one.capsule) + thickest(&other.capsule) - self.tolerance_m;
                let axes_reach_squared = match one.exact && other.exact {
                    true => reach.max(0.0) * reach.max(0.0),
                    false => f64::INFINITY,
                };
                self.solid_pairs.push(SolidPair { solids: [i, j], axes_reach_squared });
            }
        }
        self.part_pairs.push(PartPair { parts: [a, b], pairs: first..self.solid_pairs.len() });
    }

    /// How deep the body is in the ground and in itself when its links are at `frames`.
    pub fn depths(&self, frames: &LinkFrames, scratch: &mut InterpenetrationScratch) -> Depths {
        let InterpenetrationScratch { capsules, boxes, part_boxes } = scratch;
        capsules.clear();
        capsules.extend(self.solids.iter().map(|solid| solid.capsule.transformed(&frames[solid.link])));
        let ground = Ground { up: Vector3::z(), height: 0.0 };
        dispatch(Measuring { body: self, capsules, ground, frames, boxes, part_boxes })
    }

    /// The same of a body of nothing but tapered capsules that a silhouette has already placed in the frame of a camera, all of
    /// them ([`crate::body::capsules_in_camera`]): which frame it is does not matter to depths, and placing them again costs
    /// as much as measuring.
    pub fn depths_in_camera(
        &self,
        frames: &LinkFrames,
        capsules: &[TaperedCapsule],
        camera_from_world: &Isometry3<f64>,
        scratch: &mut InterpenetrationScratch,
    ) -> Depths {
        debug_assert_eq!(capsules.len(), self.solids.len());
        let up = camera_from_world.rotation * Vector3::z();
        let ground = Ground { up, height: -up.dot(&camera_from_world.translation.vector) };
        let InterpenetrationScratch { boxes, part_boxes, .. } = scratch;
        dispatch(Measuring { body: self, capsules, ground, frames, boxes, part_boxes })
    }
}

/// A box along the axes of the frame in which solids stand, laid out for one comparison of all its sides at once.
#[derive(Clone, Copy, Debug)]
struct Bounds {
    /// Lowest coordinates; the last lane fills the register and stands for an axis along which all boxes meet.
    low: Lanes,
    /// Highest coordinates, negated.
    minus_high: Lanes,
}

type Lanes = [f64; 4];

impl Bounds {
    const NOTHING: Self = Self { low: [f64::INFINITY; 4], minus_high: [f64::INFINITY; 4] };

    /// Around a tapered capsule as if both radii were smaller by `less`. Boxes of two that are deeper in each other than twice that meet.
    #[inline(always)]
    fn around(capsule: &TaperedCapsule, less: f64) -> Self {
        let (a, b) = (capsule.radius_a - less, capsule.radius_b - less);
        let (mut low, mut minus_high) = ([-1.0; 4], [-1.0; 4]);
        for axis in 0..3 {
            low[axis] = lesser(capsule.a[axis] - a, capsule.b[axis] - b);
            minus_high[axis] = lesser(-capsule.a[axis] - a, -capsule.b[axis] - b);
        }
        Self { low, minus_high }
    }

    #[inline(always)]
    fn add(&mut self, other: &Self) {
        for lane in 0..4 {
            self.low[lane] = lesser(self.low[lane], other.low[lane]);
            self.minus_high[lane] = lesser(self.minus_high[lane], other.minus_high[lane]);
        }
    }

    #[inline(always)]
    fn meets(&self, other: &Self) -> bool {
        let below =
            |low: &Lanes, minus_high: &Lanes| (0..4).fold(true, |all, lane| all & (low[lane] + minus_high[lane] < 0.0));
        below(&self.low, &other.minus_high) & below(&other.low, &self.minus_high)
    }
}

/// `f64::min` without its care for what is not a number: one instruction.
#[inline(always)]
fn lesser(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// The ground: points `p` with `up . p + height = 0`.
struct Ground {
    up: Vector3<f64>,
    height: f64,
}

impl Ground {
    #[inline(always)]
    fn height(&self, point: &Vector3<f64>) -> f64 {
        self.up.dot(point) + self.height
    }

    /// Height of the lowest corner of a box.
    #[inline(always)]
    fn lowest_height(&self, bounds: &Bounds) -> f64 {
        let mut height = self.height;
        for axis in 0..3 {
            let up = self.up[axis];
            height += if up > 0.0 { up * bounds.low[axis] } else { -up * bounds.minus_high[axis] };
        }
        height
    }
}

/// Work for [`dispatch`]: solids that stand in some frame.
struct Measuring<'a> {
    body: &'a Interpenetration,
    capsules: &'a [TaperedCapsule],
    ground: Ground,
    frames: &'a LinkFrames,
    boxes: &'a mut Vec<Bounds>,
    part_boxes: &'a mut Vec<Bounds>,
}

impl Dispatched for Measuring<'_> {
    type Output = Depths;

    #[inline(always)]
    fn work(mut self) -> Depths {
        self.bound();
        let mut depths = Depths { ground_m: self.ground_depth() - self.body.tolerance_m, ..Depths::default() };
        for PartPair { parts: [a, b], pairs } in &self.body.part_pairs {
            if self.part_boxes[*a].meets(&self.part_boxes[*b]) {
                self.add_depths(&self.body.solid_pairs[pairs.start..pairs.end], &mut depths);
            }
        }
        depths
    }
}

impl Measuring<'_> {
    /// Puts boxes around solids and parts.
    #[inline(always)]
    fn bound(&mut self) {
        let less = 0.5 * self.body.tolerance_m;
        self.boxes.resize(self.capsules.len(), Bounds::NOTHING);
        self.part_boxes.resize(self.body.parts.len(), Bounds::NOTHING);
        for (around, part) in self.part_boxes.iter_mut().zip(&self.body.parts) {
            // joined here, not read back: reading whole lanes that were just written number by number stalls
            let mut whole = Bounds::NOTHING;
            let solids = self.boxes[part.start..part.end].iter_mut();
            for (bounds, capsule) in solids.zip(&self.capsules[part.start..part.end]) {
                let own = Bounds::around(capsule, less);
                whole.add(&own);
                *bounds = own;
            }
            *around = whole;
        }
    }

    #[inline(always)]
    fn add_depths(&self, pairs: &[SolidPair], depths: &mut Depths) {
        for pair in pairs {
            let [i, j] = pair.solids;
            if self.boxes[i].meets(&self.boxes[j]) {
                let depth = -self.distance(pair) - self.body.tolerance_m;
                if depth > 0.0 {
                    depths.own_m = depths.own_m.max(depth);
                    depths.own_sum_m += depth;
                }
            }
        }
    }

    /// Signed distance of two solids; infinite where their axes tell that they are no deeper in each other than the tolerance.
    #[inline(always)]
    fn distance(&self, pair: &SolidPair) -> f64 {
        let [i, j] = pair.solids;
        let (first, second) = (&self.body.solids[i], &self.body.solids[j]);
        if pair.axes_reach_squared == f64::INFINITY {
            let first_from_second: Isometry3<f64> = self.frames[first.link].inverse() * self.frames[second.link];
            return solid_distance(&first.flesh, &second.flesh, &first_from_second);
        }
        let (a, b) = (&self.capsules[i], &self.capsules[j]);
        if squared_distance_of_axes([a, b], [&first.length, &second.length]) >= pair.axes_reach_squared {
            return f64::INFINITY;
        }
        first.axis.moved_to(a).distance(&second.axis.moved_to(b))
    }

    /// How deep the deepest point is under the ground; the tolerance where nothing is deeper.
    #[inline(always)]
    fn ground_depth(&self) -> f64 {
        let mut lowest = -self.body.tolerance_m;
        for (part, bounds) in self.body.parts.iter().zip(self.part_boxes.iter()) {
            // boxes are smaller by half the tolerance
            if self.ground.lowest_height(bounds) - 0.5 * self.body.tolerance_m < lowest {
                lowest = lesser(self.lowest_height(part), lowest);
            }
        }
        -lowest
    }

    #[inline(always)]
    fn lowest_height(&self, part: &Part) -> f64 {
        let mut lowest = f64::INFINITY;
        for (solid, capsule) in self.body.solids[part.start..part.end].iter().zip(&self.capsules[part.start..part.end])
        {
            let height = if solid.exact {
                let (a, b) = (self.ground.height(&capsule.a.coords), self.ground.height(&capsule.b.coords));
                lesser(a - capsule.radius_a, b - capsule.radius_b)
            } else {
                solid.flesh.lowest_point(&self.frames[solid.link]).map_or(f64::INFINITY, |point| point.z)
            };
            lowest = lesser(height, lowest);
        }
        lowest
    }
}

impl Solid {
    /// `None` of an empty mesh.
    fn new(link: usize, flesh: &Flesh) -> Option<Self> {
        let (capsule, exact) = match flesh {
            Flesh::TaperedCapsule(capsule) => (*capsule, true),
            _ => {
                let (centre, radius) = bounding_ball(flesh)?;
                (TaperedCapsule { a: centre, b: centre, radius_a: radius, radius_b: radius }, false)
            }
        };
        let (axis, length) = (Axis::of(&capsule), AxisLength::of(&capsule));
        Some(Self { link, flesh: flesh.clone(), capsule, axis, length, exact })
    }
}

fn thickest(capsule: &TaperedCapsule) -> f64 {
    capsule.radius_a.max(capsule.radius_b)
}

#[cfg(test)]
mod tests;
