//! Parses text to a tree of values, and a tree to settings, with readable errors.

use std::ops::Range;

use serde::de::DeserializeOwned;
use serde_json::Value;

use super::diagnostic::{Diagnostic, LineSpan, locate};
use super::json_tree::{Problem, TreeError};
use super::place::resolve_preset;
use super::range_checks::RangeCheck;
use super::{gone, json_tree};
use skiagraph_core::input;

/// The command whose `made_by.json` has a scenario as its settings.
pub(crate) const RUN_COMMAND: &str = "skiagraph run";

/// The tree of a text: TOML, or what `skiagraph run` wrote to `made_by.json`.
pub(crate) fn tree_of(text: &str, origin: &str) -> Result<Value, Diagnostic> {
    if let Ok(mut record) = serde_json::from_str::<Value>(text)
        && record["command"] == RUN_COMMAND
    {
        return Ok(record["settings"].take());
    }
    toml::from_str(text).map_err(|e| Diagnostic {
        origin: origin.to_owned(),
        place: e.span().map(|span| LineSpan::of_file(text, &span)),
        message: match e.message() {
            // valid TOML, but not representable in 64 bits
            "JSON number out of range" => "the number is out of range".to_owned(),
            _ if text.trim_start_matches('\u{feff}').trim_start().starts_with('<') => {
                "not TOML: this looks like XML; expected a scenario in TOML".to_owned()
            }
            other => format!("not TOML: {}", input::foreign_about(text.as_bytes(), other)),
        },
        ..Diagnostic::default()
    })
}

/// What a file is and which command takes it, if it is no scenario.
pub(super) fn describe_other_kind(tree: &Value) -> Option<&'static str> {
    match tree.get("schema")?.as_str()?.split_once('/')?.0 {
        "skiagraph.sweep" => Some("expected a scenario, found a sweep; use skiagraph sweep FILE"),
        "skiagraph.suite" => {
            Some("a suite is a sweep now: as in scenarios/sweeps/quick.toml, with the conditions as [axes]")
        }
        "skiagraph.recording" => Some("expected a scenario, found a recording; use skiagraph import FILE"),
        "skiagraph.gate" => Some("expected a scenario, found rules of a gate; use skiagraph gate --rules FILE"),
        _ => None,
    }
}

/// The value of a dotted key with indices; the whole tree for an empty one.
pub(super) fn at<'t>(tree: &'t mut Value, key: &str) -> Option<&'t mut Value> {
    let segments = key.split(['.', '[', ']']).filter(|segment| !segment.is_empty());
    segments.into_iter().try_fold(tree, |value, segment| match value {
        Value::Object(table) => table.get_mut(segment),
        Value::Array(elements) => elements.get_mut(segment.parse::<usize>().ok()?),
        _ => None,
    })
}

/// The settings of a tree, or its first error.
pub(crate) fn settings_of<T: DeserializeOwned>(mut tree: Value) -> Result<T, TreeError> {
    if let Some((key, expected)) = foreign(&tree) {
        return Err(TreeError { key, problem: Problem::Other(expected.to_owned()) });
    }
    resolve_preset(&mut tree);
    json_tree::value(tree)
}

/// As [`settings_of`]; the error about a number below 0 says what `check`, which finds the first value out of range,
/// says about other numbers at its key.
pub(super) fn settings_with_ranges_told<T: DeserializeOwned>(
    tree: &Value,
    check: impl Fn(&T) -> RangeCheck,
) -> Result<T, TreeError> {
    settings_of(tree.clone()).map_err(|error| error.with_range(tree, check))
}

/// The first key whose value exists in TOML but not in JSON, and what was expected.
fn foreign(tree: &Value) -> Option<(String, &'static str)> {
    let within = |key: String, value| {
        foreign(value).map(|(rest, expected)| {
            let dot = if rest.is_empty() || rest.starts_with('[') { "" } else { "." };
            (key + dot + &rest, expected)
        })
    };
    match tree {
        Value::Null => Some((String::new(), "expected a finite number")),
        Value::Object(date) if date.contains_key(DATE) => {
            Some((String::new(), "no setting is a date; put text in quotes"))
        }
        Value::Array(values) => values.iter().enumerate().find_map(|(i, value)| within(format!("[{i}]"), value)),
        Value::Object(table) => table.iter().find_map(|(key, value)| within(key.clone(), value)),
        _ => None,
    }
}

/// The key that marks a TOML date in a tree.
const DATE: &str = "$__toml_private_datetime";

impl TreeError {
    /// The unknown word at its key, if any.
    pub(super) fn unknown(&self) -> Option<&str> {
        match &self.problem {
            Problem::Unknown { word, .. } => Some(word),
            _ => None,
        }
    }

    /// Position of the unknown word, if it is a key: that of the error, or one in its table (`[tracker.frosen]`).
    fn unknown_key(&self, text: &str) -> Option<Range<usize>> {
        let word = self.unknown()?;
        let inside = locate(text, &format!("{}.{word}", self.key));
        let spot = inside.or_else(|| locate(text, &self.key).filter(|spot| &text[spot.key.clone()] == word))?;
        Some(spot.key)
    }

