//! What is kept of a run of a program: who it was, how long it took, and what went wrong in which frame.

use serde::{Deserialize, Serialize};

use crate::experiment::track_timing::TrackTiming;

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
