//! Reads measured runs: the `run.json` of a run's folder, or of all runs below a folder.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::COMPARISON_FILE;
use crate::artefacts::{CELLS_FILE, LISTING, PLAN_FILE, REPORTS, is_unlisted, parent_of};
use crate::common::{ExperimentError, read_file};
use crate::external::{EXTERNAL_FILE, ExternalRecord};
use crate::measure::results::RUN_SCHEMA;
use crate::measure::tracked::TRACK_FILE;
use crate::measure::{RUN_FILE, RunRecord};
use crate::scenario::json_tree;
use skiagraph_core::input::{foreign, is_own_output, limits, plain, unquoted};
use skiagraph_eval::{IntervalUnit, MeasuredClip, MeasuredRuns, NotComparable, RunComparison, compare_runs};

const DEPTH: usize = 3;
const MOST_RUNS: usize = 10_000;
/// Prefix of the names of folders with added seeds, which are inside the run's folder.
pub(crate) const MORE_SEEDS: &str = "seeds-";

#[derive(Clone, Debug, PartialEq)]
pub struct ComparedSide {
    /// The folder's name, or its path if names are equal.
    pub name: String,
    pub runs: MeasuredRuns,
    /// Hints of its runs about estimates that may have been misread.
    pub misread: Vec<String>,
}

impl ComparedSide {
    pub(crate) fn new(name: String, paths: &[PathBuf]) -> Result<Self, ExperimentError> {
        let misread = paths.iter().flat_map(|path| hints_of_runs(path)).collect();
        Ok(Self { name, runs: read_runs(paths)?, misread })
    }
}

#[derive(Clone, Copy, Debug)]
pub struct SidesToCompare<'a> {
    /// Folders of runs: one side each, of which the first is the base; with `versus`, all together are the base. A
    /// single folder with several runs gives one side per run.
    pub paths: &'a [PathBuf],
    /// Folders of runs that together are the other side; may be empty.
    pub versus: &'a [PathBuf],
    /// Whether sets of the same name may differ; they are then compared unpaired.
    pub across_sets: bool,
    /// The unit over which intervals are computed, if given.
    pub unit: Option<IntervalUnit>,
}

/// `skiagraph compare`: compares the first side with the others.
pub fn compare_sides(input: SidesToCompare<'_>) -> Result<RunComparison, ExperimentError> {
    let SidesToCompare { paths, versus, across_sets, unit } = input;
    let sides = if versus.is_empty() { read_sides(paths)? } else { read_two_sides(paths, versus)? };
    let [base, others @ ..] = sides.as_slice() else { return Err(too_few(paths)) };
    if others.is_empty() {
        return Err(too_few(paths));
    }
    let compared: Vec<_> = others.iter().map(|side| (side.name.as_str(), &side.runs)).collect();
    let mut comparison = compare_runs((&base.name, &base.runs), &compared, across_sets, unit)?;
    comparison.base.misread.clone_from(&base.misread);
    for (facts, side) in comparison.others.iter_mut().zip(others) {
        facts.side.misread.clone_from(&side.misread);
    }
    Ok(comparison)
}

impl From<NotComparable> for ExperimentError {
    fn from(error: NotComparable) -> Self {
        Self::NotComparable(Box::new(error))
    }
}

fn too_few(paths: &[PathBuf]) -> ExperimentError {
    let given = paths.first().map(|path| format!(" in {}", path.display())).unwrap_or_default();
    ExperimentError::Argument {
        argument: "RUN",
        detail: format!("expected two runs or more, found one{given}; name the runs to compare it with"),
    }
}

fn read_sides(paths: &[PathBuf]) -> Result<Vec<ComparedSide>, ExperimentError> {
    let expanded = match paths {
        // the reports of a sweep are in a folder of their own
        [folder] if folder.join(PLAN_FILE).is_file() => folders_with_runs(&folder.join(REPORTS)),
        [folder] if !folder.join(RUN_FILE).is_file() => folders_with_runs(folder),
        several => several.to_vec(),
    };
    let names = names(&expanded);
    let side = |(path, name)| ComparedSide::new(name, std::slice::from_ref(path));
    expanded.iter().zip(names).map(side).collect()
}

