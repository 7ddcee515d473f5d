//! Learns or reads the motion models of trackers, each only once.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::model_store::ModelStore;
use super::{LearnedModel, ModelFacts};
use crate::common::{ExperimentError, Progress, Stage};
use crate::scenario::{LearnedMotion, TrackerSettings};
use skiagraph_core::body::{Humanoid, Motion};
use skiagraph_set::{BlindSet, SourceRecording, Training};
use skiagraph_track::motion_model::LatentModel;
use skiagraph_track::motion_model::gpdm::{GpdmError, Round};
use skiagraph_track::motion_model::gpdm_graph::{
    GpdmGraph, GraphError, GraphLearner, GraphSettings, ModelKind, SegmentRange,
};

/// A start pose farther than this from every training pose is noted: rad^2 per joint, which is half a radian per joint.
const FAR_START: f64 = 0.25;

/// The motion models that trackers have used so far. Seeds and methods share equal models.
#[derive(Clone, Debug, Default)]
pub struct Models {
    /// Base folder of the paths of model files; empty for the working directory.
    folder: PathBuf,
    /// The test's recordings, if known: no model may be learned from them.
    test: Vec<SourceRecording>,
    learned: Vec<(GraphSettings, Arc<GpdmGraph>)>,
    /// The folder in which processes share learned models, if they do.
    store: Option<ModelStore>,
    read: Vec<ReadModel>,
    /// Whether the note about a start pose far from the training was given.
    has_noted_far_start: bool,
}

#[derive(Clone, Debug)]
struct ReadModel {
    path: PathBuf,
    facts: ModelFacts,
    /// The recordings that it was learned from.
    sources: Vec<SourceRecording>,
    graph: Arc<GpdmGraph>,
}

impl Models {
    /// Models for the trackers of a scenario; paths are relative to its `folder`. Models learned from `test`,
    /// the recordings of the truth, are refused.
    pub fn new(folder: &Path, test: &[SourceRecording]) -> Self {
        Self { folder: folder.to_owned(), test: test.to_vec(), ..Self::default() }
    }

    /// The same models, shared with other processes in this folder.
    pub(crate) fn sharing(self, folder: PathBuf) -> Self {
        Self { store: Some(ModelStore::new(folder)), ..self }
    }

    /// The recordings that the model of this file was learned from; empty if it was not read yet.
    pub(crate) fn sources_of(&self, name: &str) -> &[SourceRecording] {
        let path = self.folder.join(name);
        self.read.iter().find(|model| model.path == path).map_or(&[], |model| &model.sources)
    }

    /// The model of these settings, learned on first use.
    pub fn learn(
        &mut self,
        settings: &GraphSettings,
        body: &Humanoid,
        training: &Training,
        progress: &dyn Progress,
    ) -> Result<Arc<GpdmGraph>, ExperimentError> {
        let Training::Motions(motions) = training else { return Err(ExperimentError::NoTraining) };
        if let Some((_, known)) = self.learned.iter().find(|(known, _)| known == settings) {
            return Ok(known.clone());
        }
        let mut learn = || {
            progress.begin(Stage::Learn, training.frames());
            let mut learner = GraphLearner::new(body, &motions.motions, settings)?;
            grow_all(&mut learner, progress, |_| Ok(()))?;
            Ok::<_, ExperimentError>(learner.finish())
        };
        // model files hold one motion per model
        let store = self.store.as_ref().filter(|_| !settings.joint);
        let graph = Arc::new(match store {
            Some(store) => store.get(settings, body, motions, progress, &mut learn)?,
            None => learn()?,
        });
        self.learned.push((settings.clone(), graph.clone()));
        Ok(graph)
    }

