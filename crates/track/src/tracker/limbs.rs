//! Limbs against the observation: their sides against the observed contour, points inside them against the silhouette.

use nalgebra::Point3;

use super::descent::sides;
use skiagraph_core::camera::Pinhole;
use skiagraph_core::raster::{DistanceMap, Mask, TaperedCapsule, contour};

/// Distance between samples along a side, pixels.
const SIDE_SPACING: f64 = 4.0;
/// Distance between samples inside a limb, along it and across it, pixels.
const INSIDE_SPACING: f64 = 8.0;
/// Minimum number of samples along and across a limb.
const MIN_SAMPLES: f64 = 4.0;
/// Maximum number, which bounds the work for limbs far outside the image.
const MAX_SAMPLES: f64 = 200.0;

/// Distance of limb sides from the contour of one observed silhouette.
///
/// A limb's *sides* are the two lines of its outline from one end to the other, whether on the model's contour or
/// inside its silhouette. A silhouette shows no edges inside the body, so a side that crosses the body far from the
/// contour cannot be distinguished from a wrong one. It costs as much as a side that misses the contour by `tau` or
/// more, and no more: the distance is robust. Sides outside the image cost the same.
#[derive(Debug)]
pub(super) struct LimbSides {
    pinhole: Pinhole,
    /// `min(d, tau) / tau` of every pixel, in row-major order.
    distances: Vec<f32>,
}

impl LimbSides {
    /// Distances to the contour of `observed`, in pixels of `pinhole`, truncated at `tau` pixels.
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

    /// Mean of `min(d, tau) / tau` over samples along the sides of `limbs` (camera frame, metres), with `d` the
    /// distance to the observed contour: in [0, 1]. Limbs without sides (balls, and limbs not in front of the camera)
    /// are ignored; 1 if no limb has sides.
    pub(super) fn mean_distance(&self, limbs: &[TaperedCapsule]) -> f64 {
        let (mut sum, mut count) = (0.0, 0_u32);
        for (_, [from, to]) in limbs.iter().flat_map(sides).flatten() {
            let (Some(from), Some(to)) = (project(&self.pinhole, &from), project(&self.pinhole, &to)) else { continue };
            let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
            // Bounds the work for limbs far outside the image.
            let steps = (dx.hypot(dy) / SIDE_SPACING).ceil().clamp(1.0, 1e3) as u32;
            for step in 0..=steps {
                let share = f64::from(step) / f64::from(steps);
                sum += self.distance(from[0] + share * dx, from[1] + share * dy);
            }
            count += steps + 1;
        }
        if count == 0 { 1.0 } else { sum / f64::from(count) }
    }

    fn distance(&self, x: f64, y: f64) -> f64 {
        if !is_in_image(&self.pinhole, x, y) {
            return 1.0;
        }
        let pixel = y as usize * self.pinhole.width as usize + x as usize;
        f64::from(self.distances[pixel])
    }
}

/// The observed silhouette for sampling points inside limbs: the silhouette term of `[Deutscher 2005]`.
///
/// A limb's inside is the area between its two sides. Nothing is rendered, and observed pixels that the model leaves
/// uncovered cost nothing: the term is one-sided, so a limb hidden by the trunk is free.
#[derive(Debug)]
pub(super) struct LimbInsides {
    pinhole: Pinhole,
    observed: Mask,
    nothing_observed: bool,
}

impl LimbInsides {
    pub(super) fn new(pinhole: &Pinhole, observed: &Mask) -> Self {
        Self { pinhole: *pinhole, observed: observed.clone(), nothing_observed: observed.is_empty() }
    }

    /// The share of samples inside `limbs` (camera frame, metres) and inside the image that lie outside the observed
    /// silhouette, in [0, 1]. If no sample is in the image: 1, or `None` if nothing was observed either.
    pub(super) fn share_missed(&self, limbs: &[TaperedCapsule]) -> Option<f64> {
        let (mut missed, mut count) = (0_u32, 0_u32);
        for limb in limbs {
            let [Some((_, left)), Some((_, right))] = sides(limb) else { continue };
            let corners = [left[0], left[1], right[0], right[1]].map(|corner| project(&self.pinhole, &corner));
            let [Some(a), Some(b), Some(c), Some(d)] = corners else { continue };
            for [x, y] in points_between([a, b], [c, d]) {
                if is_in_image(&self.pinhole, x, y) {
                    missed += u32::from(!self.observed.get(x as u32, y as u32));
                    count += 1;
                }
            }
        }
        match (count, self.nothing_observed) {
            (0, true) => None,
            (0, false) => Some(1.0),
            _ => Some(f64::from(missed) / f64::from(count)),
        }
    }
}