/// Two sides, each of one or more folders.
fn read_two_sides(base: &[PathBuf], other: &[PathBuf]) -> Result<Vec<ComparedSide>, ExperimentError> {
    let all = names(&[base, other].concat());
    let named = |names: &[String]| match names {
        [first, rest @ ..] if !rest.is_empty() => format!("{first} and {} more", rest.len()),
        names => names.concat(),
    };
    let (base_names, other_names) = all.split_at(base.len());
    Ok(vec![ComparedSide::new(named(base_names), base)?, ComparedSide::new(named(other_names), other)?])
}

/// The direct subfolders that have runs: methods of a comparison, cells of a sweep.
pub(super) fn folders_with_runs(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let mut found: Vec<PathBuf> =
        entries.map(|entry| entry.path()).filter(|path| !run_files(path, DEPTH).is_empty()).collect();
    found.sort();
    if found.is_empty() { vec![folder.to_owned()] } else { found }
}

/// Names of folders; paths if two names are equal.
pub(super) fn names(paths: &[PathBuf]) -> Vec<String> {
    let short = |path: &PathBuf| {
        let resolved = fs::canonicalize(path).unwrap_or_else(|_| path.clone());
        let named = if resolved.is_file() { resolved.parent().map(Path::to_owned) } else { Some(resolved) };
        named.and_then(|p| Some(p.file_name()?.to_string_lossy().into_owned())).unwrap_or_default()
    };
    let all: Vec<String> = paths.iter().map(short).collect();
    let unique = |name: &String| !name.is_empty() && all.iter().filter(|other| *other == name).count() == 1;
    paths.iter().zip(&all).map(|(path, n)| if unique(n) { n.clone() } else { path.display().to_string() }).collect()
}

/// All runs at these paths: each a `run.json`, a folder with one, or a folder with such folders below it. Together they
/// are seeds of sets, draws of the noise of clips, and clips.
pub fn read_runs(paths: &[PathBuf]) -> Result<MeasuredRuns, ExperimentError> {
    let malformed = |path: &Path, detail: String| ExperimentError::Malformed { path: path.to_owned(), detail };
    let (mut runs, mut count) = (MeasuredRuns::default(), 0);
    for path in paths {
        let files = run_files_at(path);
        if files.is_empty() {
            return Err(malformed(path, no_runs_message(path)));
        }
        count += files.len();
        if count > MOST_RUNS {
            return Err(malformed(path, format!("expected at most {MOST_RUNS} runs, found {count}")));
        }
        let conditions = conditions_of(path)?;
        let mut of_sweep = MeasuredRuns::default();
        for file in files {
            let (name, clip) = read_run(&file)?;
            let side = if conditions.is_some() { &mut of_sweep } else { &mut runs };
            side.add(&name, clip).map_err(|error| malformed(&file, error.to_string()))?;
        }
        if let Some(clips) = conditions {
            let averaged = of_sweep.averaged_over_conditions(&clips);
            for (name, clip) in averaged.map_err(|error| malformed(path, error.to_string()))?.clips {
                runs.add(&name, clip).map_err(|error| malformed(path, error.to_string()))?;
            }
        }
    }
    Ok(runs)
}

