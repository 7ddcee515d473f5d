//! `--exec`, `--name` and `--tracker`: the trackers of a scenario or a sweep; and how programs are run.

use std::path::PathBuf;

use clap::Args;
use serde_json::{Map, Value};

use crate::common::ExperimentError;
use crate::external::ProgramSettings;
use crate::scenario::{ProgramTrackerSettings, Scenario, ScenarioError, TrackerSettings, as_toml, is_tracker_name};
use skiagraph_core::input::excerpt;

/// How programs are run.
#[derive(Args, Clone, Debug, Default)]
pub(super) struct ProgramOptionArguments {
    /// Time limit for one frame, in seconds
    #[arg(long, value_name = "SECONDS", default_value_t = ProgramSettings::FRAME_LIMIT_S, value_parser = seconds)]
    frame_limit: f64,

    /// Time limit until the program is ready, in seconds
    #[arg(long, value_name = "SECONDS", default_value_t = ProgramSettings::START_LIMIT_S, value_parser = seconds)]
    start_limit: f64,

    /// Number of restarts per seed after a crash or an exceeded time limit
    #[arg(long, value_name = "N", default_value_t = ProgramSettings::RESTARTS, value_parser = clap::value_parser!(u32).range(0..=1000))]
    restarts: u32,

    /// Send silhouettes within the messages, run-length encoded, instead of their paths
    #[arg(long, requires = "exec")]
    inline: bool,

    /// Run the program in a sandbox (bubblewrap) with read-only access to the system and to its copy of the set, and no
    /// network
    #[arg(long, requires = "exec")]
    sandbox: bool,

    /// File or folder that the program may read in the sandbox, for example the program itself; may be repeated. The
    /// set stays hidden even if it lies within
    #[arg(long, value_name = "PATH", requires = "sandbox")]
    readable: Vec<PathBuf>,
}

impl ProgramOptionArguments {
    /// Refuses neither a built-in tracker nor a program, and options of programs beside a built-in tracker.
    pub(super) fn check(&self, tracker: Option<&str>, exec: Option<&str>) -> Result<(), ExperimentError> {
        let refused = |argument, detail: &str| Err(ExperimentError::Argument { argument, detail: detail.to_owned() });
        match (tracker, exec) {
            (None, None) => refused(
                "--tracker or --exec",
                "expected one of them: --tracker NAME for a built-in tracker, --exec COMMAND for a program; found neither",
            ),
            (Some(_), None) if self.inline || self.sandbox => {
                let given = if self.inline { "--inline" } else { "--sandbox" };
                refused(given, "only programs have this option, and the tracker is built in; leave it out")
            }
            _ => Ok(()),
        }
    }

    pub(super) fn program(&self, command: &str) -> ProgramTrackerSettings {
        let changed = |limit: f64, default: f64| Some(limit).filter(|limit| *limit != default);
        ProgramTrackerSettings {
            command: command.to_owned(),
            inline: self.inline,
            frame_limit_s: changed(self.frame_limit, ProgramSettings::FRAME_LIMIT_S),
            start_limit_s: changed(self.start_limit, ProgramSettings::START_LIMIT_S),
            restarts: Some(self.restarts).filter(|restarts| *restarts != ProgramSettings::RESTARTS),
            sandbox: self.sandbox,
            readable: self.readable.iter().map(|path| path.display().to_string()).collect(),
            ..ProgramTrackerSettings::default()
        }
    }
}

/// The trackers of a command, instead of those of its scenario.
#[derive(Args, Clone, Debug, Default)]
pub(super) struct TrackerArguments {
    /// Program to run as the tracker: a shell command line; may be repeated. {KEY} stands for its setting KEY, given as
    /// KEY=VALUE, which all programs with {KEY} receive. It replaces the scenario's trackers
    #[arg(long, value_name = "COMMAND", value_parser = command_line)]
    exec: Vec<String>,

    /// Name of a program in folders and reports; may be repeated, in the order of --exec
    #[arg(long, value_name = "NAME", requires = "exec")]
    name: Vec<String>,

