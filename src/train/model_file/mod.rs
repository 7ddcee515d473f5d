//! The file of a learned motion model (`skiagraph.model/1`): an `.npz` with every matrix as an array.
//!
//! | array | shape | meaning |
//! |---|---|---|
//! | `facts` | bytes | JSON: robot, training motions and settings ([`ModelFacts`]) |
//! | `body` | bytes | JSON: its body, as a set's `body.json` |
//! | `segments` | (S, 3) | training motion, first frame and one past the last frame of every model |
//! | `mean`, `scales` | (S, D) | mean observation and scales W |
//! | `map_kernel` | (S, 2) | inverse width, noise precision |
//! | `dynamics_kernel` | (S, 4) | amplitude, inverse width, linear amplitude, noise precision |
//! | `centred`, `latents` | (N, D), (N, d) | observations minus their mean, and latents, model after model |
//! | `errors` | (N) | distance between recording and simulation, rad^2 (`[GPDM graph]`, Eq. 9) |
//! | `rotations` | (N, J, 4) | joint rotations of the training frames, `w x y z` |
//! | `candidates` | (C, 2) | model and row of every inter-transition candidate |
//! | `chart_means`, `root_units` | (J, 4), (6) | mean rotations and units of the observation vectors |
//! | `fingerprint`, `fingerprint_rows`, `fingerprint_version` | (F, 16), (M), () | fingerprints that identify the frames of the M recordings in any other file |
//!
//! Every array carries a checksum. Kernel matrices are recomputed when a model is read.

mod arrays;
mod facts;
#[cfg(test)]
mod tests;

use std::path::Path;

use serde::Deserialize;

use self::arrays::{Arrays, ArraysError};
pub use self::facts::{LearnedFrom, ModelFacts, RobotFacts};
use crate::common::{ExperimentError, read_file, to_json};
use crate::scenario::json_tree;
use skiagraph_core::body::Humanoid;
use skiagraph_core::input::{excerpt, limits};
use skiagraph_core::npz::{Array, Npz, Values};
use skiagraph_set::{SetError, SourceRecording, body_from_json, body_to_json, push_fingerprints, read_fingerprints};
use skiagraph_track::motion_model::gpdm::{DynamicsKernel, GpdmParts};
use skiagraph_track::motion_model::gpdm_graph::GpdmGraph;
use skiagraph_track::motion_model::pose_chart::ROOT_DIMENSIONS;
use skiagraph_truth::retarget::MotionFingerprint;

/// The format's name and version.
pub const MODEL_SCHEMA: &str = "skiagraph.model/1";

#[derive(Clone, Debug, PartialEq)]
pub struct LearnedModel {
    /// Its robot, training motions and settings.
    pub facts: ModelFacts,
    pub body: Humanoid,
    /// The model: a graph of GPDMs, or one GPDM for each whole motion.
    pub graph: GpdmGraph,
    /// Fingerprints that identify the frames of every recording of the facts; `None` in files of older versions.
    pub fingerprints: Vec<Option<MotionFingerprint>>,
}

impl LearnedModel {
    /// The recordings, and their frames, that it was learned from.
    pub fn sources(&self) -> Vec<SourceRecording> {
        let all = self.facts.learned_from.iter().zip(&self.fingerprints);
        let source = |(from, fingerprint): (&LearnedFrom, &Option<MotionFingerprint>)| SourceRecording {
            clip: from.clip.clone(),
            sha256: from.sha256.clone(),
            first_frame: from.first_frame.unwrap_or(1),
            last_frame: from.last_frame.unwrap_or(usize::MAX),
            fingerprint: fingerprint.clone(),
        };
        all.map(source).collect()
    }

    pub fn read(path: &Path) -> Result<Self, ExperimentError> {
        let model = Self::from_bytes(path, &read_file(path, limits::ARRAYS)?)?;
        if !model.facts.whole {
            let detail = "the training of this model was interrupted; run the same skiagraph train again to finish it";
            return Err(malformed(path, detail));
        }
        Ok(model)
    }

    /// The model of a file's bytes, complete or not. Errors name `path`.
    pub fn from_bytes(path: &Path, bytes: &[u8]) -> Result<Self, ExperimentError> {
        let file = path.display().to_string();
        let npz = Npz::from_bytes(&file, bytes).map_err(|e| not_a_model(path, e))?;
        let facts = facts_of(path, &npz)?;
        let body = body_from_json(&file, bytes_of(path, &npz, "body")?)?;
        if RobotFacts::from_body(&body) != facts.robot {
            return Err(malformed(path, "its body differs from the robot that its facts describe"));
        }
        let graph = Arrays { file: &file, npz: &npz }.graph(&facts, &body);
        let graph = graph.map_err(|e| match e {
            ArraysError::Npz(e) => not_a_model(path, e),
            ArraysError::Parts(e) => malformed(path, e.to_string()),
        })?;
        if graph.segments.iter().any(|s| s.range.motion >= facts.learned_from.len()) {
            return Err(malformed(path, "segments: expected training motions that its facts list"));
        }
        let fingerprints =
            read_fingerprints(&file, &npz, facts.learned_from.len()).map_err(|e| not_a_model(path, e))?;
        Ok(Self { facts, body, graph, fingerprints })
    }

