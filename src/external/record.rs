//! How a program is run, and what is kept of its run: who it was, how long it took, and what went wrong in which
//! frame.

use std::time::Duration;

use serde::{Deserialize, Serialize};

use super::sandbox::ProgramSandbox;
use super::track_timing::TrackTiming;
use super::workplace::LeftBehind;
use crate::input::{excerpt, shell_word};

/// The record of a program's run.
pub(crate) const EXTERNAL_FILE: &str = "program.json";
/// A row for every frame of every seed.
pub(crate) const ANSWERS_FILE: &str = "answers.csv";

/// How a program is run.
#[derive(Clone, Debug, PartialEq)]
pub struct ProgramSettings {
    /// The command line, for the shell.
    pub command: String,
    /// How long it may take until it is ready.
    pub start_limit: Duration,
    /// How long it may take for a frame.
    pub frame_limit: Duration,
    /// How often it is started again after a crash or a time limit, a seed.
    pub restarts: usize,
    /// Silhouettes within the messages instead of paths.
    pub inline: bool,
    /// What it may see in a sandbox; `None` for none: it runs with the rights of its user.
    pub sandbox: Option<ProgramSandbox>,
}

impl ProgramSettings {
    /// Seconds that a program may take for a frame, unless told otherwise.
    pub const FRAME_LIMIT_S: f64 = 30.0;
    /// Seconds that a program may take until it is ready, unless told otherwise.
    pub const START_LIMIT_S: f64 = 60.0;
    /// How often a program is started again, unless told otherwise.
    pub const RESTARTS: u32 = 3;

    /// As without options; the command is empty.
    #[cfg(test)]
    pub(super) fn usual() -> Self {
        Self {
            command: String::new(),
            start_limit: Duration::from_secs_f64(Self::START_LIMIT_S),
            frame_limit: Duration::from_secs_f64(Self::FRAME_LIMIT_S),
            restarts: Self::RESTARTS as usize,
            inline: false,
            sandbox: None,
        }
    }
}

/// Who tracked what: `program.json`. All but `timing` is the same for a program that always answers the same.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ExternalRecord {
    /// `skiagraph.program/1`.
    pub schema: String,
    /// The command line.
    pub command: String,
    /// What it calls itself.
    pub name: Option<String>,
    /// Which version of itself it says it is.
    pub version: Option<String>,
    /// How it was run where not by default; records of earlier versions have none.
    #[serde(default, skip_serializing_if = "ProgramOptions::are_default")]
    pub options: ProgramOptions,
    /// Which set, by the hash of its files.
    pub set_hash: String,
    /// Whether the set had no truth, so that the run is measured with `--truth`.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub without_truth: bool,
    /// Version of skiagraph.
    pub skiagraph: String,
    /// How many frames of all seeds it answered.
    pub answers: AnswerCount,
    /// What went wrong, in order; at most a hundred.
    pub incidents: Vec<Incident>,
    /// How it ended after its last answer, a seed; a seed whose program was gone for good before has none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub endings: Vec<SeedEnding>,
    /// What it left in the folders that it was handed; none of it is kept.
    #[serde(default, skip_serializing_if = "LeftBehind::is_empty")]
    pub left_behind: LeftBehind,
    /// What differs from run to run.
    pub timing: TrackTiming,
}

impl ExternalRecord {
    /// The same with name and version bounded and without control characters: they are printed, and stand in pages.
    pub(crate) fn harmless(self) -> Self {
        let [name, version] = [&self.name, &self.version].map(|word| word.as_deref().map(excerpt));
        Self { name, version, ..self }
    }
}

/// How a program ended after the last answer of a seed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SeedEnding {
    /// The seed.
    pub seed: u64,
    /// Its exit status, or that it did not end.
    pub status: String,
    /// Whether it did not end by itself within two seconds and was killed.
    pub killed: bool,
}

