//! The thickness of a body around the axes of bodytrack's cylinders, by rays towards these axes.

use nalgebra::{Isometry3, Matrix2, Point3, UnitQuaternion, Vector2, Vector3};

use crate::body::{BodyRegion, Humanoid, LANDMARKS, LinkFrames, Pose, Ray, Solid};
use crate::bodytrack_body::{BodytrackBody, CYLINDERS, SEGMENTS};

/// Shares of a cylinder's length at which it is measured, as its start and its end.
const MEASURED: [f64; 2] = [0.1, 0.9];
/// Number of rays around the axis.
const RAYS: u32 = 16;
/// Rays start at this distance from the axis, metres.
const OUTSIDE: f64 = 0.6;
/// Least and greatest radius, metres, and the one of a cylinder that no ray finds.
const LEAST: f64 = 0.01;
const GREATEST: f64 = 0.3;
const UNKNOWN: f64 = 0.05;

/// Cylinders that bodytrack lets not touch: forearms and torso, both lower legs.
const EXCLUSIVE: [[usize; 2]; 3] = [[6, 0], [8, 0], [2, 4]];
const SPHERES: u32 = 20;
/// Clear distance as a share of the radii, so that particles around the initial pose do not touch either.
const CLEARANCE: f64 = 1.1;
/// Factor of the radii of cylinders that touch, and how often it is applied at most.
const THINNED: f64 = 0.9;
const MOST_THINNED: u32 = 20;

/// Solids of a body around the axes of cylinders, in the world.
pub(super) struct CylinderThickness {
    solids: [Vec<Placed>; CYLINDERS],
    axes: [[Point3<f64>; 2]; CYLINDERS],
}

/// A solid and its frame.
type Placed = (Isometry3<f64>, Solid);

impl CylinderThickness {
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
            let [start, end] = MEASURED.map(|share| self.half_axes(cylinder, share, &turn));
            // a factor of the cylinder is one number for both of its ends
            let round = |[x, y]: [f64; 2]| (x * y).sqrt();
            let factor = ((start[0] / start[1]) * (end[0] / end[1])).powf(0.25);
            [round(start), round(end), factor, 1.0 / factor]
        })
    }

    /// The same cylinders, those that touch made thinner: bodytrack rejects every pose in which a forearm is in the
    /// torso or the lower legs are in each other, and does not end if it rejects the initial pose.
    pub(super) fn apart(&self, mut cylinders: [[f64; 4]; CYLINDERS]) -> [[f64; 4]; CYLINDERS] {
        for [one, other] in EXCLUSIVE {
            let mut left = MOST_THINNED;
            while left > 0 && self.touch(&cylinders, [one, other]) {
                for cylinder in [one, other] {
                    cylinders[cylinder][..2].iter_mut().for_each(|radius| *radius *= THINNED);
                }
                left -= 1;
            }
        }
        cylinders
    }

    /// Whether rows of spheres along two cylinders touch, as bodytrack checks it: without the factors of the cylinders.
    fn touch(&self, cylinders: &[[f64; 4]; CYLINDERS], pair: [usize; 2]) -> bool {
        let spheres = |cylinder: usize| {
            let ([from, to], [start, end, ..]) = (self.axes[cylinder], cylinders[cylinder]);
            (0..=SPHERES).map(move |sphere| {
                let share = f64::from(sphere) / f64::from(SPHERES);
                (from + share * (to - from), start + share * (end - start))
            })
        };
        let [one, other] = pair;
        spheres(one).any(|(at, radius)| {
            spheres(other).any(|(there, of_other)| (at - there).norm() < CLEARANCE * (radius + of_other))
        })
    }

    /// Half axes, along a frame's x and y, of the ellipse around a share of an axis that fits the surface best: least
    /// squares of `1 / r^2 = cos^2 / x^2 + sin^2 / y^2`. Where a limb begins, some rays find no surface.
    fn half_axes(&self, cylinder: usize, share: f64, turn: &UnitQuaternion<f64>) -> [f64; 2] {
        let [from, to] = self.axes[cylinder];
        let (mut normal, mut sums, mut count) = (Matrix2::zeros(), Vector2::zeros(), 0.0);
        for ray in 0..RAYS {
            let (sin, cos) = libm::sincos(std::f64::consts::TAU * f64::from(ray) / f64::from(RAYS));
            let Some(reach) =
                self.reach(cylinder, &(from + share * (to - from)), &(turn * Vector3::new(cos, sin, 0.0)))
            else {
                continue;
            };
            let squares = Vector2::new(cos * cos, sin * sin);
            normal += squares * squares.transpose();
            sums += squares / (reach * reach);
            count += 1.0;
        }
        // the mean, if the rays do not show an ellipse
        let round =
            if count > 0.0 { Vector2::repeat((sums[0] + sums[1]) / count) } else { Vector2::repeat(UNKNOWN.powi(-2)) };
        let fitted = normal.try_inverse().map(|inverse| inverse * sums).filter(|squares| squares.min() > 0.0);
        fitted.unwrap_or(round).map(|square| square.powf(-0.5).clamp(LEAST, GREATEST)).into()
    }

    /// How far the solids of a cylinder reach from a point in a direction.
    fn reach(&self, cylinder: usize, from: &Point3<f64>, direction: &Vector3<f64>) -> Option<f64> {
        let ray = Ray { origin: from + OUTSIDE * direction, direction: -direction };
        let entry = |(frame, solid): &Placed| solid.ray_entry(&ray.transformed(&frame.inverse()));
        let entries = self.solids[cylinder].iter().filter_map(entry);
        entries.reduce(f64::min).map(|entry| OUTSIDE - entry).filter(|reach| *reach > 0.5 * LEAST)
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Vertical axes a metre apart, but lower legs a decimetre.
    #[test]
    fn lower_legs_in_each_other_are_made_thinner_and_nothing_else() {
        let axes = std::array::from_fn(|cylinder| {
            let x = if cylinder == 4 { 2.1 } else { cylinder as f64 };
            [Point3::new(x, 0.0, 0.0), Point3::new(x, 0.0, 0.4)]
        });
        let thickness = CylinderThickness { solids: [const { Vec::new() }; CYLINDERS], axes };
        let cylinders = [[0.08, 0.06, 1.2, 1.0 / 1.2]; CYLINDERS];
        let apart = thickness.apart(cylinders);
        for (cylinder, [start, end, ..]) in apart.iter().enumerate() {
            // both starts are 0.1 m apart, with clearance
            let expected = if [2, 4].contains(&cylinder) { 0.04..0.1 / 2.0 / CLEARANCE } else { 0.08..0.080_001 };
            assert!(expected.contains(start) && (end / start - 0.75).abs() < 1e-9, "{cylinder}: {start} {end}");
        }
    }
}
