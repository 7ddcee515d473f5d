//! Support points and support polygon of a body.

use nalgebra::{Point2, Point3, Vector3};

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
        for solid in &body.links[link].solids {
            let low = corners(solid, frames, link).into_iter().filter(|point| point.z <= carried(gap));
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

/// Height up to which points of a link with this gap to the ground carry the body, metres.
fn carried(gap: f64) -> f64 {
    gap.max(0.0) + CARRIES
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

/// The convex hull of the low parts of links that touch the ground, given with their heights. A sphere contributes a
/// disc.
pub(super) fn support_polygon(
    body: &Humanoid,
    frames: &LinkFrames,
    touching: impl Iterator<Item = (usize, f64)>,
) -> Vec<Point2<f64>> {
    let mut found = Vec::new();
    for (link, gap) in touching {
        let high = carried(gap);
        for solid in &body.links[link].solids {
            match solid {
                Solid::TaperedCapsule(c) => {
                    let balls = [(c.a, c.radius_a), (c.b, c.radius_b)].into_iter();
                    found.extend(balls.flat_map(|(centre, radius)| disc(&(frames[link] * centre), radius, high)));
                }
                _ => {
                    let low = corners(solid, frames, link).into_iter().filter(|point| point.z <= high);
                    found.extend(low.map(|point| point.xy()));
                }
            }
        }
    }
    convex_hull(found)
}

/// The edge of the part of a sphere below `high`, seen from above; empty if there is none.
fn disc(centre: &Point3<f64>, radius: f64, high: f64) -> Vec<Point2<f64>> {
    let depth = (high - (centre.z - radius)).min(radius);
    if depth < 0.0 {
        return Vec::new();
    }
    let width = (depth * (2.0 * radius - depth)).sqrt();
    let on_edge = |index| {
        let (sin, cos) = libm::sincos(std::f64::consts::TAU * index as f64 / AROUND as f64);
        Point2::new(centre.x + width * cos, centre.y + width * sin)
    };
    (0..AROUND).map(on_edge).collect()
}

/// The convex hull of points, anticlockwise, without points on its edges (Andrew's monotone chain, 1979).
pub(super) fn convex_hull(mut points: Vec<Point2<f64>>) -> Vec<Point2<f64>> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup();
    if points.len() < 3 {
        return points;
    }
    let mut hull = half_hull(points.iter().copied());
    hull.extend(half_hull(points.iter().rev().copied()));
    hull
}

/// One side of the convex hull of sorted points, without its last point.
fn half_hull(points: impl Iterator<Item = Point2<f64>>) -> Vec<Point2<f64>> {
    let turns_left = |a: &Point2<f64>, b: &Point2<f64>, c: &Point2<f64>| (b - a).perp(&(c - a)) > 0.0;
    let mut chain: Vec<Point2<f64>> = Vec::new();
    for point in points {
        while chain.len() >= 2 && !turns_left(&chain[chain.len() - 2], &chain[chain.len() - 1], &point) {
            chain.pop();
        }
        chain.push(point);
    }
    chain.pop();
    chain
}

/// Signed distance of a point to the nearest edge of a convex hull, metres, negative outside; minus infinity for an
/// empty hull.
pub(super) fn margin(hull: &[Point2<f64>], point: &Point2<f64>) -> f64 {
    let edges = || (0..hull.len()).map(|i| (hull[i], hull[(i + 1) % hull.len()]));
    let to_edge = |(a, b): (Point2<f64>, Point2<f64>)| {
        let (along, away) = (b - a, point - a);
        let length = along.norm_squared();
        let share = if length > 0.0 { (along.dot(&away) / length).clamp(0.0, 1.0) } else { 0.0 };
        (away - along * share).norm()
    };
    let distance = edges().map(to_edge).fold(f64::INFINITY, f64::min);
    let inside = hull.len() >= 3 && edges().all(|(a, b)| (b - a).perp(&(point - a)) >= 0.0);
    if inside { distance } else { -distance }
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
            let hull = convex_hull(points.iter().map(Point3::xy).collect());
            let pairs = hull.iter().zip(hull.iter().cycle().skip(1));
            0.5 * pairs.map(|(a, b)| a.coords.perp(&b.coords)).sum::<f64>()
        };
        // the area of a regular 16-gon relative to that of its circle
        let expected = 8.0 / std::f64::consts::PI * (std::f64::consts::TAU / 16.0).sin();
        assert!((area(&kept) / area(&sole) - expected).abs() < 0.002, "{} {}", area(&kept), area(&sole));
        assert!(outermost(Vec::new()).is_empty());
    }

    #[test]
    fn margins_of_a_square_match_values_computed_by_hand() {
        let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.5, 0.5], [0.5, 0.0]];
        let hull = convex_hull(square.into_iter().map(Point2::from).collect());
        assert_eq!(hull.len(), 4);
        for (point, expected) in
            [([0.5, 0.4], 0.4), ([0.5, -0.2], -0.2), ([1.3, 1.4], -0.5), ([0.0, 0.3], 0.0), ([0.9, 0.5], 0.1)]
        {
            assert!((margin(&hull, &Point2::from(point)) - expected).abs() < 1e-12, "{point:?}");
        }
    }

    #[test]
    fn a_ball_on_the_ground_stands_on_its_low_disc() {
        let disc = |x: f64, z: f64| super::disc(&Point3::new(x, 0.0, z), 0.05, 0.01);
        // 0.05 m: at a height of 0.01 m it is 2 * 0.03 m wide
        let edge = disc(1.0, 0.05);
        assert_eq!(edge.len(), AROUND);
        assert!(edge.iter().all(|point| ((point - Point2::new(1.0, 0.0)).norm() - 0.03).abs() < 1e-12));
        assert!(disc(0.0, 0.0601).is_empty());
        // sunk beyond its middle, it has its full width
        assert!((disc(0.0, -0.2)[0].x - 0.05).abs() < 1e-12);
    }

    #[test]
    fn a_line_or_a_point_has_no_interior() {
        let line = convex_hull(vec![Point2::new(0.0, 0.0), Point2::new(1.0, 1.0), Point2::new(0.5, 0.5)]);
        assert!((margin(&line, &Point2::new(0.0, 1.0)) + 0.5_f64.sqrt()).abs() < 1e-12);
        assert!((margin(&[Point2::origin()], &Point2::new(3.0, 4.0)) + 5.0).abs() < 1e-12);
        assert_eq!(margin(&[], &Point2::origin()), f64::NEG_INFINITY);
    }
}
