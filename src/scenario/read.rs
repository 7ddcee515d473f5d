//! Reads a [`Scenario`] from text, with overrides; every error has a position.

use std::path::{Path, PathBuf};

use serde_json::{Map, Value};

use super::diagnostic::{Diagnostic, LineSpan, locate};
use super::json_tree::{Problem, TreeError};
use super::overrides::{full_key, keys_of, keys_of_tracker, keys_with_same_ending};
use super::program::{REFUSED, program_in};
use super::similar_file::suggestion_for;
use super::tree::{describe_other_kind, settings_with_ranges_told, tree_of};
use super::value_text::{parse_value, split_at_commas};
use super::{KeyError, Scenario, TrackerSettings};
use skiagraph_core::input::{self, limits, plain};

/// The built-in scenario: `scenarios/walk.toml`.
pub const DEFAULT_SCENARIO: &str = include_str!("../../scenarios/walk.toml");

/// Greatest number of parts of a dotted key; no setting has more than five.
const MOST_SEGMENTS: usize = 16;

/// A scenario and the base folder of its paths.
#[derive(Clone, Debug, PartialEq)]
pub struct ScenarioFile {
    /// The scenario with its overrides.
    pub scenario: Scenario,
    /// The file as named by the user.
    pub origin: String,
    /// The base folder of paths in the scenario.
    pub folder: PathBuf,
    /// The file itself; `None` for a scenario that was not read from a file.
    pub path: Option<PathBuf>,
    pub(super) text: String,
    pub(super) overrides: Vec<String>,
}

/// Errors of scenarios.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ScenarioError {
    /// The file cannot be read.
    #[error("{}: cannot read the scenario: {source}{}", plain(path.display()), suggestion_for(path))]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// The operating system's error.
        source: std::io::Error,
    },
    /// The file has an invalid value.
    #[error(transparent)]
    Unsound(#[from] Diagnostic),
}

impl ScenarioFile {
    /// Reads a scenario file; every override is `key=value` with a dotted key and a TOML value (a bare word is a
    /// string).
    ///
    /// # Errors
    /// [`ScenarioError`] if the file cannot be read, is not TOML, or has an unknown key or an invalid value.
    pub fn open(path: &Path, overrides: &[String]) -> Result<Self, ScenarioError> {
        let text = input::read_to_string(path, limits::SETTINGS)
            .map_err(|source| ScenarioError::Unreadable { path: path.to_owned(), source })?;
        let folder = path.parent().map(Path::to_owned).unwrap_or_default();
        let file = Self::parse(&text, &path.display().to_string(), folder, overrides)?;
        Ok(Self { path: Some(path.to_owned()), ..file })
    }

    /// The built-in scenario.
    ///
    /// # Errors
    /// [`ScenarioError`] if an override is invalid.
    pub fn built_in(overrides: &[String]) -> Result<Self, ScenarioError> {
        Self::parse(DEFAULT_SCENARIO, "walk.toml (built in)", PathBuf::new(), overrides)
    }

    /// As [`Self::open`], from a text. Files named in it are relative to `folder`.
    ///
    /// # Errors
    /// As [`Self::open`], except reading errors.
    pub fn parse(text: &str, origin: &str, folder: PathBuf, overrides: &[String]) -> Result<Self, ScenarioError> {
        let mut tree = tree_of(text, origin)?;
        if let Some(message) = describe_other_kind(&tree) {
            let place = locate(text, "schema").map(|spot| LineSpan::of_file(text, &spot.value));
            let (origin, key, message) = (origin.to_owned(), "schema".to_owned(), message.to_owned());
            return Err(Diagnostic { origin, place, key, message, ..Diagnostic::default() }.into());
        }
        if let Some(key) = program_in(&tree) {
            let place = locate(text, &key).map(|spot| LineSpan::of_file(text, &spot.key));
            let (origin, message) = (origin.to_owned(), REFUSED.to_owned());
            return Err(Diagnostic { origin, place, key, message, ..Diagnostic::default() }.into());
        }
        let mut scenario: Scenario = settings_with_ranges_told(&tree, Scenario::first_problem)
            .map_err(|mistake| mistake.in_text(origin, text))?;
        let mut full = Vec::new();
        for assignment in overrides {
            let assignment = with_full_key(assignment, &scenario)?;
            set(&mut tree, &assignment)?;
            scenario = settings_with_ranges_told(&tree, Scenario::first_problem)
                .map_err(|mistake| with_suggested_keys(mistake, &assignment, &scenario))?;
            full.push(assignment);
        }
        let (origin, text, overrides) = (origin.to_owned(), text.to_owned(), full);
        let file = Self { scenario, origin, folder, path: None, text, overrides };
        // once, after all overrides: an override may mend a value of the file
        match file.scenario.first_problem() {
            Ok(()) => Ok(file),
            Err(problem) => Err(file.located(&problem)),
        }
    }

