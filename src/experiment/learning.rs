//! Learning the motion models that trackers ask for, each once.

use std::sync::Arc;

use super::watch::{Stage, Watch};
use super::{ExperimentError, LatentKind, LatentTrackerSettings, RootMode};
use crate::benchmark_set::{BlindSet, Training};
use crate::body::{Humanoid, Motion};
use crate::motion_model::LatentModel;
use crate::motion_model::gpdm_graph::{GpdmGraph, GraphLearner, GraphSettings};

/// A start pose farther than this from every training pose is told to the user: rad^2 per joint, half a radian each.
const FAR_START: f64 = 0.25;

/// The motion models learned so far from one training: seeds and methods that ask for the same one share it.
#[derive(Debug, Default)]
pub struct Models {
    learned: Vec<(GraphSettings, Arc<GpdmGraph>)>,
    /// Whether the user was told that the start is far from the training.
    told_far_start: bool,
}

impl Models {
    /// The model of these settings, learned if it is not there yet.
    ///
    /// # Errors
    /// [`ExperimentError`] where the training is the test's own motion, or nothing can be learned from it.
    pub fn learn(
        &mut self,
        settings: &GraphSettings,
        body: &Humanoid,
        training: &Training,
        watch: &dyn Watch,
    ) -> Result<Arc<GpdmGraph>, ExperimentError> {
        if training.of_the_test {
            return Err(ExperimentError::NoTraining);
        }
        if let Some((_, known)) = self.learned.iter().find(|(known, _)| known == settings) {
            return Ok(known.clone());
        }
        watch.begin(Stage::Learn, training.frames());
        let mut learner = GraphLearner::new(body, &training.motions, settings)?;
        loop {
            let before = learner.frames_done();
            let grown = learner.grow(&mut |_, _| !watch.interrupted());
            if watch.interrupted() {
                return Err(ExperimentError::Interrupted);
            }
            if grown?.is_none() {
                break;
            }
            (before..learner.frames_done()).for_each(|_| watch.advance());
        }
        let graph = learner.finish();
        let graph = Arc::new(graph);
        self.learned.push((settings.clone(), graph.clone()));
        Ok(graph)
    }

    /// The particles' motion that a tracker asks for. `truth`, one pose of the tracker's body a frame, gives roots away where the
    /// settings want that; nothing else is taken of it.
    ///
    /// # Errors
    /// As [`Self::learn`]; [`ExperimentError::OracleNeedsTruth`] where roots cannot be given away.
    pub(super) fn latent<T: LatentKind>(
        &mut self,
        settings: &LatentTrackerSettings<T>,
        set: &BlindSet,
        truth: Option<&Motion>,
        watch: &dyn Watch,
    ) -> Result<LatentModel, ExperimentError> {
        let body = &set.start.body;
        let graph = self.learn(&settings.model.learning(), body, &set.start.training, watch)?;
        let model = LatentModel::new(body.clone(), graph, settings.latent())?;
        self.tell_far_start(model.start_distance(&set.start.pose), watch);
        Ok(match settings.root {
            RootMode::Tracked => model,
            RootMode::Oracle => {
                let truth = truth.ok_or(ExperimentError::OracleNeedsTruth)?;
                model.with_given_roots(truth.poses.iter().map(|pose| pose.world_from_root).collect())
            }
        })
    }

    /// Says once that particles start from the nearest training poses because the start pose is far from all of them.
    fn tell_far_start(&mut self, distance: f64, watch: &dyn Watch) {
        if distance > FAR_START && !self.told_far_start {
            self.told_far_start = true;
            let degrees = distance.sqrt().to_degrees();
            watch.say(&format!(
                "the start pose is {degrees:.0} degrees a joint away from the nearest training pose: particles start from there; \
                 train on motion that holds such a pose"
            ));
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use super::*;

    #[derive(Default)]
    struct Listener(Mutex<Vec<String>>);

    impl Watch for Listener {
        fn begin(&self, _: Stage, _: usize) {}
        fn advance(&self) {}
        fn say(&self, note: &str) {
            self.0.lock().unwrap().push(note.to_owned());
        }
        fn interrupted(&self) -> bool {
            false
        }
    }

    #[test]
    fn a_start_far_from_the_training_is_told_once() {
        let (mut models, listener) = (Models::default(), Listener::default());
        models.tell_far_start(0.01, &listener);
        assert!(listener.0.lock().unwrap().is_empty());
        models.tell_far_start(1.0, &listener);
        models.tell_far_start(1.0, &listener);
        let told = listener.0.into_inner().unwrap();
        assert_eq!(told.len(), 1);
        assert!(told[0].contains("57 degrees"), "{told:?}");
    }
}
