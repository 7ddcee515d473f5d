//! Measured runs of one set, read for pages and figures that show them beside each other.

use std::path::{Path, PathBuf};

use super::COMPARISON_FILE;
use super::reading::{check_listed, folders_with_runs, names, read_record};
use crate::common::{ExperimentError, read_file};
use crate::measure::{PER_FRAME_FILE, RUN_FILE};
use crate::scenario::TrackerSettings;
use skiagraph_core::input::limits;
use skiagraph_report::ComparedMethod;

/// The greatest number of runs in one plot: more lines cannot be told apart.
const MOST_RUNS: usize = 7;

/// The runs at these paths with their errors over the frames; a single folder stands for the runs in it. Empty unless
/// there are two to seven and each path is one run, all of the same set.
pub fn runs_of_one_set(paths: &[PathBuf]) -> Result<Vec<ComparedMethod>, ExperimentError> {
    let paths = match paths {
        [folder] if !folder.join(RUN_FILE).is_file() => folders_with_runs(folder),
        several => several.to_vec(),
    };
    let are_runs = paths.iter().all(|path| path.join(RUN_FILE).is_file());
    if !are_runs || !(2..=MOST_RUNS).contains(&paths.len()) {
        return Ok(Vec::new());
    }
    let (mut runs, mut hashes) = (Vec::new(), Vec::new());
    for (path, name) in paths.iter().zip(names(&paths)) {
        let record = read_record(&path.join(RUN_FILE))?;
        let kind_knows = |tracker: &TrackerSettings| tracker.kind().needs_truth || tracker.kind().is_given_roots();
        hashes.push(record.set_hash);
        runs.push(ComparedMethod {
            name,
            knows_truth: TrackerSettings::named(&record.tracker).is_ok_and(|tracker| kind_knows(&tracker)),
            errors: stored_columns(&path.join(PER_FRAME_FILE), &record.seeds, "humaneva_mm", true)?,
            summary: record.summary,
            report: None,
        });
    }
    let is_one_set = hashes.iter().all(|hash| *hash == hashes[0]);
    Ok(if is_one_set { runs } else { Vec::new() })
}

/// Whether a folder has the runs of several methods of a scenario.
pub fn has_methods(folder: &Path) -> bool {
    folder.join(COMPARISON_FILE).is_file()
}

/// One column of the table of frames, per seed. A column that is not `required` may be missing, and is then empty.
pub(super) fn stored_columns(
    path: &Path,
    seeds: &[u64],
    name: &str,
    required: bool,
) -> Result<Vec<Vec<Option<f64>>>, ExperimentError> {
    let malformed = |detail: String| ExperimentError::Malformed { path: path.to_owned(), detail };
    check_listed(path)?;
    let bytes = read_file(path, limits::RECORDING)?;
    let mut table = csv::Reader::from_reader(bytes.as_slice());
    let columns = table.headers().map_err(|e| malformed(e.to_string()))?.clone();
    let column = |name: &str| columns.iter().position(|column| column == name);
    let mut values = vec![Vec::new(); seeds.len()];
    let (seed, value) = match (column("seed"), column(name)) {
        (Some(seed), Some(value)) => (seed, value),
        (Some(_), None) if !required => return Ok(values),
        _ => return Err(malformed(format!("expected the columns seed and {name}"))),
    };
    for row in table.records() {
        let row = row.map_err(|e| malformed(e.to_string()))?;
        let number = row.get(seed).and_then(|text| text.parse::<u64>().ok());
        let Some(index) = seeds.iter().position(|known| Some(*known) == number) else { continue };
        values[index].push(row.get(value).and_then(|text| text.parse::<f64>().ok()).filter(|e| e.is_finite()));
    }
    Ok(values)
}