    pub(crate) fn overridden_keys(&self) -> impl Iterator<Item = &str> {
        self.overrides.iter().map(|assignment| assignment.split('=').next().unwrap_or_default().trim())
    }

    /// An error at a key of this scenario with its position in the file or in the override.
    pub(crate) fn located(&self, error: &KeyError) -> ScenarioError {
        self.problem(error).into()
    }

    /// An error about the value of a key, with its position in the file or in the override.
    pub(crate) fn complaint(&self, key: &str, message: String) -> Diagnostic {
        let culprit = self.overrides.iter().rev().find(|o| covers(o, key));
        let spot = locate(&self.text, key).filter(|_| culprit.is_none());
        let place = spot.map(|spot| LineSpan::of_file(&self.text, &spot.value));
        let key = key.to_owned();
        match culprit {
            Some(assignment) => Diagnostic { key, ..Diagnostic::of_override(assignment, message) },
            None => Diagnostic { origin: self.origin.clone(), place, key, message, ..Diagnostic::default() },
        }
    }

    /// The error of a value out of range. What was found is not shown of a file that is no scenario.
    pub(super) fn problem(&self, problem: &KeyError) -> Diagnostic {
        let is_shown = input::is_own_output(self.text.as_bytes());
        let is_override = self.overrides.iter().any(|assignment| covers(assignment, &problem.key));
        let message = if is_shown || is_override { problem.message() } else { problem.expected.clone() };
        self.complaint(&problem.key, message)
    }
}

impl TrackerSettings {
    /// These settings with overrides whose keys are relative to the tracker's own table (`particles=50`).
    ///
    /// # Errors
    /// [`Diagnostic`] if an override is invalid.
    pub fn overridden(self, overrides: &[String]) -> Result<Self, Diagnostic> {
        let mut settings = self;
        for assignment in overrides {
            let assignment = &with_own_key(assignment, &settings)?;
            let invalid = |message: String| error_about(assignment, message);
            // the tree has one entry: the tracker's name with its table
            let mut tree = serde_json::to_value(&settings).map_err(|e| invalid(e.to_string()))?;
            if let Some(Value::Object(own)) = tree.as_object_mut().and_then(|named| named.values_mut().next()) {
                insert(own, assignment)?;
            }
            let check = |settings: &Self| settings.first_problem(settings.name());
            let is_program = matches!(settings, Self::Program(_));
            settings = settings_with_ranges_told(&tree, check).map_err(|mistake| match is_program {
                true => with_suggested_setting(mistake, assignment, "settings"),
                false => mistake.of_override(assignment),
            })?;
            check(&settings)
                .map_err(|problem| Diagnostic { key: problem.key.clone(), ..invalid(problem.message()) })?;
        }
        Ok(settings)
    }
}

/// An override of a scenario with its short key expanded.
pub(super) fn with_full_key(assignment: &str, scenario: &Scenario) -> Result<String, Diagnostic> {
    let Some((key, value)) = assignment.split_once('=') else { return Ok(assignment.to_owned()) };
    // truth images by their old key, which is refused as unknown with the new one
    if key.trim() == "layers" && value.trim_start().starts_with('[') {
        return Ok(assignment.to_owned());
    }
    let full = full_key(key.trim(), &keys_of(scenario)).map_err(|message| error_about(assignment, message))?;
    Ok(format!("{full}={value}"))
}

/// An error about an override, with other keys that may be meant: `seed` is a key of several tables.
fn with_suggested_keys(mistake: TreeError, assignment: &str, scenario: &Scenario) -> Diagnostic {
    let key = assignment.split('=').next().unwrap_or_default();
    let keys = keys_of(scenario);
    match keys_with_same_ending(key, &keys).as_slice() {
        [] => {
            let trackers = scenario.trackers();
            let programs = trackers.iter().filter(|(_, tracker)| matches!(tracker, TrackerSettings::Program(_)));
            match programs.map(|(name, _)| *name).collect::<Vec<_>>().as_slice() {
                [] => mistake.of_override(assignment),
                [_] => with_suggested_setting(mistake, assignment, "settings"),
                [first, ..] => {
                    with_suggested_setting(mistake, assignment, &format!("methods.{first}.program.settings"))
                }
            }
        }
        others => {
            let diagnostic = mistake.of_override(assignment);
            let message = format!("{} (or did you mean {}?)", diagnostic.message, others.join(" or "));
            Diagnostic { message, ..diagnostic }
        }
    }
}

