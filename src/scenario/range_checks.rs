//! Building blocks of range checks.

use std::fmt::Display;
use std::ops::RangeInclusive;

use skiagraph_core::input::excerpt;
use skiagraph_track::motion_model::SettingError;

/// An error at one key of a scenario, without the file and line, which [`ScenarioFile`](super::ScenarioFile) adds.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{key}: {}", self.message())]
pub struct KeyError {
    /// Dotted key.
    pub key: String,
    /// What is wrong: what was expected, or what the key is only valid with.
    pub expected: String,
    /// What was found, as far as that is not part of what is wrong.
    pub found: Option<String>,
    /// The table or key that this one depends on.
    pub needs: Option<&'static str>,
}

impl KeyError {
    /// An error whose message is whole.
    pub(crate) fn new(key: impl Into<String>, message: impl Into<String>) -> Self {
        Self { key: key.into(), expected: message.into(), found: None, needs: None }
    }

    pub(crate) fn within(self, table: &str) -> Self {
        Self { key: format!("{table}.{}", self.key), ..self }
    }

    /// What was expected and what was found.
    pub fn message(&self) -> String {
        let found = self.found.as_ref().map(|found| format!(", found {found}"));
        self.expected.clone() + &found.unwrap_or_default()
    }

    /// The same problem of a key that depends on another one.
    pub(super) fn needing(self, other: &'static str) -> Self {
        Self { needs: Some(other), ..self }
    }
}

pub(super) type RangeCheck = Result<(), KeyError>;

pub(super) fn setting(table: &str, e: &SettingError) -> KeyError {
    invalid(&format!("{table}.{}", e.key), format!("expected {}", e.expected), excerpt(&e.found))
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

pub(super) fn only_valid_with(key: &str, is_valid: bool, other: impl Display, found: impl Display) -> RangeCheck {
    if is_valid {
        return Ok(());
    }
    Err(invalid(key, format!("only valid with {other}"), found))
}

pub(super) fn require(key: &str, sound: bool, expected: impl Display, found: impl Display) -> RangeCheck {
    if sound {
        return Ok(());
    }
    Err(invalid(key, format!("expected {expected}"), found))
}

fn invalid(key: &str, expected: String, found: impl Display) -> KeyError {
    KeyError { found: Some(found.to_string()), ..KeyError::new(key, expected) }
}
