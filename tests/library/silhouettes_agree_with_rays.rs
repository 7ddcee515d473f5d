//! Silhouettes drawn by row extents agree with rays cast one by one, for bodies in front of, around and behind the
//! camera.
//!
//! The same mask is computed in two other ways: with parry's ray cast on capsules, and, for tapered capsules, from the
//! distance between a ray and the balls that make up the solid.

use nalgebra::{Point3, Vector3};
use parry3d::query::{Ray, RayCast};
use parry3d::shape::Capsule;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use skiagraph_core::camera::Pinhole;
use skiagraph_core::raster::{CapsulePainter, Mask, TaperedCapsule, overlap};
use skiagraph_core::rng::{Purpose, stream};

const PARTS: usize = 16;
const NEAR: f64 = 0.05;

fn pinhole(width: u32) -> Pinhole {
    let (width_f, height_f) = (f64::from(width), f64::from(width * 3 / 4));
    let focal = [0.95 * width_f, 0.97 * width_f];
    Pinhole { focal, principal_point: [0.51 * width_f, 0.48 * height_f], width, height: width * 3 / 4, near: NEAR }
}

fn vector(random: &mut ChaCha8Rng, reach: f64) -> Vector3<f64> {
    Vector3::from_fn(|_, _| random.random_range(-reach..reach))
}

/// A body of sixteen parts in the camera frame, each attached to the end of another. Of five bodies three are in front
/// of the camera, one is around it, one is cut by the near plane or lies behind it.
fn body(index: u64, tapered: bool) -> Vec<TaperedCapsule> {
    let mut random = stream(index, Purpose::Corruption, 0, 0, 0);
    let root = match index % 5 {
        0..3 => Vector3::new(0.0, 0.0, random.random_range(2.0..6.0)) + vector(&mut random, 0.6),
        3 => vector(&mut random, 0.3),
        _ => Vector3::new(0.0, 0.0, random.random_range(-1.0..0.8)) + vector(&mut random, 0.5),
    };
    let mut ends = vec![Point3::from(root)];
    let mut parts = Vec::with_capacity(PARTS);
    for _ in 0..PARTS {
        let a = ends[random.random_range(0..ends.len())];
        let b = a + vector(&mut random, 0.3);
        let radius_a = random.random_range(0.02..0.15);
        let radius_b = if tapered { random.random_range(0.02..0.15) } else { radius_a };
        parts.push(TaperedCapsule { a, b, radius_a, radius_b });
        ends.push(b);
    }
    parts
}

/// Whether a ray, from the near plane on, meets one of the balls between the ends. The distance of a ball's centre from
/// the ray minus its radius is convex in the centre's place, so bisection on its slope finds the minimum.
fn ray_meets(part: &TaperedCapsule, direction: &Vector3<f64>) -> bool {
    let axis = part.b - part.a;
    let start = direction * NEAR;
    let gap = |s: f64| {
        let centre = part.a.coords + s * axis - start;
        let along = (centre.dot(direction) / direction.norm_squared()).max(0.0);
        let away = centre - along * direction;
        let distance = away.norm();
        let slope = away.dot(&axis) / distance - (part.radius_b - part.radius_a);
        (distance - (part.radius_a + s * (part.radius_b - part.radius_a)), slope)
    };
    let steepest = axis.norm() + (part.radius_b - part.radius_a).abs();
    let (mut low, mut high) = (0.0, 1.0);
    if gap(0.0).0 <= 0.0 || gap(1.0).0 <= 0.0 {
        return true;
    }
    while high - low > 1e-9 {
        let middle = 0.5 * (low + high);
        let (value, slope) = gap(middle);
        if value <= 0.0 {
            return true;
        }
        if value > steepest * 0.5 * (high - low) {
            return false;
        }
        if slope > 0.0 { high = middle } else { low = middle }
    }
    false
}

/// Pixels that a part can touch: those of its bounding ball, or all if that reaches the camera's plane.
fn window(part: &TaperedCapsule, pinhole: &Pinhole) -> [u32; 4] {
    let radius = 0.5 * (part.b - part.a).norm() + part.radius_a.max(part.radius_b);
    let centre = nalgebra::center(&part.a, &part.b);
    if centre.z + radius < NEAR {
        return [0; 4];
    }
    let depth = centre.z - radius;
    if depth < NEAR {
        return [0, 0, pinhole.width, pinhole.height];
    }
    let low = |c: f64| if c - radius < 0.0 { (c - radius) / depth } else { (c - radius) / (depth + 2.0 * radius) };
    let high = |c: f64| -low(-c);
    let from = pinhole.pixel(low(centre.x), low(centre.y));
    let to = pinhole.pixel(high(centre.x), high(centre.y));
    [from.x as u32, from.y as u32, (to.x as u32 + 1).min(pinhole.width), (to.y as u32 + 1).min(pinhole.height)]
}