    /// The model of a file, checked for this kind, body and frame rate.
    fn of_file(
        &mut self,
        name: &str,
        kind: ModelKind,
        body: &Humanoid,
        rate: f64,
        progress: &dyn Progress,
    ) -> Result<Arc<GpdmGraph>, ExperimentError> {
        let path = self.folder.join(name);
        let of_model = |e: ExperimentError| ExperimentError::ModelFile(Box::new(e));
        let at = match self.read.iter().position(|known| known.path == path) {
            Some(at) => at,
            None => {
                let model = LearnedModel::read(&path).map_err(of_model)?;
                let sources = model.sources();
                if sources.iter().any(|source| source.fingerprint.is_none()) {
                    progress.note(&format!(
                        "{} has no motion fingerprints (older version), so overlap with the test is checked by file \
                        names and hashes only; train the model again",
                        path.display()
                    ));
                }
                self.read.push(ReadModel {
                    path: path.clone(),
                    facts: model.facts,
                    sources,
                    graph: model.graph.into(),
                });
                self.read.len() - 1
            }
        };
        let ReadModel { facts, sources, graph, .. } = &self.read[at];
        facts.check_fits(&path, body, rate).map_err(of_model)?;
        let unfit = |detail: String| Err(of_model(ExperimentError::Malformed { path: path.clone(), detail }));
        if facts.settings.kind() != kind {
            let (found, wanted) = (facts.settings.kind().name(), kind.name());
            return unfit(format!(
                "expected a {wanted} model, which this tracker needs, found a {found} model; train one with --model {wanted}"
            ));
        }
        let shared = |from: &SourceRecording| self.test.iter().find_map(|test| from.shared_frames(test));
        if let Some((from, (first, last))) = sources.iter().find_map(|from| shared(from).map(|frames| (from, frames))) {
            return unfit(format!(
                "learned from frames {first} to {last} (of the file, from 1) of `{}`, which are also frames of the \
                scenario's [motion]; learn from frames that are not in the test",
                from.clip
            ));
        }
        Ok(graph.clone())
    }

    /// Reads and checks the model file of a tracker, if it has one.
    pub(crate) fn check_file(
        &mut self,
        tracker: &TrackerSettings,
        body: &Humanoid,
        rate: f64,
        progress: &dyn Progress,
    ) -> Result<(), ExperimentError> {
        match tracker.kind().learned {
            Some(LearnedMotion { model_file: Some(name), learning, .. }) => {
                self.of_file(name, learning.kind(), body, rate, progress).map(|_| ())
            }
            _ => Ok(()),
        }
    }

    /// The latent motion model of a tracker. If the settings give it the true roots, these are taken from `truth`,
    /// which has one pose of the tracker's body per frame; nothing else of it is used.
    ///
    /// # Errors
    /// As [`Self::learn`] and [`ModelFacts::check_fits`]; [`ExperimentError::OracleNeedsTruth`] if true roots are
    /// needed and there is no truth.
    pub(crate) fn latent(
        &mut self,
        settings: &LearnedMotion<'_>,
        set: &BlindSet,
        truth: Option<&Motion>,
        progress: &dyn Progress,
    ) -> Result<LatentModel, ExperimentError> {
        let (body, learning) = (&set.start.body, &settings.learning);
        let graph = match settings.model_file {
            Some(name) => self.of_file(name, learning.kind(), body, set.frames_per_second, progress)?,
            None => self.learn(learning, body, &set.start.training, progress)?,
        };
        let model = LatentModel::new(body.clone(), graph, settings.latent)?;
        self.note_far_start(model.start_distance(&set.start.pose), progress);
        if !settings.is_given_roots {
            return Ok(model);
        }
        let truth = truth.ok_or(ExperimentError::OracleNeedsTruth)?;
        Ok(model.with_given_roots(truth.poses.iter().map(|pose| pose.world_from_root).collect()))
    }

