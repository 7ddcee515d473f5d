//! Learning the motion models that trackers ask for, each once.

use std::sync::Arc;

use super::watch::{Stage, Watch};
use super::{ExperimentError, LatentKind, LatentTrackerSettings, RootMode};
use crate::benchmark_set::{BlindSet, Training};
use crate::body::{Humanoid, Motion};
use crate::motion_model::LatentModel;
use crate::motion_model::gpdm_graph::{GpdmGraph, GraphLearner, GraphSettings};

/// The motion models learned so far from one training: seeds and methods that ask for the same one share it.
#[derive(Debug, Default)]
pub struct Models {
    learned: Vec<(GraphSettings, Arc<GpdmGraph>)>,
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
        Ok(match settings.root {
            RootMode::Tracked => model,
            RootMode::Oracle => {
                let truth = truth.ok_or(ExperimentError::OracleNeedsTruth)?;
                model.with_given_roots(truth.poses.iter().map(|pose| pose.world_from_root).collect())
            }
        })
    }
}
