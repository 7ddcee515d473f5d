//! `[tracker.program]`: a tracker that is another program, with its settings.

use std::collections::BTreeMap;
use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::Scenario;
use super::diagnostic::did_you_mean;
use super::range_checks::{RangeCheck, at_most, require, within};
use super::value_text::parse_value;
use skiagraph_core::input::{excerpt, shell_word};

const MOST_SETTINGS: usize = 256;
/// Greatest length of a command line, of the name of a setting, and of its value, characters.
const LONGEST_COMMAND: usize = 10_000;
const LONGEST_NAME: usize = 64;
const LONGEST_VALUE: usize = 1000;

/// Another program, which only `--exec` can set (`docs/protocol.md`).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ProgramTrackerSettings {
    /// The shell command line. `{KEY}` stands for the value of the setting KEY, quoted for the shell; `{{KEY}}` for the
    /// text `{KEY}`.
    pub command: String,
    /// Its name in reports. Default: the one that it gives in `ready`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Its settings by name: numbers, texts, `true` or `false`. Default: none.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub settings: BTreeMap<String, Value>,
    /// Whether messages contain the silhouettes instead of paths. Default: false.
    #[serde(default, skip_serializing_if = "super::is_default")]
    pub inline: bool,
    /// Time limit for a frame, seconds. Default: 30.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frame_limit_s: Option<f64>,
    /// Time limit until the program is ready, seconds. Default: 60.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub start_limit_s: Option<f64>,
    /// Restarts per seed after a crash or an exceeded time limit. Default: 3.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub restarts: Option<u32>,
    /// Whether it runs in a sandbox. Default: false.
    #[serde(default, skip_serializing_if = "super::is_default")]
    pub sandbox: bool,
    /// Files and folders that it may read there. Default: none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub readable: Vec<String>,
    /// Its working directory, if it is not that of this process.
    #[serde(skip)]
    pub folder: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Part<'a> {
    Text(&'a str),
    Placeholder(&'a str),
}

impl ProgramTrackerSettings {
    /// The placeholders of the command line, each once, in the order of the text.
    pub fn placeholders(&self) -> Vec<&str> {
        let mut names = Vec::new();
        for part in parts(&self.command) {
            if let Part::Placeholder(name) = part
                && !names.contains(&name)
            {
                names.push(name);
            }
        }
        names
    }

    /// A message about the first placeholder without a value.
    pub fn unset_placeholder(&self) -> Option<String> {
        let name = self.placeholders().into_iter().find(|name| !self.settings.contains_key(*name))?;
        let guess = did_you_mean(name, self.settings.keys().map(String::as_str));
        let guess = guess.map(|guess| format!("; did you mean {{{guess}}}?")).unwrap_or_default();
        // a key of the scenario has its own meaning on the command line
        let is_key = Scenario::json_schema()["properties"].get(name).is_some();
        let key = if is_key { format!("settings.{name}") } else { name.to_owned() };
        Some(format!(
            "the placeholder {{{name}}} has no value: give {key}=VALUE, or write {{{{{name}}}}} for the text {{{name}}}{guess}"
        ))
    }

    /// The first invalid value; `table` is the key of the settings.
    pub(super) fn first_problem(&self, table: &str) -> RangeCheck {
        let key = |name: &str| format!("{table}.{name}");
        require(&key("command"), !self.command.trim().is_empty(), "a command line", "none")?;
        let length = self.command.chars().count();
        require(&key("command"), length <= LONGEST_COMMAND, format!("at most {LONGEST_COMMAND} characters"), length)?;
        at_most(&key("settings"), self.settings.len(), MOST_SETTINGS, "settings")?;
        for (name, value) in &self.settings {
            require(&key("settings"), is_name(name), "names of letters, digits and `_`", excerpt(name))?;
            let is_plain = match value {
                Value::String(text) => text.chars().count() <= LONGEST_VALUE,
                Value::Number(_) | Value::Bool(_) => true,
                _ => false,
            };
            let expected = format!("a number, true, false, or a text of at most {LONGEST_VALUE} characters");
            require(&format!("{table}.settings.{name}"), is_plain, expected, excerpt(&value.to_string()))?;
        }
        for (name, limit) in [("frame_limit_s", self.frame_limit_s), ("start_limit_s", self.start_limit_s)] {
            limit.map_or(Ok(()), |limit| within(&key(name), limit, 0.01..=86_400.0))?;
        }
        self.restarts.map_or(Ok(()), |restarts| within(&key("restarts"), restarts, 0..=1000))?;
        require(&key("readable"), self.sandbox || self.readable.is_empty(), "no paths without `sandbox`", "some")
    }
}

/// A command line with the values of its placeholders; those without a value are unchanged.
pub(crate) fn command_with(command: &str, settings: &BTreeMap<String, Value>) -> String {
    let text = |part| match part {
        Part::Text(text) => text.to_owned(),
        Part::Placeholder(name) => {
            settings.get(name).map_or(format!("{{{name}}}"), |value| shell_word(&setting_text(value)))
        }
    };
    parts(command).into_iter().map(text).collect()
}

/// The options `--exec`, `--name` and `--tracker` that give this override of a scenario's trackers, if it has programs.
pub(crate) fn exec_arguments(assignment: &str) -> Option<String> {
    let (key, value) = assignment.split_once('=')?;
    let value = parse_value(value).ok()?;
    let trackers: Vec<&Value> = match key {
        "tracker" => vec![&value],
        "methods" => value.as_object()?.values().collect(),
        _ => return None,
    };
    let option = |name: &str, value: &Value| Some(format!("--{name} {}", shell_word(value.as_str()?)));
    let mut words = Vec::new();
    for tracker in trackers {
        let Some(program) = tracker.get("program") else {
            words.extend(tracker.as_object()?.keys().map(|name| format!("--tracker {name}")));
            continue;
        };
        words.push(option("exec", &program["command"])?);
        words.extend(option("name", &program["name"]));
        words.extend((program["inline"] == true).then(|| "--inline".to_owned()));
    }
    words.iter().any(|word| word.starts_with("--exec")).then(|| words.join(" "))
}

/// The value of a setting as a program is given it in its command line and environment.
pub(crate) fn setting_text(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}

fn is_name(word: &str) -> bool {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || c == '_';
    word.len() <= LONGEST_NAME && word.chars().all(is_plain) && word.starts_with(|c: char| !c.is_ascii_digit())
}

/// Splits a command line into texts and placeholders. Braces around anything but a name are text, and so is `${NAME}`.
fn parts(command: &str) -> Vec<Part<'_>> {
    let (mut parts, mut rest) = (Vec::new(), command);
    while let Some((head, tail)) = rest.split_once('{') {
        let is_variable = head.ends_with('$');
        let (doubled, inside) = match tail.strip_prefix('{') {
            Some(inside) => (true, inside),
            None => (false, tail),
        };
        let word = inside.split('}').next().unwrap_or_default();
        let closing = if doubled { "}}" } else { "}" };
        let after = inside.get(word.len()..).and_then(|after| after.strip_prefix(closing));
        match after.filter(|_| is_name(word) && !is_variable) {
            Some(after) if doubled => {
                // `{{NAME}}` is the text `{NAME}`
                let braced = rest.get(head.len() + 1..rest.len() - after.len() - 1).unwrap_or_default();
                parts.extend([Part::Text(head), Part::Text(braced)]);
                rest = after;
            }
            Some(after) => {
                parts.extend([Part::Text(head), Part::Placeholder(word)]);
                rest = after;
            }
            None => {
                parts.push(Part::Text(rest.get(..=head.len()).unwrap_or_default()));
                rest = tail;
            }
        }
    }
    parts.push(Part::Text(rest));
    parts
}

