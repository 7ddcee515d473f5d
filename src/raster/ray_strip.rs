//! Which of many rays meet a tapered capsule, sixteen at a time.

use super::TaperedCapsule;
use crate::simd::{Dispatched, dispatch};

/// Rays of a strip.
pub(crate) const STRIP_RAYS: usize = 16;

/// Directions (u, v, 1) of neighbouring rays through the origin: all u, then all v; NaN where there is no ray.
pub(crate) type RayStrip = [[f64; STRIP_RAYS]; 2];

/// For each of the `chosen` strips a bit for every ray that meets `capsule` at or beyond z = `near`, the first ray in
/// the lowest bit: exactly those for which [`TaperedCapsule::exit_along`] gives at least `near`.
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

struct ManyStrips<'a> {
    quadratics: Quadratics,
    strips: &'a [RayStrip],
    chosen: &'a [u32],
    found: &'a mut [u16],
}

impl Dispatched for ManyStrips<'_> {
    type Output = ();

    #[inline(always)]
    fn work(self) {
        for (index, found) in self.chosen.iter().zip(self.found) {
            *found = self.quadratics.met_by(&self.strips[*index as usize]);
        }
    }
}

/// What [`TaperedCapsule::exit_along`] computes anew for every ray; the same operations in the same order.
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

    /// Without branches. Roots that are not real are NaN, which lies beyond nothing.
    #[inline(always)]
    fn is_met_by(&self, u: f64, v: f64) -> bool {
        let square = u * u + v * v + 1.0;
        let [a, b] = self.ends;
        let half_a = u * a[0] + v * a[1] + a[2];
        let half_b = u * b[0] + v * b[1] + b[2];
        let exit_a = (half_a + (half_a * half_a - square * a[3]).sqrt()) / square;
        let exit_b = (half_b + (half_b * half_b - square * b[3]).sqrt()) / square;
        let slope = (u * self.axis[0] + v * self.axis[1] + self.axis[2]) / self.gap;
        let leading = square - self.gap * slope * slope;
        let half = half_a + self.gap * slope * self.start;
        let root = (half * half - leading * self.cone_constant).sqrt();
        let (t, other) = ((half - root) / leading, (half + root) / leading);
        let (s, other_s) = (slope * t + self.start, slope * other + self.start);
        let on_cone = (0.0..=1.0).contains(&s) & (t >= self.near);
        let on_other = (0.0..=1.0).contains(&other_s) & (other >= self.near);
        (exit_a >= self.near) | (exit_b >= self.near) | ((on_cone | on_other) & self.has_cone)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
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
    }
}
