//! Results of cells: one file each, written atomically.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::identity::short;
use super::plan::PlannedSweep;
use super::plan_file::SweepCell;
use crate::artefacts::{output, write_whole};
use crate::common::{ExperimentError, to_json};
use skiagraph_core::input::{self, limits};
use skiagraph_core::parallel;

const SCHEMA: &str = "skiagraph.sweep_cell/1";
pub(super) const RESULTS: &str = "results";
/// Number of results to read at a time.
const BLOCK: usize = 1000;

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    Ok,
    /// Tracked and measured, with the grade `lost`, as in reports.
    Diverged,
    /// Cannot be run: its scenario and its files do not fit together, or the tracker refused.
    Failed,
}

impl Status {
    pub fn name(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::Diverged => "diverged",
            Self::Failed => "failed",
        }
    }
}

/// The result of a cell: `results/XX/ID.json`. Everything but `env` has the same bytes on every machine.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CellRecord {
    /// `skiagraph.sweep_cell/1`.
    pub schema: String,
    pub cell: String,
    pub status: Status,
    pub seed: u64,
    pub version: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
    /// Hash of the set's files; absent if there is no set.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub set_hash: Option<String>,
    /// Grade of the run, as in its report.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub grade: Option<String>,
    pub frames: usize,
    pub cameras: usize,
    /// Likelihood evaluations of all frames.
    pub likelihood_evaluations: u64,
    pub metrics: BTreeMap<String, f64>,
    /// Mean of the sweep's objective for a tracker that never moves.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frozen: Option<f64>,
    /// First digits of the SHA-256 of a program's estimates; absent for built-in trackers.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub estimates: Option<String>,
    /// First digits of the SHA-256 of all fields above.
    pub digest: String,
    /// Values that differ from run to run.
    pub env: Environment,
}

/// Values that differ from run to run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Environment {
    /// Wall-clock time of tracking, s.
    pub track_s: f64,
    /// Processor time of tracking, s, if the system reports it.
    pub track_processor_s: f64,
    /// Processor time of all work for this cell alone, s: reading, tracking, measuring, writing.
    pub processor_s: f64,
    pub host: String,
}

impl CellRecord {
    pub(super) fn new(cell: &SweepCell, status: Status) -> Self {
        Self {
            schema: SCHEMA.to_owned(),
            cell: cell.cell.clone(),
            status,
            seed: cell.seed,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            error: None,
            set_hash: None,
            grade: None,
            frames: 0,
            cameras: 0,
            likelihood_evaluations: 0,
            metrics: BTreeMap::new(),
            frozen: None,
            estimates: None,
            digest: String::new(),
            env: Environment::default(),
        }
    }

    /// The fields that do not differ from run to run.
    pub(super) fn reproducible_fields(&self) -> Result<serde_json::Map<String, serde_json::Value>, ExperimentError> {
        let tree = serde_json::to_value(self)
            .map_err(|e| ExperimentError::Malformed { path: RESULTS.into(), detail: e.to_string() })?;
        let serde_json::Value::Object(mut tree) = tree else { return Ok(serde_json::Map::new()) };
        tree.retain(|key, _| key != "digest" && key != "env");
        Ok(tree)
    }

    fn digest(&self) -> Result<String, ExperimentError> {
        Ok(short(&serde_json::Value::Object(self.reproducible_fields()?).to_string()))
    }
}

#[derive(Clone, Copy, Debug)]
pub(super) struct SweepResults<'a> {
    root: &'a Path,
}

impl<'a> SweepResults<'a> {
    pub(super) fn new(sweep: &'a PlannedSweep) -> Self {
        Self { root: &sweep.root }
    }

    fn path(&self, id: &str) -> PathBuf {
        self.root.join(RESULTS).join(id.get(..2).unwrap_or_default()).join(format!("{id}.json"))
    }

    /// Writes a result.
    ///
    /// # Errors
    /// [`crate::artefacts::ArtefactError::Output`]; no file remains then.
    pub(super) fn put(&self, mut record: CellRecord) -> Result<CellRecord, ExperimentError> {
        record.digest = record.digest()?;
        let path = self.path(&record.cell);
        let folder = path.parent().unwrap_or(self.root);
        fs::create_dir_all(folder).map_err(output(folder, "create the directory"))?;
        write_whole(&path, &to_json(&record)?)?;
        Ok(record)
    }

    pub(super) fn get(&self, id: &str) -> Option<CellRecord> {
        let bytes = input::read(&self.path(id), limits::RECORD).ok()?;
        let record: CellRecord = serde_json::from_slice(&bytes).ok()?;
        let whole = record.schema == SCHEMA && record.cell == id && record.digest().ok()? == record.digest;
        whole.then_some(record)
    }

    /// The outcome of every cell; `None` without a result.
    pub(super) fn statuses(&self, cells: &[SweepCell]) -> Vec<Option<Status>> {
        parallel::map(cells.len(), |at| self.get(&cells[at].cell).map(|record| record.status))
    }

    /// Calls `each` with every cell and the output of `prepare` for its result, in order. Results are read in blocks,
    /// and `prepare` runs on all cores.
    pub(super) fn for_each<T: Send + Sync>(
        &self,
        cells: &[SweepCell],
        prepare: impl Fn(&SweepCell, Option<CellRecord>) -> T + Sync,
        mut each: impl FnMut(&SweepCell, T) -> Result<(), ExperimentError>,
    ) -> Result<(), ExperimentError> {
        for block in cells.chunks(BLOCK) {
            let prepared = parallel::map(block.len(), |at| prepare(&block[at], self.get(&block[at].cell)));
            block.iter().zip(prepared).try_for_each(|(cell, made)| each(cell, made))?;
        }
        Ok(())
    }

    pub(super) fn remove(&self, id: &str) {
        fs::remove_file(self.path(id)).ok();
    }

    /// Removes temporary files of killed processes.
    pub(super) fn clear_leftovers(&self) {
        let folders = fs::read_dir(self.root.join(RESULTS)).into_iter().flatten().flatten();
        for entry in folders.flat_map(|folder| fs::read_dir(folder.path()).into_iter().flatten().flatten()) {
            let name = entry.file_name().to_string_lossy().into_owned();
            if name.starts_with('.') && name.contains(".json.writing-") {
                fs::remove_file(entry.path()).ok();
            }
        }
    }
}
