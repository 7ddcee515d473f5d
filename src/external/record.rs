//! How a program is run, and the record of its run: its name, its times, and the incidents by frame.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Duration;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::sandbox::ProgramSandbox;
use super::track_timing::TrackTiming;
use super::workplace::LeftBehind;
use crate::scenario::{ProgramTrackerSettings, as_toml, command_with};
use skiagraph_core::input::{excerpt, shell_word};

pub(crate) const EXTERNAL_FILE: &str = "program.json";
/// The table with one row per seed and frame.
pub(crate) const ANSWERS_FILE: &str = "answers.csv";

#[derive(Clone, Debug, PartialEq)]
pub struct ProgramSettings {
    /// The command line, for the shell, with placeholders.
    pub command: String,
    /// Its settings: values of placeholders, also in its environment and in `hello`.
    pub settings: BTreeMap<String, Value>,
    /// Time limit until it is ready.
    pub start_limit: Duration,
    pub frame_limit: Duration,
    /// Number of restarts per seed after a crash or a time limit.
    pub restarts: usize,
    /// Whether messages contain the silhouettes instead of paths.
    pub inline: bool,
    /// Its working directory; by default that of this process.
    pub folder: Option<PathBuf>,
    /// The sandbox; without one the program runs with the rights of its user.
    pub sandbox: Option<ProgramSandbox>,
    /// Whether finished seeds of an interrupted run are neither kept nor used: the command does not say what tracks.
    pub anew: bool,
}

impl ProgramSettings {
    /// Default time limit for a frame, seconds.
    pub const FRAME_LIMIT_S: f64 = 30.0;
    /// Default time limit until the program is ready, seconds.
    pub const START_LIMIT_S: f64 = 60.0;
    pub const RESTARTS: u32 = 3;

    /// The settings of a scenario's program; `hidden` are the paths that it may not see in a sandbox.
    pub fn new(program: &ProgramTrackerSettings, hidden: Vec<PathBuf>) -> Self {
        let readable = program.readable.iter().map(PathBuf::from).collect();
        let seconds = |limit: Option<f64>, default| Duration::from_secs_f64(limit.unwrap_or(default));
        Self {
            command: program.command.clone(),
            settings: program.settings.clone(),
            start_limit: seconds(program.start_limit_s, Self::START_LIMIT_S),
            frame_limit: seconds(program.frame_limit_s, Self::FRAME_LIMIT_S),
            restarts: program.restarts.unwrap_or(Self::RESTARTS) as usize,
            inline: program.inline,
            folder: program.folder.clone(),
            sandbox: program.sandbox.then_some(ProgramSandbox { readable, hidden }),
            anew: false,
        }
    }

    /// The command line with the values of its placeholders.
    pub(super) fn command_line(&self) -> String {
        command_with(&self.command, &self.settings)
    }

    /// The default settings, with an empty command.
    #[cfg(test)]
    pub(super) fn default_settings() -> Self {
        Self {
            command: String::new(),
            settings: BTreeMap::new(),
            start_limit: Duration::from_secs_f64(Self::START_LIMIT_S),
            frame_limit: Duration::from_secs_f64(Self::FRAME_LIMIT_S),
            restarts: Self::RESTARTS as usize,
            inline: false,
            folder: None,
            sandbox: None,
            anew: false,
        }
    }
}

/// The record of an external tracker's run: `program.json`. Everything except `timing` is reproducible if the program
/// is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ExternalRecord {
    /// `skiagraph.program/1`.
    pub schema: String,
    pub command: String,
    /// The program's name, as it reports it.
    pub name: Option<String>,
    /// The program's version, as it reports it.
    pub version: Option<String>,
    /// Options that differ from the defaults; absent in records of earlier versions.
    #[serde(default, skip_serializing_if = "ProgramOptions::are_default")]
    pub options: ProgramOptions,
    /// Hash of the set's files.
    pub set_hash: String,
    /// Whether the set had no truth, so that measuring needs `--truth`.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub without_truth: bool,
    pub skiagraph: String,
    /// Counts of the frames of all seeds by answer.
    pub answers: AnswerCount,
    /// Incidents in order, at most a hundred.
    pub incidents: Vec<Incident>,
    /// How it ended after the last answer of each seed; absent for seeds whose program had ended before.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub endings: Vec<SeedEnding>,
    /// Files that it left in its folders; they are removed.
    #[serde(default, skip_serializing_if = "LeftBehind::is_empty")]
    pub left_behind: LeftBehind,
    /// What differs between runs.
    pub timing: TrackTiming,
}

impl ExternalRecord {
    /// The same with name and version shortened and without control characters, because they are printed and written
    /// into pages.
    pub(crate) fn sanitised(self) -> Self {
        let [name, version] = [&self.name, &self.version].map(|word| word.as_deref().map(excerpt));
        Self { name, version, ..self }
    }

    /// The command line and the values of the program's settings, as on the command line.
    pub(crate) fn command_and_settings(&self) -> String {
        let settings: String = self.options.settings_as_arguments().collect();
        if settings.is_empty() { self.command.clone() } else { format!("{} with{settings}", self.command) }
    }
}

/// How a program ended after the last answer of a seed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SeedEnding {
    pub seed: u64,
    /// Its exit status, or `did not end`.
    pub status: String,
    /// Whether it was killed because it did not end within two seconds.
    pub killed: bool,
}

