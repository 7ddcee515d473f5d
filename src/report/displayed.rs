//! Values with their units, as pages show them.

use crate::evaluation::{MetricSummary, Unit};

/// A displayed value: shares as percentages, others with suitable decimals.
pub(super) fn number(value: f64, unit: Unit) -> String {
    let decimals = match unit {
        Unit::Fraction | Unit::Millimetre | Unit::Pixel | Unit::Degree | Unit::Millisecond => 1,
        Unit::Second | Unit::MetrePerSecondSquared | Unit::BodyWeight => 2,
        Unit::MillimetrePerSecond | Unit::MetrePerSecondCubed => 0,
        Unit::Energy => 4,
    };
    let shown = if unit == Unit::Fraction { 100.0 * value } else { value };
    let text = format!("{shown:.decimals$}");
    if text.trim_start_matches(['-', '0', '.']).is_empty() { text.trim_start_matches('-').to_owned() } else { text }
}

pub(super) fn symbol(unit: Unit) -> &'static str {
    if unit == Unit::Fraction { "%" } else { unit.symbol() }
}

pub(super) fn between(low: f64, high: f64, unit: Unit) -> String {
    format!("{} to {}", number(low, unit), number(high, unit))
}

/// The interval of a metric, or why there is none: the same words on a page and in a picture.
pub(super) fn interval_in_words(metric: &MetricSummary) -> String {
    match metric.ci95 {
        Some(ends) => format!("95 %: {}", between(ends.low, ends.high, metric.unit)),
        None => metric.interval.clone(),
    }
}

/// With its sign; 0 has none.
pub(super) fn signed(value: f64, unit: Unit) -> String {
    let text = number(value, unit);
    if text.starts_with('-') || value == 0.0 { text } else { format!("+{text}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_zero_has_no_sign() {
        assert_eq!(number(0.98765, Unit::Fraction), "98.8");
        assert_eq!(number(-0.00001, Unit::Energy), "0.0000");
        assert_eq!(number(-0.25, Unit::Energy), "-0.2500");
    }
}
