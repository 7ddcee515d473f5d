//! A planned sweep: its cells, frozen in a folder.
//!
//! | file | content |
//! |---|---|
//! | `plan.json` | [`PlanRecord`]: number of cells, seeds, digests; written last |
//! | `cells.jsonl` | one line per cell, in the order of their indices: [`SweepCell`] |
//! | `scenario.toml`, `sweep.toml` | base scenario and sweep at the time of planning |
//! | `results/XX/ID.json` | one file per finished cell; `XX` are the first two digits of its id |
//! | `sets/ID/` | benchmark sets, each rendered once |
//! | `models/ID.model` | motion models, each learned once |
//! | `reports/ID/` | complete runs of cells, if requested |

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;

use super::definition::Sweep;
use super::file::SweepFile;
use super::identity::{Identities, InputFile};
use super::plan_file::{
    BaseRecord, PlanRecord, SCHEMA, SweepCell, describe_axes, difference, digest, edited, existing_plan,
    first_difference, lines, malformed, read_plan,
};
use super::settings::{Setting, settings, with_method};
use super::splits::recordings;
use crate::artefacts::{
    ArtefactError, CELLS_FILE, LockedPlace, PLAN_FILE, Unfinished, output, parent_of, sync_parent, write_whole,
};
use crate::common::{ExperimentError, read_file, to_json};
use crate::gating::check_metric;
use crate::scenario::{REFUSED, Scenario, ScenarioError, ScenarioFile, ScenarioTemplate, TrackerSettings};
use crate::tracking::program::check_trackers;
use skiagraph_core::input::{self, excerpt, hex_sha256, is_own_output, limits};

const NO_SWEEP: &str = "expected the directory of a sweep, found no plan.json; make one with skiagraph sweep plan";
const BASE_FILE: &str = "scenario.toml";
const DEFINITION_FILE: &str = "sweep.toml";
const MOST_CELLS: usize = 2_000_000;
const LARGEST_LIST: u64 = 4 << 30;

/// A sweep before it is frozen.
#[derive(Debug)]
pub struct Draft {
    /// The plan, without digests.
    pub record: PlanRecord,
    pub cells: Vec<SweepCell>,
    definition: Sweep,
    template: ScenarioTemplate,
}

/// A sweep frozen in a folder.
#[derive(Debug)]
pub struct PlannedSweep {
    pub root: PathBuf,
    pub plan: PlanRecord,
    template: ScenarioTemplate,
}

/// Outcome of a request to plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Planned {
    /// The folder is new.
    New,
    /// The folder already had the same plan.
    Same,
    /// A different plan was replaced; its results are kept.
    Replaced,
}