/// An error about an unknown key, which may be meant as a setting of a program, whose table is `settings`.
fn with_suggested_setting(mistake: TreeError, assignment: &str, settings: &str) -> Diagnostic {
    let key = assignment.split('=').next().unwrap_or_default();
    let is_unknown = !key.contains('.') && matches!(mistake.problem, Problem::Unknown { is_key: true, .. });
    let diagnostic = mistake.of_override(assignment);
    if !is_unknown {
        return diagnostic;
    }
    let message = format!("{}; a setting of the program is given as {settings}.{assignment}", diagnostic.message);
    Diagnostic { message, ..diagnostic }
}

/// An override of a tracker with its key in the tracker's own table; `tracker.NAME.KEY` and short keys are also
/// accepted.
fn with_own_key(assignment: &str, settings: &TrackerSettings) -> Result<String, Diagnostic> {
    let Some((key, value)) = assignment.split_once('=') else { return Ok(assignment.to_owned()) };
    let invalid = |message| error_about(assignment, message);
    let name = settings.name();
    let key = key.trim();
    let in_tracker = key.strip_prefix("tracker.").unwrap_or(key);
    let own = in_tracker.strip_prefix(name).and_then(|rest| rest.strip_prefix('.'));
    if own.is_none() && in_tracker != key {
        return Err(invalid(format!("the tracker is `{name}`: write tracker.{name}.KEY or KEY")));
    }
    let full = full_key(own.unwrap_or(key), &keys_of_tracker(settings)).map_err(invalid)?;
    Ok(format!("{full}={value}"))
}

