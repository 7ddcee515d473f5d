//! `skiagraph report RUN --figures DIR`: the figures of a run or a comparison of methods as SVG files.

use std::path::{Path, PathBuf};

use nalgebra::Point3;
use serde_json::json;

use super::reading::{expect_measured, read_record};
use super::stored::{has_methods, runs_of_one_set, stored_columns};
use crate::artefacts::{Artefact, ArtefactKind, Destination, Inputs, MadeBy};
use crate::common::{ExperimentError, read_file};
use crate::measure::search_file::read_search;
use crate::measure::tracked::{POSES_FILE, SEARCH_FILE};
use crate::measure::{PER_FRAME_FILE, RUN_FILE, SearchRecord};
use skiagraph_core::body::Markers;
use skiagraph_core::input::limits;
use skiagraph_core::npz::Npz;
use skiagraph_eval::{Evaluation, SeedRun, Sequence, evaluate};
use skiagraph_report::{FigureFile, ReportInput, ReportRun, comparison_figures, run_figures};

const CAPTIONS: &str = "README.txt";

/// Writes the figures that `draw` makes from `sources`, with their captions, into a new folder. Returns their number.
pub fn write_figures(
    sources: &[PathBuf],
    draw: impl FnOnce() -> Result<Vec<FigureFile>, ExperimentError>,
    to: Destination<'_>,
) -> Result<usize, ExperimentError> {
    Inputs::new(sources.to_vec()).keep_from(to.path)?;
    let made_by = MadeBy::new("skiagraph report --figures", json!({"sources": sources}));
    let folder = Artefact::begin_folder(to, ArtefactKind::Folder, made_by)?;
    let figures = draw()?;
    let mut captions = String::new();
    for FigureFile { name, caption, svg } in &figures {
        folder.write(&format!("{name}.svg"), svg.as_bytes())?;
        captions.push_str(&format!("{name}.svg\n    {caption}\n\n"));
    }
    folder.write(CAPTIONS, captions.as_bytes())?;
    folder.finish()?;
    Ok(figures.len())
}

/// The figures of a run, of a run with several methods, or of several runs of one set.
pub fn stored_figures(sources: &[PathBuf]) -> Result<Vec<FigureFile>, ExperimentError> {
    if let [source] = sources
        && !has_methods(source)
    {
        if source.join(RUN_FILE).is_file() {
            return run_figures_of(source);
        }
        expect_measured(source)?;
        let detail = "expected the folder of a measured run, of a run with several methods, or of a sweep".to_owned();
        return Err(ExperimentError::Malformed { path: source.clone(), detail });
    }
    let runs = runs_of_one_set(sources)?;
    if runs.is_empty() {
        let detail = "expected two to seven measured runs of one set".to_owned();
        return Err(ExperimentError::Argument { argument: "RUN", detail });
    }
    Ok(comparison_figures(&runs)?)
}

/// The figures of a run: its estimates are measured again by their markers, and everything else is read.
fn run_figures_of(folder: &Path) -> Result<Vec<FigureFile>, ExperimentError> {
    let stored = read_record(&folder.join(RUN_FILE))?;
    let table = folder.join(PER_FRAME_FILE);
    let [truth_energy, energy] =
        ["energy_truth", "energy_estimate"].map(|column| stored_columns(&table, &stored.seeds, column, false));
    let (truth_energy, energy) = (truth_energy?, energy?);
    let evaluations = evaluations(folder, stored.frames_per_second)?;
    if evaluations.len() != stored.seeds.len() {
        let detail = format!("expected {} seeds as in run.json, found {}", stored.seeds.len(), evaluations.len());
        return Err(ExperimentError::Malformed { path: folder.join(POSES_FILE), detail });
    }
    let search = search(folder, [evaluations.len(), stored.frames])?;
    let runs: Vec<ReportRun<'_>> = evaluations
        .iter()
        .zip(&stored.seeds)
        .enumerate()
        .map(|(index, (evaluation, seed))| {
            let searched = || search.get(index).into_iter().flatten();
            ReportRun {
                run: SeedRun { clip: &stored.scenario, seed: *seed, evaluation },
                truth_energy: &truth_energy[index],
                estimate_energy: &energy[index],
                layers: searched().map(|record| record.layers.as_slice()).collect(),
                occupancy: searched().map(|record| record.occupancy.as_slice()).collect(),
                stances: &[],
            }
        })
        .collect();
    Ok(run_figures(&ReportInput {
        own_likelihood: stored.tracker != "external",
        ..ReportInput::of_runs(&stored.scenario, &stored.tracker, &runs, &stored.summary)
    })?)
}

/// The evaluation of every seed, measured again on the markers in `poses.npz`.
fn evaluations(folder: &Path, frames_per_second: f64) -> Result<Vec<Evaluation>, ExperimentError> {
    let path = folder.join(POSES_FILE);
    let name = path.display().to_string();
    let npz = Npz::from_bytes(&name, &read_file(&path, limits::ARRAYS)?)?;
    let truth = markers(npz.f64s(&name, "truth_markers", &[None, Some(15), Some(3)])?);
    let estimates = markers(npz.f64s(&name, "estimate_markers", &[None, Some(truth.len()), Some(15), Some(3)])?);
    let of_seed = |estimate: &[Markers]| Ok(evaluate(&Sequence::from_markers(frames_per_second, &truth, estimate))?);
    estimates.chunks_exact(truth.len().max(1)).map(of_seed).collect()
}

/// Fifteen points per frame; NaN means missing.
fn markers(numbers: &[f64]) -> Vec<Markers> {
    let (points, _) = numbers.as_chunks::<3>();
    let point =
        |[x, y, z]: &[f64; 3]| Some(Point3::new(*x, *y, *z)).filter(|point| point.iter().all(|v| v.is_finite()));
    points.chunks_exact(15).map(|frame| std::array::from_fn(|index| point(&frame[index]))).collect()
}

/// The search records; empty for poses of another program.
fn search(folder: &Path, shape: [usize; 2]) -> Result<Vec<Vec<SearchRecord>>, ExperimentError> {
    let path = folder.join(SEARCH_FILE);
    if path.is_file() { read_search(&path, shape) } else { Ok(Vec::new()) }
}