fn cast(parts: &[TaperedCapsule], pinhole: &Pinhole, meets: impl Fn(&TaperedCapsule, &Vector3<f64>) -> bool) -> Mask {
    let mut mask = Mask::new(pinhole.width, pinhole.height);
    for part in parts {
        let [left, top, right, bottom] = window(part, pinhole);
        for (x, y) in (top..bottom).flat_map(|y| (left..right).map(move |x| (x, y))) {
            let (u, v) = pinhole.normalised(&nalgebra::Point2::new(f64::from(x) + 0.5, f64::from(y) + 0.5));
            if !mask.get(x, y) && meets(part, &Vector3::new(u, v, 1.0)) {
                mask.set(x, y, true);
            }
        }
    }
    mask
}

/// Whether the ray through a point of the image, in pixels, meets a part.
fn is_seen(
    parts: &[TaperedCapsule],
    pinhole: &Pinhole,
    [x, y]: [f64; 2],
    meets: impl Fn(&TaperedCapsule, &Vector3<f64>) -> bool,
) -> bool {
    let (u, v) = pinhole.normalised(&nalgebra::Point2::new(x, y));
    parts.iter().any(|part| meets(part, &Vector3::new(u, v, 1.0)))
}

/// The greatest distance of a differing pixel's centre from the outline found by rays, pixels.
const OUTLINE_PX: f64 = 0.01;

/// Whether the outline found by rays passes within [`OUTLINE_PX`] of a pixel's centre: a ray that close differs.
fn outline_passes(
    parts: &[TaperedCapsule],
    pinhole: &Pinhole,
    (x, y): (u32, u32),
    meets: impl Fn(&TaperedCapsule, &Vector3<f64>) -> bool,
) -> bool {
    let [x, y] = [x, y].map(|c| f64::from(c) + 0.5);
    let at_centre = is_seen(parts, pinhole, [x, y], &meets);
    (0..16).map(|k| std::f64::consts::TAU * f64::from(k) / 16.0).any(|angle| {
        let near = [x + OUTLINE_PX * angle.cos(), y + OUTLINE_PX * angle.sin()];
        is_seen(parts, pinhole, near, &meets) != at_centre
    })
}

/// Draws and ray-casts bodies at 160x120. At most one pixel in 20,000 of those in either mask may differ, and only if
/// the outline passes through its centre up to rounding. Returns the number of bodies that are visible.
fn agree(
    bodies: impl Iterator<Item = Vec<TaperedCapsule>>,
    meets: impl Fn(&TaperedCapsule, &Vector3<f64>) -> bool,
) -> usize {
    let pinhole = pinhole(160);
    let mut painter = CapsulePainter::new(&pinhole);
    let (mut seen, mut differing, mut shown) = (0, 0, 0);
    for (index, parts) in bodies.enumerate() {
        let mut drawn = Mask::new(pinhole.width, pinhole.height);
        let bounds = painter.paint(&parts, &mut drawn);
        assert_eq!(bounds, drawn.bounds());
        let expected = cast(&parts, &pinhole, &meets);
        let overlap = overlap(&drawn, &expected);
        if overlap.only_model + overlap.only_observed > 0 {
            for at in (0..pinhole.height).flat_map(|y| (0..pinhole.width).map(move |x| (x, y))) {
                let differs = drawn.get(at.0, at.1) != expected.get(at.0, at.1);
                assert!(!differs || outline_passes(&parts, &pinhole, at, &meets), "body {index}, pixel {at:?}");
                differing += u64::from(differs);
            }
        }
        shown += overlap.union();
        seen += usize::from(!expected.is_empty());
    }
    println!("{differing} of {shown} pixels differ");
    assert!(20_000 * differing <= shown, "{differing} of {shown} pixels differ");
    seen
}

#[test]
fn five_hundred_tapered_bodies_agree_with_rays_at_160x120() {
    let seen = agree((0..500).map(|i| body(i, true)), ray_meets);
    assert!(seen >= 400, "{seen}");
}

#[test]
fn bodies_of_equal_radii_agree_with_parry() {
    let meets = |part: &TaperedCapsule, direction: &Vector3<f64>| {
        let single = |v: [f64; 3]| parry3d::math::Vec3::from_array(v.map(|c| c as f32));
        let capsule = Capsule::new(single(part.a.into()), single(part.b.into()), part.radius_a as f32);
        let ray = Ray::new(single((direction * NEAR).into()), single((*direction).into()));
        capsule.cast_local_ray(&ray, f32::MAX, true).is_some()
    };
    let seen = agree((0..500).map(|i| body(i, false)), meets);
    assert!(seen >= 400, "{seen}");
}
