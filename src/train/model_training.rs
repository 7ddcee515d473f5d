//! `skiagraph train`: learns a model file from recordings.
//!
//! Finished segments are saved in `MODEL.partial` beside the model, a model file that is marked as incomplete. The same
//! training resumes from it; another training refuses it.

use std::path::{Path, PathBuf};

use super::learning::{Stopped, grow_all};
use super::{LearnedFrom, LearnedModel, ModelFacts};
use crate::artefacts::{Artefact, ArtefactError, ArtefactKind, Destination, Inputs, MadeBy, Unfinished, sibling};
use crate::common::{ExperimentError, Progress, Stage, read_file};
use crate::prepare::clip_file::Folders;
use crate::prepare::robots::robot_named;
use crate::prepare::scenario_copy::inputs_of;
use crate::prepare::{PreparedScene, clip_file};
use crate::scenario::{KeyError, MotionSettings, ScenarioFile, SolidsSource};
use skiagraph_core::body::{Humanoid, Motion};
use skiagraph_core::input::{hex_sha256, limits};
use skiagraph_set::SourceRecording;
use skiagraph_track::motion_model::gpdm::GpdmError;
use skiagraph_track::motion_model::gpdm_graph::{GpdmGraph, GraphError, GraphLearner, GraphSettings, ModelKind};
use skiagraph_truth::retarget::{MotionFingerprint, RetargetError, RetargetOptions, retarget};

#[derive(Clone, Debug)]
pub struct TrainingInput {
    pub body: Humanoid,
    /// Its motions, all at one rate.
    pub motions: Vec<Motion>,
    pub learned_from: Vec<LearnedFrom>,
    /// Fingerprints that identify the motions' frames in any other file.
    pub fingerprints: Vec<Option<MotionFingerprint>>,
    pub notes: Vec<String>,
    pub files: Vec<PathBuf>,
}

/// The part of the recordings, the frame rate and the robot of a training.
#[derive(Clone, Debug, PartialEq)]
pub struct ClipOptions {
    /// The name of a built-in robot, or the path of a URDF file.
    pub robot: PathBuf,
    /// Frames per second to learn at.
    pub frames_per_second: f64,
    /// First frame used of every recording, numbered as in its file, from 1.
    pub first_frame: Option<usize>,
    /// Last frame used of every recording, inclusive.
    pub last_frame: Option<usize>,
    /// Length of the files' unit, metres; `None` for the format's unit or a guess.
    pub metres_per_unit: Option<f64>,
}

#[derive(Clone, Debug)]
pub struct Trained {
    pub model: LearnedModel,
    pub notes: Vec<String>,
}

impl TrainingInput {
    /// The `[training]` of a scenario, on the tracker's body.
    ///
    /// # Errors
    /// [`ExperimentError`] that names the file, line or key; also if the scenario has no `[training]`.
    pub fn from_scenario(file: &ScenarioFile, mocap_directory: Option<&Path>) -> Result<Self, ExperimentError> {
        if file.scenario.training.is_none() {
            let message = "expected [[training.clips]]: a motion model must not learn from the test's own frames";
            return Err(file.located(&KeyError::new("training", message)).into());
        };
        let scene = PreparedScene::new(file, mocap_directory)?;
        let motions = scene.start.training.motions().to_vec();
        let learned_from = scene.training_sources.iter().zip(&motions).map(|(s, m)| LearnedFrom::new(s, m)).collect();
        let fingerprints = scene.training_sources.into_iter().map(|source| source.fingerprint).collect();
        let files = inputs_of(file, mocap_directory).into_paths();
        Ok(Self { body: scene.start.body, motions, learned_from, fingerprints, notes: scene.notes, files })
    }

    /// Recordings, each retargeted to the robot in its subject's size.
    pub fn from_clips(
        clips: &[PathBuf],
        options: &ClipOptions,
        mocap_directory: Option<&Path>,
    ) -> Result<Self, ExperimentError> {
        let places = Folders { folder: Path::new(""), mocap_directory };
        let template = robot_named(Path::new(""), &options.robot, SolidsSource::Urdf)
            .map_err(|e| e.into_error(|detail| ExperimentError::Argument { argument: "--robot", detail }))?;
        let mut input = Self {
            body: template.clone(),
            motions: vec![],
            learned_from: vec![],
            fingerprints: vec![],
            notes: vec![],
            files: vec![PathBuf::from(&options.robot)],
        };
        for (index, clip) in clips.iter().enumerate() {
            let settings = MotionSettings {
                first_frame: options.first_frame,
                last_frame: options.last_frame,
                frames_per_second: options.frames_per_second,
                metres_per_unit: options.metres_per_unit,
                ..MotionSettings::from_clip(&clip.display().to_string())
            };
            let clip_file::UsedRecording { clip: recording, source, .. } =
                clip_file::read_part(places, clip, &settings).map_err(|error| of_argument(error, &settings.clip))?;
            let retargeted = retarget(&recording, &template, &RetargetOptions::default()).map_err(|e| match e {
                RetargetError::MissingMarkers(_) => ExperimentError::from(e).about(&options.robot),
                _ => ExperimentError::from(e).about(clip),
            })?;
            input.learned_from.push(LearnedFrom::new(&source, &retargeted.motion));
            input.fingerprints.push(source.fingerprint);
            input.files.extend(clip_file::paths_of(places, clip, &settings));
            input.notes.extend(retargeted.report.notes.iter().map(|note| format!("{}: {note}", settings.clip)));
            input.motions.push(retargeted.motion);
            if index == 0 {
                input.body = retargeted.humanoid;
            }
        }
        Ok(input)
    }