impl Draft {
    /// Expands the cells of a sweep and hashes their inputs.
    pub fn new(file: &SweepFile, mocap_directory: Option<&Path>) -> Result<Self, ExperimentError> {
        let sweep = &file.sweep;
        let complain = |key: &str, message: String| ScenarioError::from(file.complaint(key, message));
        check_metric(&sweep.objective).map_err(|message| complain("objective", message))?;
        let base = match &sweep.base {
            Some(base) => ScenarioFile::open(&file.folder.join(base), &sweep.set),
            None => ScenarioFile::built_in(&sweep.set),
        }?;
        let template = ScenarioTemplate::new(base)?;
        if let Some(splits) = &sweep.splits {
            splits.check(file).map_err(ScenarioError::from)?;
        }
        let identities = Identities::new(mocap_directory);
        let scenario = &template.file().scenario;
        let first = u64::from(sweep.seed.unwrap_or(scenario.seed));
        let seeds: Vec<u64> = (0..u64::from(sweep.seeds.unwrap_or(scenario.seeds))).map(|n| first + n).collect();
        let mut made = settings(file, &template, |setting, scenario| {
            check_trackers(&scenario.scenario).map_err(|error| scenario.located(&error))?;
            refuse_other_programs(file, scenario.scenario.clone())?;
            let recordings = if sweep.splits.is_some() { recordings(scenario, mocap_directory) } else { Vec::new() };
            let identity = |seed: &u64| identities.identify(&with_seed(scenario.clone(), *seed, sweep.draws));
            let made = if sweep.draws { seeds.as_slice() } else { &[first] };
            let made = made.iter().map(identity).collect::<Result<Vec<_>, _>>()?;
            Ok((made, weight(&scenario.scenario), recordings, setting))
        })?;
        if let Some(splits) = &sweep.splits {
            let chooses =
                |key: &String| ["motion.", "training.", "distractor"].iter().any(|table| key.starts_with(table));
            let chooses = keys_of(sweep, &template, &splits.by).iter().any(chooses);
            let shown = made.iter().map(|(.., recordings, setting)| (&setting.axes, recordings.as_slice()));
            splits.check_settings(file, chooses, shown).map_err(ScenarioError::from)?;
        }
        group_by_set(&mut made, |(identities, ..)| &identities[0].set);
        let count = made.len().saturating_mul(seeds.len());
        if count > MOST_CELLS {
            let message =
                format!("expected at most {MOST_CELLS} cells, found {} settings x {} seeds", made.len(), seeds.len());
            return Err(complain("seeds", message).into());
        }
        let mut cells: Vec<SweepCell> = Vec::with_capacity(count);
        for (number, (identities, weight, _, setting)) in made.iter().enumerate() {
            let Setting { axes, set, method } = setting;
            // with draws of the noise, every seed has its own set
            let of_seeds = seeds.iter().zip(identities.iter().cycle());
            cells.extend(of_seeds.map(|(seed, identity)| SweepCell {
                index: number * seeds.len() + (seed - first) as usize,
                cell: identity.cell(*seed),
                setting: number,
                seed: *seed,
                set: identity.set.clone(),
                weight: *weight,
                axes: axes.clone(),
                overrides: set.clone(),
                method: method.clone(),
                report: sweep.named.then(|| report_folder(set, method.as_deref(), *seed, seeds.len())),
            }));
        }
        refuse_duplicates(file, &cells)?;
        let sets: BTreeSet<&String> = cells.iter().map(|cell| &cell.set).collect();
        let axes: BTreeSet<&String> = made.iter().flat_map(|(.., setting)| setting.axes.keys()).collect();
        let inputs = identities.into_inputs().into_iter().map(|i| InputFile { path: absolute(&i.path), ..i }).collect();
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
            draws: sweep.draws,
            programs_folder: (!file.commands.is_empty()).then(|| absolute(Path::new("."))),
            seeds,
            axes: axes.into_iter().cloned().collect(),
            objective: sweep.objective.clone(),
            reports: sweep.reports,
            splits: sweep.splits.clone(),
            base: BaseRecord {
                file: base_file.path.as_deref().map(absolute),
                sha256: hex_sha256(template.text().as_bytes()),
                folder: absolute(&base_file.folder),
                set: template.overrides().to_vec(),
            },
            mocap_directory: mocap_directory.map(absolute),
            inputs,
            cells_sha256: String::new(),
            digest: String::new(),
        };
        Ok(Self { record, cells, definition: Sweep { base: None, ..sweep.clone() }, template })
    }

    /// The scenario of a cell.
    ///
    /// # Errors
    /// None that planning has not already reported.
    pub fn scenario(&self, cell: &SweepCell) -> Result<ScenarioFile, ExperimentError> {
        scenario(&self.template, &self.record, cell)
    }

    /// As [`Self::scenario`], with the truth images that it asks for, which no cell needs.
    pub(super) fn scene(&self, cell: &SweepCell) -> Result<ScenarioFile, ExperimentError> {
        let truth_images = self.template.with(&cell.overrides)?.scenario.truth_images;
        let mut file = self.scenario(cell)?;
        file.scenario.truth_images = truth_images;
        Ok(file)
    }

    /// Whether sets have the names of their cells.
    pub(super) fn is_named(&self) -> bool {
        self.definition.named
    }

    /// The full keys that the values of an axis set.
    pub(super) fn keys_of(&self, axis: &str) -> Vec<String> {
        keys_of(&self.definition, &self.template, axis)
    }

    /// The full key that a short one means in the scenario; unchanged if it is unknown or ambiguous.
    pub fn full_key(&self, key: &str) -> String {
        self.template.full_key(key)
    }

    /// Freezes the sweep in a folder. A folder with the same plan is left unchanged. With `extend`, a different plan is
    /// replaced, and the results of cells that are in both plans are kept.
    ///
    /// # Errors
    /// [`ArtefactError::Occupied`] if the folder has other content, [`ExperimentError::OtherPlan`] if it has a
    /// different plan and `extend` is false, [`ArtefactError::Busy`] while another process plans there.
    pub fn freeze(&self, root: &Path, extend: bool) -> Result<Planned, ExperimentError> {
        let text = lines(&self.cells)?;
        let mut record = PlanRecord { cells_sha256: hex_sha256(&text), ..self.record.clone() };
        record.digest = digest(&record)?;
        let place = LockedPlace::take(root)?;
        if let Some(existing) = existing_plan(root)? {
            if existing == record
                && input::read(&root.join(CELLS_FILE), LARGEST_LIST)
                    .is_ok_and(|cells| hex_sha256(&cells) == record.cells_sha256)
            {
                return Ok(Planned::Same);
            }
            if !extend {
                return Err(ExperimentError::OtherPlan {
                    path: root.to_owned(),
                    difference: difference(&existing, &record),
                });
            }
            self.write(root, &record, &text)?;
            return Ok(Planned::Replaced);
        }
        if fs::read_dir(root).is_ok_and(|mut entries| entries.next().is_some()) || root.is_file() {
            return Err(ArtefactError::Occupied { path: root.to_owned() }.into());
        }
        let unfinished = Unfinished::begin(place.beside("partial"));
        let folder = unfinished.path();
        fs::create_dir(folder).map_err(output(folder, "create the directory"))?;
        self.write(folder, &record, &text)?;
        unfinished.finish(root, || fs::rename(folder, root).map_err(output(root, "write the plan")))?;
        sync_parent(root);
        Ok(Planned::New)
    }

    fn write(&self, folder: &Path, record: &PlanRecord, cells: &[u8]) -> Result<(), ExperimentError> {
        let definition = serde_json::to_value(&self.definition).map_err(|e| malformed(folder, e.to_string()))?;
        let definition = toml::to_string(&definition).map_err(|e| malformed(folder, e.to_string()))?;
        write_whole(&folder.join(BASE_FILE), self.template.text().as_bytes())?;
        write_whole(&folder.join(DEFINITION_FILE), definition.as_bytes())?;
        write_whole(&folder.join(CELLS_FILE), cells)?;
        Ok(write_whole(&folder.join(PLAN_FILE), &to_json(record)?)?)
    }
}