    /// Built-in tracker beside the programs, such as annealed_particle_filter, with the scenario's settings if it has
    /// that tracker; may be repeated
    #[arg(long, value_name = "NAME")]
    tracker: Vec<String>,

    #[command(flatten)]
    options: ProgramOptionArguments,
}

impl TrackerArguments {
    /// Whether the scenario keeps its own trackers.
    pub(super) fn is_empty(&self) -> bool {
        self.exec.is_empty() && self.tracker.is_empty()
    }

    pub(super) fn commands(&self) -> &[String] {
        &self.exec
    }

    /// The keys of a setting, by its key on the command line, if several programs have its placeholder; else empty.
    pub(super) fn shared_setting(&self, key: &str) -> Vec<String> {
        let name = key.strip_prefix("settings.").unwrap_or(key);
        // a key of the scenario has its own meaning on the command line
        if name == key && Scenario::json_schema()["properties"].get(name).is_some() {
            return Vec::new();
        }
        let programs = self.exec.iter().zip(&self.name);
        let own = programs.filter(|(command, _)| self.options.program(command).placeholders().contains(&name));
        let keys: Vec<String> = own.map(|(_, program)| format!("methods.{program}.program.settings.{name}")).collect();
        if keys.len() > 1 { keys } else { Vec::new() }
    }

    /// The trackers as an override of a scenario; `None` if it keeps its own.
    ///
    /// # Errors
    /// [`ExperimentError::Argument`] for names that do not fit; [`ScenarioError`] for an unknown tracker.
    pub(super) fn assignment(&self, scenario: &Scenario) -> Result<Option<String>, ExperimentError> {
        if self.is_empty() {
            return Ok(None);
        }
        let (programs, several) = (self.exec.len(), self.exec.len() + self.tracker.len() > 1);
        let refuse = |detail: String| ExperimentError::Argument { argument: "--name", detail };
        let needed = if programs > 1 { programs } else { self.name.len().min(1) };
        if self.name.len() != needed {
            return Err(refuse(format!(
                "expected one name for each --exec, {programs} in their order, found {}; names distinguish the programs in \
                 folders and reports",
                self.name.len()
            )));
        }
        if let Some(name) = self.name.iter().find(|name| !is_tracker_name(name)) {
            return Err(refuse(format!("expected 1 to 64 letters, digits, `-` or `_`, found {:?}", excerpt(name))));
        }
        let mut named = Vec::new();
        for (index, command) in self.exec.iter().enumerate() {
            let name = self.name.get(index).cloned();
            let program = ProgramTrackerSettings { name: name.clone(), ..self.options.program(command) };
            named.push((name.unwrap_or_else(|| "program".to_owned()), TrackerSettings::Program(program)));
        }
        for name in &self.tracker {
            let own = scenario.trackers().into_iter().map(|(_, own)| own).find(|own| own.name() == name);
            let built_in = own.map_or_else(|| TrackerSettings::named(name), Ok).map_err(ScenarioError::from)?;
            named.push((name.clone(), built_in));
        }
        let mut trackers = Map::new();
        for (name, settings) in named {
            if trackers.insert(name.clone(), serde_json::to_value(settings).unwrap_or_default()).is_some() {
                return Err(refuse(format!("expected different names, found {name} twice")));
            }
        }
        let only = trackers.values().next().cloned().filter(|_| !several);
        Ok(Some(match only {
            Some(tracker) => format!("tracker={}", as_toml(&tracker)),
            None => format!("methods={}", as_toml(&Value::Object(trackers))),
        }))
    }
}

pub(super) fn command_line(text: &str) -> Result<String, String> {
    if text.trim().is_empty() {
        return Err("expected a command line, as in --exec \"python my_tracker.py\", found nothing".to_owned());
    }
    Ok(text.to_owned())
}

fn seconds(text: &str) -> Result<f64, String> {
    let found = text.parse().ok().filter(|seconds: &f64| (0.01..=86_400.0).contains(seconds));
    found.ok_or_else(|| "expected a number of seconds from 0.01 to 86400".to_owned())
}
