//! The insides of limbs against an observed silhouette: one-sided, at sample points.

use super::limb_sides::{project, sides};
use crate::camera::Pinhole;
use crate::raster::{Mask, TaperedCapsule};

/// Pixels between samples, along a limb and across it.
const SPACING: f64 = 8.0;
/// Samples along and across a limb, however small it is.
const LEAST: f64 = 4.0;
/// And however large: what lies far outside the picture is not walked through pixel by pixel.
const MOST: f64 = 200.0;

/// Which pixels were observed, for limbs that are looked at in points: `[Deutscher 2005]`'s silhouette term.
///
/// A limb's inside is what lies between its two sides. Nothing is drawn, and nothing tells what of the observed
/// silhouette the model leaves uncovered: a limb that hides inside the trunk costs nothing.
#[derive(Debug)]
pub(super) struct LimbInsides {
    pinhole: Pinhole,
    observed: Mask,
    nothing_observed: bool,
}

impl LimbInsides {
    /// For what was observed in the pixels of `pinhole`.
    pub(super) fn new(pinhole: &Pinhole, observed: &Mask) -> Self {
        Self { pinhole: *pinhole, observed: observed.clone(), nothing_observed: observed.is_empty() }
    }

    /// Of the samples inside `limbs` (camera frame, metres) that lie in the picture, the share that lies outside the
    /// observed silhouette: in [0, 1]. Where none lies in the picture, 1, and `None` if nothing was observed either.
    pub(super) fn share_missed(&self, limbs: &[TaperedCapsule]) -> Option<f64> {
        let (mut missed, mut count) = (0_u32, 0_u32);
        for limb in limbs {
            let [Some(left), Some(right)] = sides(limb) else { continue };
            let corners = [left[0], left[1], right[0], right[1]].map(|corner| project(&self.pinhole, &corner));
            let [Some(a), Some(b), Some(c), Some(d)] = corners else { continue };
            for [x, y] in points_between([a, b], [c, d]) {
                if x >= 0.0 && y >= 0.0 && x < f64::from(self.pinhole.width) && y < f64::from(self.pinhole.height) {
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
    let number = |length: f64| (length / SPACING).round().clamp(LEAST, MOST) as u32;
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

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;
    use crate::raster::CapsulePainter;

    fn pinhole() -> Pinhole {
        Pinhole { focal: [200.0; 2], principal_point: [80.0, 60.0], width: 160, height: 120, near: 0.05 }
    }

    fn limb(x: f64) -> TaperedCapsule {
        let (a, b) = (Point3::new(x, -0.2, 2.0), Point3::new(x, 0.2, 2.0));
        TaperedCapsule { a, b, radius_a: 0.1, radius_b: 0.1 }
    }

    fn painted(limbs: &[TaperedCapsule]) -> Mask {
        let mut mask = Mask::new(160, 120);
        CapsulePainter::new(&pinhole()).paint(limbs, &mut mask);
        mask
    }

    #[test]
    fn the_share_is_that_of_the_limbs_area_beside_the_silhouette() {
        let insides = LimbInsides::new(&pinhole(), &painted(&[limb(0.0)]));
        // the limb is 20 pixels wide: at 5 pixels aside a quarter of it is uncovered, in columns of samples a quarter
        let shares = [0.0, 0.05, 0.1, 0.5].map(|x| insides.share_missed(&[limb(x)]));
        assert_eq!(shares, [0.0, 0.25, 0.5, 1.0].map(Some));
    }

    #[test]
    fn a_limb_inside_the_trunk_costs_nothing_and_one_beyond_the_picture_costs_all() {
        let trunk = TaperedCapsule { radius_a: 0.3, radius_b: 0.3, ..limb(0.0) };
        let insides = LimbInsides::new(&pinhole(), &painted(&[trunk]));
        assert_eq!(insides.share_missed(&[limb(0.1)]), Some(0.0), "one-sided");
        assert_eq!(insides.share_missed(&[limb(50.0)]), Some(1.0));
        assert_eq!(insides.share_missed(&[]), Some(1.0));
        assert_eq!(LimbInsides::new(&pinhole(), &Mask::new(160, 120)).share_missed(&[limb(50.0)]), None);
    }

    #[test]
    fn what_the_edge_of_the_picture_cuts_off_has_no_say() {
        let cut = limb(0.8);
        let insides = LimbInsides::new(&pinhole(), &painted(&[cut]));
        assert!(painted(&[cut]).count() < painted(&[limb(0.0)]).count());
        assert_eq!(insides.share_missed(&[cut]), Some(0.0));
    }
}
