//! From a text to a tree of values, from a tree to settings, with readable errors.

use std::ops::Range;

use serde::de::DeserializeOwned;
use serde_json::Value;

use super::complaint::{Diagnostic, LineSpan, did_you_mean, locate};
use super::json_tree;
use super::range_checks::RangeCheck;
use crate::input::{self, excerpt};

/// The tree of a text.
pub(crate) fn tree_of(text: &str, origin: &str) -> Result<Value, Diagnostic> {
    toml::from_str(text).map_err(|e| Diagnostic {
        origin: origin.to_owned(),
        place: e.span().map(|span| LineSpan::of_file(text, &span)),
        key: String::new(),
        message: match e.message() {
            // valid TOML, but not a 64-bit number
            "JSON number out of range" => "the number is out of range".to_owned(),
            other => format!("not TOML: {}", input::foreign_about(text.as_bytes(), other)),
        },
    })
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

/// The settings of a tree.
pub(crate) fn settings_of<T: DeserializeOwned>(
    tree: Value,
    complain: impl FnOnce(SettingsMistake) -> Diagnostic,
) -> Result<T, Diagnostic> {
    settings_or_mistake(tree).map_err(complain)
}

/// The settings of a tree, or its first error.
pub(super) fn settings_or_mistake<T: DeserializeOwned>(tree: Value) -> Result<T, SettingsMistake> {
    if let Some((key, expected)) = foreign(&tree) {
        return Err(SettingsMistake { key, unknown: None, message: expected.to_owned() });
    }
    json_tree::value(tree).map_err(|e| SettingsMistake::new(&e))
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
pub(crate) struct SettingsMistake {
    /// Dotted; empty for the whole.
    pub(super) key: String,
    /// The word that is unknown there.
    pub(super) unknown: Option<String>,
    pub(super) message: String,
}

impl SettingsMistake {
    fn new(error: &json_tree::TreeError) -> Self {
        let key = error.path().to_string();
        let key = if key == "." { String::new() } else { key.trim_end_matches(".?").to_owned() };
        let message = error.inner().to_string();
        if key == "tracker" && message.contains("expected map with a single key") {
            let message = "expected one tracker, found several (or none); keep one table [tracker.NAME], or give each a \
                           name of its own to run all on the same observations: [methods.A.NAME], [methods.B.NAME]";
            return Self { key, unknown: None, message: message.to_owned() };
        }
        let unknown = message.starts_with("unknown ").then(|| message.split('`').nth(1)).flatten().map(str::to_owned);
        Self { key, unknown, message: in_plain_words(&message) }
    }

    /// Position of the unknown word, if it is a key: that of the error, or one in its table (`[tracker.frosen]`).
    fn unknown_key(&self, text: &str) -> Option<Range<usize>> {
        let word = self.unknown.as_ref()?;
        let inside = locate(text, &format!("{}.{word}", self.key));
        let spot = inside.or_else(|| locate(text, &self.key).filter(|spot| text[spot.key.clone()] == **word))?;
        Some(spot.key)
    }

    /// As an error of `origin`, without a line.
    pub(super) fn about(self, origin: &str) -> Diagnostic {
        Diagnostic { origin: origin.to_owned(), place: None, key: self.key, message: self.message }
    }

    /// As an error of a text, with its line.
    pub(crate) fn in_text(self, origin: &str, text: &str) -> Diagnostic {
        let spot = locate(text, &self.key);
        let span = self.unknown_key(text).or(spot.map(|spot| spot.value));
        let place = span.map(|span| LineSpan::of_file(text, &span));
        let complaint = Diagnostic { place, ..self.clone().about(origin) };
        if input::is_own_output(text.as_bytes()) || complaint.message.starts_with("missing key") {
            return complaint;
        }
        // a file of another kind: its keys and values are not shown
        match self.unknown {
            Some(_) => Diagnostic { key: String::new(), message: "unknown key".to_owned(), ..complaint },
            None => Diagnostic { message: input::unquoted(&complaint.message), ..complaint },
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
fn in_plain_words(message: &str) -> String {
    if let Some((what, word, expected)) = unknown(message) {
        // the word is user input, the expected names are ours
        let known: Vec<&str> = expected.split('`').skip(1).step_by(2).collect();
        let guess = did_you_mean(word, known.iter().copied());
        let guess = guess.map(|g| format!(", did you mean `{g}`?")).unwrap_or_default();
        let known = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
        return format!("{what} `{}`{guess} (known here: {known})", excerpt(word));
    }
    PLAIN_WORDS.iter().fold(input::foreign(message), |message, (from, to)| message.replace(from, to))
}

/// A complaint about a negative whole number, with the range of its key, which is found with other numbers in its
/// place; any other complaint as it is. `tree` is what was read, `check` finds the first value out of its range.
pub(super) fn with_range<T: DeserializeOwned>(
    complaint: Diagnostic,
    tree: &Value,
    check: impl Fn(&T) -> RangeCheck,
) -> Diagnostic {
    let Some(found) = complaint.message.strip_prefix("invalid value: integer `-") else { return complaint };
    let Some((found, _)) = found.split_once('`') else { return complaint };
    let expected_of = |number: u32| {
        let mut other = tree.clone();
        *at(&mut other, &complaint.key)? = number.into();
        let settings: T = settings_or_mistake(other).ok()?;
        let problem = check(&settings).err().filter(|problem| problem.key == complaint.key)?;
        let (expected, _) = problem.message.strip_prefix("expected ")?.rsplit_once(", found ")?;
        Some(expected.to_owned())
    };
    let expected = [u32::MAX, 0].into_iter().find_map(expected_of);
    let expected = expected.unwrap_or_else(|| "a whole number from 0".to_owned());
    Diagnostic { message: format!("expected {expected}, found -{found}"), ..complaint }
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use crate::scenario::{DEFAULT_SCENARIO, ScenarioFile, TrackerSettings};

    #[test]
    fn a_negative_number_is_told_with_the_range_of_its_key() {
        for (change, key, expected) in [
            ("particles=-5", "tracker.annealed_particle_filter.particles", "1 to 1000000"),
            ("tracker.annealed_particle_filter.layers=-1", "tracker.annealed_particle_filter.layers", "1 to 1000"),
            ("seeds=-1", "seeds", "1 to 100000"),
            ("seed=-3", "seed", "a whole number from 0"),
            ("rig.ring.count=-2", "rig.ring.count", "1 to 64"),
        ] {
            let error = ScenarioFile::built_in(&[change.to_owned()]).unwrap_err().to_string();
            // a short key is told in full
            let (_, value) = change.split_once('=').unwrap();
            // and one that may be meant for several others is told these
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
