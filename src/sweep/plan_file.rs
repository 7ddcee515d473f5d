//! The files of a plan, `plan.json` and `cells.jsonl`, and differences between plans.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use super::identity::{InputFile, short};
use super::splits::Splits;
use crate::artefacts::{CELLS_FILE, MadeBy, PLAN_FILE};
use crate::common::{ExperimentError, read_file, to_json};
use crate::scenario::{as_toml, json_tree};
use skiagraph_core::input::{self, excerpt, limits};

pub(super) const SCHEMA: &str = "skiagraph.sweep_plan/1";

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SweepCell {
    /// Its place in the plan, from 0.
    pub index: usize,
    /// Its id: a hash of everything that its result depends on.
    pub cell: String,
    /// Number of its setting, from 0.
    pub setting: usize,
    pub seed: u64,
    pub set: String,
    /// Cost of tracking a frame, in likelihood evaluations times cameras.
    pub weight: u64,
    pub axes: Map<String, Value>,
    pub overrides: Vec<String>,
    /// Its method, if the base scenario has several.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub method: Option<String>,
    /// The folder of its report below `reports`, if it has a name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub report: Option<String>,
}

impl SweepCell {
    pub(super) fn report_folder(&self) -> &str {
        self.report.as_deref().unwrap_or(&self.cell)
    }
}

/// A frozen sweep: `plan.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlanRecord {
    /// `skiagraph.sweep_plan/1`.
    pub schema: String,
    pub name: String,
    pub description: String,
    /// Path of the sweep file as the user gave it, or of the scenario of a sweep without a file.
    pub source: String,
    pub version: String,
    pub cells: usize,
    /// Number of settings; every setting has a cell for every seed.
    pub settings: usize,
    pub sets: usize,
    pub seeds: Vec<u64>,
    pub axes: Vec<String>,
    /// Metric to compare settings by.
    pub objective: String,
    /// Whether every cell keeps a complete run with its report.
    pub reports: bool,
    /// Splits of the sets, if the sweep has any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub splits: Option<Splits>,
    /// Whether every seed also has its own noise.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub draws: bool,
    /// Working directory of external programs; absent without any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub programs_folder: Option<PathBuf>,
    pub base: BaseRecord,
    /// Folder to search for clips.
    pub mocap_directory: Option<PathBuf>,
    /// Recordings, robots and models that cells read.
    pub inputs: Vec<InputFile>,
    /// SHA-256 of `cells.jsonl`.
    pub cells_sha256: String,
    /// First digits of the SHA-256 of all fields above.
    pub digest: String,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BaseRecord {
    /// The file; absent for the built-in scenario.
    pub file: Option<PathBuf>,
    pub sha256: String,
    /// The folder that its paths are relative to.
    pub folder: PathBuf,
    /// Overrides for all cells.
    pub set: Vec<String>,
}

pub(super) fn lines(cells: &[SweepCell]) -> Result<Vec<u8>, ExperimentError> {
    let blocks: Vec<&[SweepCell]> = cells.chunks(1000).collect();
    let written = skiagraph_core::parallel::map(blocks.len(), |block| {
        let mut text = Vec::new();
        for cell in blocks[block] {
            serde_json::to_writer(&mut text, cell).map_err(|e| malformed(Path::new(CELLS_FILE), e.to_string()))?;
            text.push(b'\n');
        }
        Ok(text)
    });
    Ok(written.into_iter().collect::<Result<Vec<Vec<u8>>, ExperimentError>>()?.concat())
}

pub(super) fn digest(record: &PlanRecord) -> Result<String, ExperimentError> {
    let bare = PlanRecord { digest: String::new(), ..record.clone() };
    Ok(short(&String::from_utf8_lossy(&to_json(&bare)?)))
}

pub(super) fn read_plan(path: &Path) -> Result<PlanRecord, ExperimentError> {
    let plan: PlanRecord =
        json_tree::value_of_file(&read_file(path, limits::RECORD)?).map_err(|detail| malformed(path, detail))?;
    if plan.schema != SCHEMA {
        let detail = format!("expected schema \"{SCHEMA}\", found {:?}", excerpt(&plan.schema));
        return Err(malformed(path, detail));
    }
    if digest(&plan)? != plan.digest {
        return Err(edited(path));
    }
    Ok(plan)
}

pub(super) fn existing_plan(root: &Path) -> Result<Option<PlanRecord>, ExperimentError> {
    let path = root.join(PLAN_FILE);
    if path.exists() { read_plan(&path).map(Some) } else { Ok(None) }
}

/// The first difference between two plans: a plan is what makes a sweep.
pub(super) fn difference(existing: &PlanRecord, new: &PlanRecord) -> String {
    let made_by = |plan: &PlanRecord| {
        let (cells_sha256, digest) = (String::new(), String::new());
        let bare = PlanRecord { cells: 0, sets: 0, cells_sha256, digest, ..plan.clone() };
        MadeBy::new("skiagraph sweep", serde_json::to_value(bare).unwrap_or_default())
    };
    made_by(existing).difference(&made_by(new)).unwrap_or_else(|| "the values of the axes".to_owned())
}

/// The first line that differs: its number and both versions.
pub(super) fn first_difference(a: &str, b: &str) -> Option<(usize, String, String)> {
    if a == b {
        return None;
    }
    let (mut left, mut right) = (a.lines(), b.lines());
    for number in 1.. {
        match (left.next(), right.next()) {
            (None, None) => return Some((number, "end of the file".to_owned(), "end of the file".to_owned())),
            (a, b) if a == b => {}
            (a, b) => return Some((number, a.unwrap_or("(nothing)").to_owned(), b.unwrap_or("(nothing)").to_owned())),
        }
    }
    None
}

pub(super) fn without(axes: &Map<String, Value>, over: &[String]) -> Map<String, Value> {
    axes.iter().filter(|(key, _)| !over.contains(key)).map(|(key, value)| (key.clone(), value.clone())).collect()
}

/// Axes and values: `particles=50 rig.ring.count=2`.
pub(super) fn describe_axes(axes: &Map<String, Value>) -> String {
    let words: Vec<String> = axes.iter().map(|(key, value)| format!("{key}={}", table_text(value))).collect();
    if words.is_empty() { "no axis has two values".to_owned() } else { input::plain(words.join(" ")) }
}

/// A value for a table: text without quotes.
pub(super) fn table_text(value: &Value) -> String {
    value.as_str().map_or_else(|| as_toml(value), str::to_owned)
}

pub(super) fn edited(path: &Path) -> ExperimentError {
    malformed(
        path,
        "changed after it was planned; undo the change, or choose another directory with --out; skiagraph sweep plan \
         --extend plans a sweep again",
    )
}

pub(super) fn malformed(path: &Path, detail: impl Into<String>) -> ExperimentError {
    ExperimentError::Malformed { path: path.to_owned(), detail: detail.into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_line_that_differs_is_found() {
        assert_eq!(first_difference("a\nb\n", "a\nb\n"), None);
        assert_eq!(first_difference("a\nb\n", "a\nc\n"), Some((2, "b".to_owned(), "c".to_owned())));
        assert_eq!(first_difference("a\n", "a\nb\n"), Some((2, "(nothing)".to_owned(), "b".to_owned())));
    }
}
