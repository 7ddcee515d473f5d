//! Learned motion models in a folder that processes share: every distinct model is learned once, by the first process
//! that needs it.
//!
//! A model is identified by a hash of everything that it depends on: the settings, the body, the poses, and the
//! program's version. All processes use the model as read from the file, also the one that wrote it.

use std::path::{Path, PathBuf};
use std::time::Duration;

use super::{LearnedFrom, LearnedModel, ModelFacts};
use crate::artefacts::{Artefact, ArtefactError, ArtefactKind, Destination};
use crate::common::{ExperimentError, Progress, to_json};
use skiagraph_core::body::Humanoid;
use skiagraph_core::input::hex_sha256;
use skiagraph_set::{TrainingMotions, body_to_json};
use skiagraph_track::motion_model::gpdm_graph::{GpdmGraph, GraphSettings};

/// Hexadecimal digits of the hash in a file's name.
const DIGITS: usize = 16;
/// Interval at which a model that another process learns is checked for.
const POLL_INTERVAL: Duration = Duration::from_millis(200);

#[derive(Clone, Debug)]
pub(crate) struct ModelStore {
    folder: PathBuf,
}

impl ModelStore {
    /// Models in this folder, which need not exist yet.
    pub(crate) fn new(folder: PathBuf) -> Self {
        Self { folder }
    }

    /// The model of these settings: read, or learned with `learn` and written. Waits while another process learns it.
    pub(crate) fn get(
        &self,
        settings: &GraphSettings,
        body: &Humanoid,
        training: &TrainingMotions,
        progress: &dyn Progress,
        learn: &mut dyn FnMut() -> Result<GpdmGraph, ExperimentError>,
    ) -> Result<GpdmGraph, ExperimentError> {
        let facts = facts(settings, body, training);
        let path = self.path(&facts, body)?;
        loop {
            if path.exists() {
                return read(&path, &facts);
            }
            if progress.interrupted() {
                return Err(ExperimentError::Interrupted);
            }
            match Artefact::begin(Destination { path: &path, force: false }, ArtefactKind::File) {
                // another process is learning it
                Err(ArtefactError::Busy { .. }) => std::thread::sleep(POLL_INTERVAL),
                Err(error) => return Err(error.into()),
                // another process has just written it
                Ok(_) if path.exists() => {}
                Ok(place) => {
                    let model = LearnedModel {
                        graph: learn()?,
                        body: body.clone(),
                        fingerprints: vec![None; facts.learned_from.len()],
                        facts: facts.clone(),
                    };
                    place.put(&model.to_bytes()?)?;
                }
            }
        }
    }

    fn path(&self, facts: &ModelFacts, body: &Humanoid) -> Result<PathBuf, ExperimentError> {
        let mut bytes = to_json(facts)?;
        bytes.extend(body_to_json("body", body)?);
        let hash = hex_sha256(&bytes);
        Ok(self.folder.join(format!("{}.model", hash.get(..DIGITS).unwrap_or(&hash))))
    }
}

fn facts(settings: &GraphSettings, body: &Humanoid, training: &TrainingMotions) -> ModelFacts {
    let named =
        |index: usize| training.sources.get(index).cloned().unwrap_or_else(|| format!("training {}", index + 1));
    let motions = training.motions.iter().enumerate();
    let learned_from = motions.map(|(index, motion)| LearnedFrom::from_motion(&named(index), motion)).collect();
    let rate = training.motions.first().map_or(0.0, |motion| motion.frames_per_second);
    ModelFacts::new(body, rate, learned_from, settings.clone())
}

fn read(path: &Path, facts: &ModelFacts) -> Result<GpdmGraph, ExperimentError> {
    let model = LearnedModel::read(path)?;
    if model.facts == *facts {
        return Ok(model.graph);
    }
    let detail = "does not have the model of its name; remove the file, and the model is learned again".to_owned();
    Err(ExperimentError::Malformed { path: path.to_owned(), detail })
}