/// Whether an override sets `key`, itself or as part of a table.
pub(super) fn covers(assignment: &str, key: &str) -> bool {
    let name = assignment.split('=').next().unwrap_or_default().trim();
    key.strip_prefix(name).is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[']))
}

fn error_about(assignment: &str, message: String) -> Diagnostic {
    Diagnostic::of_override(assignment, message)
}

/// What is wrong with several values where one is expected; `None` for other text.
fn several_values(text: &str) -> Option<String> {
    let parts = split_at_commas(text);
    let are_values = parts.len() > 1 && parts.iter().all(|part| parse_value(part.trim()).is_ok());
    let count = parts.len();
    let message =
        || format!("expected one value, found {count}; several are for skiagraph sweep, a list is in brackets");
    are_values.then(message)
}

pub(super) fn set(tree: &mut Value, assignment: &str) -> Result<(), Diagnostic> {
    match tree {
        Value::Object(table) => insert(table, assignment),
        _ => Err(error_about(assignment, "expected a table".to_owned())),
    }
}

fn insert(table: &mut Map<String, Value>, assignment: &str) -> Result<(), Diagnostic> {
    let invalid = |message: &str| error_about(assignment, message.to_owned());
    let (key, value) = assignment
        .split_once('=')
        .ok_or_else(|| invalid("expected key=value, such as tracker.annealed_particle_filter.particles=100"))?;
    let value = parse_value(value.trim()).map_err(|e| invalid(&several_values(value).unwrap_or(e)))?;
    // every dot is one level of nested tables
    if key.split('.').count() > MOST_SEGMENTS {
        return Err(invalid(&format!("expected a key of at most {MOST_SEGMENTS} parts between dots, found more")));
    }
    let mut segments: Vec<&str> = key.trim().split('.').collect();
    let Some(last) = segments.pop().filter(|s| !s.is_empty()) else {
        return Err(invalid("expected a key before `=`"));
    };
    // a whole table of trackers replaces the other one, because a scenario has one tracker or methods
    match (segments.is_empty(), last) {
        (true, "tracker") => table.remove("methods"),
        (true, "methods") => table.remove("tracker"),
        _ => None,
    };
    let mut table = table;
    for (depth, segment) in segments.iter().enumerate() {
        let slot = table.entry((*segment).to_owned()).or_insert_with(|| Value::Object(Map::new()));
        if !slot.is_object() {
            *slot = Value::Object(Map::new());
        }
        let Value::Object(inner) = slot else { return Err(invalid("expected a table")) };
        let method = depth == 1 && segments[0] == "methods";
        if (depth == 0 && *segment == "tracker") || method {
            // a scenario or method has one tracker, so naming another replaces it
            let chosen = segments.get(depth + 1).copied().unwrap_or(last);
            inner.retain(|name, _| name == chosen);
        }
        table = inner;
    }
    table.insert(last.to_owned(), value);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::Mismatch;

    const SMALL: &str = "schema = \"skiagraph.scenario/1\"\nname = \"a\"\n\n[motion]\nclip = \"embedded:walk\"\n";

    fn parse(extra: &str, overrides: &[&str]) -> Result<Scenario, String> {
        let overrides: Vec<String> = overrides.iter().map(|o| (*o).to_owned()).collect();
        ScenarioFile::parse(&format!("{SMALL}{extra}"), "a.toml", PathBuf::new(), &overrides)
            .map(|f| f.scenario)
            .map_err(|e| e.to_string())
    }

    #[test]
    fn a_tracker_that_needs_a_table_says_how_to_write_it() {
        let error = parse("", &["tracker=gpdm"]).unwrap_err();
        assert!(error.contains("tracker.gpdm: expected a table of settings"), "{error}");
        assert!(error.contains("write tracker.gpdm={}"), "{error}");
    }

    #[test]
    fn files_of_other_kinds_are_recognised() {
        let error = |text: &str| ScenarioFile::parse(text, "a.toml", PathBuf::new(), &[]).unwrap_err().to_string();
        let sweep = error("schema = \"skiagraph.sweep/1\"\n[axes]\nparticles = [1, 2]\n");
        assert!(
            sweep.starts_with("a.toml:1: schema: expected a scenario, found a sweep; use skiagraph sweep"),
            "{sweep}"
        );
        let gate = error("schema = \"skiagraph.gate/1\"\nseeds = 10\n");
        assert!(gate.contains("use skiagraph gate --rules FILE"), "{gate}");
        let robot = error("\n<robot name=\"r\"/>\n");
        assert!(robot.contains("this looks like XML; expected a scenario in TOML"), "{robot}");
    }

    #[test]
    fn values_of_a_wrong_kind_are_shown_with_their_line() {
        for (extra, expected, line) in [
            ("loop_to_s = nan", "motion.loop_to_s: expected a finite number", "loop_to_s = nan"),
            ("source = 2021-01-01", "motion.source: no setting is a date", "source = 2021-01-01"),
            ("[rig.ring]\nsize_px = [160, 120, 3]", "rig.ring.size_px: invalid length 3", "size_px = [160, 120, 3]"),
            ("[tracker_body]\nmismatch = 4", "integer `4`, expected a text or a table", "mismatch = 4"),
            ("[tracker.frosen]", "tracker: unknown name `frosen`, did you mean `frozen`?", "[tracker.frosen]"),
            (
                "[tracker.gpdm_graph]\nmodel.detector = \"speed_minimum\"",
                "model.detector: unknown name `speed_minimum`, did you mean `speed_minima`?",
                "model.detector = \"speed_minimum\"",
            ),
            (
                "[tracker.frozen]\n[tracker.oracle]",
                "tracker: expected one tracker, found several (or none); keep one table [tracker.NAME]",
                "[tracker.frozen]",
            ),
        ] {
            let error = parse(extra, &[]).unwrap_err();
            assert!(error.contains(expected) && error.contains(line), "{error}");
        }
        assert!(
            parse("", &["motion.loop_to_s=inf"]).unwrap_err().contains("motion.loop_to_s: expected a finite number")
        );
    }

    #[test]
    fn overrides_change_values_and_may_change_the_tracker() {
        let s = parse("[tracker.frozen]\n", &["seed=7", "tracker_body.mismatch=none", "motion.loop_to_s=2"]).unwrap();
        assert_eq!((s.seed, s.motion.loop_to_s, s.tracker_body.mismatch), (7, Some(2.0), Mismatch::None));
        let s = parse("[tracker.frozen]\n", &["tracker.oracle={}"]).unwrap();
        assert!(matches!(s.tracker(), TrackerSettings::Oracle(_)));
        let s = parse("", &["tracker_body.mismatch.percent={length=1.0, girth=2.0}"]).unwrap();
        assert_eq!(s.tracker_body.mismatch.percents(), Some((1.0, 2.0)));
    }

    #[test]
    fn layers_are_those_of_the_annealing() {
        let scenario = parse("", &["layers=3"]).unwrap();
        assert!(matches!(scenario.tracker(), TrackerSettings::AnnealedParticleFilter(s) if s.layers == 3));
        for changes in [&["layers=[\"depth\"]"][..], &["tracker={ frozen = {} }", "layers=[\"depth\"]"]] {
            let error = parse("", changes).unwrap_err();
            assert!(error.contains("`layers` is gone; images of the truth are `truth_images`"), "{error}");
        }
    }

    #[test]
    fn a_bad_override_is_named() {
        assert!(parse("", &["seed"]).unwrap_err().contains("expected key=value"));
        let error = parse("", &["seed=deep"]).unwrap_err();
        assert!(error.contains("or did you mean motion.variation.seed"), "{error}");
    }
}
