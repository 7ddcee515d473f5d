//! A sweep that is planned: its cells, frozen in a folder.
//!
//! | file | what it is |
//! |---|---|
//! | `plan.json` | [`PlanRecord`]: number of cells, seeds, digests; written last |
//! | `cells.jsonl` | one line a cell, in the order of their indices: [`SweepCell`] |
//! | `scenario.toml`, `sweep.toml` | base scenario and sweep as they were when it was planned |
//! | `results/XX/ID.json` | one file a finished cell; `XX` are the first two digits of its id |
//! | `sets/ID/` | benchmark sets, each rendered once |
//! | `reports/ID/` | whole runs of cells, where they were asked for |

use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use super::identity::{Identities, InputFile, short};
use super::settings::{Setting, settings, with_method};
use crate::evaluation::{METRICS, find_metric};
use crate::experiment::error::{output, read_file};
use crate::experiment::place::{LockedPlace, parent_of, sync_parent, write_synced};
use crate::experiment::{ExperimentError, to_json, unfinished};
use crate::input::{excerpt, hex_sha256, limits};
use crate::scenario::{ScenarioError, ScenarioFile, ScenarioTemplate, Sweep, SweepFile, did_you_mean, json_tree};

/// The name of a plan.
pub const PLAN_FILE: &str = "plan.json";
/// The name of the list of cells.
pub const CELLS_FILE: &str = "cells.jsonl";
const BASE_FILE: &str = "scenario.toml";
const DEFINITION_FILE: &str = "sweep.toml";
const SCHEMA: &str = "skiagraph.sweep_plan/1";
/// Most cells of a sweep.
const MOST_CELLS: usize = 2_000_000;
/// Size of the largest list of cells.
const LARGEST_LIST: u64 = 4 << 30;

/// One cell: a setting and a seed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SweepCell {
    /// Its place in the plan, from 0.
    pub index: usize,
    /// What it is known by: a hash of all that its result depends on.
    pub cell: String,
    /// Which setting, from 0.
    pub setting: usize,
    /// Its random seed.
    pub seed: u64,
    /// The hash of the set that it tracks.
    pub set: String,
    /// What it costs to track a frame, in likelihood evaluations times cameras.
    pub weight: u64,
    /// Axes and values.
    pub axes: Map<String, Value>,
    /// Overrides of the base scenario.
    pub overrides: Vec<String>,
    /// Which of the base scenario's methods, where it has several.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub method: Option<String>,
}

/// A frozen sweep: `plan.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlanRecord {
    /// `skiagraph.sweep_plan/1`.
    pub schema: String,
    /// The sweep's name.
    pub name: String,
    /// Its description.
    pub description: String,
    /// The sweep file as it was named, or the scenario of a sweep that no file holds.
    pub source: String,
    /// Version of the program.
    pub version: String,
    /// Number of cells.
    pub cells: usize,
    /// Number of settings; every setting has a cell for every seed.
    pub settings: usize,
    /// Number of different sets.
    pub sets: usize,
    /// The seeds.
    pub seeds: Vec<u64>,
    /// The names of the axes.
    pub axes: Vec<String>,
    /// The metric that settings are compared by.
    pub objective: String,
    /// Whether every cell leaves a whole run with its report.
    pub reports: bool,
    /// The base scenario.
    pub base: BaseRecord,
    /// Where clips are searched for.
    pub mocap_directory: Option<PathBuf>,
    /// Recordings, robots and models that cells read.
    pub inputs: Vec<InputFile>,
    /// SHA-256 of `cells.jsonl`.
    pub cells_sha256: String,
    /// First digits of the SHA-256 of all that is above.
    pub digest: String,
}

/// The base scenario of a plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BaseRecord {
    /// The file; absent for the built-in scenario.
    pub file: Option<PathBuf>,
    /// Its SHA-256.
    pub sha256: String,
    /// The folder that its paths are relative to.
    pub folder: PathBuf,
    /// Overrides for all cells.
    pub set: Vec<String>,
}

