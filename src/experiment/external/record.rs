//! What is kept of a run of a program: who it was, how long it took, and what went wrong in which frame.

use serde::{Deserialize, Serialize};

use crate::experiment::track_timing::TrackTiming;
use crate::input::excerpt;

/// The record of a program's run.
pub(in crate::experiment) const EXTERNAL_FILE: &str = "program.json";
/// A row for every frame of every seed.
pub(in crate::experiment) const ANSWERS_FILE: &str = "answers.csv";

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
    /// Which set, by the hash of its files.
    pub set_hash: String,
    /// Version of skiagraph.
    pub skiagraph: String,
    /// How many frames of all seeds it answered.
    pub answers: AnswerCount,
    /// What went wrong, in order; at most a hundred.
    pub incidents: Vec<Incident>,
    /// What differs from run to run.
    pub timing: TrackTiming,
}

impl ExternalRecord {
    /// The same with name and version bounded and without control characters: they are printed, and stand in pages.
    pub(in crate::experiment) fn harmless(self) -> Self {
        let [name, version] = [&self.name, &self.version].map(|word| word.as_deref().map(excerpt));
        Self { name, version, ..self }
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

/// Something that went wrong.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Incident {
    /// The seed.
    pub seed: u64,
    /// The frame that was asked for; absent before the first.
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
    fn what_a_program_calls_itself_controls_no_terminal() {
        let timing = TrackTiming { seconds: 1.0, frames_per_second: 1.0, likelihood_evaluations: 0, threads: 1 };
        let record = ExternalRecord {
            schema: "skiagraph.program/1".to_owned(),
            command: "sh t.sh".to_owned(),
            name: Some("\u{1b}[31mred\n".to_owned()),
            version: Some("9".repeat(5000)),
            set_hash: String::new(),
            skiagraph: String::new(),
            answers: AnswerCount::default(),
            incidents: Vec::new(),
            timing,
        };
        let harmless = record.harmless();
        assert_eq!(harmless.name.as_deref(), Some("\u{fffd}[31mred "));
        assert_eq!(harmless.version.map(|version| version.chars().count()), Some(200));
    }
}