/// The names of the sets of every clip of a sweep that has its clips under several conditions: its runs are not
/// independent, so each clip is one observation. `None` for the folder of anything else.
fn conditions_of(path: &Path) -> Result<Option<BTreeMap<String, BTreeSet<String>>>, ExperimentError> {
    if path.is_file() || path.join(RUN_FILE).is_file() {
        return Ok(None);
    }
    let Some(sweep) = path.ancestors().take(3).find(|folder| folder.join(PLAN_FILE).is_file()) else {
        return Ok(None);
    };
    let plan: Value = serde_json::from_slice(&read_file(&sweep.join(PLAN_FILE), limits::RECORD)?).unwrap_or_default();
    let mut axes = plan["axes"].as_array().into_iter().flatten().filter_map(Value::as_str);
    if !axes.any(|axis| ["place", "body", "cameras"].contains(&axis)) {
        return Ok(None);
    }
    let mut clips: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    let cells = read_file(&sweep.join(CELLS_FILE), limits::RECORD)?;
    for cell in cells.split(|byte| *byte == b'\n').filter_map(|line| serde_json::from_slice::<Value>(line).ok()) {
        let mut overrides = cell["overrides"].as_array().into_iter().flatten().rev().filter_map(Value::as_str);
        let name = overrides.find_map(|assignment| assignment.strip_prefix("name="));
        if let (Some(clip), Some(name)) = (cell["axes"]["clip"].as_str(), name) {
            clips.entry(clip.to_owned()).or_default().insert(name.to_owned());
        }
    }
    // cells without a name have the names of their scenarios
    Ok(Some(clips).filter(|clips| !clips.is_empty()))
}

/// Whether a folder has a tracked run that is not measured.
pub(super) fn is_unmeasured(folder: &Path) -> bool {
    let is_there = |file: &str| folder.join(file).is_file();
    !is_there(RUN_FILE) && [TRACK_FILE, EXTERNAL_FILE].into_iter().any(is_there)
}

fn unmeasured_message(folder: &Path) -> String {
    format!("this run was tracked but not measured; run skiagraph evaluate SET {}", folder.display())
}

pub(super) fn no_runs_message(path: &Path) -> String {
    if !path.exists() {
        return "there is no such file or folder; expected a run's folder".to_owned();
    }
    if is_unmeasured(path) {
        return unmeasured_message(path);
    }
    if path.join(COMPARISON_FILE).is_file() {
        return format!("the folders of the methods in {COMPARISON_FILE} are missing");
    }
    format!("expected a {RUN_FILE} of skiagraph run or skiagraph evaluate, or folders with one")
}

/// All `run.json` files at a path, which is one of them or a folder.
pub(crate) fn run_files_at(path: &Path) -> Vec<PathBuf> {
    if path.is_file() { vec![path.to_owned()] } else { run_files(path, DEPTH) }
}

/// The `run.json` in a folder with those of its added seeds, or else those below it, in the order of their paths.
/// Hidden folders and links are skipped, and so are folders without a listing inside folders that have one.
fn run_files(folder: &Path, depth: usize) -> Vec<PathBuf> {
    let file = folder.join(RUN_FILE);
    if file.is_file() {
        let more =
            folders_in(folder).into_iter().filter(|below| is_more_seeds(below)).map(|below| below.join(RUN_FILE));
        return [file].into_iter().chain(more.filter(|file| file.is_file())).collect();
    }
    if depth == 0 {
        return Vec::new();
    }
    folders_in(folder).iter().flat_map(|below| run_files(below, depth - 1)).collect()
}

fn folders_in(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    // folders that others put into a result of this program are not runs
    let is_listed = folder.join(LISTING).is_file();
    let mut folders: Vec<PathBuf> = entries
        .filter(|entry| entry.file_type().is_ok_and(|kind| kind.is_dir()))
        .filter(|entry| !entry.file_name().to_string_lossy().starts_with('.'))
        .map(|entry| entry.path())
        .filter(|path| !is_listed || path.join(LISTING).is_file())
        .collect();
    folders.sort();
    folders
}

/// Hints of the runs at a path about misread estimates, each with its clip. Unreadable files are skipped, because
/// [`read_runs`] reports them.
pub(crate) fn hints_of_runs(path: &Path) -> Vec<String> {
    let files = run_files_at(path);
    let hint = |file: &PathBuf| {
        let run = read_record(file).ok()?;
        Some(format!("{}: {}", run.scenario, plain(&run.hint?.text)))
    };
    files.iter().take(MOST_RUNS).filter_map(hint).collect()
}