/// A sweep before it is frozen.
#[derive(Debug)]
pub struct Draft {
    record: PlanRecord,
    /// The cells.
    pub cells: Vec<SweepCell>,
    base: String,
    definition: Sweep,
    template: ScenarioTemplate,
}

/// A sweep that is frozen in a folder.
#[derive(Debug)]
pub struct PlannedSweep {
    /// The folder.
    pub root: PathBuf,
    /// The plan.
    pub plan: PlanRecord,
    template: ScenarioTemplate,
}

/// What became of a request to plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Planned {
    /// The folder is new.
    New,
    /// The same plan was there.
    Same,
    /// Another plan was there and was replaced; its results stay.
    Replaced,
}

impl Draft {
    /// The cells of a sweep, with everything that they read.
    ///
    /// # Errors
    /// [`ExperimentError`] that names the key or file.
    pub fn new(file: &SweepFile, mocap_directory: Option<&Path>) -> Result<Self, ExperimentError> {
        let sweep = &file.sweep;
        check_objective(file)?;
        let base = match &sweep.base {
            Some(base) => ScenarioFile::open(&file.folder.join(base), &sweep.set),
            None => ScenarioFile::built_in(&sweep.set),
        }?;
        let template = ScenarioTemplate::new(base)?;
        let identities = Identities::new(mocap_directory);
        let mut made = settings(file, &template, |setting, scenario| {
            Ok((identities.identify(scenario)?, weight(scenario), setting))
        })?;
        group_by_set(&mut made, |(identity, ..)| &identity.set);
        let scenario = &template.file().scenario;
        let first = u64::from(sweep.seed.unwrap_or(scenario.seed));
        let seeds: Vec<u64> = (0..u64::from(sweep.seeds.unwrap_or(scenario.seeds))).map(|n| first + n).collect();
        let count = made.len().saturating_mul(seeds.len());
        if count > MOST_CELLS {
            let message =
                format!("expected at most {MOST_CELLS} cells, found {} settings x {} seeds", made.len(), seeds.len());
            return Err(ScenarioError::from(file.complaint("seeds", message)).into());
        }
        let mut cells: Vec<SweepCell> = Vec::with_capacity(count);
        for (number, (identity, weight, setting)) in made.iter().enumerate() {
            let Setting { axes, set, method } = setting;
            cells.extend(seeds.iter().map(|seed| SweepCell {
                index: 0,
                cell: identity.cell(*seed),
                setting: number,
                seed: *seed,
                set: identity.set.clone(),
                weight: *weight,
                axes: axes.clone(),
                overrides: set.clone(),
                method: method.clone(),
            }));
        }
        refuse_twins(file, &cells)?;
        cells.iter_mut().enumerate().for_each(|(index, cell)| cell.index = index);
        let mut sets: Vec<&String> = made.iter().map(|(identity, ..)| &identity.set).collect();
        sets.dedup();
        let mut axes: Vec<String> = made.iter().flat_map(|(.., setting)| setting.axes.keys().cloned()).collect();
        axes.sort();
        axes.dedup();
        let base_file = template.file();
        let record = PlanRecord {
            schema: SCHEMA.to_owned(),
            name: sweep.name.clone(),
            description: sweep.description.clone(),
            source: file.origin.clone(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            cells: cells.len(),
            settings: made.len(),
            sets: sets.len(),
            seeds,
            axes,
            objective: sweep.objective.clone(),
            reports: sweep.reports,
            base: BaseRecord {
                file: base_file.path.as_deref().map(absolute),
                sha256: hex_sha256(template.text().as_bytes()),
                folder: absolute(&base_file.folder),
                set: template.overrides().to_vec(),
            },
            mocap_directory: mocap_directory.map(absolute),
            inputs: Vec::new(),
            cells_sha256: String::new(),
            digest: String::new(),
        };
        let inputs = identities.into_inputs().into_iter().map(|i| InputFile { path: absolute(&i.path), ..i }).collect();
        let definition = Sweep { base: None, ..sweep.clone() };
        let base = template.text().to_owned();
        Ok(Self { record: PlanRecord { inputs, ..record }, cells, base, definition, template })
    }

    /// What is planned; without digests.
    pub fn record(&self) -> &PlanRecord {
        &self.record
    }

    /// The scenario of a cell.
    ///
    /// # Errors
    /// None that planning has not met.
    pub fn scenario(&self, cell: &SweepCell) -> Result<ScenarioFile, ExperimentError> {
        scenario(&self.template, cell)
    }

    /// Freezes the sweep in a folder. A folder with the same plan is left as it is. With `extend` another plan is
    /// replaced, and the results of cells that both have count.
    ///
    /// # Errors
    /// [`ExperimentError::Occupied`] where something else is, [`ExperimentError::OtherPlan`] where another plan is and
    /// `extend` is not asked for, [`ExperimentError::Busy`] while another process plans there.
    pub fn freeze(&self, root: &Path, extend: bool) -> Result<Planned, ExperimentError> {
        let text = lines(&self.cells)?;
        let mut record = PlanRecord { cells_sha256: hex_sha256(&text), ..self.record.clone() };
        record.digest = digest(&record)?;
        let place = LockedPlace::take(root)?;
        if let Some(there) = there(root)? {
            if there == record
                && fs::read(root.join(CELLS_FILE)).is_ok_and(|cells| hex_sha256(&cells) == record.cells_sha256)
            {
                return Ok(Planned::Same);
            }
            if !extend {
                return Err(ExperimentError::OtherPlan {
                    path: root.to_owned(),
                    difference: difference(&there, &record),
                });
            }
            self.write(root, &record, &text)?;
            return Ok(Planned::Replaced);
        }
        if fs::read_dir(root).is_ok_and(|mut entries| entries.next().is_some()) || root.is_file() {
            return Err(ExperimentError::Occupied { path: root.to_owned() });
        }
        let folder = place.beside("partial");
        unfinished::begin(&folder);
        let written = fs::create_dir(&folder)
            .map_err(output(&folder, "create the directory"))
            .and_then(|()| self.write(&folder, &record, &text));
        let moved = written.and_then(|()| {
            unfinished::finish(&folder, root, || fs::rename(&folder, root).map_err(output(root, "write the plan")))
        });
        if moved.is_err() {
            unfinished::remove(&folder).ok();
            unfinished::end(&folder);
        }
        sync_parent(root);
        moved.map(|()| Planned::New)
    }

    fn write(&self, folder: &Path, record: &PlanRecord, cells: &[u8]) -> Result<(), ExperimentError> {
        let definition = serde_json::to_value(&self.definition).map_err(|e| malformed(folder, e.to_string()))?;
        let definition = toml::to_string(&definition).map_err(|e| malformed(folder, e.to_string()))?;
        put(&folder.join(BASE_FILE), self.base.as_bytes())?;
        put(&folder.join(DEFINITION_FILE), definition.as_bytes())?;
        put(&folder.join(CELLS_FILE), cells)?;
        put(&folder.join(PLAN_FILE), &to_json(record)?)
    }
}

impl PlannedSweep {
    /// Opens a folder, and refuses one whose plan or inputs changed since it was frozen.
    ///
    /// # Errors
    /// [`ExperimentError::Malformed`] that names the file and says what to do.
    pub fn open(root: &Path) -> Result<Self, ExperimentError> {
        let path = root.join(PLAN_FILE);
        if !path.exists() {
            let detail = "no sweep is planned here; plan one with skiagraph sweep plan";
            return Err(malformed(&path, detail));
        }
        let plan = read_plan(&path)?;
        if plan.version != env!("CARGO_PKG_VERSION") {
            let detail = format!(
                "planned by version {}, and this is {}: results would not be comparable; plan it again elsewhere",
                excerpt(&plan.version),
                env!("CARGO_PKG_VERSION")
            );
            return Err(malformed(&path, detail));
        }
        let base = root.join(BASE_FILE);
        let text = String::from_utf8_lossy(&read_file(&base, limits::SETTINGS)?).into_owned();
        if hex_sha256(text.as_bytes()) != plan.base.sha256 {
            return Err(edited(&base));
        }
        let origin = plan.base.file.as_ref().unwrap_or(&base).display().to_string();
        let file = ScenarioFile::parse(&text, &origin, plan.base.folder.clone(), &plan.base.set)?;
        let sweep = Self { root: root.to_owned(), plan, template: ScenarioTemplate::new(file)? };
        sweep.check_base(&text)?;
        sweep.check_inputs()?;
        Ok(sweep)
    }

