//! Results, kept part by part in `runs/monocular/parts`, so that an interrupted study resumes.

use std::collections::BTreeMap;
use std::error::Error;
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use skiagraph::artefacts::Destination;
use skiagraph::common::NoProgress;
use skiagraph::evaluation::Summary;
use skiagraph::experiment::{Compared, compare};
use skiagraph::prepare::PreparedScene;
use skiagraph::report::ComparedMethod;
use skiagraph::scenario::ScenarioFile;

use super::units::Unit;

/// One motion tracked with one protocol by all methods.
#[derive(Serialize, Deserialize)]
pub(crate) struct Tracked {
    /// Description of both bodies, as in the program's reports.
    pub(crate) bodies: String,
    pub(crate) frames: usize,
    pub(crate) methods: BTreeMap<String, Method>,
}

/// One of the methods.
#[derive(Serialize, Deserialize)]
pub(crate) struct Method {
    pub(crate) tracker: String,
    #[serde(default)]
    pub(crate) knows_truth: bool,
    pub(crate) models: Option<usize>,
    pub(crate) brought_back: u64,
    pub(crate) summary: Summary,
    pub(crate) frozen: BTreeMap<String, f64>,
    /// HumanEva error, mm, by seed and frame.
    pub(crate) errors: Vec<Vec<Option<f64>>>,
}

/// A part and what it was made from.
#[derive(Serialize, Deserialize)]
struct Kept<T> {
    /// The scenario, overrides included, as JSON.
    made_from: serde_json::Value,
    part: T,
}

/// The stored part with this name if it was made from this scenario, else the result of `make`, which is stored.
pub(crate) fn kept_or<T: Serialize + DeserializeOwned>(
    folder: &Path,
    name: &str,
    file: &ScenarioFile,
    make: impl FnOnce() -> Result<T, Box<dyn Error>>,
) -> Result<T, Box<dyn Error>> {
    let (path, made_from) = (folder.join(format!("{name}.json")), serde_json::to_value(&file.scenario)?);
    let kept = std::fs::read(&path).ok().and_then(|bytes| serde_json::from_slice::<Kept<T>>(&bytes).ok());
    if let Some(kept) = kept.filter(|kept| kept.made_from == made_from) {
        eprintln!("{name}: kept");
        return Ok(kept.part);
    }
    let kept = Kept { made_from, part: make()? };
    std::fs::create_dir_all(folder)?;
    let begun: PathBuf = folder.join(format!("{name}.begun"));
    std::fs::write(&begun, serde_json::to_vec(&kept)?)?;
    std::fs::rename(&begun, &path)?;
    eprintln!("{name}: done");
    Ok(kept.part)
}

/// Tracks a motion under a protocol.
pub(crate) fn tracked(unit: &Unit, file: &ScenarioFile, mocap: &Path, runs: &Path) -> Result<Tracked, Box<dyn Error>> {
    let prepared = PreparedScene::new(file, Some(mocap))?;
    let out = runs.join(unit.name());
    let Compared { comparison, methods, .. } =
        compare(file, Some(mocap), Destination { path: &out, force: true }, &NoProgress)?;
    let method = |compared: ComparedMethod| {
        let record = &comparison.methods[&compared.name];
        let of = Method {
            tracker: compared.tracker,
            knows_truth: compared.knows_truth,
            models: record.models,
            brought_back: record.recovered_particles,
            summary: compared.summary,
            frozen: compared.frozen,
            errors: compared.errors,
        };
        (compared.name, of)
    };
    let methods = methods.into_iter().map(method).collect();
    Ok(Tracked { bodies: prepared.facts.mismatch, frames: comparison.frames, methods })
}

impl Tracked {
    /// The methods in the form of the program's plots.
    pub(crate) fn compared(&self) -> Vec<ComparedMethod> {
        let method = |(name, method): (&String, &Method)| ComparedMethod {
            name: name.clone(),
            tracker: method.tracker.clone(),
            knows_truth: method.knows_truth,
            summary: method.summary.clone(),
            frozen: method.frozen.clone(),
            errors: method.errors.clone(),
        };
        self.methods.iter().map(method).collect()
    }
}

impl Method {
    /// Mean of a metric over all seeds.
    pub(crate) fn mean(&self, metric: &str) -> Option<f64> {
        self.summary.metrics.get(metric).map(|m| m.mean)
    }

    /// Mean of a metric, seed by seed.
    pub(crate) fn by_seed(&self, metric: &str) -> Vec<f64> {
        self.summary.metrics.get(metric).map_or(Vec::new(), |m| m.per_run.iter().copied().flatten().collect())
    }
}
