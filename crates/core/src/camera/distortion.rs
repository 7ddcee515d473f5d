//! OpenCV's lens model and its inverse.

/// OpenCV's radial-tangential lens distortion, `k1 k2 p1 p2 k3`; all zero is an ideal lens.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Distortion {
    /// First radial coefficient.
    pub k1: f64,
    /// Second radial coefficient.
    pub k2: f64,
    /// First tangential coefficient.
    pub p1: f64,
    /// Second tangential coefficient.
    pub p2: f64,
    /// Third radial coefficient.
    pub k3: f64,
}

/// Newton steps before [`Distortion::undistort`] gives up.
const MAX_STEPS: usize = 50;

/// Greatest error of the inverse, in normalised coordinates.
const TOLERANCE: f64 = 1e-12;

/// Number of points between the image centre and a solution that are checked for a fold of the lens model.
const FOLD_CHECKS: u32 = 16;

impl Distortion {
    /// From OpenCV's `distCoeffs` with five coefficients.
    pub fn from_coefficients([k1, k2, p1, p2, k3]: [f64; 5]) -> Self {
        Self { k1, k2, p1, p2, k3 }
    }

    /// In OpenCV's order, `k1 k2 p1 p2 k3`.
    #[inline]
    pub fn coefficients(&self) -> [f64; 5] {
        [self.k1, self.k2, self.p1, self.p2, self.k3]
    }

    /// Distorts normalised image coordinates (x/z, y/z), as OpenCV documents for `projectPoints`.
    #[inline]
    pub fn apply(&self, x: f64, y: f64) -> (f64, f64) {
        let r2 = x * x + y * y;
        let radial = 1.0 + r2 * (self.k1 + r2 * (self.k2 + r2 * self.k3));
        (
            x * radial + 2.0 * self.p1 * x * y + self.p2 * (r2 + 2.0 * x * x),
            y * radial + self.p1 * (r2 + 2.0 * y * y) + 2.0 * self.p2 * x * y,
        )
    }

    /// The inverse of [`Self::apply`] on the region around the image centre where the distortion is one-to-one; `None`
    /// if no point there is distorted to `(x, y)`. Newton's method, to 1e-12.
    pub fn undistort(&self, x: f64, y: f64) -> Option<(f64, f64)> {
        if self.is_none() {
            return (x.is_finite() && y.is_finite()).then_some((x, y));
        }
        let (mut u, mut v) = (x, y);
        for _ in 0..MAX_STEPS {
            let (du, dv) = self.apply(u, v);
            let (ex, ey) = (x - du, y - dv);
            let [xu, xv, yu, yv] = self.jacobian(u, v);
            let determinant = xu * yv - xv * yu;
            if ex.abs().max(ey.abs()) <= TOLERANCE {
                return self.is_before_fold(u, v).then_some((u, v));
            }
            // Outside the fold Newton's method diverges; a step towards the centre recovers it.
            if determinant > 1e-3 {
                u += (yv * ex - xv * ey) / determinant;
                v += (xu * ey - yu * ex) / determinant;
            } else {
                u *= 0.5;
                v *= 0.5;
            }
        }
        None
    }

    /// Whether the lens is ideal.
    #[inline]
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// Partial derivatives of [`Self::apply`]: `[dx'/dx, dx'/dy, dy'/dx, dy'/dy]`.
    fn jacobian(&self, x: f64, y: f64) -> [f64; 4] {
        let r2 = x * x + y * y;
        let radial = 1.0 + r2 * (self.k1 + r2 * (self.k2 + r2 * self.k3));
        let slope = 2.0 * (self.k1 + r2 * (2.0 * self.k2 + 3.0 * r2 * self.k3));
        let mixed = x * y * slope + 2.0 * self.p1 * x + 2.0 * self.p2 * y;
        [
            radial + x * x * slope + 2.0 * self.p1 * y + 6.0 * self.p2 * x,
            mixed,
            mixed,
            radial + y * y * slope + 6.0 * self.p1 * y + 2.0 * self.p2 * x,
        ]
    }