    /// All cells, in order.
    ///
    /// # Errors
    /// [`ExperimentError::Malformed`] for a list that is not the one that was frozen.
    pub fn cells(&self) -> Result<Vec<SweepCell>, ExperimentError> {
        let path = self.root.join(CELLS_FILE);
        let bytes = read_file(&path, LARGEST_LIST)?;
        if hex_sha256(&bytes) != self.plan.cells_sha256 {
            return Err(edited(&path));
        }
        let lines: Vec<&[u8]> = bytes.split(|byte| *byte == b'\n').filter(|line| !line.is_empty()).collect();
        let blocks: Vec<&[&[u8]]> = lines.chunks(1000).collect();
        let parsed = crate::parallel::map(blocks.len(), |block| {
            blocks[block].iter().map(|line| serde_json::from_slice(line)).collect::<Result<Vec<SweepCell>, _>>()
        });
        let mut cells = Vec::with_capacity(lines.len());
        for block in parsed {
            cells.extend(block.map_err(|e| malformed(&path, e.to_string()))?);
        }
        Ok(cells)
    }

    /// The scenario of a cell.
    ///
    /// # Errors
    /// [`ExperimentError`] where an override is refused.
    pub fn scenario(&self, cell: &SweepCell) -> Result<ScenarioFile, ExperimentError> {
        scenario(&self.template, cell)
    }

