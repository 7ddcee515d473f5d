//! Formats values and units for pages.

use skiagraph_eval::Unit;

/// Formats a value: shares as percentages, others with decimals that suit the unit.
pub fn number(value: f64, unit: Unit) -> String {
    with_decimals(value, unit, decimals(unit))
}

/// Formats a value with enough decimals for two significant digits of `least`, a small difference, and no fewer than
/// the unit has, so that a nonzero difference is never shown as 0.0.
pub(super) fn number_to(value: f64, unit: Unit, least: f64) -> String {
    let least = if unit == Unit::Fraction { 100.0 * least } else { least }.abs();
    let needed = if least > 0.0 && least.is_finite() { 1.0 - libm::floor(libm::log10(least)) } else { 0.0 };
    // below a millionth, a difference is due to rounding
    with_decimals(value, unit, decimals(unit).max(if needed <= 6.0 { needed.max(0.0) as usize } else { 0 }))
}

fn decimals(unit: Unit) -> usize {
    match unit {
        Unit::Fraction | Unit::Millimetre | Unit::Pixel | Unit::Degree | Unit::Millisecond => 1,
        Unit::Second | Unit::MetrePerSecondSquared | Unit::BodyWeight => 2,
        Unit::MillimetrePerSecond | Unit::MetrePerSecondCubed => 0,
        Unit::Energy => 4,
    }
}

fn with_decimals(value: f64, unit: Unit, decimals: usize) -> String {
    let shown = if unit == Unit::Fraction { 100.0 * value } else { value };
    let text = format!("{shown:.decimals$}");
    if text.trim_start_matches(['-', '0', '.']).is_empty() { text.trim_start_matches('-').to_owned() } else { text }
}

/// The sign of a unit; `%` for fractions, which are shown as percentages.
pub fn symbol(unit: Unit) -> &'static str {
    if unit == Unit::Fraction { "%" } else { unit.symbol() }
}

/// Both ends of an interval in one unit, as `4.2 to 5.1`.
pub fn between(low: f64, high: f64, unit: Unit) -> String {
    format!("{} to {}", number(low, unit), number(high, unit))
}

/// Like [`between`], with the decimals of [`number_to`].
pub(super) fn between_to(low: f64, high: f64, unit: Unit, least: f64) -> String {
    format!("{} to {}", number_to(low, unit, least), number_to(high, unit, least))
}

/// Formats a value with its sign and the decimals of [`number_to`]; 0 has no sign.
pub(super) fn signed_to(value: f64, unit: Unit, least: f64) -> String {
    let text = number_to(value, unit, least);
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

    #[test]
    fn a_small_difference_has_two_digits_and_a_rounding_error_has_none() {
        let shown = |value: f64| signed_to(value, Unit::Millimetre, value);
        assert_eq!([0.0312, -0.0042, 4.25, 0.0].map(shown), ["+0.031", "-0.0042", "+4.2", "0.0"]);
        assert_eq!([0.55, 0.99, 12.0].map(shown), ["+0.55", "+0.99", "+12.0"]);
        assert_eq!(shown(1e-13), "+0.0", "a rounding error");
        assert_eq!(number_to(0.2, Unit::Millimetre, 0.031), "0.200");
        assert_eq!(signed_to(0.000_31, Unit::Fraction, 0.000_31), "+0.031");
    }
}
