//! Forces and moments at the root.

use nalgebra::Vector3;

/// A force at the root link's centre of mass and a moment, world, N and N m.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Wrench {
    pub(super) force: Vector3<f64>,
    pub(super) moment: Vector3<f64>,
}

impl Wrench {
    /// The norm of its force and of its moment divided by a lever (metres), newtons.
    pub(super) fn size(&self, lever: f64) -> f64 {
        libm::sqrt(self.product(self, lever))
    }

    pub(super) fn scaled(&self, by: f64) -> Self {
        Self { force: self.force * by, moment: self.moment * by }
    }

    /// The sum of two wrenches.
    pub(super) fn and(&self, other: &Self) -> Self {
        Self { force: self.force + other.force, moment: self.moment + other.moment }
    }

    /// The greatest share of `other`, 0 to 1, that can be added without exceeding `bound`, newtons; the wrench itself
    /// must not exceed it.
    pub(super) fn room(&self, other: &Self, lever: f64, bound: f64) -> f64 {
        let (own, mixed, theirs) = (self.product(self, lever), self.product(other, lever), other.product(other, lever));
        if own + 2.0 * mixed + theirs <= bound * bound || theirs <= 0.0 {
            return 1.0;
        }
        let root = libm::sqrt((mixed * mixed + theirs * (bound * bound - own)).max(0.0));
        ((root - mixed) / theirs).clamp(0.0, 1.0)
    }

    fn product(&self, other: &Self, lever: f64) -> f64 {
        self.force.dot(&other.force) + self.moment.dot(&other.moment) / (lever * lever)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rest_of_the_bound_is_used_and_no_more() {
        let wrench = |force: f64, moment: f64| Wrench { force: Vector3::x() * force, moment: Vector3::y() * moment };
        // a lever of 2 m: a moment of 8 N m counts as 4 N
        assert!((wrench(3.0, 8.0).size(2.0) - 5.0).abs() < 1e-12);
        assert_eq!(wrench(3.0, 0.0).room(&wrench(1.0, 0.0), 2.0, 5.0), 1.0, "all of it fits");
        assert!((wrench(3.0, 0.0).room(&wrench(8.0, 0.0), 2.0, 5.0) - 0.25).abs() < 1e-12);
        let (base, other) = (wrench(3.0, 2.0), wrench(-5.0, 40.0));
        let share = base.room(&other, 2.0, 6.0);
        assert!(share > 0.0 && (base.and(&other.scaled(share)).size(2.0) - 6.0).abs() < 1e-12, "{share}");
        assert_eq!(wrench(5.0, 0.0).room(&wrench(1.0, 0.0), 2.0, 5.0), 0.0, "nothing is left");
        assert_eq!(wrench(0.0, 0.0).room(&Wrench::default(), 2.0, 0.0), 1.0);
    }
}