/// Points on a grid between two lines, pixels.
fn points_between(left: [[f64; 2]; 2], right: [[f64; 2]; 2]) -> impl Iterator<Item = [f64; 2]> {
    let middle = |[from, to]: [[f64; 2]; 2]| between(from, to, 0.5);
    let number = |length: f64| (length / INSIDE_SPACING).round().clamp(MIN_SAMPLES, MAX_SAMPLES) as u32;
    let along = number(distance(left[0], left[1]));
    let across = number(distance(middle(left), middle(right)));
    let share = |index: u32, count: u32| (f64::from(index) + 0.5) / f64::from(count);
    (0..along).flat_map(move |station| {
        let ends = [left, right].map(|[from, to]| between(from, to, share(station, along)));
        (0..across).map(move |place| between(ends[0], ends[1], share(place, across)))
    })
}

fn between(from: [f64; 2], to: [f64; 2], share: f64) -> [f64; 2] {
    [0, 1].map(|i| from[i] + share * (to[i] - from[i]))
}

fn distance(from: [f64; 2], to: [f64; 2]) -> f64 {
    (to[0] - from[0]).hypot(to[1] - from[1])
}

fn is_in_image(pinhole: &Pinhole, x: f64, y: f64) -> bool {
    x >= 0.0 && y >= 0.0 && x < f64::from(pinhole.width) && y < f64::from(pinhole.height)
}

/// The pixel of a point in the camera frame; `None` if the point is not in front of the camera.
fn project(pinhole: &Pinhole, point: &Point3<f64>) -> Option<[f64; 2]> {
    let pixel = |i: usize| pinhole.principal_point[i] + pinhole.focal[i] * point[i] / point.z;
    (point.z > pinhole.near).then(|| [pixel(0), pixel(1)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use skiagraph_core::raster::CapsulePainter;

    fn pinhole() -> Pinhole {
        Pinhole { focal: [200.0; 2], principal_point: [80.0, 60.0], width: 160, height: 120, near: 0.05 }
    }

    fn limb(x: f64) -> TaperedCapsule {
        let (a, b) = (Point3::new(x, -0.3, 2.0), Point3::new(x + 0.05, 0.3, 2.1));
        TaperedCapsule { a, b, radius_a: 0.09, radius_b: 0.05 }
    }

    /// Upright, at constant depth.
    fn straight(x: f64) -> TaperedCapsule {
        let (a, b) = (Point3::new(x, -0.2, 2.0), Point3::new(x, 0.2, 2.0));
        TaperedCapsule { a, b, radius_a: 0.1, radius_b: 0.1 }
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
    fn a_side_deep_inside_the_body_or_outside_the_image_costs_at_most_one() {
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
        assert_eq!(sides(&ball), [None, None]);
    }

    #[test]
    fn the_share_is_the_limbs_area_outside_the_silhouette() {
        let insides = LimbInsides::new(&pinhole(), &painted(&[straight(0.0)]));
        // the limb is 20 pixels wide: at 5 pixels aside a quarter of it is uncovered, in columns of samples a quarter
        let shares = [0.0, 0.05, 0.1, 0.5].map(|x| insides.share_missed(&[straight(x)]));
        assert_eq!(shares, [0.0, 0.25, 0.5, 1.0].map(Some));
    }

    #[test]
    fn a_limb_inside_the_trunk_costs_nothing_and_one_outside_the_image_costs_one() {
        let trunk = TaperedCapsule { radius_a: 0.3, radius_b: 0.3, ..straight(0.0) };
        let insides = LimbInsides::new(&pinhole(), &painted(&[trunk]));
        assert_eq!(insides.share_missed(&[straight(0.1)]), Some(0.0), "one-sided");
        assert_eq!(insides.share_missed(&[straight(50.0)]), Some(1.0));
        assert_eq!(insides.share_missed(&[]), Some(1.0));
        assert_eq!(LimbInsides::new(&pinhole(), &Mask::new(160, 120)).share_missed(&[straight(50.0)]), None);
    }

    #[test]
    fn parts_cropped_by_the_image_are_ignored() {
        let cut = straight(0.8);
        let insides = LimbInsides::new(&pinhole(), &painted(&[cut]));
        assert!(painted(&[cut]).count() < painted(&[straight(0.0)]).count());
        assert_eq!(insides.share_missed(&[cut]), Some(0.0));
    }
}
