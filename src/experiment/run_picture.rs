//! The picture of a measured run or of a comparison of methods, from their files.

use std::path::Path;

use super::run_reading::{check_listed, read_record};
use super::{COMPARISON_FILE, MethodComparison};
use crate::common::{ExperimentError, read_file};
use crate::input::{limits, plain};
use crate::measure::{CONTACT_SHEET_FILE, PER_FRAME_FILE, RUN_FILE};
use crate::report::{ComparedMethod, SummaryPicture, comparison_picture, summary_picture};
use crate::scenario::{TrackerSettings, json_tree};

/// The comparison of methods in a folder, and its methods with their errors over the frames.
///
/// # Errors
/// [`ExperimentError`] that names the missing or damaged file.
pub(super) fn stored_methods(run: &Path) -> Result<(MethodComparison, Vec<ComparedMethod>), ExperimentError> {
    let path = run.join(COMPARISON_FILE);
    let malformed = |detail: String| ExperimentError::Malformed { path: path.clone(), detail };
    let stored: MethodComparison = json_tree::value_of_file(&read_listed(&path, limits::JSON)?).map_err(malformed)?;
    if stored.schema != MethodComparison::SCHEMA {
        return Err(malformed(format!("expected schema {}, found {:?}", MethodComparison::SCHEMA, stored.schema)));
    }
    let mut methods = Vec::new();
    for (name, method) in &stored.methods {
        // the name must be a single folder's, so that it cannot lead elsewhere
        if Path::new(name).file_name().is_none_or(|file| file != name.as_str()) {
            return Err(malformed(format!("expected the name of a folder as a method's name, found {name:?}")));
        }
        let errors = stored_columns(&run.join(name).join(PER_FRAME_FILE), &stored.seeds, "humaneva_mm", true)?;
        let needs_truth = TrackerSettings::named(&method.tracker).is_ok_and(|known| known.kind().needs_truth);
        methods.push(ComparedMethod {
            name: name.clone(),
            tracker: method.tracker.clone(),
            knows_truth: method.given_roots || needs_truth,
            summary: method.summary.clone(),
            frozen: method.frozen.clone(),
            errors,
        });
    }
    Ok((stored, methods))
}

/// The picture of a comparison of methods: verdict, errors with intervals, errors over time.
fn methods_picture(run: &Path) -> Result<Vec<u8>, ExperimentError> {
    let (comparison, methods) = stored_methods(run)?;
    Ok(comparison_picture(&comparison.input(&methods))?)
}

/// `skiagraph report RUN --png`: one PNG with the verdict, main figures, error over time and selected frames; for a
/// comparison of methods, with the verdict, errors with intervals and errors over time.
///
/// # Errors
/// [`ExperimentError`] that names the missing or damaged file.
pub fn run_picture(run: &Path) -> Result<Vec<u8>, ExperimentError> {
    if run.join(COMPARISON_FILE).is_file() {
        return methods_picture(run);
    }
    let stored = read_record(&run.join(RUN_FILE))?;
    let errors = stored_columns(&run.join(PER_FRAME_FILE), &stored.seeds, "humaneva_mm", true)?;
    let sheet_path = run.join(CONTACT_SHEET_FILE);
    let sheet = sheet_path.is_file().then(|| read_listed(&sheet_path, limits::PICTURE)).transpose()?;
    let plural = if stored.seeds.len() == 1 { "" } else { "s" };
    let about = format!("{}, {} frames, {} seed{plural}", stored.tracker, stored.frames, stored.seeds.len());
    // as on pages and the terminal, the hint precedes the verdict
    let hint = stored.hint.as_ref().map(|hint| plain(&hint.text) + " ");
    Ok(summary_picture(&SummaryPicture {
        title: &stored.scenario,
        about: &about,
        verdict: &(hint.unwrap_or_default() + &stored.verdict.line),
        summary: &stored.summary,
        frozen_mm: stored.frozen.get("humaneva_mm").copied(),
        errors: &errors,
        sheet: sheet.as_deref(),
    })?)
}

/// The bytes of an unmodified file of this program.
pub(super) fn read_listed(path: &Path, limit: u64) -> Result<Vec<u8>, ExperimentError> {
    check_listed(path)?;
    read_file(path, limit)
}

/// One column of the table of frames, per seed. A column that is not `required` may be missing, and is then empty.
///
/// # Errors
/// [`ExperimentError`] that names the missing or damaged file.
pub(super) fn stored_columns(
    path: &Path,
    seeds: &[u64],
    name: &str,
    required: bool,
) -> Result<Vec<Vec<Option<f64>>>, ExperimentError> {
    let malformed = |detail: String| ExperimentError::Malformed { path: path.to_owned(), detail };
    let bytes = read_listed(path, limits::RECORDING)?;
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