impl PlannedSweep {
    /// Opens a folder; refuses it if the plan or its inputs changed since it was frozen.
    pub fn open(root: &Path) -> Result<Self, ExperimentError> {
        let sweep = Self::open_results(root)?;
        sweep.check_inputs()?;
        Ok(sweep)
    }

    /// As [`Self::open`], to read results only: the recordings, robots and programs may have changed or be missing.
    pub fn open_results(root: &Path) -> Result<Self, ExperimentError> {
        let path = root.join(PLAN_FILE);
        if !path.exists() {
            return Err(malformed(root, NO_SWEEP));
        }
        let plan = read_plan(&path)?;
        if plan.version != env!("CARGO_PKG_VERSION") {
            let detail = format!(
                "planned by version {}, but this is version {}: results would not be comparable; plan the sweep again in \
                 another directory",
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
        Ok(sweep)
    }

    /// All cells, in order.
    ///
    /// # Errors
    /// [`ExperimentError::Malformed`] if the list changed since it was frozen.
    pub fn cells(&self) -> Result<Vec<SweepCell>, ExperimentError> {
        let path = self.root.join(CELLS_FILE);
        let bytes = read_file(&path, LARGEST_LIST)?;
        if hex_sha256(&bytes) != self.plan.cells_sha256 {
            return Err(edited(&path));
        }
        let lines: Vec<&[u8]> = bytes.split(|byte| *byte == b'\n').filter(|line| !line.is_empty()).collect();
        let blocks: Vec<&[&[u8]]> = lines.chunks(1000).collect();
        let parsed = skiagraph_core::parallel::map(blocks.len(), |block| {
            blocks[block].iter().map(|line| serde_json::from_slice(line)).collect::<Result<Vec<SweepCell>, _>>()
        });
        let mut cells = Vec::with_capacity(lines.len());
        for block in parsed {
            cells.extend(block.map_err(|e| malformed(&path, e.to_string()))?);
        }
        Ok(cells)
    }

    /// The scenario of a cell.
    pub fn scenario(&self, cell: &SweepCell) -> Result<ScenarioFile, ExperimentError> {
        scenario(&self.template, &self.plan, cell)
    }

    pub(super) fn only_tracker(&self) -> String {
        match self.template.file().scenario.tracker() {
            TrackerSettings::Program(program) => program.name.unwrap_or_else(|| "program".to_owned()),
            built_in => built_in.name().to_owned(),
        }
    }

    pub(super) fn is_of_program(&self, axis: &str) -> bool {
        self.template.full_key(axis).contains(".program.settings.")
    }

    /// The definition of the sweep; its base scenario is the copy in the folder.
    pub fn definition(&self) -> Result<SweepFile, ExperimentError> {
        Ok(SweepFile::open(&self.root.join(DEFINITION_FILE))?)
    }

    /// Refuses a base scenario that changed since it was frozen; a missing file is accepted.
    fn check_base(&self, frozen: &str) -> Result<(), ExperimentError> {
        let Some(path) = self.plan.base.file.as_deref() else { return Ok(()) };
        let Ok(now) = input::read_to_string(path, limits::SETTINGS) else { return Ok(()) };
        match first_difference(frozen, &now) {
            None => Ok(()),
            Some(_) if !is_own_output(now.as_bytes()) => {
                Err(malformed(path, format!("is no longer a scenario; {} was planned from it", self.root.display())))
            }
            Some((line, was, is)) => Err(malformed(
                path,
                format!(
                    "changed since {} was planned: line {line} was `{}` and is `{}`; restore it, or choose another \
                     directory with --out; skiagraph sweep plan --extend keeps the results of unchanged cells",
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

fn scenario(template: &ScenarioTemplate, plan: &PlanRecord, cell: &SweepCell) -> Result<ScenarioFile, ExperimentError> {
    let mut file = template.with(&cell.overrides)?;
    if let Some(method) = &cell.method {
        file = with_method(file, method);
    }
    file.scenario.truth_images.clear();
    file.scenario.programs().for_each(|program| program.folder.clone_from(&plan.programs_folder));
    Ok(with_seed(file, cell.seed, plan.draws))
}

/// The full keys that the values of an axis set.
fn keys_of(sweep: &Sweep, template: &ScenarioTemplate, axis: &str) -> Vec<String> {
    let values = sweep.axes.get(axis).and_then(Value::as_array).into_iter().flatten();
    let sets = values.filter_map(|value| value["set"].as_array()).flatten().filter_map(Value::as_str);
    let mut keys: Vec<&str> = sets.filter_map(|assignment| assignment.split('=').next()).map(str::trim).collect();
    if keys.is_empty() {
        keys.push(axis);
    }
    keys.into_iter().map(|key| template.full_key(key)).collect()
}

/// A scenario with one seed, which with `draws` also counts up the seed of its noise.
fn with_seed(mut file: ScenarioFile, seed: u64, draws: bool) -> ScenarioFile {
    let number = u32::try_from(seed).unwrap_or(u32::MAX);
    if draws {
        file.scenario.observation.seed = file.scenario.observation.seed.saturating_add(number);
    }
    (file.scenario.seed, file.scenario.seeds) = (number, 1);
    file
}

/// Refuses programs that were not named on the command line.
fn refuse_other_programs(file: &SweepFile, mut scenario: Scenario) -> Result<(), ExperimentError> {
    let is_known = |command: &String| file.commands.contains(command);
    match scenario.programs().find(|program| !is_known(&program.command)) {
        None => Ok(()),
        Some(_) => Err(ScenarioError::from(file.complaint("set", REFUSED.to_owned())).into()),
    }
}

/// The folder of the report of a cell with a name: the method, the name, and the seed if there are several.
fn report_folder(set: &[String], method: Option<&str>, seed: u64, seeds: usize) -> String {
    let name = set.iter().rev().find_map(|assignment| assignment.strip_prefix("name=")).unwrap_or("cell");
    let method = method.map(|method| format!("{method}/")).unwrap_or_default();
    let seed = if seeds > 1 { format!("-{seed}") } else { String::new() };
    format!("{method}{name}{seed}")
}

/// Refuses two equal settings: their cells would share one result, so they must be a mistake.
fn refuse_duplicates(file: &SweepFile, cells: &[SweepCell]) -> Result<(), ExperimentError> {
    let mut ids: Vec<(&str, usize)> = cells.iter().enumerate().map(|(at, cell)| (cell.cell.as_str(), at)).collect();
    ids.sort_unstable();
    let Some(pair) = ids.windows(2).find(|pair| pair[0].0 == pair[1].0) else { return Ok(()) };
    let words = |at: usize| describe_axes(&cells[at].axes);
    let key = if file.sweep.points.is_empty() { "axes" } else { "points" };
    let message = format!(
        "expected different settings, but `{}` and `{}` make the same scenario",
        words(pair[0].1),
        words(pair[1].1)
    );
    Err(ScenarioError::from(file.complaint(key, message)).into())
}

/// Groups the settings of each set, with sets in the order of their first occurrence, so that a shard needs few sets.
fn group_by_set<T>(made: &mut [T], set: impl Fn(&T) -> &String) {
    let mut order = std::collections::HashMap::new();
    for one in made.iter() {
        let next = order.len();
        order.entry(set(one).clone()).or_insert(next);
    }
    made.sort_by_key(|one| order[set(one)]);
}

fn weight(scenario: &Scenario) -> u64 {
    let trackers = scenario.trackers();
    let evaluations: u64 = trackers.iter().map(|(_, tracker)| tracker.kind().evaluations_per_frame()).sum();
    evaluations.max(1) * scenario.rig.count() as u64
}

fn absolute(path: &Path) -> PathBuf {
    let path = if path.as_os_str().is_empty() { parent_of(path) } else { path };
    fs::canonicalize(path).unwrap_or_else(|_| path.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_shipped_sweep_can_be_planned() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/sweeps");
        let mut count = 0;
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let draft = Draft::new(&SweepFile::open(&path).unwrap(), None).unwrap();
            let record = &draft.record;
            assert_eq!(record.cells, record.settings * record.seeds.len());
            assert!(draft.cells.iter().all(|cell| draft.scenario(cell).is_ok()), "{}", path.display());
            let mut sets: Vec<&String> = draft.cells.iter().map(|cell| &cell.set).collect();
            sets.dedup();
            assert_eq!(sets.len(), record.sets, "cells of a set are adjacent");
            count += 1;
        }
        assert!(count >= 5, "{count}");
    }
}
