//! Support points of a body.

use nalgebra::{Point3, Vector3};

use crate::body::{Humanoid, LinkFrames, Solid};

/// Points of a link up to this height above the ground carry the body, metres, because soft tissue yields; above the
/// link's lowest point if all of it is higher, because recordings float.
const CARRIES: f64 = 0.01;
/// Number of points on the edge of a disc.
const AROUND: usize = 16;

/// A point that can support the body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SupportPoint {
    /// The link that it belongs to.
    pub link: usize,
    /// World, metres.
    pub point: Point3<f64>,
}

/// The support points of links that touch the ground, given with their heights. Of the parts that are low enough: the
/// lowest points of the spheres of a tapered capsule, the corners of a box, eight points of each rim of a cylinder,
/// and the outermost vertices of a mesh in sixteen directions.
pub fn support_points(
    body: &Humanoid,
    frames: &LinkFrames,
    touching: impl Iterator<Item = (usize, f64)>,
) -> Vec<SupportPoint> {
    let mut found = Vec::new();
    for (link, gap) in touching {
        // points up to this height carry the body
        let carried = gap.max(0.0) + CARRIES;
        for solid in &body.links[link].solids {
            let low = corners(solid, frames, link).into_iter().filter(|point| point.z <= carried);
            let low = if matches!(solid, Solid::Mesh { .. }) { outermost(low.collect()) } else { low.collect() };
            found.extend(low.into_iter().map(|point| SupportPoint { link, point }));
        }
    }
    found
}

/// The extreme points in [`AROUND`] horizontal directions, without duplicates: forces inside their hull are sums of
/// forces at them. Otherwise a sole with thousands of vertices would take minutes per frame.
fn outermost(points: Vec<Point3<f64>>) -> Vec<Point3<f64>> {
    let furthest = |index: usize| {
        let (sin, cos) = libm::sincos(std::f64::consts::TAU * index as f64 / AROUND as f64);
        let reach = |point: &Point3<f64>| cos * point.x + sin * point.y;
        (0..points.len()).max_by(|a, b| reach(&points[*a]).total_cmp(&reach(&points[*b])))
    };
    let mut chosen: Vec<usize> = (0..AROUND).filter_map(furthest).collect();
    chosen.sort_unstable();
    chosen.dedup();
    chosen.into_iter().map(|index| points[index]).collect()
}

fn corners(solid: &Solid, frames: &LinkFrames, link: usize) -> Vec<Point3<f64>> {
    let place = &frames[link];
    match solid {
        Solid::TaperedCapsule(c) => {
            let balls = [(c.a, c.radius_a), (c.b, c.radius_b)];
            balls.map(|(centre, radius)| place * centre - Vector3::z() * radius).to_vec()
        }
        Solid::Box { link_from_box, half_extents: [x, y, z] } => {
            let signs = |corner: usize| [0, 1, 2].map(|bit| if corner >> bit & 1 == 1 { 1.0 } else { -1.0 });
            let corner =
                |signs: [f64; 3]| place * (link_from_box * Point3::new(signs[0] * x, signs[1] * y, signs[2] * z));
            (0..8).map(|index| corner(signs(index))).collect()
        }
        Solid::Cylinder { link_from_cylinder, radius, half_length } => {
            let around = |index: usize| {
                let (sin, cos) = libm::sincos(std::f64::consts::FRAC_PI_4 * (index % 8) as f64);
                let height = if index < 8 { *half_length } else { -*half_length };
                place * (link_from_cylinder * Point3::new(radius * cos, radius * sin, height))
            };
            (0..16).map(around).collect()
        }
        Solid::Mesh { vertices, .. } => vertices.iter().map(|vertex| place * vertex).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sole_with_thousands_of_vertices_is_reduced_to_sixteen_of_the_same_extent() {
        let around = |index: u32| {
            let angle = std::f64::consts::TAU * f64::from(index) / 5000.0;
            Point3::new(0.1 * angle.cos(), 0.1 * angle.sin(), 0.0)
        };
        let sole: Vec<Point3<f64>> = (0..5000).map(around).collect();
        let kept = outermost(sole.clone());
        assert!(kept.len() == AROUND && kept.iter().all(|point| sole.contains(point)), "{}", kept.len());
        let area = |points: &[Point3<f64>]| {
            // indices are in the order of the circle, so the points are the corners of a polygon
            let pairs = points.iter().zip(points.iter().cycle().skip(1));
            0.5 * pairs.map(|(a, b)| a.x * b.y - a.y * b.x).sum::<f64>()
        };
        // the area of a regular 16-gon relative to that of its circle
        let expected = 8.0 / std::f64::consts::PI * (std::f64::consts::TAU / 16.0).sin();
        assert!((area(&kept) / area(&sole) - expected).abs() < 0.002, "{} {}", area(&kept), area(&sole));
        assert!(outermost(Vec::new()).is_empty());
    }
}