    /// Whether the lens model preserves orientation from the centre to normalised `(x, y)`; beyond the fold it does
    /// not.
    pub fn is_before_fold(&self, x: f64, y: f64) -> bool {
        // an upper bound of the norm of the Jacobian minus the unit matrix, from the centre up to here
        let r = x.hypot(y);
        let r2 = r * r;
        let radial = r2 * (3.0 * self.k1.abs() + r2 * (5.0 * self.k2.abs() + r2 * 7.0 * self.k3.abs()));
        if radial + 8.0 * r * (self.p1.abs() + self.p2.abs()) < 0.99 {
            return true;
        }
        (1..=FOLD_CHECKS).all(|i| {
            let s = f64::from(i) / f64::from(FOLD_CHECKS);
            let [a, b, c, d] = self.jacobian(s * x, s * y);
            a * d - b * c > 0.0
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const BARREL: Distortion = Distortion { k1: -0.35, k2: 0.18, p1: 0.004, p2: -0.003, k3: -0.05 };

    proptest! {
        #[test]
        fn undistort_is_the_inverse_of_apply(
            k1 in -0.2..0.3_f64, k2 in -0.05..0.1_f64, p1 in -0.01..0.01_f64, p2 in -0.01..0.01_f64,
            x in -0.7..0.7_f64, y in -0.6..0.6_f64,
        ) {
            let lens = Distortion { k1, k2, p1, p2, k3: 0.01 };
            let (u, v) = lens.apply(x, y);
            let (x2, y2) = lens.undistort(u, v).expect("the lens is one to one here");
            prop_assert!((x2 - x).abs() < 1e-10 && (y2 - y).abs() < 1e-10);
        }

        #[test]
        fn what_is_quickly_found_before_the_fold_is_so_at_every_check(
            k1 in -0.5..0.5_f64, k2 in -0.3..0.3_f64, p1 in -0.05..0.05_f64, k3 in -0.2..0.2_f64,
            x in -1.2..1.2_f64, y in -1.2..1.2_f64,
        ) {
            let lens = Distortion { k1, k2, p1, p2: -0.5 * p1, k3 };
            let is_positive = |i: u32| {
                let [a, b, c, d] = lens.jacobian(x * f64::from(i) / 16.0, y * f64::from(i) / 16.0);
                a * d - b * c > 0.0
            };
            prop_assert_eq!(lens.is_before_fold(x, y), (1..=16).all(is_positive));
        }

        #[test]
        fn the_result_of_undistort_is_distorted_back(x in -3.0..3.0_f64, y in -3.0..3.0_f64) {
            if let Some((u, v)) = BARREL.undistort(x, y) {
                let (x2, y2) = BARREL.apply(u, v);
                prop_assert!((x2 - x).abs() < 1e-11 && (y2 - y).abs() < 1e-11);
            }
        }
    }

    #[test]
    fn the_jacobian_agrees_with_finite_differences() {
        let (x, y, h) = (0.31, -0.22, 1e-6);
        let ((ax, ay), (bx, by)) = (BARREL.apply(x + h, y), BARREL.apply(x - h, y));
        let ((cx, cy), (dx, dy)) = (BARREL.apply(x, y + h), BARREL.apply(x, y - h));
        let numeric = [(ax - bx), (cx - dx), (ay - by), (cy - dy)].map(|d| d / (2.0 * h));
        for (exact, numeric) in BARREL.jacobian(x, y).into_iter().zip(numeric) {
            assert!((exact - numeric).abs() < 1e-9);
        }
    }

    #[test]
    fn points_outside_a_barrel_lens_have_no_inverse() {
        let lens = Distortion { k1: -0.3, ..Distortion::default() };
        // r (1 - 0.3 r^2) has its maximum at r = 1.054, where it is 0.7027.
        assert!(lens.undistort(0.70, 0.0).is_some());
        assert_eq!(lens.undistort(0.71, 0.0), None);
        assert_eq!(lens.undistort(f64::NAN, 0.0), None);
    }
}
