//! Which of many rays meet a tapered capsule, and where, sixteen at a time.

use super::TaperedCapsule;
use crate::simd::{Dispatched, dispatch};

/// Rays of a strip.
pub(crate) const STRIP_RAYS: usize = 16;

/// Directions (u, v, 1) of neighbouring rays through the origin: all u, then all v; NaN for a missing ray.
pub(crate) type RayStrip = [[f64; STRIP_RAYS]; 2];

/// For each of the `chosen` strips one bit for every ray that meets `capsule` at or beyond z = `near`, the first ray
/// in the lowest bit: exactly those for which [`TaperedCapsule::exit_along`] gives at least `near`.
pub(crate) fn rays_that_meet(
    capsule: &TaperedCapsule,
    near: f64,
    strips: &[RayStrip],
    chosen: &[u32],
    found: &mut Vec<u16>,
) {
    found.clear();
    found.resize(chosen.len(), 0);
    dispatch(ManyStrips { quadratics: Quadratics::new(capsule, near), strips, chosen, found });
}

/// For each of the `chosen` strips the depth z at which every ray first is in `capsule` at or beyond z = `near`;
/// infinite if it never is. The same rays meet it as in [`rays_that_meet`].
pub(crate) fn entries_of_rays(
    capsule: &TaperedCapsule,
    near: f64,
    strips: &[RayStrip],
    chosen: &[u32],
    found: &mut Vec<[f64; STRIP_RAYS]>,
) {
    found.clear();
    found.resize(chosen.len(), [f64::INFINITY; STRIP_RAYS]);
    dispatch(ManyStrips { quadratics: Quadratics::new(capsule, near), strips, chosen, found });
}

struct ManyStrips<'a, T> {
    quadratics: Quadratics,
    strips: &'a [RayStrip],
    chosen: &'a [u32],
    found: &'a mut [T],
}

impl Dispatched for ManyStrips<'_, [f64; STRIP_RAYS]> {
    type Output = ();

    #[inline(always)]
    fn work(self) {
        for (index, found) in self.chosen.iter().zip(self.found) {
            let [us, vs] = &self.strips[*index as usize];
            for ((found, u), v) in found.iter_mut().zip(us).zip(vs) {
                *found = self.quadratics.entry(*u, *v);
            }
        }
    }
}

impl Dispatched for ManyStrips<'_, u16> {
    type Output = ();

    #[inline(always)]
    fn work(self) {
        for (index, found) in self.chosen.iter().zip(self.found) {
            *found = self.quadratics.met_by(&self.strips[*index as usize]);
        }
    }
}

/// Quantities that [`TaperedCapsule::exit_along`] computes for every ray; the same operations in the same order.
struct Quadratics {
    near: f64,
    ends: [[f64; 4]; 2],
    axis: [f64; 3],
    gap: f64,
    start: f64,
    cone_constant: f64,
    has_cone: bool,
}

impl Quadratics {
    #[inline(always)]
    fn new(capsule: &TaperedCapsule, near: f64) -> Self {
        let TaperedCapsule { a, b, radius_a, radius_b } = capsule;
        let end = |centre: &nalgebra::Point3<f64>, radius: f64| {
            [centre.x, centre.y, centre.z, centre.coords.norm_squared() - radius * radius]
        };
        let axis = b - a;
        let taper = radius_b - radius_a;
        let gap = axis.norm_squared() - taper * taper;
        let start = (radius_a * taper - a.coords.dot(&axis)) / gap;
        Self {
            near,
            ends: [end(a, *radius_a), end(b, *radius_b)],
            axis: axis.into(),
            gap,
            start,
            cone_constant: a.coords.norm_squared() - radius_a * radius_a - gap * start * start,
            has_cone: gap > 0.0,
        }
    }

    #[inline(always)]
    fn met_by(&self, [us, vs]: &RayStrip) -> u16 {
        let mut met = [false; STRIP_RAYS];
        for ((met, u), v) in met.iter_mut().zip(us).zip(vs) {
            *met = self.is_met_by(*u, *v);
        }
        let mut bits = 0;
        for (index, met) in met.iter().enumerate() {
            bits |= u16::from(*met) << index;
        }
        bits
    }

    /// Branch-free. Roots that are not real are NaN and compare as not beyond anything.
    #[inline(always)]
    fn is_met_by(&self, u: f64, v: f64) -> bool {
        let Crossings { ends, cone, on_cone } = self.crossings(u, v);
        let beyond = |t: f64| t >= self.near;
        beyond(ends[0][1]) | beyond(ends[1][1]) | (beyond(cone[0]) & on_cone[0]) | (beyond(cone[1]) & on_cone[1])
    }

    /// The solid is convex: a ray enters it at the least root and leaves it at the greatest.
    #[inline(always)]
    fn entry(&self, u: f64, v: f64) -> f64 {
        let Crossings { ends, cone, on_cone } = self.crossings(u, v);
        // comparisons with NaN are false
        let less = |least: f64, t: f64| if t < least { t } else { least };
        let more = |most: f64, t: f64| if t > most { t } else { most };
        let (mut enters, mut leaves) = (f64::INFINITY, f64::NEG_INFINITY);
        for [first, last] in ends {
            (enters, leaves) = (less(enters, first), more(leaves, last));
        }
        for (t, on_cone) in cone.into_iter().zip(on_cone) {
            let t = if on_cone { t } else { f64::NAN };
            (enters, leaves) = (less(enters, t), more(leaves, t));
        }
        if leaves >= self.near { more(enters, self.near) } else { f64::INFINITY }
    }