    /// Notes once that particles start at the nearest training pose if the start pose is far from all training poses.
    fn note_far_start(&mut self, distance: f64, progress: &dyn Progress) {
        if distance > FAR_START && !self.has_noted_far_start {
            self.has_noted_far_start = true;
            let degrees = distance.sqrt().to_degrees();
            progress.note(&format!(
                "the start pose is {degrees:.0} degrees per joint away from the nearest training pose, and particles \
                start at that training pose; add training motion with a similar pose"
            ));
        }
    }
}

pub(crate) enum Stopped {
    /// Learning failed or was interrupted.
    Learning(GraphError),
    /// The learned part cannot be saved.
    Keeping(ExperimentError),
}

impl From<Stopped> for ExperimentError {
    fn from(stopped: Stopped) -> Self {
        match stopped {
            Stopped::Learning(GraphError::Model { source: GpdmError::Interrupted, .. }) => Self::Interrupted,
            Stopped::Learning(error) => error.into(),
            Stopped::Keeping(error) => error,
        }
    }
}

/// Learns all remaining segments; `keep` is called with the graph after each.
pub(crate) fn grow_all(
    learner: &mut GraphLearner<'_>,
    progress: &dyn Progress,
    keep: impl Fn(&GpdmGraph) -> Result<(), ExperimentError>,
) -> Result<(), Stopped> {
    loop {
        let (models, done) = (learner.graph().segments.len(), learner.frames_done());
        let mut keep_on = |range: SegmentRange, round: Round| {
            let frames = range.end - range.first;
            let (number, loss) = (round.number, round.loss);
            progress
                .set_status(&format!("model {}: {frames} frames, round {number}, -ln posterior {loss:.1}", models + 1));
            !progress.interrupted()
        };
        if learner.grow(&mut keep_on).map_err(Stopped::Learning)?.is_none() {
            return Ok(());
        }
        keep(learner.graph()).map_err(Stopped::Keeping)?;
        (done..learner.frames_done()).for_each(|_| progress.advance());
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use super::*;

    #[derive(Default)]
    struct Listener(Mutex<Vec<String>>);

    impl Progress for Listener {
        fn begin(&self, _: Stage, _: usize) {}
        fn advance(&self) {}
        fn note(&self, note: &str) {
            self.0.lock().unwrap().push(note.to_owned());
        }
        fn interrupted(&self) -> bool {
            false
        }
    }

    #[test]
    fn a_model_of_several_motions_is_learned_although_models_are_shared_in_a_folder() {
        let body = Humanoid::tracker25().unwrap();
        let swing = |frames: usize, speed: f64| Motion {
            frames_per_second: 60.0,
            poses: (0..frames)
                .map(|t| {
                    let mut pose = body.zero_pose();
                    let angles = pose.joint_angles.iter_mut().enumerate();
                    angles.for_each(|(i, a)| *a = 0.05 * (speed * t as f64 + i as f64).sin());
                    pose
                })
                .collect(),
        };
        let training = Training::new(vec![swing(35, 0.2), swing(40, 0.3)]);
        let mut settings = GraphSettings { single: true, joint: true, ..GraphSettings::default() };
        settings.training.rounds = 1;
        let folder = tempfile::tempdir().unwrap();
        let learn = |mut models: Models| models.learn(&settings, &body, &training, &Listener::default()).unwrap();
        let alone = learn(Models::default());
        // twice: the second must not read what the first may have stored
        let shared = || learn(Models::default().sharing(folder.path().to_owned()));
        assert_eq!([shared(), shared()], [alone.clone(), alone]);
    }

    #[test]
    fn a_start_far_from_the_training_is_noted_once() {
        let (mut models, listener) = (Models::default(), Listener::default());
        models.note_far_start(0.01, &listener);
        assert!(listener.0.lock().unwrap().is_empty());
        models.note_far_start(1.0, &listener);
        models.note_far_start(1.0, &listener);
        let notes = listener.0.into_inner().unwrap();
        assert_eq!(notes.len(), 1);
        assert!(notes[0].contains("57 degrees"), "{notes:?}");
    }
}