/// The error about a program in a file: only the command line may start programs, so that files of others are safe.
pub(crate) const REFUSED: &str =
    "a file cannot start programs; remove it, and name the program with --exec \"COMMAND\"";

/// The key of a program in the tree of a scenario's file.
pub(crate) fn program_in(tree: &Value) -> Option<String> {
    let is_program = |table: &Value| table.get("program").is_some();
    if is_program(&tree["tracker"]) {
        return Some("tracker.program".to_owned());
    }
    let methods = tree["methods"].as_object()?;
    methods.iter().find(|(_, method)| is_program(method)).map(|(name, _)| format!("methods.{name}.program"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn program(command: &str, settings: &[(&str, Value)]) -> ProgramTrackerSettings {
        let settings = settings.iter().map(|(name, value)| ((*name).to_owned(), value.clone())).collect();
        ProgramTrackerSettings { command: command.to_owned(), settings, ..ProgramTrackerSettings::default() }
    }

    #[test]
    fn placeholders_are_replaced_by_quoted_values_and_other_braces_are_kept() {
        let settings = [("alpha", 0.1.into()), ("mode", "a b".into())];
        for (command, expected) in [
            ("t --alpha {alpha} {mode}", "t --alpha 0.1 'a b'"),
            ("t {alpha}{alpha}", "t 0.10.1"),
            ("t {{alpha}} ${alpha} {1} {} { alpha } {a", "t {alpha} ${alpha} {1} {} { alpha } {a"),
            ("awk '{ print }' {{{alpha}}}", "awk '{ print }' {{alpha}}"),
            ("", ""),
        ] {
            let program = program(command, &settings);
            assert_eq!(command_with(&program.command, &program.settings), expected, "{command}");
        }
    }

    #[test]
    fn a_placeholder_without_a_value_is_named() {
        assert_eq!(program("t {alpha}", &[("alpha", 1.into())]).unset_placeholder(), None);
        let message = program("t {alpha} {beta}", &[("alpha", 1.into()), ("betta", 1.into())]).unset_placeholder();
        let message = message.unwrap();
        assert!(message.starts_with("the placeholder {beta} has no value: give beta=VALUE"), "{message}");
        assert!(message.contains("write {{beta}}") && message.ends_with("did you mean {betta}?"), "{message}");
        let message = program("t {seeds}", &[]).unset_placeholder().unwrap();
        assert!(message.contains("give settings.seeds=VALUE"), "{message}");
        assert_eq!(program("t {b} {a} {b}", &[]).placeholders(), ["b", "a"]);
    }

    #[test]
    fn invalid_settings_are_refused() {
        let found = |program: &ProgramTrackerSettings| program.first_problem("tracker.program").unwrap_err().key;
        assert_eq!(found(&program(" ", &[])), "tracker.program.command");
        assert_eq!(found(&program("t", &[("a b", 1.into())])), "tracker.program.settings");
        assert_eq!(found(&program("t", &[("a", Value::Array(Vec::new()))])), "tracker.program.settings.a");
        let limited = ProgramTrackerSettings { frame_limit_s: Some(0.0), ..program("t", &[]) };
        assert_eq!(found(&limited), "tracker.program.frame_limit_s");
        assert!(program("t", &[("a", 1.into())]).first_problem("tracker.program").is_ok());
    }
}
