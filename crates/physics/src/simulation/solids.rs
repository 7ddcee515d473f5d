//! Converts a body's solids to rapier's colliders.

use nalgebra::{Isometry3, Vector3};
use rapier3d::prelude::*;

use skiagraph_core::body::Solid;
use skiagraph_core::raster::TaperedCapsule;

/// Collision groups: parts that collide with the ground, parts that collide with other links, and the ground.
const FEET: Group = Group::GROUP_1;
const SKIN: Group = Group::GROUP_2;
const GROUND: Group = Group::GROUP_3;

/// Greatest radius error of the capsules that approximate a tapered capsule for other links, metres.
const RADIUS_ERROR: f64 = 0.005;

/// The ground z = 0.
pub(super) fn ground(friction: f64) -> Collider {
    let up = rapier3d::na::Unit::new_unchecked(Vector::Z);
    ColliderBuilder::halfspace(up).friction(friction as Real).collision_groups(groups(GROUND, FEET)).build()
}

/// The colliders of a link's solid, without mass. For the ground, a tapered capsule is its two end spheres, which is
/// exact; for other links and props it is a chain of capsules. Empty for a mesh without volume.
pub(super) fn colliders(solid: &Solid, friction: f64, link: usize) -> Vec<Collider> {
    let finish = |shape: SharedShape, pose: Pose, groups: InteractionGroups| {
        let builder = ColliderBuilder::new(shape).position(pose).density(0.0).friction(friction as Real);
        builder.collision_groups(groups).user_data(link as u128).active_hooks(ActiveHooks::FILTER_CONTACT_PAIRS).build()
    };
    let (ends, skin) = match solid {
        Solid::TaperedCapsule(capsule) => {
            let ends = [(capsule.a, capsule.radius_a), (capsule.b, capsule.radius_b)];
            (ends.into_iter().filter(|(_, radius)| *radius > 0.0).collect(), groups(SKIN, SKIN))
        }
        _ => (Vec::new(), groups(FEET | SKIN, SKIN | GROUND)),
    };
    let balls = ends.into_iter().map(|(centre, radius)| {
        let place = Pose::from_translation(vector(&centre.coords));
        finish(SharedShape::ball(radius as Real), place, groups(FEET, GROUND))
    });
    balls.chain(shapes(solid).into_iter().map(|(shape, pose)| finish(shape, pose, skin))).collect()
}

/// The colliders of a prop; its solid is in the world frame.
pub(super) fn prop_colliders(solid: &Solid, friction: f64) -> Vec<Collider> {
    let finish = |(shape, pose): (SharedShape, Pose)| {
        let builder = ColliderBuilder::new(shape).position(pose).friction(friction as Real);
        builder.collision_groups(groups(SKIN, SKIN)).active_hooks(ActiveHooks::FILTER_CONTACT_PAIRS).build()
    };
    shapes(solid).into_iter().map(finish).collect()
}

fn shapes(solid: &Solid) -> Vec<(SharedShape, Pose)> {
    match solid {
        Solid::TaperedCapsule(capsule) => chain(capsule).map(|shape| (shape, Pose::IDENTITY)).collect(),
        Solid::Box { link_from_box, half_extents } => {
            let [x, y, z] = half_extents.map(|half| half as Real);
            vec![(SharedShape::cuboid(x, y, z), pose(link_from_box))]
        }
        Solid::Cylinder { link_from_cylinder, radius, half_length } => {
            // rapier's cylinders are aligned with y
            let upright = Isometry3::rotation(Vector3::x() * std::f64::consts::FRAC_PI_2);
            let shape = SharedShape::cylinder(*half_length as Real, *radius as Real);
            vec![(shape, pose(&(link_from_cylinder * upright)))]
        }
        Solid::Mesh { vertices, .. } => {
            let points: Vec<Vector> = vertices.iter().map(|vertex| vector(&vertex.coords)).collect();
            SharedShape::convex_hull(&points).map(|hull| (hull, Pose::IDENTITY)).into_iter().collect()
        }
    }
}

fn chain(capsule: &TaperedCapsule) -> impl Iterator<Item = SharedShape> {
    let TaperedCapsule { a, b, radius_a, radius_b } = *capsule;
    let pieces = libm::ceil((radius_b - radius_a).abs() / (2.0 * RADIUS_ERROR)).clamp(1.0, 16.0);
    let place = move |share: f64| vector(&a.coords.lerp(&b.coords, share));
    (0..pieces as usize).map(move |piece| {
        let [from, to] = [piece, piece + 1].map(|end| end as f64 / pieces);
        let radius = radius_a + 0.5 * (from + to) * (radius_b - radius_a);
        SharedShape::capsule(place(from), place(to), radius as Real)
    })
}

fn groups(of: Group, with: Group) -> InteractionGroups {
    InteractionGroups::new(of, with, InteractionTestMode::And)
}

pub(super) fn vector(v: &Vector3<f64>) -> Vector {
    Vector::new(v.x as Real, v.y as Real, v.z as Real)
}

pub(super) fn pose(isometry: &Isometry3<f64>) -> Pose {
    let q = isometry.rotation;
    let rotation = Rotation::from_xyzw(q.i as Real, q.j as Real, q.k as Real, q.w as Real);
    Pose::from_parts(vector(&isometry.translation.vector), rotation)
}