    #[inline(always)]
    fn crossings(&self, u: f64, v: f64) -> Crossings {
        let square = u * u + v * v + 1.0;
        let [a, b] = self.ends;
        let half_a = u * a[0] + v * a[1] + a[2];
        let half_b = u * b[0] + v * b[1] + b[2];
        let root_a = (half_a * half_a - square * a[3]).sqrt();
        let root_b = (half_b * half_b - square * b[3]).sqrt();
        let slope = (u * self.axis[0] + v * self.axis[1] + self.axis[2]) / self.gap;
        let leading = square - self.gap * slope * slope;
        let half = half_a + self.gap * slope * self.start;
        let root = (half * half - leading * self.cone_constant).sqrt();
        let cone = [(half - root) / leading, (half + root) / leading];
        Crossings {
            ends: [
                [(half_a - root_a) / square, (half_a + root_a) / square],
                [(half_b - root_b) / square, (half_b + root_b) / square],
            ],
            cone,
            on_cone: cone.map(|t| (0.0..=1.0).contains(&(slope * t + self.start)) & self.has_cone),
        }
    }
}

/// Where a ray crosses the surfaces of a capsule's parts; NaN if it does not.
struct Crossings {
    ends: [[f64; 2]; 2],
    cone: [f64; 2],
    /// Whether it is on the part of the cone between the balls.
    on_cone: [bool; 2],
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::distance_by_search;
    use nalgebra::{Point3, Vector3};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_same_rays_meet_it_as_one_by_one(
            ends in prop::array::uniform6(-1.0..1.0_f64),
            near_z in -0.5..3.0_f64,
            radii in prop::array::uniform2(0.0..0.5_f64),
            rays in prop::array::uniform32(-1.2..1.2_f64),
            to_the_middle: bool,
        ) {
            let [ax, ay, az, bx, by, bz] = ends;
            let a = Point3::new(ax, ay, az + near_z);
            let b = Point3::new(bx, by, bz + near_z);
            let capsule = TaperedCapsule { a, b, radius_a: radii[0], radius_b: radii[1] };
            let mut strip = [[0.0; STRIP_RAYS]; 2];
            for (index, ray) in rays.iter().enumerate() {
                // rays close to the axis meet it, others may not
                let middle = if to_the_middle { [(ax + bx) / 2.0, (ay + by) / 2.0][index / 16] } else { 0.0 };
                strip[index / 16][index % 16] = ray + middle;
            }
            (strip[0][7], strip[1][7]) = (f64::NAN, f64::NAN);
            let mut found = vec![1; 9];
            rays_that_meet(&capsule, 0.1, &[strip, strip], &[1], &mut found);
            let one_by_one = (0..STRIP_RAYS).fold(0, |bits, index| {
                let exit = capsule.exit_along(&Vector3::new(strip[0][index], strip[1][index], 1.0));
                bits | u16::from(exit.is_some_and(|depth| depth >= 0.1)) << index
            });
            prop_assert_eq!(found, vec![one_by_one]);
        }

        #[test]
        fn entries_agree_with_marching_along_rays(
            ends in prop::array::uniform6(-1.0..1.0_f64),
            near_z in 0.5..3.0_f64,
            radii in prop::array::uniform2(0.05..0.5_f64),
            rays in prop::array::uniform32(-0.8..0.8_f64),
        ) {
            let [ax, ay, az, bx, by, bz] = ends;
            let (a, b) = (Point3::new(ax, ay, az + near_z), Point3::new(bx, by, bz + near_z));
            let capsule = TaperedCapsule { a, b, radius_a: radii[0], radius_b: radii[1] };
            let mut strip = [[0.0; STRIP_RAYS]; 2];
            rays.iter().enumerate().for_each(|(index, ray)| strip[index / 16][index % 16] = *ray);
            let (mut found, mut met, near) = (Vec::new(), Vec::new(), 0.1);
            entries_of_rays(&capsule, near, &[strip], &[0], &mut found);
            rays_that_meet(&capsule, near, &[strip], &[0], &mut met);
            for (index, entry) in found[0].iter().enumerate() {
                prop_assert_eq!(entry.is_finite(), met[0] >> index & 1 == 1);
                let [u, v] = strip.map(|coordinates| coordinates[index]);
                let at = |z: f64| distance_by_search(&capsule, &Point3::new(u * z, v * z, z));
                if !entry.is_finite() {
                    prop_assert!((0..100).all(|i| at(near + 0.06 * f64::from(i)) > -1e-9));
                } else if *entry > near {
                    prop_assert!(at(*entry).abs() < 2e-5, "{} off", at(*entry));
                    prop_assert!((0..20).all(|i| at(near + (entry - near) * f64::from(i) / 20.0) > -1e-9));
                } else {
                    prop_assert!(*entry == near && at(near) < 2e-5);
                }
            }
        }
    }
}