    fn frames(&self) -> usize {
        self.motions.iter().map(|motion| motion.poses.len()).sum()
    }

    fn warnings(&self) -> Vec<String> {
        let poses = || self.motions.iter().flat_map(|motion| &motion.poses);
        let Some(first) = poses().next() else { return Vec::new() };
        let still = |i: &usize| poses().all(|p| (p.joint_angles[*i] - first.joint_angles[*i]).abs() < 1e-9);
        let still: Vec<&str> = (0..first.joint_angles.len())
            .filter(still)
            .map(|i| self.body.degrees_of_freedom[i].name.as_str())
            .collect();
        let repeated = |motion: &Motion| motion.poses.windows(2).filter(|pair| pair[0] == pair[1]).count();
        let mut warnings = Vec::new();
        if !still.is_empty() {
            warnings.push(format!(
                "constant in the training motion, so the model does not move them: {}",
                still.join(", ")
            ));
        }
        for (from, count) in self.learned_from.iter().zip(self.motions.iter().map(repeated)).filter(|(_, n)| *n > 0) {
            warnings.push(format!("{}: {count} frames equal the previous frame; check the frame rate", from.clip));
        }
        warnings
    }
}

impl LearnedFrom {
    fn new(source: &SourceRecording, motion: &Motion) -> Self {
        Self {
            sha256: source.sha256.clone(),
            first_frame: Some(source.first_frame),
            last_frame: Some(source.last_frame),
            ..Self::from_motion(&source.clip, motion)
        }
    }

    /// The facts of a motion of which only the name is known.
    pub(crate) fn from_motion(clip: &str, motion: &Motion) -> Self {
        let numbers = motion.poses.iter().flat_map(|pose| {
            let (t, q) = (pose.world_from_root.translation.vector, pose.world_from_root.rotation);
            [t.x, t.y, t.z, q.w, q.i, q.j, q.k].into_iter().chain(pose.joint_angles.iter().copied())
        });
        let bytes: Vec<u8> = numbers.flat_map(f64::to_le_bytes).collect();
        Self {
            clip: clip.to_owned(),
            sha256: None,
            first_frame: None,
            last_frame: None,
            frames: motion.poses.len(),
            poses_sha256: hex_sha256(&bytes),
        }
    }
}

/// Learns a model and writes it to `to` when it is complete.
pub fn train(
    input: &TrainingInput,
    settings: &GraphSettings,
    to: Destination<'_>,
    progress: &dyn Progress,
) -> Result<Trained, ExperimentError> {
    let partial = sibling(to.path, "", ".partial");
    let inputs = Inputs::new(input.files.iter().cloned());
    inputs.keep_from(to.path)?;
    inputs.keep_from(&partial)?;
    let facts = facts(input, settings);
    let place = Artefact::begin_unless(to, ArtefactKind::File, other_model(to.path, &facts))?;
    let keeping = Artefact::begin(Destination { path: &partial, ..to }, ArtefactKind::File)?;
    let mut learner =
        GraphLearner::new(&input.body, &input.motions, settings).map_err(|e| describe(input, e, to.path))?;
    let state = |graph: &GpdmGraph, whole: bool| LearnedModel {
        facts: ModelFacts { whole, ..facts.clone() },
        body: input.body.clone(),
        graph: graph.clone(),
        fingerprints: input.fingerprints.clone(),
    };
    let unfinished = if let Some(kept) = kept(&partial, &facts, to.force, progress)? {
        let models = kept.graph.segments.len();
        learner = learner.resume(kept.graph.segments).map_err(|e| describe(input, e, to.path))?;
        let kept = if models == 1 { "1 model".to_owned() } else { format!("{models} models") };
        progress.note(&format!("resuming with {kept} saved in {}", partial.display()));
        Unfinished::resume(&partial)
    } else {
        // report an unwritable output before the work
        keeping.put(&state(learner.graph(), false).to_bytes()?)?;
        Unfinished::begin(&partial)
    };
    let keep = |graph: &GpdmGraph| {
        keeping.put(&state(graph, false).to_bytes()?)?;
        unfinished.keep();
        Ok(())
    };
    progress.begin(Stage::Learn, input.frames());
    (0..learner.frames_done()).for_each(|_| progress.advance());
    if let Err(error) = grow_all(&mut learner, progress, keep) {
        let nothing = learner.graph().segments.is_empty();
        return Err(match error {
            Stopped::Learning(GraphError::Model { source: GpdmError::Interrupted, .. }) if nothing => {
                ExperimentError::Interrupted
            }
            Stopped::Learning(e) => describe(input, e, &partial),
            Stopped::Keeping(e) => e,
        });
    }
    let model = state(&learner.finish(), true);
    place.put(&model.to_bytes()?)?;
    unfinished.discard();
    let mut notes = input.notes.clone();
    notes.extend(input.warnings());
    if model.graph.candidates.is_empty() && settings.kind() == ModelKind::GpdmGraph {
        notes.push(
            "no inter-transition candidates were found: particles only pass from one model to the next of the same \
            recording"
                .into(),
        );
    }
    Ok(Trained { model, notes })
}