    fn message(&self) -> String {
        let (key, problem) = (&self.key, &self.problem);
        match problem {
            Problem::NotOne if key == "tracker" => {
                "expected one tracker, found several (or none); keep one table [tracker.NAME], or name each to run all \
                 on the same observations: [methods.A.NAME], [methods.B.NAME]"
                    .to_owned()
            }
            Problem::NameAlone if key.starts_with("tracker.") => format!("{problem}; write {key}={{}}"),
            Problem::Unknown { word, .. } => gone::message(key, word).unwrap_or_else(|| problem.to_string()),
            _ => problem.to_string(),
        }
    }

    pub(super) fn of_override(self, assignment: &str) -> Diagnostic {
        let message = self.message();
        Diagnostic { key: self.key, ..Diagnostic::of_override(assignment, message) }
    }

    pub(crate) fn in_text(self, origin: &str, text: &str) -> Diagnostic {
        let spot = locate(text, &self.key);
        let span = self.unknown_key(text).or(spot.map(|spot| spot.value));
        let place = span.map(|span| LineSpan::of_file(text, &span));
        let (origin, message) = (origin.to_owned(), self.message());
        let diagnostic = Diagnostic { origin, place, message, ..Diagnostic::default() };
        if input::is_own_output(text.as_bytes()) {
            return Diagnostic { key: self.key, ..diagnostic };
        }
        // keys and values of other kinds of files are not shown
        match self.problem {
            Problem::Unknown { .. } => Diagnostic { message: "unknown key".to_owned(), ..diagnostic },
            Problem::Unexpected { what, expected, .. } => {
                let found = Problem::Unexpected { what, found: "…".to_owned(), expected };
                Diagnostic { key: self.key, message: found.to_string(), ..diagnostic }
            }
            Problem::Negative { .. } => {
                Diagnostic { key: self.key, message: "expected a whole number from 0".to_owned(), ..diagnostic }
            }
            Problem::Other(message) => Diagnostic { key: self.key, message: input::unquoted(message), ..diagnostic },
            Problem::Missing { .. } | Problem::NotOne | Problem::NameAlone => {
                Diagnostic { key: self.key, ..diagnostic }
            }
        }
    }

    /// With the range of the key of a number below 0, which is found by trying other numbers.
    pub(super) fn with_range<T: DeserializeOwned>(self, tree: &Value, check: impl Fn(&T) -> RangeCheck) -> Self {
        let Problem::Negative { found, .. } = self.problem else { return self };
        let expected_of = |number: u32| {
            let mut other = tree.clone();
            *at(&mut other, &self.key)? = number.into();
            let settings: T = settings_of(other).ok()?;
            let problem = check(&settings).err().filter(|problem| problem.key == self.key)?;
            problem.found.is_some().then_some(problem.expected)
        };
        let expected = [u32::MAX, 0].into_iter().find_map(expected_of);
        Self { problem: Problem::Negative { found, expected }, ..self }
    }
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use crate::scenario::{DEFAULT_SCENARIO, ScenarioFile, TrackerSettings};

    #[test]
    fn a_value_in_place_of_a_table_is_not_answered_with_the_name_of_a_type() {
        let change = "tracker.annealed_particle_filter.refinement=false".to_owned();
        let error = ScenarioFile::built_in(&[change]).unwrap_err().to_string();
        assert!(error.ends_with("refinement: invalid type: boolean `false`, expected a table of settings"), "{error}");
    }

    #[test]
    fn the_error_for_a_negative_number_has_the_range_of_its_key() {
        for (change, key, expected) in [
            ("particles=-5", "tracker.annealed_particle_filter.particles", "1 to 1000000"),
            ("tracker.annealed_particle_filter.layers=-1", "tracker.annealed_particle_filter.layers", "1 to 1000"),
            ("seeds=-1", "seeds", "1 to 100000"),
            ("seed=-3", "seed", "a whole number from 0"),
            ("rig.ring.count=-2", "rig.ring.count", "1 to 64"),
        ] {
            let error = ScenarioFile::built_in(&[change.to_owned()]).unwrap_err().to_string();
            // errors have the full key
            let (_, value) = change.split_once('=').unwrap();
            // and other keys that may be meant
            let others = "motion.variation.seed or actor.shape.seed or tracker_body.seed or observation.seed";
            let hint = if key == "seed" { format!(" (or did you mean {others}?)") } else { String::new() };
            assert_eq!(error, format!("override {key}={value}: {key}: expected {expected}, found {value}{hint}"));
        }
        let text = DEFAULT_SCENARIO.replace("seeds = 5", "seeds = -5");
        let error = ScenarioFile::parse(&text, "a.toml", PathBuf::new(), &[]).unwrap_err().to_string();
        let line = 1 + DEFAULT_SCENARIO.lines().position(|line| line.starts_with("seeds = 5")).unwrap();
        // the line itself follows
        let expected = format!("a.toml:{line}: seeds: expected 1 to 100000, found -5");
        assert_eq!(error.lines().next(), Some(expected.as_str()));
        let error = TrackerSettings::default().overridden(&["particles=-5".to_owned()]).unwrap_err().to_string();
        assert_eq!(error, "override particles=-5: annealed_particle_filter.particles: expected 1 to 1000000, found -5");
    }
}
