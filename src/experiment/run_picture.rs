//! A picture of a measured run or of a comparison of methods, from the files that they left.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Deserialize;

use super::error::read_file;
use super::{COMPARISON_FILE, CONTACT_SHEET_FILE, ExperimentError, PER_FRAME_FILE, RUN_FILE};
use crate::evaluation::Summary;
use crate::input::limits;
use crate::report::{ComparedMethod, ComparisonInput, SummaryPicture, comparison_picture, summary_picture};
use crate::scenario::{TrackerSettings, json_tree};

#[derive(Deserialize)]
struct PicturedRun {
    schema: String,
    scenario: String,
    seeds: Vec<u64>,
    tracker: String,
    frames: usize,
    verdict: PicturedVerdict,
    #[serde(default)]
    frozen: BTreeMap<String, f64>,
    #[serde(flatten)]
    summary: Summary,
}

#[derive(Deserialize)]
struct PicturedVerdict {
    line: String,
}

#[derive(Deserialize)]
struct PicturedComparison {
    schema: String,
    scenario: String,
    seeds: Vec<u64>,
    frames: usize,
    matched: bool,
    methods: BTreeMap<String, PicturedMethod>,
}

#[derive(Deserialize)]
struct PicturedMethod {
    tracker: String,
    /// Whether the true roots were given away to it.
    #[serde(default)]
    given_roots: bool,
    #[serde(default)]
    frozen: BTreeMap<String, f64>,
    #[serde(flatten)]
    summary: Summary,
}

/// Of a run that compares methods: verdict, errors with intervals, errors over time.
fn methods_picture(run: &Path) -> Result<Vec<u8>, ExperimentError> {
    let path = run.join(COMPARISON_FILE);
    let malformed = |detail: String| ExperimentError::Malformed { path: path.clone(), detail };
    let stored: PicturedComparison = json_tree::value_of_file(&read_file(&path, limits::JSON)?).map_err(malformed)?;
    if stored.schema != "skiagraph.comparison/1" {
        return Err(malformed(format!("expected schema skiagraph.comparison/1, found {:?}", stored.schema)));
    }
    let mut methods = Vec::new();
    for (name, method) in stored.methods {
        // the name is a folder's: no path leads elsewhere
        if Path::new(&name).file_name().is_none_or(|file| file != name.as_str()) {
            return Err(malformed(format!("expected the name of a folder as a method's name, found {name:?}")));
        }
        let errors = errors_of(&run.join(&name).join(PER_FRAME_FILE), &stored.seeds)?;
        let PicturedMethod { tracker, given_roots, frozen, summary } = method;
        let knows_truth = given_roots || TrackerSettings::named(&tracker).is_ok_and(|known| known.kind().needs_truth());
        methods.push(ComparedMethod { name, tracker, knows_truth, summary, frozen, errors });
    }
    Ok(comparison_picture(&ComparisonInput {
        title: &stored.scenario,
        frames: stored.frames,
        seeds: stored.seeds.len(),
        matched: stored.matched,
        methods: &methods,
    })?)
}

/// `skiagraph report RUN --png`: verdict, main figures, error over time and chosen frames in one PNG; of a comparison
/// of methods verdict, errors with intervals and errors over time.
///
/// # Errors
/// [`ExperimentError`] naming the file that is missing or damaged.
pub fn run_picture(run: &Path) -> Result<Vec<u8>, ExperimentError> {
    if run.join(COMPARISON_FILE).is_file() {
        return methods_picture(run);
    }
    let path = run.join(RUN_FILE);
    let malformed = |detail: String| ExperimentError::Malformed { path: path.clone(), detail };
    let bytes = read_file(&path, limits::JSON)?;
    let stored: PicturedRun = json_tree::value_of_file(&bytes).map_err(malformed)?;
    if stored.schema != "skiagraph.run/1" {
        return Err(malformed(format!("expected schema skiagraph.run/1, found {:?}", stored.schema)));
    }
    let errors = errors_of(&run.join(PER_FRAME_FILE), &stored.seeds)?;
    let sheet_path = run.join(CONTACT_SHEET_FILE);
    let sheet = sheet_path.is_file().then(|| read_file(&sheet_path, limits::PICTURE)).transpose()?;
    let plural = if stored.seeds.len() == 1 { "" } else { "s" };
    let about = format!("{}, {} frames, {} seed{plural}", stored.tracker, stored.frames, stored.seeds.len());
    Ok(summary_picture(&SummaryPicture {
        title: &stored.scenario,
        about: &about,
        verdict: &stored.verdict.line,
        summary: &stored.summary,
        frozen_mm: stored.frozen.get("humaneva_mm").copied(),
        errors: &errors,
        sheet: sheet.as_deref(),
    })?)
}

/// HumanEva errors of every seed over the frames.
fn errors_of(path: &Path, seeds: &[u64]) -> Result<Vec<Vec<Option<f64>>>, ExperimentError> {
    let malformed = |detail: String| ExperimentError::Malformed { path: path.to_owned(), detail };
    let bytes = read_file(path, limits::RECORDING)?;
    let mut table = csv::Reader::from_reader(bytes.as_slice());
    let columns = table.headers().map_err(|e| malformed(e.to_string()))?.clone();
    let column = |name: &str| columns.iter().position(|column| column == name);
    let (Some(seed), Some(error)) = (column("seed"), column("humaneva_mm")) else {
        return Err(malformed("expected the columns seed and humaneva_mm".to_owned()));
    };
    let mut errors = vec![Vec::new(); seeds.len()];
    for row in table.records() {
        let row = row.map_err(|e| malformed(e.to_string()))?;
        let number = row.get(seed).and_then(|text| text.parse::<u64>().ok());
        let Some(index) = seeds.iter().position(|known| Some(*known) == number) else { continue };
        errors[index].push(row.get(error).and_then(|text| text.parse::<f64>().ok()).filter(|e| e.is_finite()));
    }
    Ok(errors)
}
