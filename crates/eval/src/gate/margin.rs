//! How much a metric may worsen.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::Unit;

/// How much a metric may worsen: a number with its unit (`2mm`, `1.5deg`, `0.02`), or a share of the baseline's mean
/// (`5%`; percentage points for a metric that is itself a share).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "WrittenMargin", into = "String")]
pub struct Margin {
    value: f64,
    unit: MarginUnit,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum MarginUnit {
    None,
    Percent,
    Unit(Unit),
}

/// The form in files.
#[derive(Deserialize)]
#[serde(untagged, expecting = "expected a number of 0 or more with its unit, as in \"2mm\", \"1.5deg\" or \"1%\"")]
enum WrittenMargin {
    Number(f64),
    Text(String),
}

/// Why a margin cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MarginError {
    /// Not a number with a unit.
    #[error("margin `{0}`: expected a number of 0 or more with its unit, as in 2mm, 1.5deg, 0.02 or 5%")]
    Malformed(String),
    /// A negative number.
    #[error(
        "margin `{0}`: a margin is how much worse a run may be, for errors and for scores, so it must be 0 or more"
    )]
    Negative(String),
    /// It does not fit the metric.
    #[error("{0}")]
    Unfit(String),
}

/// Units as written, with their factors to the metric's unit.
const UNITS: [(&str, Unit, f64); 12] = [
    ("mm", Unit::Millimetre, 1.0),
    ("px", Unit::Pixel, 1.0),
    ("cm", Unit::Millimetre, 10.0),
    ("m", Unit::Millimetre, 1000.0),
    ("deg", Unit::Degree, 1.0),
    ("°", Unit::Degree, 1.0),
    ("mm/s", Unit::MillimetrePerSecond, 1.0),
    ("m/s", Unit::MillimetrePerSecond, 1000.0),
    ("m/s^2", Unit::MetrePerSecondSquared, 1.0),
    ("m/s^3", Unit::MetrePerSecondCubed, 1.0),
    ("s", Unit::Second, 1.0),
    ("ms", Unit::Millisecond, 1.0),
];

impl FromStr for Margin {
    type Err = MarginError;

    fn from_str(text: &str) -> Result<Self, MarginError> {
        let malformed = || MarginError::Malformed(text.chars().take(40).collect());
        let trimmed = text.trim();
        if trimmed.strip_prefix('-').is_some_and(|rest| rest.parse::<Self>().is_ok()) {
            return Err(MarginError::Negative(text.chars().take(40).collect()));
        }
        let end = trimmed.find(|c: char| !(c.is_ascii_digit() || c == '.')).unwrap_or(trimmed.len());
        let (number, unit) = (&trimmed[..end], trimmed[end..].trim());
        let value: f64 = number.parse().map_err(|_| malformed())?;
        let (factor, unit) = match unit {
            "" => (1.0, MarginUnit::None),
            "%" => (0.01, MarginUnit::Percent),
            name => {
                let known = UNITS.iter().find(|(known, ..)| *known == name);
                known.map(|(_, unit, factor)| (*factor, MarginUnit::Unit(*unit))).ok_or_else(malformed)?
            }
        };
        let value = value * factor;
        if value.is_finite() { Ok(Self { value, unit }) } else { Err(malformed()) }
    }
}

impl TryFrom<WrittenMargin> for Margin {
    type Error = MarginError;

    fn try_from(written: WrittenMargin) -> Result<Self, MarginError> {
        match written {
            WrittenMargin::Text(text) => text.parse(),
            WrittenMargin::Number(value) if value.is_finite() && value >= 0.0 => {
                Ok(Self { value, unit: MarginUnit::None })
            }
            WrittenMargin::Number(value) if value < 0.0 => Err(MarginError::Negative(value.to_string())),
            WrittenMargin::Number(value) => Err(MarginError::Malformed(value.to_string())),
        }
    }
}

impl From<Margin> for String {
    fn from(margin: Margin) -> Self {
        margin.to_string()
    }
}

impl fmt::Display for Margin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.unit {
            MarginUnit::None => write!(f, "{}", self.value),
            MarginUnit::Percent => write!(f, "{} %", 100.0 * self.value),
            MarginUnit::Unit(unit) => write!(f, "{} {}", self.value, unit.symbol()),
        }
    }
}

impl Margin {
    /// A number in the metric's unit.
    pub(super) const fn from_number(value: f64) -> Self {
        Self { value, unit: MarginUnit::None }
    }

