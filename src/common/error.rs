//! The error of the application.

use std::io;
use std::path::{Path, PathBuf};

use crate::artefacts::{ArtefactError, NOTHING_WRITTEN, Resumable, is_no_room};
use crate::scenario::{KeyError, ScenarioError, ScenarioFile};
use skiagraph_core::body::{SkinError, TooFewFrames, UrdfError};
use skiagraph_core::contact::ContactError;
use skiagraph_core::input::{self, plain};
use skiagraph_core::npz::NpzError;
use skiagraph_eval::{EvaluationError, GateRefusal, NotComparable};
use skiagraph_physics::PhysicsError;
use skiagraph_report::ReportError;
use skiagraph_set::SetError;
use skiagraph_track::motion_model::SettingError;
use skiagraph_track::motion_model::gpdm_graph::GraphError;
use skiagraph_track::tracker::{CalibrationError, TrackError};
use skiagraph_truth::mocap::MocapError;
use skiagraph_truth::retarget::RetargetError;
use skiagraph_truth::scene::SceneError;

/// Why the tracker `keypoints` needs several cameras.
pub(crate) const ONE_CAMERA: &str = "expected at least two cameras, not 1: keypoints of one camera have no depth; use \
                                     annealed_particle_filter with evidence = \"keypoints\"";

/// The exit code of this program, and of trackers, if the same command may succeed later (`EX_TEMPFAIL`).
pub(crate) const TRY_AGAIN: u8 = 75;

