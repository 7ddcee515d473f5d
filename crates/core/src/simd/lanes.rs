//! Sums and exponentials over columns, in SIMD lanes.
//!
//! A sum is kept as eight partial sums, because floating-point addition may not be reordered: a single running sum
//! would compile to sequential additions. The partial sums are added in a fixed order, so every instruction set gives
//! the same bits.

/// Lanes of a sum: two registers of four.
const LANES: usize = 8;

/// Dot product.
#[inline(always)]
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    let ((a_lanes, a_rest), (b_lanes, b_rest)) = (a.as_chunks::<LANES>(), b.as_chunks::<LANES>());
    let mut sums = [0.0; LANES];
    for (a, b) in a_lanes.iter().zip(b_lanes) {
        for lane in 0..LANES {
            sums[lane] += a[lane] * b[lane];
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    sums.iter().sum::<f64>() + rest
}

/// Sum.
#[inline(always)]
pub fn sum(a: &[f64]) -> f64 {
    let (lanes, rest) = a.as_chunks::<LANES>();
    let mut sums = [0.0; LANES];
    for a in lanes {
        for lane in 0..LANES {
            sums[lane] += a[lane];
        }
    }
    sums.iter().sum::<f64>() + rest.iter().sum::<f64>()
}

/// `target += factor * values`.
#[inline(always)]
pub fn add_scaled(target: &mut [f64], factor: f64, values: &[f64]) {
    for (target, value) in target.iter_mut().zip(values) {
        *target += factor * value;
    }
}

/// Replaces every value by `amplitude * exp(value)`, for values up to zero; values below -708 are clamped to -708.
///
/// Cody and Waite's reduction by multiples of ln 2, then the Taylor polynomial of degree 13, whose remainder is below
/// 1e-17 there: the result is within 2 units in the last place. NaN stays NaN.
#[inline(always)]
pub fn scaled_exponentials(values: &mut [f64], amplitude: f64) {
    /// Adding it rounds to an integer, which is then in the lowest bits.
    const ROUND: f64 = 6_755_399_441_055_744.0;
    const LN_2_HIGH: f64 = 6.931_471_803_691_238e-1;
    const LN_2_LOW: f64 = 1.908_214_929_270_587_7e-10;
    for value in values {
        let x = if *value < -708.0 { -708.0 } else { *value };
        let shifted = x * std::f64::consts::LOG2_E + ROUND;
        let whole = shifted - ROUND;
        let rest = (x - whole * LN_2_HIGH) - whole * LN_2_LOW;
        let mut series = INVERSE_FACTORIALS[13];
        for term in (0..13).rev() {
            series = series * rest + INVERSE_FACTORIALS[term];
        }
        let power = f64::from_bits(shifted.to_bits().wrapping_add(1023) << 52);
        *value = amplitude * (series * power);
    }
}

const INVERSE_FACTORIALS: [f64; 14] = {
    let mut inverse = [1.0; 14];
    let (mut n, mut factorial) = (1, 1.0);
    while n < 14 {
        factorial *= n as f64;
        inverse[n] = 1.0 / factorial;
        n += 1;
    }
    inverse
};

#[cfg(test)]
mod tests {
    use super::super::{Dispatched, dispatch};
    use super::*;

    struct Exponentials<'a>(&'a mut [f64]);

    impl Dispatched for Exponentials<'_> {
        type Output = ();

        #[inline(always)]
        fn work(self) {
            scaled_exponentials(self.0, 1.0);
        }
    }

    #[test]
    fn exponentials_match_the_library_to_the_last_digits_on_every_build() {
        let exponents: Vec<f64> =
            (0..7080).map(|i| -0.1 * f64::from(i) - 0.0123).chain([0.0, -1e-300, -707.9]).collect();
        let (mut here, mut baseline) = (exponents.clone(), exponents.clone());
        dispatch(Exponentials(&mut here));
        scaled_exponentials(&mut baseline, 1.0);
        for ((x, a), b) in exponents.iter().zip(&here).zip(&baseline) {
            assert_eq!(a.to_bits(), b.to_bits());
            assert!((a / x.exp() - 1.0).abs() < 5e-16, "exp({x}) = {a}");
        }
        assert_eq!(here[exponents.len() - 3], 1.0);
        let mut odd = [f64::NAN, f64::NEG_INFINITY, -1e9];
        dispatch(Exponentials(&mut odd));
        assert!(odd[0].is_nan() && odd[1] < 1e-307 && odd[2] < 1e-307);
    }

    #[test]
    fn sums_include_lanes_and_remainder() {
        let a: Vec<f64> = (0..19).map(f64::from).collect();
        assert_eq!(sum(&a), 171.0);
        assert_eq!(dot(&a, &a), 2109.0);
        let mut b = a.clone();
        add_scaled(&mut b, 2.0, &a);
        assert!(b.iter().zip(&a).all(|(b, a)| *b == 3.0 * a));
    }
}
