//! Round values along an axis of a picture.

/// Values that are whole multiples of a round step (1, 2, 2.5 or 5 times a power of ten) within a range, about five,
/// each with its words: all with the decimals that the step needs. None of a range that is empty or not finite.
pub(crate) fn round_ticks([low, high]: [f64; 2]) -> Vec<(f64, String)> {
    if !(low.is_finite() && high.is_finite() && high > low) {
        return Vec::new();
    }
    let rough = ((high - low) / 5.0).max(1e-9);
    let power = libm::floor(libm::log10(rough)) as i32;
    let scale = libm::pow(10.0, f64::from(power));
    // a step with a decimal more than its power has
    let steps = [(1.0, 0), (2.0, 0), (2.5, 1), (5.0, 0), (10.0, -1)];
    // what rounding leaves of a range that a step divides is no other step
    let fits = |(digits, _): &(f64, i32)| digits * scale >= rough * (1.0 - 1e-9);
    let (digits, more) = steps.into_iter().find(fits).unwrap_or((10.0, -1));
    let decimals = usize::try_from(more - power).unwrap_or(0);
    let step = digits * scale;
    let first = libm::ceil(low / step - 1e-9);
    let within = |value: &f64| *value <= high + 1e-9 * step;
    let values = (0_u8..12).map(|count| (first + f64::from(count)) * step).take_while(within);
    // no negative zero
    values.map(|value| value + 0.0).map(|value| (value, format!("{value:.decimals$}"))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(range: [f64; 2]) -> String {
        round_ticks(range).into_iter().map(|(_, words)| words).collect::<Vec<_>>().join(" ")
    }

    /// They were 0, 3, 5, 8 and 11: quarters of the range, rounded when they were written.
    #[test]
    fn ticks_are_multiples_of_a_round_step_with_the_decimals_that_it_needs() {
        assert_eq!(words([0.0, 10.8]), "0.0 2.5 5.0 7.5 10.0");
        assert_eq!(words([0.0, 97.0]), "0 20 40 60 80");
        assert_eq!(words([0.0, 1.0]), "0.0 0.2 0.4 0.6 0.8 1.0");
        assert_eq!(words([0.0, 120.0]), "0 25 50 75 100");
        assert_eq!(words([0.0, 43.0]), "0 10 20 30 40");
        assert_eq!(words([0.003, 0.0041]), "0.00300 0.00325 0.00350 0.00375 0.00400");
        assert_eq!(words([-7.0, 3.0]), "-6 -4 -2 0 2");
        assert_eq!(words([0.0, 1234.0]), "0 250 500 750 1000");
    }

    #[test]
    fn what_is_written_is_the_value_itself_and_none_is_outside_of_the_range() {
        for (low, high) in [(0.0, 10.8), (2.0, 2.3), (0.0, 7.7e5), (-1e-4, 3e-4), (0.1, 0.7)] {
            let ticks = round_ticks([low, high]);
            assert!((3..=6).contains(&ticks.len()), "{low} {high}: {ticks:?}");
            for (value, words) in ticks {
                let written: f64 = words.parse().unwrap();
                assert!((written - value).abs() <= 1e-9 * (high - low), "{words} for {value}");
                assert!(value >= low - 1e-9 * (high - low) && value <= high + 1e-9 * (high - low), "{value}");
            }
        }
        assert!([[1.0, 1.0], [2.0, 1.0], [0.0, f64::NAN]].map(round_ticks).iter().all(Vec::is_empty));
    }
}
