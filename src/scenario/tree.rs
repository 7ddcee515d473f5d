//! Parses text to a tree of values, and a tree to settings, with readable errors.

use std::ops::Range;

use serde::de::DeserializeOwned;
use serde_json::Value;

use super::diagnostic::{Diagnostic, LineSpan, did_you_mean, locate};
use super::json_tree;
use super::place::resolve_preset;
use super::range_checks::RangeCheck;
use crate::input::{self, excerpt};

/// The tree of a text.
pub(crate) fn tree_of(text: &str, origin: &str) -> Result<Value, Diagnostic> {
    toml::from_str(text).map_err(|e| Diagnostic {
        origin: origin.to_owned(),
        place: e.span().map(|span| LineSpan::of_file(text, &span)),
        key: String::new(),
        message: match e.message() {
            // valid TOML, but not representable in 64 bits
            "JSON number out of range" => "the number is out of range".to_owned(),
            _ if text.trim_start_matches('\u{feff}').trim_start().starts_with('<') => {
                "not TOML: this looks like XML; expected a scenario in TOML".to_owned()
            }
            other => format!("not TOML: {}", input::foreign_about(text.as_bytes(), other)),
        },
    })
}

/// What a file is and which command takes it, if it is no scenario.
pub(super) fn describe_other_kind(tree: &Value) -> Option<&'static str> {
    match tree.get("schema")?.as_str()?.split_once('/')?.0 {
        "skiagraph.sweep" => Some("expected a scenario, found a sweep; use skiagraph sweep FILE"),
        "skiagraph.suite" => Some("expected a scenario, found a suite; use skiagraph suite FILE"),
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

/// The settings of a tree; `diagnostic` makes the error.
pub(crate) fn settings_of<T: DeserializeOwned>(
    tree: Value,
    diagnostic: impl FnOnce(SettingsError) -> Diagnostic,
) -> Result<T, Diagnostic> {
    settings_or_error(tree).map_err(diagnostic)
}

/// The settings of a tree, or its first error.
pub(super) fn settings_or_error<T: DeserializeOwned>(mut tree: Value) -> Result<T, SettingsError> {
    if let Some((key, expected)) = foreign(&tree) {
        return Err(SettingsError { key, unknown: None, message: expected.to_owned() });
    }
    resolve_preset(&mut tree);
    json_tree::value(tree).map_err(|e| SettingsError::new(&e))
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

/// An error of reading settings.
#[derive(Clone)]
pub(crate) struct SettingsError {
    /// Dotted key; empty for the whole tree.
    pub(super) key: String,
    /// The unknown word at this key, if any.
    pub(super) unknown: Option<String>,
    pub(super) message: String,
}

impl SettingsError {
    fn new(error: &json_tree::TreeError) -> Self {
        let key = error.path().to_string();
        let key = if key == "." { String::new() } else { key.trim_end_matches(".?").to_owned() };
        let message = error.inner().to_string();
        if key == "tracker" && message.contains("expected map with a single key") {
            let message = "expected one tracker, found several (or none); keep one table [tracker.NAME], or name each \
                           to run all on the same observations: [methods.A.NAME], [methods.B.NAME]";
            return Self { key, unknown: None, message: message.to_owned() };
        }
        if key.starts_with("tracker.") && message.contains("unit variant, expected newtype variant") {
            let message = format!("expected a table of settings, found a name alone; write {key}={{}}");
            return Self { key, unknown: None, message };
        }
        let unknown = message.starts_with("unknown ").then(|| message.split('`').nth(1)).flatten().map(str::to_owned);
        Self { key, unknown, message: in_terms_of_settings(&message) }
    }

    /// Position of the unknown word, if it is a key: that of the error, or one in its table (`[tracker.frosen]`).
    fn unknown_key(&self, text: &str) -> Option<Range<usize>> {
        let word = self.unknown.as_ref()?;
        let inside = locate(text, &format!("{}.{word}", self.key));
        let spot = inside.or_else(|| locate(text, &self.key).filter(|spot| text[spot.key.clone()] == **word))?;
        Some(spot.key)
    }

    /// The error as one of `origin`, without a line.
    pub(super) fn about(self, origin: &str) -> Diagnostic {
        Diagnostic { origin: origin.to_owned(), place: None, key: self.key, message: self.message }
    }

    /// The error as one of a text, with its line.
    pub(crate) fn in_text(self, origin: &str, text: &str) -> Diagnostic {
        let spot = locate(text, &self.key);
        let span = self.unknown_key(text).or(spot.map(|spot| spot.value));
        let place = span.map(|span| LineSpan::of_file(text, &span));
        let diagnostic = Diagnostic { place, ..self.clone().about(origin) };
        if input::is_own_output(text.as_bytes()) || diagnostic.message.starts_with("missing key") {
            return diagnostic;
        }
        // keys and values of other kinds of files are not shown
        match self.unknown {
            Some(_) => Diagnostic { key: String::new(), message: "unknown key".to_owned(), ..diagnostic },
            None => Diagnostic { message: input::unquoted(&diagnostic.message), ..diagnostic },
        }
    }
}

const PLAIN_WORDS: [(&str, &str); 8] = [
    ("missing field", "missing key"),
    ("expected usize", "expected a whole number"),
    ("expected u32", "expected a whole number"),
    ("expected u64", "expected a whole number"),
    ("expected f64", "expected a number"),
    ("invalid value: map, expected map with a single key", "expected a single name in this table"),
    ("expected string or map", "expected a text or a table"),
    ("expected fewer elements in array", "expected fewer numbers"),
];

/// Parses serde's message about an unknown word: its kind, the word, and what serde expected.
fn unknown(message: &str) -> Option<(&'static str, &str, &str)> {
    let kinds = [("unknown field `", "unknown key"), ("unknown variant `", "unknown name")];
    let (rest, what) = kinds.iter().find_map(|(begin, what)| Some((message.strip_prefix(begin)?, *what)))?;
    let end = rest.rfind("`, expected ").or_else(|| rest.rfind("`, there are no "))?;
    Some((what, &rest[..end], &rest[end + 1..]))
}

/// Serde's message in terms of a scenario.
fn in_terms_of_settings(message: &str) -> String {
    if let Some((what, word, expected)) = unknown(message) {
        // the word is user input, the expected names are this program's
        let known: Vec<&str> = expected.split('`').skip(1).step_by(2).collect();
        let guess = did_you_mean(word, known.iter().copied());
        let guess = guess.map(|g| format!(", did you mean `{g}`?")).unwrap_or_default();
        let known = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
        return format!("{what} `{}`{guess} (known here: {known})", excerpt(word));
    }
    // a type's name of this program
    let message = match message.split_once(", expected struct ") {
        Some((found, _)) => format!("{found}, expected a table of settings"),
        None => message.to_owned(),
    };
    PLAIN_WORDS.iter().fold(input::foreign(message), |message, (from, to)| message.replace(from, to))
}

/// An error about a negative whole number, with the range of its key, which is found by trying other numbers; other
/// errors are unchanged. `tree` is the tree that was read, `check` finds the first value out of range.
pub(super) fn with_range<T: DeserializeOwned>(
    diagnostic: Diagnostic,
    tree: &Value,
    check: impl Fn(&T) -> RangeCheck,
) -> Diagnostic {
    let Some(found) = diagnostic.message.strip_prefix("invalid value: integer `-") else { return diagnostic };
    let Some((found, _)) = found.split_once('`') else { return diagnostic };
    let expected_of = |number: u32| {
        let mut other = tree.clone();
        *at(&mut other, &diagnostic.key)? = number.into();
        let settings: T = settings_or_error(other).ok()?;
        let problem = check(&settings).err().filter(|problem| problem.key == diagnostic.key)?;
        let (expected, _) = problem.message.strip_prefix("expected ")?.rsplit_once(", found ")?;
        Some(expected.to_owned())
    };
    let expected = [u32::MAX, 0].into_iter().find_map(expected_of);
    let expected = expected.unwrap_or_else(|| "a whole number from 0".to_owned());
    Diagnostic { message: format!("expected {expected}, found -{found}"), ..diagnostic }
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
