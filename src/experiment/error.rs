//! Why an experiment could not be done.

use std::io;
use std::path::{Path, PathBuf};

use super::ScenarioError;
use crate::benchmark_set::SetError;
use crate::body::UrdfError;
use crate::body::retarget::RetargetError;
use crate::contact::ContactError;
use crate::evaluation::EvaluationError;
use crate::mocap::MocapError;
use crate::motion_model::MotionModelError;
use crate::motion_model::gpdm_graph::GraphError;
use crate::report::ReportError;
use crate::scene::SceneError;
use crate::tracker::{SettingError, TrackError};

/// Why an experiment could not be done. Every message says what, where, and what to do.
#[derive(Debug, thiserror::Error)]
pub enum ExperimentError {
    /// The scenario is unsound by itself, or asks for something that its files do not have.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// A recording cannot be used.
    #[error(transparent)]
    Mocap(#[from] MocapError),
    /// A robot cannot be used.
    #[error(transparent)]
    Robot(#[from] UrdfError),
    /// A recording cannot be given to a robot.
    #[error(transparent)]
    Retarget(#[from] RetargetError),
    /// A motion cannot be settled on the ground.
    #[error("actor.contact: {0}")]
    Contact(#[from] ContactError),
    /// There is nothing to see.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A set cannot be read or made.
    #[error(transparent)]
    Set(SetError),
    /// A tracker's setting makes no sense.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// A motion model cannot be made.
    #[error(transparent)]
    MotionModel(#[from] MotionModelError),
    /// A motion model cannot be learned.
    #[error(transparent)]
    Learning(#[from] GraphError),
    /// A model was to be learned of the test itself.
    #[error(
        "this tracker learns a motion model, and the set's training motion is that of the test itself; render it from a scenario with [[training.clips]]"
    )]
    NoTraining,
    /// Tracking could not go on.
    #[error(transparent)]
    Track(#[from] TrackError),
    /// Nothing can be measured.
    #[error(transparent)]
    Evaluation(#[from] EvaluationError),
    /// No report can be drawn.
    #[error(transparent)]
    Report(#[from] ReportError),
    /// The oracle was asked of a set that does not know the truth for the tracker's body.
    #[error(
        "the oracle needs the truth, and this set has none for the tracker's body; render it with skiagraph render"
    )]
    OracleNeedsTruth,
    /// A run and a set that do not belong together.
    #[error("{run} was not made from {set}: {detail}", run = run.display(), set = set.display())]
    AnotherSet {
        /// The run.
        run: PathBuf,
        /// The set.
        set: PathBuf,
        /// How one can tell.
        detail: String,
    },
    /// A set would be overwritten.
    #[error(
        "{path}: there is a benchmark set here already, and runs may have been made from it; choose another place with \
         --out, or replace it with --force",
        path = path.display()
    )]
    SetThere {
        /// The place.
        path: PathBuf,
    },
    /// A file of a run does not hold what its format says.
    #[error("{path}: {detail}", path = path.display())]
    Malformed {
        /// The file.
        path: PathBuf,
        /// What was expected and what was found.
        detail: String,
    },
    /// A file of a run cannot be read.
    #[error("{path}: cannot be read: {source}", path = path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the operating system answered.
        source: io::Error,
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
    /// Another process of this program writes to the same place.
    #[error(
        "{path}: another skiagraph is writing here now; wait until it is done, or choose another --out",
        path = path.display()
    )]
    Busy {
        /// The place.
        path: PathBuf,
    },
    /// What a command reads would be overwritten or changed.
    #[error(
        "{path}: the command reads {input}, which this --out would replace or change; choose another --out",
        path = path.display(), input = input.display()
    )]
    IsInput {
        /// The place.
        path: PathBuf,
        /// What is read.
        input: PathBuf,
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
    /// An argument of the command line makes no sense.
    #[error("{argument}: {detail}")]
    Argument {
        /// The argument.
        argument: &'static str,
        /// What was expected and what was found.
        detail: String,
    },
    /// The user stopped it.
    #[error("interrupted; nothing was written")]
    Interrupted,
    /// The user stopped a training.
    #[error("interrupted; what is learned is kept in {}: the same command goes on from there", partial.display())]
    TrainingInterrupted {
        /// Where it is kept.
        partial: PathBuf,
    },
}

impl ExperimentError {
    /// The process's exit code: 2 for bad input or a place that cannot be written, 75 where another process is at work, 130 after
    /// an interruption.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Busy { .. } => 75,
            Self::Interrupted | Self::TrainingInterrupted { .. } => 130,
            _ => 2,
        }
    }
}

impl From<SetError> for ExperimentError {
    fn from(error: SetError) -> Self {
        match error {
            SetError::Stopped => Self::Interrupted,
            other => Self::Set(other),
        }
    }
}

pub(super) fn output(path: &Path, action: &'static str) -> impl FnOnce(io::Error) -> ExperimentError {
    let path = path.to_owned();
    move |source| ExperimentError::Output { path, action, source }
}

pub(super) fn read_file(path: &Path) -> Result<Vec<u8>, ExperimentError> {
    std::fs::read(path).map_err(|source| ExperimentError::Unreadable { path: path.to_owned(), source })
}
