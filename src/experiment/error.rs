//! Why an experiment could not be done.

use std::io;
use std::path::PathBuf;

use super::ScenarioError;

/// Why an experiment could not be done. Every message says what, where, and what to do.
#[derive(Debug, thiserror::Error)]
pub enum ExperimentError {
    /// The scenario is unsound by itself.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// The scenario asks for something that its files do not have.
    #[error("{origin}: {key}: {message}")]
    Unsound {
        /// The scenario.
        origin: String,
        /// Dotted key.
        key: String,
        /// What was expected, what was found, what to do.
        message: String,
    },
    /// A result cannot be written.
    #[error("{path}: cannot {action}: {source}", path = path.display())]
    Output {
        /// The file or directory.
        path: PathBuf,
        /// What was tried, as in "cannot ...".
        action: &'static str,
        /// What the operating system answered.
        source: io::Error,
    },
    /// Something that is not ours stands where a result should go.
    #[error(
        "{path}: there is something here that is not a result of ours; choose another --out, or --force to move it aside",
        path = path.display()
    )]
    Occupied {
        /// The place.
        path: PathBuf,
    },
    /// The user stopped it.
    #[error("interrupted; nothing was written")]
    Interrupted,
}

impl ExperimentError {
    /// The process's exit code: 2 for bad input or a place that cannot be written, 130 after an interruption.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Interrupted => 130,
            _ => 2,
        }
    }
}