fn is_more_seeds(folder: &Path) -> bool {
    folder.file_name().is_some_and(|name| name.to_string_lossy().starts_with(MORE_SEEDS))
}

pub(crate) fn run_folders(path: &Path) -> Vec<PathBuf> {
    let files = run_files(path, DEPTH);
    let folders = files.iter().filter_map(|file| file.parent()).filter(|folder| !is_more_seeds(folder));
    folders.map(Path::to_owned).collect()
}

/// What identifies a program: its command, name and version, and options that differ from the defaults.
fn identity(program: &ExternalRecord) -> Value {
    let mut known = json!({ "command": program.command, "name": program.name, "version": program.version });
    // absent if all are defaults, as in records of earlier versions
    if !program.options.are_default() {
        known["options"] = json!(program.options);
    }
    known
}

/// Refuses the folder of a tracked run that is not measured.
pub(crate) fn expect_measured(folder: &Path) -> Result<(), ExperimentError> {
    if is_unmeasured(folder) {
        return Err(ExperimentError::Malformed { path: folder.to_owned(), detail: unmeasured_message(folder) });
    }
    Ok(())
}

/// Reads an unmodified `run.json`.
pub(crate) fn read_record(path: &Path) -> Result<RunRecord, ExperimentError> {
    let malformed = |detail: String| ExperimentError::Malformed { path: path.to_owned(), detail };
    expect_measured(parent_of(path))?;
    check_listed(path)?;
    let bytes = read_file(path, limits::RECORD)?;
    let tree: Value = serde_json::from_slice(&bytes).map_err(|e| malformed(unquoted(e)))?;
    let schema = tree.get("schema").and_then(Value::as_str).filter(|_| is_own_output(&bytes)).unwrap_or("none");
    if schema != RUN_SCHEMA {
        return Err(malformed(format!(
            "expected the schema {RUN_SCHEMA}, found {schema}; give the folder of a run, measured with this version"
        )));
    }
    json_tree::value(tree).map_err(|e| malformed(foreign(e)))
}

fn read_run(path: &Path) -> Result<(String, MeasuredClip), ExperimentError> {
    let malformed = |detail: String| ExperimentError::Malformed { path: path.to_owned(), detail };
    let run = read_record(path)?;
    let runs = run.summary.runs.len();
    let lengths = run.summary.metrics.iter().map(|(name, metric)| (name, metric.per_run.len()));
    if let Some((name, found)) = lengths.into_iter().find(|(_, found)| *found != runs) {
        return Err(malformed(format!("metrics.{name}.per_run: expected one value per run ({runs}), found {found}")));
    }
    let clip = measured_clip(&run);
    let mut seeds = clip.seeds.clone();
    seeds.sort_unstable();
    match seeds.windows(2).find(|pair| pair[0] == pair[1]) {
        Some(twice) => Err(malformed(format!("runs: seed {} occurs twice", twice[0]))),
        None => Ok((run.scenario, clip)),
    }
}

pub(super) fn measured_clip(run: &RunRecord) -> MeasuredClip {
    let facts = MeasuredClip {
        set_hash: run.set_hash.clone(),
        scene_hash: run.scene_hash.clone(),
        frames: run.frames,
        frames_per_second: run.frames_per_second,
        tracker: run.tracker.clone(),
        settings: run.settings.clone().or(run.program.as_ref().map(identity)),
        version: run.version.clone(),
        seeds: Vec::new(),
        metrics: Default::default(),
        joints: Default::default(),
    };
    facts.with_values(&run.summary)
}

/// Refuses a file that this program did not write, or that was changed afterwards.
pub(super) fn check_listed(path: &Path) -> Result<(), ExperimentError> {
    if !is_unlisted(path) {
        return Ok(());
    }
    let detail = format!(
        "skiagraph did not write this file, or it was changed since (its hash is not in {LISTING} beside it); measure the \
         run again with skiagraph evaluate SET {}",
        parent_of(path).display()
    );
    Err(ExperimentError::Malformed { path: path.to_owned(), detail })
}
