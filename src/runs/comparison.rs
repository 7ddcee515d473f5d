//! Several methods on one set, each with a run folder, and their comparison.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::reading::measured_clip;
use super::run::MethodRun;
use crate::artefacts::{Artefact, ArtefactKind, Destination, output};
use crate::common::{ExperimentError, Progress, to_json};
use crate::external::TrackTiming;
use crate::measure::REPORT_FILE;
use crate::prepare::scenario_copy::{inputs_of, made_by_run};
use crate::rendering::draw;
use crate::scenario::{Scenario, ScenarioFile};
use crate::tracking::program::{check_trackers, unfinished_run_of};
use crate::tracking::unfinished_run::UnfinishedRun;
use crate::train::Models;
use skiagraph_eval::{MeasuredRuns, Summary, compare_runs};
use skiagraph_report::{ComparedMethod, difference_page};

pub const COMPARISON_FILE: &str = "comparison.json";
pub const COMPARISON_PAGE: &str = "comparison.html";

/// Several methods in numbers: `comparison.json`. Everything except `timing` has the same bytes for the same scenario.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MethodComparison {
    /// `skiagraph.comparison/1`.
    pub schema: String,
    pub scenario: String,
    pub seeds: Vec<u64>,
    pub frames: usize,
    #[serde(default)]
    pub frames_per_second: f64,
    /// Whether actor and tracker share one body.
    pub matched: bool,
    /// Hash of the set's files.
    #[serde(default)]
    pub set_hash: String,
    #[serde(default)]
    pub version: String,
    /// The methods by name, which is also the name of the method's run folder.
    pub methods: BTreeMap<String, MethodRecord>,
}

/// One method of a comparison.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MethodRecord {
    pub tracker: String,
    /// The tracker and all its settings as in a scenario.
    #[serde(default)]
    pub settings: Value,
    /// Whether it was given the true root of every frame.
    #[serde(default)]
    pub given_roots: bool,
    /// Descriptions of the tracker's training recordings; empty without any.
    #[serde(default)]
    pub learned_from: Vec<String>,
    /// Number of learned models, if there are any.
    #[serde(default)]
    pub models: Option<usize>,
    /// Number of particles, over all frames and seeds, that left their model's region and were moved back.
    #[serde(default)]
    pub recovered_particles: u64,
    /// Every metric over all seeds, with its protocol, interval and values per seed.
    #[serde(flatten)]
    pub summary: Summary,
    /// Mean of every metric for a tracker that never moves.
    #[serde(default)]
    pub frozen: BTreeMap<String, f64>,
    /// What differs between runs.
    #[serde(default)]
    pub timing: Option<TrackTiming>,
}

#[derive(Clone, Debug)]
pub struct Compared {
    pub comparison: MethodComparison,
    pub notes: Vec<String>,
}

/// `skiagraph run` of a scenario with methods: renders once, then tracks and measures with every method and all seeds.
/// Motion models are learned once.
pub fn compare(
    file: &ScenarioFile,
    mocap_directory: Option<&Path>,
    to: Destination<'_>,
    progress: &dyn Progress,
) -> Result<Compared, ExperimentError> {
    let scenario = &file.scenario;
    check_trackers(&file.scenario).map_err(|error| file.located(&error))?;
    inputs_of(file, mocap_directory).keep_from(to.path)?;
    let made_by = made_by_run(scenario)?;
    let directory = Artefact::begin_folder(to, ArtefactKind::Run, made_by.clone())?;
    let (set, notes) = draw(file, mocap_directory, progress)?;
    let seeds: Vec<u64> = scenario.all_seeds().collect();
    let unfinished = unfinished_run_of(scenario, &made_by, &set.blind, to)?;
    let mut models = Models::new(&file.folder, &set.truth.recordings);
    let comparison = empty(scenario, &set.blind, set.truth.facts.matched);
    let mut compared = Compared { comparison, notes };
    let (mut methods, mut sides) = (Vec::new(), Vec::new());
    for (name, settings) in &scenario.methods {
        let folder = directory.folder().join(name);
        fs::create_dir(&folder).map_err(output(&folder, "create the directory"))?;
        let alone = Scenario { tracker: Some(settings.clone()), methods: BTreeMap::new(), ..scenario.clone() };
        let attempt = MethodRun {
            directory: &directory,
            folder: name,
            scenario: &alone,
            set: &set,
            seeds: &seeds,
            unfinished: unfinished.as_ref(),
            hidden: directory.folder(),
        };
        let done = attempt.run(&mut models, progress)?;
        let hint = done.record.hint.as_ref();
        compared.notes.extend(hint.map(|hint| format!("{name}: the estimate may have been misread: {}", hint.text)));
        let occupancies = || done.tracked.search.iter().flatten().map(|record| &record.occupancy);
        let record = MethodRecord {
            tracker: settings.name().to_owned(),
            settings: serde_json::to_value(settings).unwrap_or_default(),
            given_roots: settings.kind().is_given_roots(),
            learned_from: done.record.learned_from.clone(),
            models: occupancies().map(Vec::len).max().filter(|models| *models > 0),
            recovered_particles: occupancies().flatten().map(|model| u64::from(model.recovered)).sum(),
            summary: done.record.summary.clone(),
            frozen: done.record.frozen.clone(),
            timing: done.record.timing,
        };
        compared.comparison.methods.insert(name.clone(), record);
        methods.push(ComparedMethod {
            name: name.clone(),
            knows_truth: settings.kind().needs_truth || settings.kind().is_given_roots(),
            summary: done.record.summary.clone(),
            errors: done.errors,
            report: Some(format!("{name}/{REPORT_FILE}")),
        });
        let clips = BTreeMap::from([(scenario.name.clone(), measured_clip(&done.record))]);
        sides.push((name.as_str(), MeasuredRuns { clips, ..MeasuredRuns::default() }));
    }
    if let [base, others @ ..] = sides.as_slice() {
        let others: Vec<_> = others.iter().map(|(name, runs)| (*name, runs)).collect();
        let differences = compare_runs((base.0, &base.1), &others, false, None)?;
        directory.write(COMPARISON_PAGE, difference_page(&differences, &methods)?.as_bytes())?;
    }
    directory.write(COMPARISON_FILE, &to_json(&compared.comparison)?)?;
    directory.finish()?;
    unfinished.into_iter().for_each(UnfinishedRun::finish);
    Ok(compared)
}

impl MethodComparison {
    const SCHEMA: &str = "skiagraph.comparison/1";
}

fn empty(scenario: &Scenario, set: &skiagraph_set::BlindSet, matched: bool) -> MethodComparison {
    MethodComparison {
        schema: MethodComparison::SCHEMA.to_owned(),
        scenario: scenario.name.clone(),
        seeds: scenario.all_seeds().collect(),
        frames: set.frame_count,
        frames_per_second: set.frames_per_second,
        matched,
        set_hash: set.set_hash.clone(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        methods: BTreeMap::new(),
    }
}