    /// The bytes of the file.
    ///
    /// # Errors
    /// [`ExperimentError`] if the parts of the graph do not fit together, or beyond 4 GiB.
    pub fn to_bytes(&self) -> Result<Vec<u8>, ExperimentError> {
        let file = Path::new("model");
        let graph = self.graph.clone().checked().map_err(|e| malformed(file, e.to_string()))?;
        let body = body_to_json("body", &self.body)?;
        let facts = to_json(&self.facts)?;
        let parts: Vec<GpdmParts> = graph.segments.iter().map(|s| s.gpdm.to_parts()).collect();
        let (models, frames) = (parts.len(), graph.segments.iter().map(|s| s.errors.len()).sum());
        let (dimensions, joints) = (graph.chart.dimensions(), graph.chart.groups().len());
        let all = |of: &dyn Fn(&GpdmParts) -> Vec<f64>| parts.iter().flat_map(of).collect::<Vec<f64>>();
        let latents = all(&|p| p.latents.clone());
        let latent_dimensions = self.facts.settings.training.latent_dimensions;
        let ranges = graph.segments.iter().flat_map(|s| [s.range.motion, s.range.first, s.range.end]);
        let rotations = graph.segments.iter().flat_map(|s| s.rotations.iter().flatten());
        let candidates = graph.candidates.iter().flat_map(|c| [c.segment, c.row]);
        let means = graph.chart.mean_rotations().into_iter().flatten().collect::<Vec<f64>>();
        let mut npz = Npz::from_iter([
            ("facts", Array::new(&[facts.len()], facts)),
            ("body", Array::new(&[body.len()], body)),
            ("segments", Array::new(&[models, 3], integers(ranges))),
            ("mean", Array::new(&[models, dimensions], all(&|p| p.mean.clone()))),
            ("scales", Array::new(&[models, dimensions], all(&|p| p.scales.clone()))),
            ("map_kernel", Array::new(&[models, 2], all(&|p| vec![p.map.inverse_width, p.map.noise_precision]))),
            ("dynamics_kernel", Array::new(&[models, 4], all(&|p| dynamics_numbers(&p.dynamics).to_vec()))),
            ("centred", Array::new(&[frames, dimensions], all(&|p| p.centred.clone()))),
            ("latents", Array::new(&[frames, latent_dimensions], latents)),
            ("errors", Array::new(&[frames], graph.segments.iter().flat_map(|s| s.errors.clone()).collect::<Vec<_>>())),
            (
                "rotations",
                Array::new(&[frames, joints, 4], rotations.flat_map(|q| [q.w, q.i, q.j, q.k]).collect::<Vec<f64>>()),
            ),
            ("candidates", Array::new(&[graph.candidates.len(), 2], integers(candidates))),
            ("chart_means", Array::new(&[joints, 4], means)),
            ("root_units", Array::new(&[ROOT_DIMENSIONS], graph.chart.root_units().to_vec())),
        ]);
        if self.fingerprints.iter().any(Option::is_some) {
            push_fingerprints(&mut npz, self.fingerprints.iter().map(Option::as_ref));
        }
        Ok(npz.to_bytes("model")?)
    }
}

#[derive(Deserialize)]
struct ModelTag {
    schema: String,
}

fn facts_of(path: &Path, npz: &Npz) -> Result<ModelFacts, ExperimentError> {
    let bytes = bytes_of(path, npz, "facts")?;
    let in_facts = |detail| malformed(path, format!("facts: {detail}"));
    let ModelTag { schema } = json_tree::value_of_file(bytes).map_err(in_facts)?;
    if schema != MODEL_SCHEMA {
        let detail = match schema.strip_prefix("skiagraph.model/") {
            Some(_) => format!("written as {}, this program reads {MODEL_SCHEMA}; update skiagraph", excerpt(&schema)),
            None => format!("schema {:?}, expected {MODEL_SCHEMA:?}", excerpt(&schema)),
        };
        return Err(malformed(path, detail));
    }
    json_tree::value_of_file(bytes).map_err(in_facts)
}

fn bytes_of<'a>(path: &Path, npz: &'a Npz, name: &str) -> Result<&'a [u8], ExperimentError> {
    match npz.get(name).map(|array| &array.values) {
        Some(Values::U8(bytes)) => Ok(bytes),
        _ => Err(malformed(path, format!("not a skiagraph model: it has no array {name:?}"))),
    }
}

fn malformed(path: &Path, detail: impl Into<String>) -> ExperimentError {
    ExperimentError::Malformed { path: path.to_owned(), detail: detail.into() }
}

fn not_a_model(path: &Path, error: impl Into<SetError>) -> ExperimentError {
    match error.into() {
        SetError::Malformed { detail, .. } => malformed(path, format!("{detail} (not a complete skiagraph model)")),
        other => other.into(),
    }
}

fn dynamics_numbers(kernel: &DynamicsKernel) -> [f64; 4] {
    [kernel.amplitude, kernel.inverse_width, kernel.linear, kernel.noise_precision]
}

fn integers(values: impl Iterator<Item = usize>) -> Vec<i64> {
    values.map(|value| value as i64).collect()
}
