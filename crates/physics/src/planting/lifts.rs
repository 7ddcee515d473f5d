//! Lifts over time that are smooth and everywhere large enough.

/// A lift begins this long before it is needed and ends this long after, seconds.
const RISE_S: f64 = 0.2;

/// The lift of every frame: at least `needed` (metres, >= 0), zero if nothing is needed within twice `RISE_S`, and
/// smooth in between. `needed` is first dilated by `RISE_S` on either side (maximum) and then averaged twice over
/// `RISE_S`, so no average is below the needed value. With D the greatest of `needed`, the lift changes by at most D /
/// `RISE_S` a second, and that rate by at most 2 D / `RISE_S`^2 a second, except at the ends of the motion and for the
/// rounding to whole frames.
pub(super) fn smooth_lifts(needed: &[f64], frames_per_second: f64) -> Vec<f64> {
    let half = libm::round(0.5 * RISE_S * frames_per_second) as usize;
    let spread = over_windows(needed, 2 * half, |window| window.iter().copied().fold(0.0, f64::max));
    let mean = |window: &[f64]| window.iter().sum::<f64>() / window.len() as f64;
    over_windows(&over_windows(&spread, half, mean), half, mean)
}

/// Applies `value` to the window of `reach` frames on either side of every frame, truncated at the ends.
fn over_windows(values: &[f64], reach: usize, value: impl Fn(&[f64]) -> f64) -> Vec<f64> {
    let window = |frame: usize| &values[frame.saturating_sub(reach)..(frame + reach + 1).min(values.len())];
    (0..values.len()).map(|frame| value(window(frame))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn only_needed_lifts_are_made_and_a_dip_is_covered_smoothly() {
        assert_eq!(smooth_lifts(&[0.0; 50], 60.0), [0.0; 50]);
        assert!(smooth_lifts(&[], 60.0).is_empty());
        let mut needed = vec![0.0; 121];
        needed[60] = 0.08;
        let lifts = smooth_lifts(&needed, 60.0);
        assert!((lifts[60] - 0.08).abs() < 1e-12, "a lift is as great as needed, not greater");
        assert!(lifts[..36].iter().chain(&lifts[85..]).all(|lift| *lift == 0.0), "0.4 s away there is none");
        let rates: Vec<f64> = lifts.windows(2).map(|pair| (pair[1] - pair[0]) * 60.0).collect();
        let bound = 0.08 / RISE_S;
        assert!(rates.iter().all(|rate| rate.abs() <= bound + 1e-12), "{rates:?}");
        let changes = rates.windows(2).map(|pair| (pair[1] - pair[0]).abs() * 60.0).fold(0.0, f64::max);
        assert!(changes <= 2.0 * 0.08 / (RISE_S * RISE_S), "{changes} m/s^2");
    }

    proptest! {
        #[test]
        fn lifts_are_nowhere_too_small_nor_greater_than_the_greatest_needed(
            needed in prop::collection::vec(0.0..0.5_f64, 1..80),
            frames_per_second in 1.0..240.0_f64,
        ) {
            let greatest = needed.iter().copied().fold(0.0, f64::max);
            for (lift, needed) in smooth_lifts(&needed, frames_per_second).iter().zip(&needed) {
                prop_assert!(*lift >= needed - 1e-12 && *lift <= greatest + 1e-12);
            }
        }
    }
}