/// Options of `skiagraph track` that are not its defaults.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ProgramOptions {
    /// Silhouettes within the messages.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub inline: bool,
    /// Seconds for a frame.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frame_limit_s: Option<f64>,
    /// Seconds until it is ready.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub start_limit_s: Option<f64>,
    /// How often it is started again, a seed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub restarts: Option<usize>,
    /// In a sandbox.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub sandbox: bool,
    /// What it may read there besides the system and the blind side, as the command line has it.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub readable: Vec<String>,
}

impl ProgramOptions {
    pub(crate) fn of(settings: &ProgramSettings) -> Self {
        let seconds = |limit: Duration, usual: f64| Some(limit.as_secs_f64()).filter(|seconds| *seconds != usual);
        let readable = settings.sandbox.iter().flat_map(|sandbox| &sandbox.readable);
        Self {
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

    /// As on the command line, each with a space before it.
    pub(crate) fn in_words(&self) -> String {
        let inline = self.inline.then(|| " --inline".to_owned());
        let frame = self.frame_limit_s.map(|seconds| format!(" --frame-limit {seconds}"));
        let start = self.start_limit_s.map(|seconds| format!(" --start-limit {seconds}"));
        let restarts = self.restarts.map(|restarts| format!(" --restarts {restarts}"));
        let sandbox = self.sandbox.then(|| " --sandbox".to_owned());
        let readable = self.readable.iter().map(|path| Some(format!(" --readable {}", shell_word(path))));
        [inline, frame, start, restarts, sandbox].into_iter().chain(readable).flatten().collect()
    }
}

/// Frames of all seeds by their answers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct AnswerCount {
    /// With an estimate.
    pub poses: usize,
    /// Given up by the program itself.
    pub lost: usize,
    /// Without an answer in time, or with one that makes no sense.
    pub failed: usize,
}

impl AnswerCount {
    /// Counts a frame by its word in `answers.csv`.
    pub(super) fn add(&mut self, word: &str) {
        match word {
            "failed" => self.failed += 1,
            "pose" => self.poses += 1,
            _ => self.lost += 1,
        }
    }
}

/// Something that went wrong.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Incident {
    /// The seed.
    pub seed: u64,
    /// The frame that was asked for; absent before the first and after the last.
    pub frame: Option<usize>,
    /// What happened.
    pub what: String,
    /// The last lines of the program's standard error.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub standard_error: Vec<String>,
}

impl Incident {
    /// In one line.
    pub fn in_words(&self) -> String {
        let frame = self.frame.map(|frame| format!(", frame {frame}")).unwrap_or_default();
        let said = match self.standard_error.as_slice() {
            [] => String::new(),
            lines => format!("; its last lines: {}", lines.join(" / ")),
        };
        format!("seed {}{frame}: {}{said}", self.seed, self.what)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_are_kept_where_they_are_not_the_defaults() {
        let settings = ProgramSettings {
            command: "sh t.sh".to_owned(),
            start_limit: Duration::from_secs_f64(ProgramSettings::START_LIMIT_S),
            frame_limit: Duration::from_secs_f64(0.5),
            restarts: 0,
            inline: true,
            sandbox: Some(ProgramSandbox { readable: vec!["my tracker".into()], hidden: vec!["set".into()] }),
        };
        let options = ProgramOptions::of(&settings);
        assert_eq!(options.in_words(), " --inline --frame-limit 0.5 --restarts 0 --sandbox --readable 'my tracker'");
        let text = serde_json::to_string(&options).unwrap();
        assert_eq!(serde_json::from_str::<ProgramOptions>(&text).unwrap(), options);
        let usual = ProgramSettings {
            frame_limit: Duration::from_secs_f64(ProgramSettings::FRAME_LIMIT_S),
            restarts: ProgramSettings::RESTARTS as usize,
            inline: false,
            sandbox: None,
            ..settings
        };
        assert!(ProgramOptions::of(&usual).are_default());
    }

    #[test]
    fn what_a_program_calls_itself_controls_no_terminal() {
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
        let harmless = record.harmless();
        assert_eq!(harmless.name.as_deref(), Some("\u{fffd}[31mred "));
        assert_eq!(harmless.version.map(|version| version.chars().count()), Some(200));
    }
}