/// Errors of experiments. Every message names the problem, the place, and what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExperimentError {
    /// The scenario is invalid by itself, or does not fit the files that it names.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// A value of a scenario is invalid; the file and line are added where both are known.
    #[error(transparent)]
    Key(#[from] KeyError),
    /// A recording cannot be used.
    #[error(transparent)]
    Mocap(#[from] MocapError),
    /// A robot cannot be used.
    #[error(transparent)]
    Robot(#[from] UrdfError),
    /// A skin cannot be used.
    #[error(transparent)]
    Skin(#[from] SkinError),
    /// A recording cannot be retargeted to a robot.
    #[error(transparent)]
    Retarget(#[from] RetargetError),
    /// Contact of a motion cannot be measured.
    #[error("actor.contact: {0}")]
    Contact(#[from] ContactError),
    /// A motion cannot be planted or simulated, or its dynamics cannot be computed.
    #[error("actor.contact: {0}")]
    Physics(#[from] PhysicsError),
    /// The scene is invalid.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A result cannot be written to its place.
    #[error(transparent)]
    Artefact(#[from] ArtefactError),
    /// A set cannot be read or made.
    #[error(transparent)]
    Set(SetError),
    /// A setting of a tracker or motion model is invalid.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// A training motion is too short to measure differences between frames.
    #[error(transparent)]
    TooFewFrames(#[from] TooFewFrames),
    /// A motion model cannot be learned.
    #[error(transparent)]
    Learning(#[from] GraphError),
    /// A tracker learns from motion, and the set has no training motion.
    #[error(
        "this tracker learns from training motion, and the set has none; give the trackers with a motion model one of \
        `skiagraph train` (model_file=FILE), or render the set from a scenario with [[training.clips]]"
    )]
    NoTraining,
    /// A tracker uses keypoints, and the set has none.
    #[error(
        "this tracker uses keypoints, and the set has none; render the set with observation.keypoints.layout=halpe26, \
        coco17 or body25"
    )]
    NoKeypoints,
    /// The tracker `keypoints` cannot triangulate in one camera.
    #[error("tracker keypoints: {ONE_CAMERA}")]
    KeypointsOfOneCamera,
    /// The run's models learned from frames of the test.
    #[error(
        "{run}: its tracker learned from frames {first} to {last} (of the file, from 1) of `{clip}`, which are frames of the \
        test; such a run measures memory, not tracking",
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
    /// The model file that a setting names cannot be used.
    #[error(transparent)]
    ModelFile(Box<ExperimentError>),
    /// Tracking failed.
    #[error(transparent)]
    Track(#[from] TrackError),
    /// The tracker's body cannot be calibrated.
    #[error(transparent)]
    Calibration(#[from] CalibrationError),
    /// Nothing can be measured.
    #[error(transparent)]
    Evaluation(#[from] EvaluationError),
    /// No report can be drawn.
    #[error(transparent)]
    Report(#[from] ReportError),
    /// The set has no ground truth for the tracker's body.
    #[error(
        "the oracle needs ground truth for the tracker's body, and this set has none; make the set with skiagraph render"
    )]
    OracleNeedsTruth,
    /// The run does not fit the set.
    #[error("{} does not fit {}: {detail}", plain(run.display()), plain(set.display()))]
    AnotherSet {
        /// The run.
        run: PathBuf,
        /// The set.
        set: PathBuf,
        /// The difference.
        detail: String,
    },
    /// Estimates in memory do not fit the set.
    #[error("these estimates do not fit the set {}: {}", plain(set), plain(detail))]
    Unfit {
        /// The set's name.
        set: String,
        /// The difference.
        detail: String,
    },
    /// Runs cannot be compared.
    #[error("{}", plain(.0))]
    NotComparable(Box<NotComparable>),
    /// A run cannot be compared with a baseline.
    #[error("{}", plain(.0))]
    Gate(Box<GateRefusal>),
    /// A program that should track cannot be run.
    #[error(
        "--exec {}: it {}{}; docs/protocol.md describes what it must answer",
        plain(command),
        plain(what),
        last_lines(errors)
    )]
    Program {
        /// The command line.
        command: String,
        /// What went wrong.
        what: String,
        /// Its last lines on standard error.
        errors: Vec<String>,
    },
    /// A program that tracks asked to be run again later.
    #[error(
        "--exec {}: it ended with exit code {TRY_AGAIN}, which asks for another time; run the same command again",
        plain(command)
    )]
    Postponed {
        /// The command line.
        command: String,
    },
    /// A set would be overwritten.
    #[error(
        "{}: a benchmark set exists here, and runs may depend on it; write elsewhere, or replace it with --force",
        plain(path.display())
    )]
    SetThere {
        /// The path.
        path: PathBuf,
    },
    /// A file of a run does not have the expected content.
    #[error("{}: {}", plain(path.display()), plain(detail))]
    Malformed {
        /// The file.
        path: PathBuf,
        /// What was expected and what was found.
        detail: String,
    },
    /// A value has no form in JSON.
    #[error("cannot be written as JSON: {0}")]
    Unwritable(#[from] serde_json::Error),
    /// A file of a run cannot be read.
    #[error("{}: cannot be read: {source}", plain(path.display()))]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// The operating system's error.
        source: io::Error,
    },
    /// A folder of exports exists where one export would go.
    #[error(
        "{}: this folder contains exports ({there}); choose --out {} to put this one beside them, or use \
        --force to rename the folder to NAME~",
        plain(path.display()),
        plain(beside.display())
    )]
    ExportsThere {
        /// The path.
        path: PathBuf,
        /// The formats that are there.
        there: String,
        /// The place of the export beside them.
        beside: PathBuf,
    },
    /// A folder has another sweep.
    #[error(
        "{}: other results are planned here ({}); write elsewhere. The plan of a sweep can be extended, which keeps the \
        results of cells that are in both: skiagraph sweep plan --extend",
        plain(path.display()),
        plain(difference)
    )]
    OtherPlan {
        /// The folder.
        path: PathBuf,
        /// The first difference.
        difference: String,
    },
    /// No cell of a sweep has a result yet.
    #[error("{}: no cell has a result yet; run the sweep: skiagraph sweep run DIR", plain(path.display()))]
    SweepIncomplete {
        /// The sweep's folder.
        path: PathBuf,
    },
    /// A command-line argument is invalid.
    #[error("{argument}: {}", plain(detail))]
    Argument {
        /// The argument.
        argument: &'static str,
        /// What was expected and what was found.
        detail: String,
    },
    /// An error with the file that it is about.
    #[error("{}: {source}", plain(file.display()))]
    With {
        /// The scenario, recording, set or run.
        file: PathBuf,
        /// The error.
        source: Box<ExperimentError>,
    },
    /// The user interrupted the command.
    #[error("{NOTHING_WRITTEN}")]
    Interrupted,
    /// A set could not be drawn, or not all seeds tracked, for a reason that may pass.
    #[error("{source}; progress is saved in {}: run the same command to resume", plain(partial.display()))]
    Unfinished {
        /// The directory with the progress.
        partial: PathBuf,
        /// The reason.
        source: Box<ExperimentError>,
    },
}

