//! Why an experiment could not be done.

use std::io;
use std::path::{Path, PathBuf};

use crate::benchmark_set::SetError;
use crate::body::UrdfError;
use crate::contact::ContactError;
use crate::evaluation::EvaluationError;
use crate::input::{self, plain};
use crate::mocap::MocapError;
use crate::motion_model::MotionModelError;
use crate::motion_model::gpdm_graph::GraphError;
use crate::npz::NpzError;
use crate::physics::PhysicsError;
use crate::report::ReportError;
use crate::retarget::RetargetError;
use crate::scenario::{ScenarioError, ScenarioFile};
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
    /// A motion cannot be simulated, or its dynamics cannot be told.
    #[error("actor.contact: {0}")]
    Physics(#[from] PhysicsError),
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
    /// A model was to be learned from a set that has no motion to learn from.
    #[error(
        "this tracker learns from motion, and the set has none for it; render it from a scenario with [[training.clips]]"
    )]
    NoTraining,
    /// A run whose models learned from frames of the test.
    #[error(
        "{run}: its tracker learned from frames {first} to {last} of `{clip}`, and they are frames of the test; such a run measures \
         memory, not tracking",
        run = run.display()
    )]
    LearnedFromTest {
        /// The run.
        run: PathBuf,
        /// The recording.
        clip: String,
        /// First frame, as its file counts.
        first: usize,
        /// Last frame.
        last: usize,
    },
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
    #[error("{} was not made from {}: {detail}", plain(run.display()), plain(set.display()))]
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
        "{}: there is a benchmark set here already, and runs may have been made from it; choose another place with \
         --out, or replace it with --force",
        plain(path.display())
    )]
    SetThere {
        /// The place.
        path: PathBuf,
    },
    /// A file of a run does not hold what its format says.
    #[error("{}: {}", plain(path.display()), plain(detail))]
    Malformed {
        /// The file.
        path: PathBuf,
        /// What was expected and what was found.
        detail: String,
    },
    /// A file of a run cannot be read.
    #[error("{}: cannot be read: {source}", plain(path.display()))]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the operating system answered.
        source: io::Error,
    },
    /// A result cannot be written.
    #[error("{}: cannot {action}: {source}", plain(path.display()))]
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
        "{}: there is something here that is not a result of ours as we wrote it; choose another --out, or --force to move it \
         aside",
        plain(path.display())
    )]
    Occupied {
        /// The place.
        path: PathBuf,
    },
    /// An argument of the command line makes no sense.
    #[error("{argument}: {}", plain(detail))]
    Argument {
        /// The argument.
        argument: &'static str,
        /// What was expected and what was found.
        detail: String,
    },
    /// What went wrong says nothing of the file with which it did.
    #[error("{}: {source}", plain(file.display()))]
    With {
        /// The scenario, recording, set or run.
        file: PathBuf,
        /// What went wrong.
        source: Box<ExperimentError>,
    },
    /// The user stopped it.
    #[error("interrupted; nothing was written")]
    Interrupted,
    /// The user stopped a training.
    #[error("interrupted; what is learned is kept in {}: the same command goes on from there", plain(partial.display()))]
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

    /// The same error with the file that it is about, unless it names one itself.
    pub(crate) fn about(self, file: impl Into<PathBuf>) -> Self {
        if self.names_a_file() { self } else { Self::With { file: file.into(), source: Box::new(self) } }
    }

    fn names_a_file(&self) -> bool {
        match self {
            Self::Mocap(error) => !matches!(error, MocapError::Setting { .. } | MocapError::NotCyclic { .. }),
            Self::Robot(error) => !matches!(error, UrdfError::NotShipped { .. }),
            Self::Set(error) => !matches!(error, SetError::Inconsistent { .. }),
            Self::Contact(_) | Self::Physics(_) => false,
            Self::Retarget(_) | Self::Scene(_) | Self::Setting(_) | Self::MotionModel(_) => false,
            Self::Learning(_) | Self::NoTraining | Self::Track(_) | Self::Evaluation(_) | Self::Report(_) => false,
            Self::OracleNeedsTruth => false,
            Self::LearnedFromTest { .. } | Self::Busy { .. } | Self::IsInput { .. } => true,
            Self::Scenario(_) | Self::AnotherSet { .. } | Self::SetThere { .. } | Self::Malformed { .. } => true,
            Self::Unreadable { .. } | Self::Output { .. } | Self::Occupied { .. } | Self::Argument { .. } => true,
            Self::With { .. } | Self::Interrupted | Self::TrainingInterrupted { .. } => true,
        }
    }
}

impl From<NpzError> for ExperimentError {
    fn from(error: NpzError) -> Self {
        Self::Set(error.into())
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

/// What is wrong with a scenario, at one of its keys.
pub(super) fn scenario_error(file: &ScenarioFile, key: &str, message: String) -> ExperimentError {
    ScenarioError::from(file.complaint(key, message)).into()
}

pub(super) fn output(path: &Path, action: &'static str) -> impl FnOnce(io::Error) -> ExperimentError {
    let path = path.to_owned();
    move |source| ExperimentError::Output { path, action, source }
}

pub(super) fn read_file(path: &Path, limit: u64) -> Result<Vec<u8>, ExperimentError> {
    input::read(path, limit).map_err(|source| ExperimentError::Unreadable { path: path.to_owned(), source })
}
