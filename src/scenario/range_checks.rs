//! Building blocks of range checks.

use std::fmt::Display;
use std::ops::RangeInclusive;

use crate::input::excerpt;
use crate::motion_model::SettingError;

/// An invalid value.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct InvalidValue {
    /// Dotted key.
    pub key: String,
    /// What was expected and what was found.
    pub message: String,
}

pub(super) type RangeCheck = Result<(), InvalidValue>;

pub(super) fn setting(table: &str, e: &SettingError) -> InvalidValue {
    InvalidValue {
        key: format!("{table}.{}", e.key),
        message: format!("expected {}, found {}", e.expected, excerpt(&e.found)),
    }
}

pub(super) fn at_most(key: &str, found: usize, most: usize, what: &str) -> RangeCheck {
    require(key, found <= most, format_args!("at most {most} {what}"), found)
}

pub(super) fn within<T: PartialOrd + Display>(key: &str, value: T, range: RangeInclusive<T>) -> RangeCheck {
    let sound = range.contains(&value);
    require(key, sound, format_args!("{} to {}{}", range.start(), range.end(), unit_of(key)), value)
}

/// The unit at the end of a key's name, after a space.
fn unit_of(key: &str) -> &'static str {
    let name = key.split('[').next().unwrap_or_default();
    let ends = [
        ("_m", " m"),
        ("_mm", " mm"),
        ("_s", " s"),
        ("_ms", " ms"),
        ("_us", " us"),
        ("_deg", " degrees"),
        ("_px", " px"),
        ("_hz", " Hz"),
        ("_kg", " kg"),
        ("_ns", " N s"),
        ("_percent", " %"),
        ("frames_per_second", " Hz"),
    ];
    let name = if key.ends_with(']') { name } else { key };
    ends.into_iter().find(|(end, _)| name.ends_with(end)).map_or("", |(_, unit)| unit)
}

/// Refuses a setting that is only valid with another one.
pub(super) fn only_valid_with(key: &str, is_valid: bool, other: impl Display, found: impl Display) -> RangeCheck {
    if is_valid {
        return Ok(());
    }
    Err(InvalidValue { key: key.to_owned(), message: format!("only valid with {other}, found {found}") })
}

pub(super) fn require(key: &str, sound: bool, expected: impl Display, found: impl Display) -> RangeCheck {
    if sound {
        return Ok(());
    }
    Err(InvalidValue { key: key.to_owned(), message: format!("expected {expected}, found {found}") })
}