/// Options of `skiagraph track` that differ from the defaults.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ProgramOptions {
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub settings: BTreeMap<String, Value>,
    /// Whether messages contain the silhouettes.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub inline: bool,
    /// Time limit for a frame, seconds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frame_limit_s: Option<f64>,
    /// Time limit until the program is ready, seconds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub start_limit_s: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub restarts: Option<usize>,
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub sandbox: bool,
    /// Paths that it may read there besides the system and the blind side, as on the command line.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub readable: Vec<String>,
}

impl ProgramOptions {
    pub(crate) fn of(settings: &ProgramSettings) -> Self {
        let seconds = |limit: Duration, default: f64| Some(limit.as_secs_f64()).filter(|seconds| *seconds != default);
        let readable = settings.sandbox.iter().flat_map(|sandbox| &sandbox.readable);
        Self {
            settings: settings.settings.clone(),
            inline: settings.inline,
            frame_limit_s: seconds(settings.frame_limit, ProgramSettings::FRAME_LIMIT_S),
            start_limit_s: seconds(settings.start_limit, ProgramSettings::START_LIMIT_S),
            restarts: Some(settings.restarts).filter(|restarts| *restarts != ProgramSettings::RESTARTS as usize),
            sandbox: settings.sandbox.is_some(),
            readable: readable.map(|path| path.display().to_string()).collect(),
        }
    }

    pub(crate) fn are_default(&self) -> bool {
        *self == Self::default()
    }

    fn settings_as_arguments(&self) -> impl Iterator<Item = String> {
        self.settings.iter().map(|(name, value)| {
            let assignment = format!("{name}={}", as_toml(value));
            format!(" {}", shell_word(&assignment))
        })
    }
}

/// Frames of all seeds by their answers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct AnswerCount {
    /// With an estimate.
    pub poses: usize,
    /// Reported as lost by the program.
    pub lost: usize,
    /// Without a valid answer in time.
    pub failed: usize,
}

impl AnswerCount {
    /// Counts a frame by its `answer` column in `answers.csv`.
    pub(super) fn add(&mut self, word: &str) {
        match word {
            "failed" => self.failed += 1,
            "pose" => self.poses += 1,
            _ => self.lost += 1,
        }
    }
}

/// A failure of the program.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Incident {
    pub seed: u64,
    /// The requested frame; absent before the first and after the last.
    pub frame: Option<usize>,
    pub what: String,
    /// The last lines of the program's standard error.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub standard_error: Vec<String>,
}

impl Incident {
    pub fn describe(&self) -> String {
        let frame = self.frame.map(|frame| format!(", frame {frame}")).unwrap_or_default();
        let errors = match self.standard_error.as_slice() {
            [] => String::new(),
            lines => format!("; its last lines: {}", lines.join(" / ")),
        };
        format!("seed {}{frame}: {}{errors}", self.seed, self.what)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_that_differ_from_the_defaults_are_kept() {
        let settings = ProgramSettings {
            command: "sh t.sh --alpha {alpha}".to_owned(),
            settings: [("alpha".to_owned(), 0.5.into())].into(),
            start_limit: Duration::from_secs_f64(ProgramSettings::START_LIMIT_S),
            frame_limit: Duration::from_secs_f64(0.5),
            restarts: 0,
            inline: true,
            folder: None,
            sandbox: Some(ProgramSandbox { readable: vec!["my tracker".into()], hidden: vec!["set".into()] }),
            anew: false,
        };
        let options = ProgramOptions::of(&settings);
        assert_eq!(options.settings_as_arguments().collect::<String>(), " alpha=0.5");
        let text = serde_json::to_string(&options).unwrap();
        assert_eq!(serde_json::from_str::<ProgramOptions>(&text).unwrap(), options);
        let default_settings = ProgramSettings {
            frame_limit: Duration::from_secs_f64(ProgramSettings::FRAME_LIMIT_S),
            restarts: ProgramSettings::RESTARTS as usize,
            inline: false,
            settings: BTreeMap::new(),
            sandbox: None,
            ..settings
        };
        assert!(ProgramOptions::of(&default_settings).are_default());
    }

    #[test]
    fn the_name_of_a_program_cannot_control_the_terminal() {
        let timing = TrackTiming { seconds: 1.0, frames_per_second: 1.0, likelihood_evaluations: 0, threads: 1 };
        let record = ExternalRecord {
            schema: "skiagraph.program/1".to_owned(),
            command: "sh t.sh".to_owned(),
            name: Some("\u{1b}[31mred\n".to_owned()),
            version: Some("9".repeat(5000)),
            options: ProgramOptions::default(),
            set_hash: String::new(),
            without_truth: false,
            skiagraph: String::new(),
            answers: AnswerCount::default(),
            incidents: Vec::new(),
            endings: Vec::new(),
            left_behind: LeftBehind::default(),
            timing,
        };
        assert_eq!(record.command_and_settings(), "sh t.sh");
        let sanitised = record.sanitised();
        assert_eq!(sanitised.name.as_deref(), Some("\u{fffd}[31mred "));
        assert_eq!(sanitised.version.as_ref().map(|version| version.chars().count()), Some(200));
        let settings: BTreeMap<String, Value> =
            BTreeMap::from([("alpha".to_owned(), 0.5.into()), ("beta".to_owned(), true.into())]);
        let options = ProgramOptions { settings, ..ProgramOptions::default() };
        let set = ExternalRecord { command: "sh t.sh {alpha}".to_owned(), options, ..sanitised };
        assert_eq!(set.command_and_settings(), "sh t.sh {alpha} with alpha=0.5 beta=true");
    }
}