    /// The sweep as it was defined; its base scenario is the folder's own.
    ///
    /// # Errors
    /// [`ExperimentError`] where it cannot be read.
    pub fn definition(&self) -> Result<SweepFile, ExperimentError> {
        Ok(SweepFile::open(&self.root.join(DEFINITION_FILE))?)
    }

    /// A command that runs the same sweep.
    pub fn command(&self) -> String {
        format!("skiagraph sweep {} --out sweeps/{}", self.plan.source, self.plan.name)
    }

    /// Where clips are searched for.
    pub fn mocap_directory(&self) -> Option<&Path> {
        self.plan.mocap_directory.as_deref()
    }

    /// The base scenario, where its file is still there, must be what was frozen.
    fn check_base(&self, frozen: &str) -> Result<(), ExperimentError> {
        let Some(path) = self.plan.base.file.as_deref() else { return Ok(()) };
        let Ok(now) = fs::read_to_string(path) else { return Ok(()) };
        match first_difference(frozen, &now) {
            None => Ok(()),
            Some((line, was, is)) => Err(malformed(
                path,
                format!(
                    "changed since {} was planned: line {line} was `{}` and is `{}`; restore it, or plan again in another \
                    folder (or with --extend, which keeps the results of cells that stay the same)",
                    self.root.display(),
                    excerpt(&was),
                    excerpt(&is)
                ),
            )),
        }
    }

