//! The sides of limbs against an observed contour.

use nalgebra::{Point3, Vector3};

use crate::camera::Pinhole;
use crate::raster::{DistanceMap, Mask, TaperedCapsule, contour};

/// Pixels between samples along a side.
const SPACING: f64 = 4.0;

/// How far the sides of limbs lie from the contour of one observed silhouette.
///
/// A limb's *sides* are the two lines along which its outline runs from one end to the other, wherever they lie: on the
/// model's contour or inside its silhouette. What was observed is a silhouette, so an edge inside the body was never
/// seen, and a side that crosses the body far from the contour cannot be told from a wrong one. It costs what a side
/// costs that missed the contour by `tau` or more, never more: a robust distance. Sides outside the picture cost the
/// same.
#[derive(Debug)]
pub(super) struct LimbSides {
    pinhole: Pinhole,
    /// `min(d, tau) / tau` of every pixel, row by row.
    distances: Vec<f32>,
}

impl LimbSides {
    /// Distances to the contour of `observed`, in the pixels of `pinhole`, cut off at `tau` pixels.
    pub(super) fn new(pinhole: &Pinhole, observed: &Mask, tau: f64) -> Self {
        let edge = contour(observed);
        let (width, height) = (pinhole.width, pinhole.height);
        let map = DistanceMap::within(&edge, edge.bounds().grown(tau.ceil() as u32, width, height));
        let mut distances = vec![1.0; width as usize * height as usize];
        let window = map.window();
        for y in window.top..window.bottom {
            for x in window.left..window.right {
                let pixel = y as usize * width as usize + x as usize;
                distances[pixel] = (map.distance(x, y) / tau).min(1.0) as f32;
            }
        }
        Self { pinhole: *pinhole, distances }
    }

    /// Mean over samples along the sides of `limbs` (camera frame, metres) of `min(d, tau) / tau`, `d` being the
    /// distance to the observed contour: in [0, 1]. Limbs without sides (balls, and what is not before the camera) have
    /// no say; where all are so, 1.
    pub(super) fn mean_distance(&self, limbs: &[TaperedCapsule]) -> f64 {
        let (mut sum, mut count) = (0.0, 0_u32);
        for [from, to] in limbs.iter().flat_map(sides).flatten() {
            let (Some(from), Some(to)) = (project(&self.pinhole, &from), project(&self.pinhole, &to)) else { continue };
            let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
            // what lies far outside the picture is not walked along pixel by pixel
            let steps = (dx.hypot(dy) / SPACING).ceil().clamp(1.0, 1e3) as u32;
            for step in 0..=steps {
                let share = f64::from(step) / f64::from(steps);
                sum += self.distance(from[0] + share * dx, from[1] + share * dy);
            }
            count += steps + 1;
        }
        if count == 0 { 1.0 } else { sum / f64::from(count) }
    }

    fn distance(&self, x: f64, y: f64) -> f64 {
        let inside = x >= 0.0 && y >= 0.0 && x < f64::from(self.pinhole.width) && y < f64::from(self.pinhole.height);
        if !inside {
            return 1.0;
        }
        let pixel = y as usize * self.pinhole.width as usize + x as usize;
        f64::from(self.distances[pixel])
    }
}

/// The pixel of a point of the camera frame; `None` of what is not before the camera.
pub(super) fn project(pinhole: &Pinhole, point: &Point3<f64>) -> Option<[f64; 2]> {
    let pixel = |i: usize| pinhole.principal_point[i] + pinhole.focal[i] * point[i] / point.z;
    (point.z > pinhole.near).then(|| [pixel(0), pixel(1)])
}

/// Where the two planes through the camera's centre that touch both balls of a limb touch them; `None` where one ball
/// hides the other.
///
/// A plane of unit normal `n` touches the balls at `a - ra n` and `b - rb n` where `n.a = ra` and `n.b = rb`. With
/// `w = a x b` and `q = ra b - rb a` that is `n = (q x w +- w sqrt(|w|^2 - |q|^2)) / |w|^2`.
pub(super) fn sides(limb: &TaperedCapsule) -> [Option<[Point3<f64>; 2]>; 2] {
    let (a, b) = (limb.a.coords, limb.b.coords);
    let (w, q) = (a.cross(&b), limb.radius_a * b - limb.radius_b * a);
    let (square, rest) = (w.norm_squared(), w.norm_squared() - q.norm_squared());
    if square <= 0.0 || rest <= 0.0 {
        return [None; 2];
    }
    let touching = |sign: f64| {
        let normal: Vector3<f64> = (q.cross(&w) + sign * rest.sqrt() * w) / square;
        Some([limb.a - limb.radius_a * normal, limb.b - limb.radius_b * normal])
    };
    [touching(1.0), touching(-1.0)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::CapsulePainter;

    fn pinhole() -> Pinhole {
        Pinhole { focal: [200.0; 2], principal_point: [80.0, 60.0], width: 160, height: 120, near: 0.05 }
    }

    fn limb(x: f64) -> TaperedCapsule {
        let (a, b) = (Point3::new(x, -0.3, 2.0), Point3::new(x + 0.05, 0.3, 2.1));
        TaperedCapsule { a, b, radius_a: 0.09, radius_b: 0.05 }
    }

    fn painted(limbs: &[TaperedCapsule]) -> Mask {
        let mut mask = Mask::new(160, 120);
        CapsulePainter::new(&pinhole()).paint(limbs, &mut mask);
        mask
    }

    #[test]
    fn sides_lie_on_the_limbs_own_contour_and_leave_it_as_the_limb_moves() {
        let limbs = LimbSides::new(&pinhole(), &painted(&[limb(0.0)]), 10.0);
        let there = limbs.mean_distance(&[limb(0.0)]);
        assert!(there < 0.1, "{there}: less than a pixel of ten");
        let costs: Vec<f64> = [0.01, 0.03, 0.06].map(|x| limbs.mean_distance(&[limb(x)])).to_vec();
        assert!(there < costs[0] && costs.windows(2).all(|c| c[0] < c[1]), "{there} {costs:?}");
        // one pixel is 0.01 m at 2 m: a shift of three pixels costs about three of ten
        assert!((costs[1] - there - 0.3).abs() < 0.1, "{costs:?}");
    }

    #[test]
    fn a_side_deep_inside_or_outside_the_picture_costs_one_and_no_more() {
        let trunk = TaperedCapsule { radius_a: 0.4, radius_b: 0.4, ..limb(0.0) };
        let thin = TaperedCapsule { radius_a: 0.02, radius_b: 0.02, ..limb(0.0) };
        let limbs = LimbSides::new(&pinhole(), &painted(&[trunk]), 10.0);
        assert_eq!(limbs.mean_distance(&[thin]), 1.0);
        assert_eq!(limbs.mean_distance(&[limb(50.0)]), 1.0);
        let behind = TaperedCapsule { a: Point3::new(0.0, 0.0, -2.0), b: Point3::new(0.0, 0.3, -2.0), ..limb(0.0) };
        assert_eq!(limbs.mean_distance(&[behind]), 1.0);
        assert_eq!(limbs.mean_distance(&[]), 1.0);
    }

    #[test]
    fn a_ball_that_hides_the_other_has_no_sides() {
        let ball = TaperedCapsule { b: limb(0.0).a, ..limb(0.0) };
        assert_eq!(sides(&ball), [None; 2]);
    }
}
