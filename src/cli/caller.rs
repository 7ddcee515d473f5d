//! What programs that call this one are told. The last line of standard output is an object with the kind of an error
//! and its fields, with `--json` or if `SKIAGRAPH_CALLER` is set; then also with the output's path, where a command
//! chooses it. Sentences are for people, and may change.

use std::borrow::Cow;
use std::path::Path;

use clap::error::{ContextKind, ContextValue};
use serde_json::{Map, Value, json};

use super::CommandError;
use crate::artefacts::ArtefactError;
use crate::common::ExperimentError;
use crate::scenario::ScenarioError;

/// The variable of a calling program.
const VARIABLE: &str = "SKIAGRAPH_CALLER";

/// Tells a calling program where the output is, and the notes about its input.
pub(super) fn print_written(path: &Path, notes: &[String]) {
    if std::env::var_os(VARIABLE).is_some() {
        let written = json!({"schema": "skiagraph.written/1", "path": text(path), "notes": notes});
        // a failure to print cannot be reported anywhere
        super::output::print(&written.to_string()).ok();
    }
}

/// Prints the error of a command, if its values are wanted.
pub fn print_failure(error: &CommandError) {
    let (kind, fields) = of_command(error);
    print(kind, error.exit_code(), &error.to_string(), fields);
}

/// Prints an error of the command line itself, if its values are wanted. `--help` and `--version` are none.
pub(super) fn print_usage_error(error: &clap::Error) {
    let context = |kind| match error.get(kind) {
        Some(ContextValue::String(text)) => Some(text.clone()),
        _ => None,
    };
    if error.use_stderr() {
        let (argument, found) = (context(ContextKind::InvalidArg), context(ContextKind::InvalidValue));
        let text = error.to_string();
        // the command's usage follows
        let first = text.split("\n\n").next().unwrap_or_default();
        print("usage", 2, first.trim_start_matches("error: "), json!({"argument": argument, "found": found}));
    }
}

fn print(kind: &str, exit_code: u8, message: &str, fields: Value) {
    if std::env::var_os(VARIABLE).is_none() && std::env::args_os().all(|argument| argument != "--json") {
        return;
    }
    let mut object = Map::new();
    let head = json!({"schema": "skiagraph.error/1", "kind": kind, "exit_code": exit_code, "message": message});
    for part in [head, fields] {
        let Value::Object(part) = part else { continue };
        object.extend(part.into_iter().filter(|(_, value)| !value.is_null()));
    }
    super::output::print(&Value::Object(object).to_string()).ok();
}

/// A path that is not UTF-8 as far as it is.
fn text(path: &Path) -> Cow<'_, str> {
    path.to_string_lossy()
}

fn of_command(error: &CommandError) -> (&'static str, Value) {
    match error {
        CommandError::Experiment(error) => of_experiment(error),
        CommandError::Artefact(error) => of_artefact(error),
        CommandError::Scenario(error) => of_scenario(error),
        CommandError::Retired(_) => ("retired", Value::Null),
        CommandError::Threads(_) => ("threads", Value::Null),
        CommandError::Stdout(_) => ("output", Value::Null),
    }
}

fn of_experiment(error: &ExperimentError) -> (&'static str, Value) {
    use ExperimentError as E;
    match error {
        E::Scenario(error) => of_scenario(error),
        E::Artefact(error) => of_artefact(error),
        E::ModelFile(source) | E::With { source, .. } => of_experiment(source),
        E::Unfinished { partial, source } => {
            let (kind, mut fields) = of_experiment(source);
            fields["progress"] = json!(text(partial));
            (kind, fields)
        }
        E::Argument { argument, detail } => ("argument", json!({"argument": argument, "detail": detail})),
        E::Malformed { path, detail } => ("malformed", json!({"path": text(path), "detail": detail})),
        E::Unreadable { path, .. } => ("unreadable", json!({"path": text(path)})),
        E::AnotherSet { run, set, detail } => {
            ("another_set", json!({"run": text(run), "set": text(set), "detail": detail}))
        }
        E::Program { command, what, errors } => {
            ("program", json!({"command": command, "detail": what, "stderr": errors}))
        }
        E::Postponed { command } => ("postponed", json!({"command": command})),
        E::SetThere { path } | E::ExportsThere { path, .. } => ("occupied", json!({"path": text(path)})),
        E::OtherPlan { path, difference } => ("other_settings", json!({"path": text(path), "difference": difference})),
        E::SweepIncomplete { path } => ("sweep_incomplete", json!({"path": text(path)})),
        E::NotComparable(_) | E::Gate(_) => ("not_comparable", Value::Null),
        E::Interrupted => ("interrupted", Value::Null),
        _ => ("input", Value::Null),
    }
}

fn of_artefact(error: &ArtefactError) -> (&'static str, Value) {
    use ArtefactError as E;
    match error {
        E::Output { path, .. } => ("output", json!({"path": text(path)})),
        E::Busy { path } => ("busy", json!({"path": text(path)})),
        E::IsInput { path, input } => ("is_input", json!({"path": text(path), "input": text(input)})),
        E::Occupied { path } | E::InTheWay { path } => ("occupied", json!({"path": text(path)})),
        E::OtherResult { path, difference } | E::OtherUnfinished { partial: path, difference } => {
            ("other_settings", json!({"path": text(path), "difference": difference}))
        }
        E::ProgressSaved { partial } => ("interrupted", json!({"progress": text(partial)})),
    }
}

fn of_scenario(error: &ScenarioError) -> (&'static str, Value) {
    match error {
        ScenarioError::Unreadable { path, .. } => ("unreadable", json!({"path": text(path)})),
        ScenarioError::Unsound(found) => {
            let line = found.place.as_ref().map(|place| place.line);
            let key = Some(&found.key).filter(|key| !key.is_empty());
            ("scenario", json!({"origin": found.origin, "line": line, "key": key, "detail": found.message}))
        }
    }
}