    fn check_inputs(&self) -> Result<(), ExperimentError> {
        for input in &self.plan.inputs {
            let now = InputFile::read(&input.path)?;
            if now.sha256 != input.sha256 {
                let detail = format!(
                    "changed since {} was planned: its SHA-256 was {} and is {}; restore it, or plan again",
                    self.root.display(),
                    excerpt(&input.sha256),
                    now.sha256
                );
                return Err(malformed(&input.path, detail));
            }
        }
        Ok(())
    }
}

fn scenario(template: &ScenarioTemplate, cell: &SweepCell) -> Result<ScenarioFile, ExperimentError> {
    let mut file = template.with(&cell.overrides)?;
    if let Some(method) = &cell.method {
        file = with_method(file, method);
    }
    file.scenario.seed = u32::try_from(cell.seed).unwrap_or(u32::MAX);
    file.scenario.seeds = 1;
    file.scenario.layers.clear();
    Ok(file)
}

/// Writes a file of a sweep's folder, whole.
pub(super) fn put(path: &Path, bytes: &[u8]) -> Result<(), ExperimentError> {
    let mut name = std::ffi::OsString::from(".");
    name.push(path.file_name().unwrap_or_default());
    name.push(format!(".writing-{}", std::process::id()));
    let meanwhile = path.with_file_name(name);
    unfinished::begin(&meanwhile);
    let written = write_synced(&meanwhile, bytes)
        .map_err(output(path, "write"))
        .and_then(|()| fs::rename(&meanwhile, path).map_err(output(path, "write")));
    if written.is_err() {
        fs::remove_file(&meanwhile).ok();
    }
    unfinished::end(&meanwhile);
    written
}

fn check_objective(file: &SweepFile) -> Result<(), ExperimentError> {
    let name = &file.sweep.objective;
    if find_metric(name).is_some() {
        return Ok(());
    }
    let guess = did_you_mean(name, METRICS.iter().map(|metric| metric.name));
    let guess = guess.map(|guess| format!("; did you mean `{guess}`?")).unwrap_or_default();
    let message = format!("expected the name of a metric, found `{}`{guess}", excerpt(name));
    Err(ScenarioError::from(file.complaint("objective", message)).into())
}

/// Two settings that are the same are a mistake: their cells would have one result.
fn refuse_twins(file: &SweepFile, cells: &[SweepCell]) -> Result<(), ExperimentError> {
    let mut ids: Vec<(&str, usize)> = cells.iter().enumerate().map(|(at, cell)| (cell.cell.as_str(), at)).collect();
    ids.sort_unstable();
    let Some(twins) = ids.windows(2).find(|pair| pair[0].0 == pair[1].0) else { return Ok(()) };
    let words = |at: usize| {
        let axes = cells[at].axes.iter().map(|(key, value)| format!("{key}={value}"));
        axes.collect::<Vec<_>>().join(" ")
    };
    let key = if file.sweep.points.is_empty() { "axes" } else { "points" };
    let message = format!(
        "expected different settings, but `{}` and `{}` make the same scenario",
        words(twins[0].1),
        words(twins[1].1)
    );
    Err(ScenarioError::from(file.complaint(key, message)).into())
}

/// Settings of one set side by side, sets in the order in which they first occur: a shard then needs few sets.
fn group_by_set<T>(made: &mut [T], set: impl Fn(&T) -> &String) {
    let mut order = std::collections::HashMap::new();
    for one in made.iter() {
        let next = order.len();
        order.entry(set(one).clone()).or_insert(next);
    }
    made.sort_by_key(|one| order[set(one)]);
}

fn weight(file: &ScenarioFile) -> u64 {
    let trackers = file.scenario.trackers();
    let evaluations: u64 = trackers.iter().map(|(_, tracker)| tracker.kind().evaluations_per_frame()).sum();
    evaluations.max(1) * file.scenario.rig.count() as u64
}

fn lines(cells: &[SweepCell]) -> Result<Vec<u8>, ExperimentError> {
    let blocks: Vec<&[SweepCell]> = cells.chunks(1000).collect();
    let written = crate::parallel::map(blocks.len(), |block| {
        let mut text = Vec::new();
        for cell in blocks[block] {
            serde_json::to_writer(&mut text, cell).map_err(|e| malformed(Path::new(CELLS_FILE), e.to_string()))?;
            text.push(b'\n');
        }
        Ok(text)
    });
    Ok(written.into_iter().collect::<Result<Vec<Vec<u8>>, ExperimentError>>()?.concat())
}

fn digest(record: &PlanRecord) -> Result<String, ExperimentError> {
    let bare = PlanRecord { digest: String::new(), ..record.clone() };
    Ok(short(&String::from_utf8_lossy(&to_json(&bare)?)))
}

fn read_plan(path: &Path) -> Result<PlanRecord, ExperimentError> {
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

/// The plan in a folder; `None` where there is none.
fn there(root: &Path) -> Result<Option<PlanRecord>, ExperimentError> {
    let path = root.join(PLAN_FILE);
    if path.exists() { read_plan(&path).map(Some) } else { Ok(None) }
}

/// The first thing in which two plans differ.
fn difference(there: &PlanRecord, new: &PlanRecord) -> String {
    let facts = |plan: &PlanRecord| {
        [
            ("name", plan.name.clone()),
            ("version", plan.version.clone()),
            ("base scenario", format!("{:?}", plan.base.file)),
            ("overrides", plan.base.set.join(" ")),
            ("axes", plan.axes.join(", ")),
            ("seeds", format!("{:?}", plan.seeds)),
            ("settings", plan.settings.to_string()),
            ("objective", plan.objective.clone()),
            ("content of the base scenario", plan.base.sha256.clone()),
            ("inputs", plan.inputs.iter().map(|i| i.sha256.as_str()).collect::<Vec<_>>().join(" ")),
            ("reports", plan.reports.to_string()),
        ]
    };
    let differs = facts(there).into_iter().zip(facts(new)).find(|(old, new)| old.1 != new.1);
    match differs {
        Some(((what, old), (_, new))) => format!("{what}: there `{}`, here `{}`", excerpt(&old), excerpt(&new)),
        None => "the values of the axes".to_owned(),
    }
}

/// The first line that differs: its number, and both.
fn first_difference(a: &str, b: &str) -> Option<(usize, String, String)> {
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

fn edited(path: &Path) -> ExperimentError {
    malformed(
        path,
        "changed after the sweep was planned; undo the change, or plan again with skiagraph sweep plan --extend",
    )
}

fn malformed(path: &Path, detail: impl Into<String>) -> ExperimentError {
    ExperimentError::Malformed { path: path.to_owned(), detail: detail.into() }
}

fn absolute(path: &Path) -> PathBuf {
    let path = if path.as_os_str().is_empty() { parent_of(path) } else { path };
    fs::canonicalize(path).unwrap_or_else(|_| path.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_sweep_that_ships_can_be_planned_and_is_the_same_from_anywhere() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/sweeps");
        let mut count = 0;
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let draft = Draft::new(&SweepFile::open(&path).unwrap(), None).unwrap();
            let record = draft.record();
            assert_eq!(record.cells, record.settings * record.seeds.len());
            assert!(draft.cells.iter().all(|cell| draft.scenario(cell).is_ok()), "{}", path.display());
            let mut sets: Vec<&String> = draft.cells.iter().map(|cell| &cell.set).collect();
            sets.dedup();
            assert_eq!(sets.len(), record.sets, "cells of a set stand side by side");
            count += 1;
        }
        assert!(count >= 5, "{count}");
    }

    #[test]
    fn the_first_line_that_differs_is_told() {
        assert_eq!(first_difference("a\nb\n", "a\nb\n"), None);
        assert_eq!(first_difference("a\nb\n", "a\nc\n"), Some((2, "b".to_owned(), "c".to_owned())));
        assert_eq!(first_difference("a\n", "a\nb\n"), Some((2, "(nothing)".to_owned(), "b".to_owned())));
    }
}
