//! Ticks at round values along an axis.

/// At most `most` multiples of a round step (1, 2, 2.5 or 5 times a power of ten) within a range, with labels that have
/// the decimals of the step. Empty for a range that is empty or not finite.
pub(super) fn round_ticks(range: [f64; 2], most: u32) -> Vec<(f64, String)> {
    let [low, high] = range;
    if !(low.is_finite() && high.is_finite() && high > low) {
        return Vec::new();
    }
    let rough = ((high - low) / f64::from(most.max(2) - 1)).max(1e-9);
    let power = libm::floor(libm::log10(rough)) as i32;
    let scale = libm::pow(10.0, f64::from(power));
    // steps, each with its number of decimals beyond the power of ten
    let steps = [(1.0, 0), (2.0, 0), (2.5, 1), (5.0, 0), (10.0, -1)];
    // tolerance for rounding errors in a range that is a multiple of a step
    let fits = |(digits, _): &(f64, i32)| digits * scale >= rough * (1.0 - 1e-9);
    let (digits, more) = steps.into_iter().find(fits).unwrap_or((10.0, -1));
    let decimals = usize::try_from(more - power).unwrap_or(0);
    let values = multiples(range, digits * scale, most as usize + 1);
    // no negative zero
    values.into_iter().map(|value| value + 0.0).map(|value| (value, format!("{value:.decimals$}"))).collect()
}

/// Like [`round_ticks`], at whole numbers only.
pub(super) fn whole_ticks(range: [f64; 2], most: u32) -> Vec<(f64, String)> {
    let steps = (0..15).flat_map(|power| [1.0, 2.0, 5.0].map(|digit| digit * libm::pow(10.0, f64::from(power))));
    let fitting = steps.map(|step| multiples(range, step, most as usize + 1));
    let ticks = fitting.into_iter().find(|ticks| ticks.len() <= most.max(1) as usize).unwrap_or_default();
    ticks.into_iter().map(|value| (value, format!("{value:.0}"))).collect()
}

fn multiples([low, high]: [f64; 2], step: f64, most: usize) -> Vec<f64> {
    let first = libm::ceil(low / step - 1e-9);
    let all = (0..most).map(|count| (first + count as f64) * step);
    all.take_while(|value| *value <= high + 1e-9 * step).collect()
}

/// At most `most` round values whose exponents of ten lie within a range: powers of ten if there are at least three,
/// else 1, 2 and 5 times powers of ten, else all digits, else multiples of a round step.
pub(super) fn log_ticks(exponents: [f64; 2], most: usize) -> Vec<f64> {
    let [low, high] = exponents.map(|exponent| libm::pow(10.0, exponent));
    let of_digits = |digits: &[f64]| -> Vec<f64> {
        let powers = libm::floor(exponents[0]) as i32..=libm::ceil(exponents[1]) as i32;
        let all = powers.flat_map(|power| digits.iter().map(move |digit| digit * libm::pow(10.0, f64::from(power))));
        all.filter(|value| (low * (1.0 - 1e-9)..=high * (1.0 + 1e-9)).contains(value)).collect()
    };
    let mut kinds = vec![of_digits(&[1.0]), of_digits(&[1.0, 2.0, 5.0])];
    kinds.push(of_digits(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0]));
    let rough = (high - low) / 4.0;
    let power = libm::pow(10.0, libm::floor(libm::log10(rough.max(f64::MIN_POSITIVE))));
    let steps = [1.0, 2.0, 5.0, 10.0].map(|step| multiples([low, high], step * power, most + 1));
    let linear = steps.into_iter().find(|ticks| ticks.len() <= most).unwrap_or_default();
    kinds.push(linear.into_iter().filter(|value| *value > 0.0).collect());
    let enough = |ticks: &&Vec<f64>| ticks.len() >= 3 && ticks.len() <= most;
    if let Some(ticks) = kinds.iter().find(enough) {
        return ticks.clone();
    }
    let fitting = kinds.iter().filter(|ticks| ticks.len() <= most);
    match fitting.max_by_key(|ticks| ticks.len()).filter(|ticks| !ticks.is_empty()) {
        Some(ticks) => ticks.clone(),
        // too many powers of ten
        None => kinds[0].iter().copied().step_by(kinds[0].len().div_ceil(most.max(1)).max(1)).collect(),
    }
}

/// The power of ten with this exponent, to three digits.
pub(super) fn power_of_ten(exponent: f64) -> String {
    let value = libm::pow(10.0, exponent);
    let step = libm::pow(10.0, libm::floor(exponent) - 2.0);
    let rounded = (1000.0 * (value / step).round() * step).round() / 1000.0;
    format!("{}", rounded + 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(range: [f64; 2]) -> String {
        round_ticks(range, 6).into_iter().map(|(_, words)| words).collect::<Vec<_>>().join(" ")
    }

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
    fn labels_equal_the_values_which_lie_within_the_range() {
        for (low, high) in [(0.0, 10.8), (2.0, 2.3), (0.0, 7.7e5), (-1e-4, 3e-4), (0.1, 0.7)] {
            let ticks = round_ticks([low, high], 6);
            assert!((3..=6).contains(&ticks.len()), "{low} {high}: {ticks:?}");
            for (value, words) in ticks {
                let written: f64 = words.parse().unwrap();
                assert!((written - value).abs() <= 1e-9 * (high - low), "{words} for {value}");
                assert!(value >= low - 1e-9 * (high - low) && value <= high + 1e-9 * (high - low), "{value}");
            }
        }
        assert!([[1.0, 1.0], [2.0, 1.0], [0.0, f64::NAN]].map(|range| round_ticks(range, 6)).iter().all(Vec::is_empty));
    }

    fn logarithmic(low: f64, high: f64, most: usize) -> Vec<f64> {
        log_ticks([low, high].map(libm::log10), most)
    }

    fn close(found: &[f64], expected: &[f64]) {
        let same = found.len() == expected.len() && found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6 * b);
        assert!(same, "{found:?} {expected:?}");
    }

    #[test]
    fn a_logarithmic_axis_has_ticks_at_round_values() {
        close(&logarithmic(380.0, 820.0, 6), &[400.0, 500.0, 600.0, 700.0, 800.0]);
        close(&logarithmic(43.0, 1162.0, 6), &[50.0, 100.0, 200.0, 500.0, 1000.0]);
        close(&logarithmic(112.0, 228.0, 7), &[120.0, 140.0, 160.0, 180.0, 200.0, 220.0]);
        close(&logarithmic(3.0, 3e5, 8), &[10.0, 100.0, 1000.0, 1e4, 1e5]);
        close(&logarithmic(408.0, 436.0, 6), &[410.0, 415.0, 420.0, 425.0, 430.0, 435.0]);
        assert!(logarithmic(1e-9, 1e9, 5).len() <= 5);
        let words = [415.0, 3.2, 1e5, 0.05].map(|value| power_of_ten(libm::log10(value)));
        assert_eq!(words, ["415", "3.2", "100000", "0.05"]);
    }
}