    /// The margin in the metric's unit; `base` is the baseline's mean.
    ///
    /// # Errors
    /// [`MarginError::Unfit`] if the unit does not fit the metric, a length has none, or the margin of a share is a
    /// number of 1 or more.
    pub fn resolve(&self, metric: &str, unit: Unit, base: f64) -> Result<f64, MarginError> {
        let unfit = |why: String| Err(MarginError::Unfit(format!("margin {self} of {metric}: {why}")));
        match self.unit {
            MarginUnit::None if unit == Unit::Fraction && self.value >= 1.0 => {
                unfit(format!("it is a share, from 0 to 1; did you mean {self}%?"))
            }
            // 0.005 may be metres
            MarginUnit::None if unit == Unit::Millimetre && self.value > 0.0 => {
                unfit(format!("expected a number with its unit, as in {self}mm, or a percentage"))
            }
            MarginUnit::None => Ok(self.value),
            MarginUnit::Percent if unit == Unit::Fraction => Ok(self.value),
            MarginUnit::Percent => Ok(self.value * base.abs()),
            MarginUnit::Unit(given) if given == unit => Ok(self.value),
            MarginUnit::Unit(_) => {
                let symbol = if unit.symbol().is_empty() { "a number without a unit" } else { unit.symbol() };
                unfit(format!("expected {symbol}, or a percentage"))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn margin(text: &str, unit: Unit, base: f64) -> f64 {
        text.parse::<Margin>().unwrap().resolve("x", unit, base).unwrap()
    }

    #[test]
    fn a_percentage_is_relative_to_the_baseline_unless_the_metric_is_a_share() {
        assert_eq!(margin("2mm", Unit::Millimetre, 30.0), 2.0);
        assert_eq!(margin("0.2 cm", Unit::Millimetre, 30.0), 2.0);
        assert_eq!(margin("2", Unit::Degree, 30.0), 2.0);
        assert_eq!(margin("5%", Unit::Millimetre, 30.0), 1.5);
        assert_eq!(margin("5%", Unit::Fraction, 0.9), 0.05);
        assert_eq!(margin("0mm", Unit::Millimetre, 30.0), 0.0);
    }

    #[test]
    fn the_margin_of_a_share_is_below_one_and_of_a_length_has_a_unit() {
        let resolved = |text: &str, unit| text.parse::<Margin>().unwrap().resolve("pck150", unit, 0.9);
        assert_eq!(resolved("0.02", Unit::Fraction), Ok(0.02));
        assert_eq!(resolved("2%", Unit::Fraction), Ok(0.02));
        let refused = resolved("2", Unit::Fraction).unwrap_err().to_string();
        assert_eq!(refused, "margin 2 of pck150: it is a share, from 0 to 1; did you mean 2%?");
        assert!(resolved("1", Unit::Fraction).is_err());
        assert_eq!(resolved("2", Unit::Degree), Ok(2.0));
        assert_eq!(resolved("0", Unit::Millimetre), Ok(0.0));
        let refused = resolved("2", Unit::Millimetre).unwrap_err().to_string();
        assert_eq!(refused, "margin 2 of pck150: expected a number with its unit, as in 2mm, or a percentage");
    }

    #[test]
    fn a_margin_of_a_wrong_type_is_refused_with_the_expected_form() {
        let refused = serde_json::from_str::<Margin>("[2]").unwrap_err().to_string();
        assert!(refused.contains("expected a number of 0 or more with its unit"), "{refused}");
        assert!(!refused.contains("untagged"), "{refused}");
    }

    #[test]
    fn invalid_margins_are_refused() {
        for text in ["", "mm", "-2mm", "2 parsecs", "1e999", "NaN", "2furlongs", "infmm", "1..2"] {
            assert!(text.parse::<Margin>().is_err(), "{text}");
        }
        for text in ["-2mm", " -0.02", "-5%", "-2 mm"] {
            let refused = text.parse::<Margin>().unwrap_err();
            assert_eq!(refused, MarginError::Negative(text.to_owned()), "{text}");
            assert!(refused.to_string().ends_with(", so it must be 0 or more"), "{refused}");
        }
        let refused = serde_json::from_str::<Margin>("-2").unwrap_err().to_string();
        assert!(refused.starts_with("margin `-2`: ") && refused.contains("must be 0 or more"), "{refused}");
        let other = "2deg".parse::<Margin>().unwrap().resolve("humaneva_mm", Unit::Millimetre, 30.0).unwrap_err();
        assert_eq!(other.to_string(), "margin 2 ° of humaneva_mm: expected mm, or a percentage");
    }
}
