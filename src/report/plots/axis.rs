//! Where an axis has its ticks.

use std::ops::Range;

use plotters::coord::ranged1d::{DefaultFormatting, KeyPointHint, Ranged};
use plotters::coord::types::RangedCoordf64;

use super::short_number::short;

/// An axis of a plot.
#[derive(Clone, Debug)]
pub(in crate::report) struct PlotAxis {
    ends: [f64; 2],
    ticks: Ticks,
}

#[derive(Clone, Copy, Debug)]
enum Ticks {
    /// At any round number.
    Round,
    /// At whole numbers alone: there is no half camera.
    Whole,
    /// At the logarithms of round numbers; the axis counts exponents of ten.
    Logarithmic,
}

impl PlotAxis {
    /// From the first to the second value.
    pub(in crate::report) fn round([from, to]: [f64; 2]) -> Self {
        Self { ends: [from, to], ticks: Ticks::Round }
    }

    /// As [`Self::round`], with ticks at whole numbers where all values are whole.
    pub(in crate::report) fn from_values(ends: [f64; 2], mut values: impl Iterator<Item = f64>) -> Self {
        let ticks = if values.all(|value| value.fract() == 0.0) { Ticks::Whole } else { Ticks::Round };
        Self { ends, ticks }
    }

    /// From the first to the second exponent of ten.
    pub(in crate::report) fn logarithmic([from, to]: [f64; 2]) -> Self {
        Self { ends: [from, to], ticks: Ticks::Logarithmic }
    }

    fn increasing(&self) -> [f64; 2] {
        let [from, to] = self.ends;
        [from.min(to), from.max(to)]
    }
}

impl Ranged for PlotAxis {
    type FormatOption = DefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        RangedCoordf64::from(self.range()).map(value, limit)
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        match self.ticks {
            Ticks::Round => RangedCoordf64::from(self.range()).key_points(hint),
            Ticks::Whole => whole_ticks(self.increasing(), hint.max_num_points()),
            Ticks::Logarithmic => {
                log_ticks(self.increasing(), hint.max_num_points()).into_iter().map(libm::log10).collect()
            }
        }
    }

    fn range(&self) -> Range<f64> {
        self.ends[0]..self.ends[1]
    }
}

/// At most `most` whole multiples of 1, 2 or 5 times a power of ten within a range.
fn whole_ticks(range: [f64; 2], most: usize) -> Vec<f64> {
    let steps = (0..15).flat_map(|power| [1.0, 2.0, 5.0].map(|digit| digit * libm::pow(10.0, f64::from(power))));
    let fitting = steps.map(|step| multiples(range, step, most + 1)).find(|ticks| ticks.len() <= most.max(1));
    fitting.unwrap_or_default()
}

/// Multiples of a step within a range, no more than `most`.
fn multiples([low, high]: [f64; 2], step: f64, most: usize) -> Vec<f64> {
    let slack = 1e-9 * (high - low);
    let first = libm::ceil((low - slack) / step);
    let all = (0..most).map(|count| (first + count as f64) * step);
    all.take_while(|value| *value <= high + slack).collect()
}

/// At most `most` round values whose exponents of ten lie within a range: powers of ten where three or more are in it,
/// else 1, 2 and 5 times these, else all digits of them, else multiples of a round step.
pub(crate) fn log_ticks(exponents: [f64; 2], most: usize) -> Vec<f64> {
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
    let linear = multiples([low, high], if rough / power >= 5.0 { 5.0 * power } else { power }, most + 1);
    kinds.push(linear.into_iter().filter(|value| *value > 0.0).collect());
    let enough = |ticks: &&Vec<f64>| ticks.len() >= 3 && ticks.len() <= most;
    if let Some(ticks) = kinds.iter().find(enough) {
        return ticks.clone();
    }
    let fitting = kinds.iter().filter(|ticks| ticks.len() <= most);
    match fitting.max_by_key(|ticks| ticks.len()).filter(|ticks| !ticks.is_empty()) {
        Some(ticks) => ticks.clone(),
        // more powers of ten than there is room for
        None => kinds[0].iter().copied().step_by(kinds[0].len().div_ceil(most.max(1)).max(1)).collect(),
    }
}

/// The value of an exponent of ten, to three digits.
pub(super) fn power_of_ten(exponent: f64) -> String {
    let value = libm::pow(10.0, exponent);
    let step = libm::pow(10.0, libm::floor(exponent) - 2.0);
    short((value / step).round() * step)
}

#[cfg(test)]
mod tests {
    use super::*;
    use plotters::coord::ranged1d::BoldPoints;

    fn close(found: &[f64], expected: &[f64]) {
        let same = found.len() == expected.len() && found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6 * b);
        assert!(same, "{found:?} {expected:?}");
    }

    fn logarithmic(low: f64, high: f64, most: usize) -> Vec<f64> {
        log_ticks([low, high].map(libm::log10), most)
    }

    /// The ticks of old on a logarithmic axis were 400, 500, 630 and 790.
    #[test]
    fn a_logarithmic_axis_has_ticks_at_round_values() {
        close(&logarithmic(380.0, 820.0, 6), &[400.0, 500.0, 600.0, 700.0, 800.0]);
        close(&logarithmic(43.0, 1162.0, 6), &[50.0, 100.0, 200.0, 500.0, 1000.0]);
        close(&logarithmic(3.0, 3e5, 8), &[10.0, 100.0, 1000.0, 1e4, 1e5]);
        close(&logarithmic(408.0, 436.0, 6), &[410.0, 415.0, 420.0, 425.0, 430.0, 435.0]);
        assert!(logarithmic(1e-9, 1e9, 5).len() <= 5);
        assert_eq!(
            [415.0, 3.2, 1e5, 0.05].map(|value| power_of_ten(libm::log10(value))),
            ["415", "3.2", "100000", "0.05"]
        );
        let axis = PlotAxis::logarithmic([2.0, 3.0]);
        close(&axis.key_points(BoldPoints(6)), &[100.0_f64, 200.0, 500.0, 1000.0].map(libm::log10));
    }

    #[test]
    fn an_axis_of_whole_numbers_has_whole_ticks() {
        let ticks =
            |values: [f64; 2], most| PlotAxis::from_values(values, values.into_iter()).key_points(BoldPoints(most));
        assert_eq!(ticks([1.0, 4.0], 8), [1.0, 2.0, 3.0, 4.0], "no half cameras");
        assert_eq!(ticks([2.0, 3.0], 8), [2.0, 3.0]);
        assert_eq!(ticks([0.0, 240.0], 8), [0.0, 50.0, 100.0, 150.0, 200.0]);
        assert!(ticks([0.5, 4.0], 8).iter().any(|tick| tick.fract() != 0.0));
    }

    #[test]
    fn an_axis_that_runs_backwards_has_its_ticks_too() {
        assert_eq!(PlotAxis::from_values([4.0, 1.0], [1.0, 4.0].into_iter()).key_points(BoldPoints(5)).len(), 4);
    }
}
