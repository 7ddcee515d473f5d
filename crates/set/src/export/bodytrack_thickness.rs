//! The thickness of a body around the axes of bodytrack's cylinders, by rays towards these axes.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};

use crate::body::{BodyRegion, Humanoid, LANDMARKS, LinkFrames, Pose, Ray, Solid};
use crate::bodytrack_body::{BodytrackBody, CYLINDERS, SEGMENTS};

/// Shares of a cylinder's length at which it is measured.
const MEASURED: [f64; 2] = [0.15, 0.85];
/// Rays start at this distance from the axis, metres.
const OUTSIDE: f64 = 0.6;
/// Least and greatest radius, metres, and the one of a cylinder that no ray finds.
const LEAST: f64 = 0.01;
const GREATEST: f64 = 0.3;
const UNKNOWN: f64 = 0.05;

/// Solids of a body around the axes of cylinders, in the world.
pub(super) struct Thickness {
    solids: [Vec<Placed>; CYLINDERS],
    axes: [[Point3<f64>; 2]; CYLINDERS],
}

/// A solid and its frame.
type Placed = (Isometry3<f64>, Solid);

impl Thickness {
    pub(super) fn new(body: &Humanoid, pose: &Pose, places: &[Point3<f64>; LANDMARKS.len()]) -> Self {
        let axes = SEGMENTS.map(|ends| ends.map(|end| places[end as usize]));
        let frames = body.link_frames(pose);
        let cylinders: Vec<Option<usize>> = BodyRegion::of_links(body)
            .into_iter()
            .zip(&frames.0)
            .map(|(region, frame)| nearest(&axes, of_region(region), &frame.translation.vector.into()))
            .collect();
        let mut solids = [const { Vec::new() }; CYLINDERS];
        let surface = surface(body, &frames, &cylinders);
        let of_links = body.links.iter().zip(&frames.0).zip(&cylinders).flat_map(|((link, frame), cylinder)| {
            link.solids.iter().map(move |solid| (*cylinder, (*frame, solid.clone())))
        });
        for (cylinder, placed) in of_links.filter(|_| body.skin.is_none()).chain(surface) {
            solids.iter_mut().skip(cylinder.unwrap_or(CYLINDERS)).take(1).for_each(|own| own.push(placed.clone()));
        }
        Self { solids, axes }
    }

    /// Radii and factors of bodytrack's cylinders in a pose of its body.
    pub(super) fn cylinders(&self, theirs: &BodytrackBody, pose: &Pose) -> [[f64; 4]; CYLINDERS] {
        let frames = theirs.humanoid.link_frames(pose);
        std::array::from_fn(|cylinder| {
            let turn = theirs.link(cylinder).map_or_else(UnitQuaternion::identity, |link| frames[link].rotation);
            let sides = [Vector3::x(), Vector3::y()].map(|side| turn * side);
            let measured = MEASURED.map(|share| sides.map(|side| self.radius(cylinder, share, &side)));
            let [start, end] = at_ends(measured);
            // a factor of the cylinder is one number for both of its ends
            let round = |[x, y]: [f64; 2]| (x * y).sqrt();
            let factor = ((start[0] / start[1]) * (end[0] / end[1])).powf(0.25);
            [round(start), round(end), factor, 1.0 / factor]
        })
    }

    /// Half the thickness at a share of an axis.
    fn radius(&self, cylinder: usize, share: f64, side: &Vector3<f64>) -> f64 {
        let [from, to] = self.axes[cylinder];
        let reach = |sign: f64| self.reach(cylinder, &(from + share * (to - from)), &(side * sign));
        let radius = match [reach(1.0), reach(-1.0)] {
            [Some(one), Some(other)] => 0.5 * (one + other),
            [Some(one), None] | [None, Some(one)] => one,
            [None, None] => UNKNOWN,
        };
        radius.clamp(LEAST, GREATEST)
    }

    /// How far the solids of a cylinder reach from a point in a direction.
    fn reach(&self, cylinder: usize, from: &Point3<f64>, direction: &Vector3<f64>) -> Option<f64> {
        let ray = Ray { origin: from + OUTSIDE * direction, direction: -direction };
        let entry = |(frame, solid): &Placed| solid.ray_entry(&ray.transformed(&frame.inverse()));
        let entries = self.solids[cylinder].iter().filter_map(entry);
        entries.reduce(f64::min).map(|entry| OUTSIDE - entry).filter(|reach| *reach > 0.0)
    }
}

/// The radii at both ends of a cylinder that has these where it is measured.
fn at_ends(measured: [[f64; 2]; 2]) -> [[f64; 2]; 2] {
    let [near, far] = MEASURED;
    [0.0, 1.0].map(|share| {
        let at = (share - near) / (far - near);
        [0, 1].map(|side| (measured[0][side] + at * (measured[1][side] - measured[0][side])).max(LEAST))
    })
}

/// Indices of the cylinders of a region.
fn of_region(region: BodyRegion) -> &'static [usize] {
    match region {
        BodyRegion::Trunk => &[0],
        BodyRegion::Thighs => &[1, 3],
        BodyRegion::ShanksAndFeet => &[2, 4],
        BodyRegion::UpperArms => &[5, 7],
        BodyRegion::ForearmsAndHands => &[6, 8],
        BodyRegion::Head => &[9],
    }
}

/// The one of some cylinders whose axis is nearest to a point.
fn nearest(axes: &[[Point3<f64>; 2]; CYLINDERS], among: &[usize], point: &Point3<f64>) -> Option<usize> {
    let distance = |cylinder: &usize| {
        let [from, to] = axes[*cylinder];
        let along = (to - from).dot(&(point - from)) / (to - from).norm_squared().max(f64::MIN_POSITIVE);
        (from + along.clamp(0.0, 1.0) * (to - from) - point).norm()
    };
    among.iter().copied().min_by(|a, b| distance(a).total_cmp(&distance(b)))
}

/// The skin's triangles as one mesh a cylinder, each triangle with the link that moves its first corner most.
fn surface(body: &Humanoid, frames: &LinkFrames, cylinders: &[Option<usize>]) -> Vec<(Option<usize>, Placed)> {
    let Some(skin) = &body.skin else { return Vec::new() };
    let mut vertices = Vec::new();
    skin.deform_into(frames, &mut vertices);
    let cylinder_of = |vertex: u32| {
        let link = skin.influences(vertex as usize).max_by(|(_, a), (_, b)| a.total_cmp(b)).map(|(link, _)| link);
        link.and_then(|link| cylinders.get(link).copied().flatten())
    };
    let mesh = |cylinder: usize| {
        let own = skin.triangles().iter().filter(|[first, ..]| cylinder_of(*first) == Some(cylinder));
        let solid = Solid::Mesh { vertices: vertices.clone(), triangles: own.copied().collect() };
        (Some(cylinder), (Isometry3::identity(), solid))
    };
    (0..CYLINDERS).map(mesh).collect()
}