/// The error for the command-line argument that corresponds to a key of a clip's settings.
/// An error at a key of the settings of `clip`, at the option that set it.
fn of_argument(error: ExperimentError, clip: &str) -> ExperimentError {
    let ExperimentError::Key(error) = error else { return error };
    let argument = match error.key.as_str() {
        "first_frame" => "--first-frame",
        "last_frame" => "--last-frame",
        "frames_per_second" => "--fps",
        "metres_per_unit" => "--metres-per-unit",
        _ => "CLIP",
    };
    let message = error.message();
    let detail = if error.key == "clip" { message } else { format!("{clip}: {message}") };
    ExperimentError::Argument { argument, detail }
}

fn facts(input: &TrainingInput, settings: &GraphSettings) -> ModelFacts {
    let frames_per_second = input.motions.first().map_or(0.0, |motion| motion.frames_per_second);
    let learned_from = input.learned_from.clone();
    ModelFacts { whole: false, ..ModelFacts::new(&input.body, frames_per_second, learned_from, settings.clone()) }
}

/// The difference between these facts and those of the model at `path`; `None` if there is no such model or no
/// difference.
fn other_model(path: &Path, facts: &ModelFacts) -> Option<String> {
    let there = LearnedModel::from_bytes(path, &read_file(path, limits::ARRAYS).ok()?).ok()?;
    difference_of(&there.facts, facts)
}

/// The first difference of two trainings, complete or not.
fn difference_of(there: &ModelFacts, here: &ModelFacts) -> Option<String> {
    let made_by = |facts: &ModelFacts| {
        let facts = serde_json::to_value(ModelFacts { whole: true, ..facts.clone() });
        Some(MadeBy::new("skiagraph train", facts.ok()?))
    };
    made_by(there)?.difference(&made_by(here)?)
}

/// The state of an interrupted training of the same motions with the same settings; `None` if there is none or it is
/// damaged.
///
/// # Errors
/// [`ArtefactError::OtherUnfinished`] if the state is of another training, unless `force` is given.
fn kept(
    partial: &Path,
    facts: &ModelFacts,
    force: bool,
    progress: &dyn Progress,
) -> Result<Option<LearnedModel>, ExperimentError> {
    let Ok(bytes) = read_file(partial, limits::ARRAYS) else { return Ok(None) };
    let kept = match LearnedModel::from_bytes(partial, &bytes) {
        Ok(kept) => kept,
        Err(_) => {
            progress.note(&format!("{} is damaged: training starts again", partial.display()));
            return Ok(None);
        }
    };
    match difference_of(&kept.facts, facts) {
        _ if kept.graph.segments.is_empty() => Ok(None),
        None => Ok(Some(kept)),
        Some(_) if force => Ok(None),
        Some(difference) => Err(ArtefactError::OtherUnfinished { partial: partial.to_owned(), difference }.into()),
    }
}

/// The same error with the recording's name; for an interruption, the error with the saved progress.
fn describe(input: &TrainingInput, error: GraphError, partial: &Path) -> ExperimentError {
    let of = |motion: usize| PathBuf::from(input.learned_from.get(motion).map_or("training", |from| &from.clip));
    match error {
        GraphError::Model { source: GpdmError::Interrupted, .. } => {
            ArtefactError::ProgressSaved { partial: partial.to_owned() }.into()
        }
        GraphError::Model { range, source } => ExperimentError::Malformed {
            path: of(range.motion),
            detail: format!(
                "frames {} to {} (from 1, at the training's frame rate) of the training motion: {source}",
                range.first + 1,
                range.end
            ),
        },
        GraphError::ShorterThanClip { motion, frames, clip } => ExperimentError::Malformed {
            path: of(motion),
            detail: format!(
                "expected at least {clip} frames, found {frames}; use a longer recording or a smaller --clip-length"
            ),
        },
        other => ExperimentError::from(other).about(of(0)),
    }
}
