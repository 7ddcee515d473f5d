//! Learned motion models in a folder that processes share: every distinct one is learned once, by whoever asks first.
//!
//! A model is known by a hash of all that it depends on: the settings, the body, the poses, and the program's version.
//! What is used is always what the file holds, also by the process that wrote it.

use std::path::{Path, PathBuf};
use std::time::Duration;

use super::{LearnedFrom, LearnedModel, ModelFacts};
use crate::artefacts::{Artefact, ArtefactError, ArtefactKind, Destination};
use crate::benchmark_set::{TrainingMotions, body_to_json};
use crate::body::Humanoid;
use crate::common::{ExperimentError, Progress, to_json};
use crate::input::hex_sha256;
use crate::motion_model::gpdm_graph::{GpdmGraph, GraphSettings};

/// Hexadecimal digits of a hash that name a file.
const DIGITS: usize = 16;
/// How often it is looked whether another process has learned a model.
const PATIENCE: Duration = Duration::from_millis(200);

/// The folder.
#[derive(Clone, Debug)]
pub(crate) struct ModelStore {
    folder: PathBuf,
}

impl ModelStore {
    /// Models in this folder, which need not be there yet.
    pub(crate) fn new(folder: PathBuf) -> Self {
        Self { folder }
    }

    /// The model of these settings: read, or learned with `learn` and written. While another process learns it, this
    /// one waits.
    ///
    /// # Errors
    /// Those of `learn`; [`ExperimentError`] where the file cannot be read or written, or holds another model.
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
                // another process learns it
                Err(ArtefactError::Busy { .. }) => std::thread::sleep(PATIENCE),
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
    let detail = "is not the model that its name says; remove it, and it is learned again".to_owned();
    Err(ExperimentError::Malformed { path: path.to_owned(), detail })
}