impl ExperimentError {
    /// The process's exit code: 2 for bad input or output that cannot be written, 75 if another process is at work, the
    /// disk is full or a program asks for another time, 1 if a sweep is incomplete, 130 after an interruption.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Artefact(error) => error.exit_code(),
            // the disk may have space later
            Self::Set(SetError::Io { source, .. }) if is_no_room(source) => TRY_AGAIN,
            Self::Postponed { .. } => TRY_AGAIN,
            Self::Unfinished { source, .. } => source.exit_code(),
            Self::SweepIncomplete { .. } => 1,
            Self::Interrupted => 130,
            _ => 2,
        }
    }

    /// The same error with the file and line of its key, if it names a key of this scenario.
    pub(crate) fn located(self, file: &ScenarioFile) -> Self {
        match self {
            Self::Key(error) => file.located(&error).into(),
            other => other,
        }
    }

    /// The same error with the key relative to a table, if it names a key.
    pub(crate) fn within(self, table: &str) -> Self {
        match self {
            Self::Key(error) => error.within(table).into(),
            other => other,
        }
    }

    /// The same error with the file that it is about, unless it names one itself.
    pub(crate) fn about(self, file: impl Into<PathBuf>) -> Self {
        if self.names_a_file() { self } else { Self::With { file: file.into(), source: Box::new(self) } }
    }

    /// The same error for work whose progress is saved, if it is.
    pub(crate) fn with_progress(self, resumable: &Resumable) -> Self {
        let partial = resumable.folder().to_owned();
        match self {
            _ if !resumable.is_kept() => self,
            Self::Interrupted => ArtefactError::ProgressSaved { partial }.into(),
            Self::Artefact(ArtefactError::OtherUnfinished { .. }) => self,
            other => Self::Unfinished { partial, source: Box::new(other) },
        }
    }

    fn names_a_file(&self) -> bool {
        match self {
            Self::Mocap(error) => !matches!(error, MocapError::Setting(_)),
            Self::Robot(error) => !matches!(error, UrdfError::NotShipped(_)),
            Self::Skin(error) => matches!(error, SkinError::Unreadable { .. } | SkinError::Malformed { .. }),
            Self::Set(error) => !matches!(error, SetError::Inconsistent { .. }),
            Self::ModelFile(source) => source.names_a_file(),
            Self::Key(_) | Self::Contact(_) | Self::Physics(_) | Self::Retarget(_) | Self::Scene(_) => false,
            Self::Setting(_) | Self::TooFewFrames(_) | Self::Learning(_) | Self::Track(_) => false,
            Self::Calibration(_) | Self::Evaluation(_) | Self::Report(_) => false,
            Self::NoTraining | Self::NoKeypoints | Self::KeypointsOfOneCamera | Self::OracleNeedsTruth => false,
            _ => true,
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

/// Whether the user has to act before the file can be read: it is missing, of another kind, or access is denied. Other
/// reasons, such as a network that is down, may pass.
pub(crate) fn stays_unreadable(error: &io::Error) -> bool {
    use io::ErrorKind::{
        FileTooLarge, InvalidData, InvalidInput, IsADirectory, NotADirectory, NotFound, PermissionDenied,
    };
    matches!(
        error.kind(),
        NotFound | PermissionDenied | IsADirectory | NotADirectory | InvalidData | InvalidInput | FileTooLarge
    )
}

/// The last lines of a program's standard error, for the end of a message.
fn last_lines(errors: &[String]) -> String {
    if errors.is_empty() { String::new() } else { format!("; its last lines: {}", plain(errors.join(" / "))) }
}

pub(crate) fn key_error(key: impl Into<String>, message: impl Into<String>) -> ExperimentError {
    KeyError::new(key, message).into()
}

pub(crate) fn read_file(path: &Path, limit: u64) -> Result<Vec<u8>, ExperimentError> {
    input::read(path, limit).map_err(|source| ExperimentError::Unreadable { path: path.to_owned(), source })
}
