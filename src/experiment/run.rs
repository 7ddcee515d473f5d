//! Rendering, tracking and measuring with atomic directories, and all three in one.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use super::destination::Destination;
use super::error::output;
use super::external::{
    ANSWERS_FILE, Conformance, EXTERNAL_FILE, ExternalRecord, ProgramSettings, dry_run, track_with_program,
};
use super::inputs::Inputs;
use super::measuring::{Measures, SeedMeasures, check_fit};
use super::observing::Observing;
use super::ours::ResultKind;
use super::ownership::{self, LISTING, Listing};
use super::partial_directory::PartialDirectory;
use super::place::write_synced;
use super::poses_file::{PosesDeclared, check_scale, read_poses};
use super::results::{RunRecord, RunResults, tracker_in_words};
use super::scene_check::{CamerasInside, unseen_in};
use super::staging::Staged;
use super::tracking::{BODIES_FILE, POSES_FILE, SEARCH_FILE, TRACK_FILE, Tracked, track};
use super::unfinished;
use super::unfinished_set::{UnfinishedSet, settings_of};
use super::watch::{Stage, Watch};
use super::{ExperimentError, Models, NamedFiles};
use crate::benchmark_set::{BenchmarkSet, BlindSet, Observed, SetDrawing, SetError, SetParts, TruthSet, is_set};
use crate::observation::{Observation, ObservationFacts};
use crate::scenario::{Scenario, ScenarioFile, TrackerSettings};

pub(super) const SCENARIO_FILE: &str = "scenario.toml";

/// A run that is done.
#[derive(Clone, Debug)]
pub struct RunOutcome {
    /// Its numbers.
    pub record: RunRecord,
    /// What a user should know.
    pub notes: Vec<String>,
}

/// Draws what the cameras see of a scenario: a benchmark set in memory, and notes for the user.
///
/// # Errors
/// [`ExperimentError`] that names the file, line or key.
pub fn draw(
    file: &ScenarioFile,
    mocap_directory: Option<&Path>,
    watch: &dyn Watch,
) -> Result<(BenchmarkSet, Vec<String>), ExperimentError> {
    draw_by(file, mocap_directory, watch, |parts, observe| {
        BenchmarkSet::assemble_unless(parts, &|| watch.interrupted(), |frame| {
            watch.advance();
            observe(frame)
        })
    })
}

/// Stages a scenario and has `make` draw its frames; what that made, and notes for the user.
fn draw_by<T>(
    file: &ScenarioFile,
    mocap_directory: Option<&Path>,
    watch: &dyn Watch,
    make: impl FnOnce(&SetParts<'_>, &(dyn Fn(usize) -> Observation + Sync)) -> Result<T, SetError>,
) -> Result<(T, Vec<String>), ExperimentError> {
    let staged = Staged::new(file, mocap_directory)?;
    let inside = CamerasInside::new(file, &staged);
    if let Some(refused) = inside.refused.into_iter().next() {
        return Err(refused);
    }
    let settings = &file.scenario.observation;
    let others = staged.ground_truth.distractors.len();
    let facts =
        (!settings.is_exact() || others > 0).then(|| ObservationFacts { distractors: others, ..settings.facts() });
    watch.begin(Stage::Render, staged.frames());
    let parts = SetParts {
        name: &file.scenario.name,
        rig: &staged.rig,
        start: &staged.start,
        ground_truth: &staged.ground_truth,
        refitted: Some(&staged.refitted),
        facts: &staged.facts,
        recordings: &staged.sources,
        observed: Observed { facts: facts.as_ref(), tracker_rig: staged.tracker_rig.as_ref() },
    };
    let observer = Observing::new(&staged.ground_truth, &staged.rig, settings)?;
    let (seen, observed) = (AtomicBool::new(false), AtomicUsize::new(0));
    let shows = |observation: &Observation| observation.silhouettes.iter().any(|silhouette| !silhouette.is_empty());
    let made = make(&parts, &|frame| {
        let observation = observer.observe(frame);
        seen.fetch_or(shows(&observation), Ordering::Relaxed);
        observed.fetch_add(1, Ordering::Relaxed);
        observation
    })?;
    if watch.interrupted() {
        return Err(ExperimentError::Interrupted);
    }
    // frames that were drawn before an interruption may be those that show something
    let others = observed.into_inner() < staged.frames();
    let is_seen = seen.into_inner() || (others && (0..staged.frames()).any(|frame| shows(&observer.observe(frame))));
    if !is_seen {
        return Err(unseen_in(file, staged.frames()));
    }
    Ok((made, [staged.notes, inside.told].concat()))
}

/// How a set is rendered.
#[derive(Clone, Copy, Debug, Default)]
pub struct RenderOptions<'a> {
    /// Where the complete set goes; its own place then holds it without the truth, for a public challenge.
    pub whole: Option<&'a Path>,
    /// Into how many tar shards the set's files are repeated for training; `None` for none.
    pub shards: Option<usize>,
}

/// `skiagraph render`: writes a scenario's benchmark set; returns it and notes for the user. What is drawn when it is
/// interrupted, or the disk is full, stays beside the place, and the same call goes on with it.
///
/// # Errors
/// [`ExperimentError`]; then no set has changed on the disk. [`ExperimentError::ProgressSaved`] and
/// [`ExperimentError::Unfinished`] where the same call would go on, [`ExperimentError::OtherUnfinished`] where another
/// was interrupted.
pub fn render(
    file: &ScenarioFile,
    mocap_directory: Option<&Path>,
    to: Destination<'_>,
    watch: &dyn Watch,
) -> Result<(BenchmarkSet, Vec<String>), ExperimentError> {
    render_with(file, mocap_directory, to, &RenderOptions::default(), watch)
}

/// As [`render`], with options.
///
/// # Errors
/// As [`render`].
pub fn render_with(
    file: &ScenarioFile,
    mocap_directory: Option<&Path>,
    to: Destination<'_>,
    options: &RenderOptions<'_>,
    watch: &dyn Watch,
) -> Result<(BenchmarkSet, Vec<String>), ExperimentError> {
    // A run takes minutes to repeat; the runs that were made from a set are worth nothing without it.
    if let Some(path) = [Some(to.path), options.whole].into_iter().flatten().find(|path| is_set(path) && !to.force) {
        return Err(ExperimentError::SetThere { path: path.to_owned() });
    }
    let inputs = Inputs::from_scenario(file, mocap_directory);
    inputs.keep_from(to.path)?;
    options.whole.map_or(Ok(()), |path| inputs.keep_from(path))?;
    let settings = settings_of(&scenario_text(&file.scenario.of_set())?, options.shards)?;
    let complete = Destination { path: options.whole.unwrap_or(to.path), ..to };
    let unfinished = UnfinishedSet::begin(complete, &settings)?;
    let public = options.whole.map(|_| PartialDirectory::begin(to.path, ResultKind::Set, to.force)).transpose()?;
    let notes = draw_to_disk(file, mocap_directory, &unfinished, options.shards, watch);
    let notes = notes.map_err(|e| unfinished.told(e))?;
    if let Some(public) = public {
        BlindSet::read(&unfinished.folder())?.write_without_truth(public.folder())?;
        unfinished.finish()?;
        public.finish()?;
    } else {
        unfinished.finish()?;
    }
    Ok((BenchmarkSet::read(complete.path)?, notes))
}

/// Draws what is not there yet; notes for the user.
fn draw_to_disk(
    file: &ScenarioFile,
    mocap_directory: Option<&Path>,
    unfinished: &UnfinishedSet,
    shards: Option<usize>,
    watch: &dyn Watch,
) -> Result<Vec<String>, ExperimentError> {
    let (folder, journal) = (unfinished.folder(), unfinished.journal());
    let layers = &file.scenario.layers;
    let (there, mut notes) = draw_by(file, mocap_directory, watch, |parts, observe| {
        let (frames, cameras) = (parts.ground_truth.frames.len(), parts.rig.cameras.len());
        let done = AtomicUsize::new(0);
        if shards.is_some() && !layers.is_empty() {
            watch.begin(Stage::Layers, frames * (1 + cameras));
        }
        let tick = || {
            unfinished.keep();
            watch.advance();
            // with shards, layers come between
            if done.fetch_add(1, Ordering::Relaxed) + 1 == frames && !layers.is_empty() && shards.is_none() {
                watch.begin(Stage::Layers, frames * cameras);
            }
        };
        let drawing =
            SetDrawing { layers, shards, journal: Some(&journal), stop: &|| watch.interrupted(), tick: &tick };
        BenchmarkSet::draw_into(&folder, parts, &drawing, observe)
    })?;
    if there > 0 {
        notes.push(format!("resumed: {there} frames were drawn before the interruption"));
    }
    Ok(notes)
}

/// `skiagraph track`: runs a tracker over a set. Of the set it reads cameras, observations and start alone, unless the
/// tracker is the oracle.
///
/// # Errors
/// [`ExperimentError`]; then nothing has changed on the disk.
pub fn track_set(
    set: &Path,
    settings: &TrackerSettings,
    seeds: &[u64],
    to: Destination<'_>,
    watch: &dyn Watch,
) -> Result<Tracked, ExperimentError> {
    track_set_calibrating(set, settings, seeds, None, to, watch)
}

/// As [`track_set`]; `calibrate` says whether the tracker calibrates its body, whatever the set says of it.
///
/// # Errors
/// [`ExperimentError`]; then nothing has changed on the disk.
pub fn track_set_calibrating(
    set: &Path,
    settings: &TrackerSettings,
    seeds: &[u64],
    calibrate: Option<bool>,
    to: Destination<'_>,
    watch: &dyn Watch,
) -> Result<Tracked, ExperimentError> {
    Inputs::from_set(set, settings).keep_from(to.path)?;
    let directory = PartialDirectory::begin(to.path, ResultKind::Run, to.force)?;
    let mut blind = BlindSet::read(set)?;
    blind.start.calibrate = calibrate.unwrap_or(blind.start.calibrate);
    let truth = if settings.kind().needs_truth() { TruthSet::read(set)?.refitted } else { None };
    let tracked = track(&blind, settings, seeds, truth.as_ref(), &mut Models::default(), watch)?;
    write_all(&directory, &tracked.files(&blind)?)?;
    directory.finish()?;
    Ok(tracked)
}

/// `skiagraph track --exec`: runs a program over a set, handed a folder that holds the blind side alone.
///
/// # Errors
/// [`ExperimentError`]; then nothing has changed on the disk.
pub fn track_set_with_program(
    set: &Path,
    settings: &ProgramSettings,
    seeds: &[u64],
    to: Destination<'_>,
    watch: &dyn Watch,
) -> Result<ExternalRecord, ExperimentError> {
    Inputs::new([set.to_owned()]).keep_from(to.path)?;
    let directory = PartialDirectory::begin(to.path, ResultKind::Run, to.force)?;
    let blind = BlindSet::read(set)?;
    let handed = HandedOut::new(&blind, directory.folder())?;
    let done = track_with_program(&blind, &handed.folder, settings, seeds, watch)?;
    drop(handed);
    let tracked = Tracked {
        record: None,
        estimates: done.estimates,
        search: Vec::new(),
        sources: Vec::new(),
        program: Some(done.record.clone()),
    };
    write_all(&directory, &tracked.files(&blind)?)?;
    directory.write(ANSWERS_FILE, &done.answers)?;
    directory.finish()?;
    Ok(done.record)
}

/// `skiagraph track --exec --dry-run`: whether a program keeps to the protocol.
///
/// # Errors
/// [`ExperimentError`] if the program never becomes ready, or the set cannot be read.
pub fn check_program(
    set: &Path,
    settings: &ProgramSettings,
    watch: &dyn Watch,
) -> Result<Conformance, ExperimentError> {
    let blind = BlindSet::read(set)?;
    let beside = std::env::temp_dir().join(format!("skiagraph-dry-run-{}", std::process::id()));
    fs::create_dir_all(&beside).map_err(output(&beside, "create the directory"))?;
    unfinished::begin(&beside);
    let found = HandedOut::new(&blind, &beside).and_then(|handed| dry_run(&blind, &handed.folder, settings, watch));
    fs::remove_dir_all(&beside).ok();
    unfinished::end(&beside);
    found
}

/// The blind side of a set in a folder of its own; gone when dropped.
struct HandedOut {
    folder: PathBuf,
}

impl HandedOut {
    fn new(set: &BlindSet, below: &Path) -> Result<Self, ExperimentError> {
        let folder = fs::canonicalize(below).unwrap_or_else(|_| below.to_owned()).join("handed-out");
        let handed = Self { folder };
        set.hand_out(&handed.folder)?;
        Ok(handed)
    }
}

impl Drop for HandedOut {
    fn drop(&mut self) {
        fs::remove_dir_all(&self.folder).ok();
    }
}

/// An evaluation that is done.
#[derive(Clone, Debug)]
pub struct Evaluated {
    /// Its numbers.
    pub record: RunRecord,
    /// The folder with its files.
    pub place: PathBuf,
    /// What a user should know.
    pub notes: Vec<String>,
}

/// `skiagraph evaluate`: measures a run against the truth of its set. `run` is a run of this program, another program's
/// folder with a `poses.npz`, or a file of poses (`.npz`, `.csv`, `.trc`, `.bvh`) of which a user may declare units,
/// axes and names. The results of a run of this program go into its folder unless `out` says otherwise; nothing else
/// there is changed. Results of another program's estimate go beside it, into `NAME-evaluation` or `out`, never into
/// it.
///
/// # Errors
/// [`ExperimentError`]; then nothing has changed on the disk.
pub fn evaluate_run(
    set: &Path,
    run: &Path,
    declared: &PosesDeclared,
    out: Option<&Path>,
    force: bool,
    watch: &dyn Watch,
) -> Result<Evaluated, ExperimentError> {
    let whole = BenchmarkSet::read(set)?;
    let listing = Listing::read(run);
    let holds = |names: &[&str]| names.iter().all(|name| listing.holds(run, name));
    let bodies = !run.join(BODIES_FILE).exists() || listing.holds(run, BODIES_FILE);
    let is_tracked = holds(&[TRACK_FILE, POSES_FILE, SEARCH_FILE]) && bodies;
    let is_ours = is_tracked || holds(&[EXTERNAL_FILE, POSES_FILE]);
    let place = match out {
        Some(out) => out.to_owned(),
        None if is_ours => run.to_owned(),
        None => beside_estimate(run)?,
    };
    let body = &whole.blind.start.body;
    let mut tracked = match is_ours {
        true if is_tracked => Tracked::read(run, body)?,
        true => Tracked::read_program(run, body)?,
        false => read_poses(&if run.is_dir() { run.join(POSES_FILE) } else { run.to_owned() }, &whole, declared)?,
    };
    if !is_ours && run.join(TRACK_FILE).exists() {
        tracked.estimates.notes.push(format!(
            "{run}/{POSES_FILE} was changed after the run (its hash differs from {run}/{LISTING}): it is measured \
            without {run}/{TRACK_FILE}, as another program's estimate",
            run = run.display()
        ));
    }
    check_fit(&whole, &tracked).map_err(|detail| ExperimentError::AnotherSet {
        run: run.to_owned(),
        set: set.to_owned(),
        detail,
    })?;
    if !is_tracked {
        check_scale(&whole.blind, &tracked.estimates)
            .map_err(|detail| ExperimentError::Malformed { path: run.to_owned(), detail })?;
    }
    check_sources(&whole, &tracked, run, watch)?;
    if is_ours && out.is_none() {
        let results = measure(&whole, &tracked, watch)?;
        replace_files(run, &listing, &results.files)?;
        return Ok(Evaluated { record: results.record, place, notes: tracked.estimates.notes });
    }
    Inputs::new([set, run].map(Path::to_owned)).keep_from(&place)?;
    let directory = PartialDirectory::begin(&place, ResultKind::Run, force)?;
    let results = measure(&whole, &tracked, watch)?;
    write_all(&directory, &results.files)?;
    directory.finish()?;
    Ok(Evaluated { record: results.record, place, notes: tracked.estimates.notes })
}

/// Where the results of somebody else's estimate go: `NAME-evaluation` beside it.
fn beside_estimate(run: &Path) -> Result<PathBuf, ExperimentError> {
    let name = if run.is_dir() { run.file_name() } else { run.file_stem() };
    let name = name.ok_or_else(|| ExperimentError::Argument {
        argument: "--out",
        detail: format!("cannot derive an output directory from {}; give one", run.display()),
    })?;
    let mut name = name.to_owned();
    name.push("-evaluation");
    Ok(run.with_file_name(name))
}

/// Refuses a run whose model file learned from frames of the test. `track` cannot: what the test is known by lies
/// beside the truth.
fn check_sources(set: &BenchmarkSet, tracked: &Tracked, run: &Path, watch: &dyn Watch) -> Result<(), ExperimentError> {
    if tracked.sources.is_empty() {
        return Ok(());
    }
    let tests = &set.truth.recordings;
    if tests.is_empty() {
        watch.note(
            "the set does not record its source recording, so it is unknown whether the run's model learned from it",
        );
        return Ok(());
    }
    for source in &tracked.sources {
        if let Some((first, last)) = tests.iter().find_map(|test| source.shared_frames(test)) {
            let (run, clip) = (run.to_owned(), source.clip.clone());
            return Err(ExperimentError::LearnedFromTest { run, clip, first, last });
        }
        if source.fingerprint.is_none() {
            let clip = &source.clip;
            watch.note(&format!(
                "overlap of `{clip}` (training) with the test was checked by file names and hashes only"
            ));
        }
    }
    Ok(())
}

/// `skiagraph run`: renders, tracks and measures a scenario with all its seeds.
///
/// # Errors
/// [`ExperimentError`]; then nothing has changed on the disk.
pub fn run(
    file: &ScenarioFile,
    mocap_directory: Option<&Path>,
    to: Destination<'_>,
    watch: &dyn Watch,
) -> Result<RunOutcome, ExperimentError> {
    Inputs::from_scenario(file, mocap_directory).keep_from(to.path)?;
    let directory = PartialDirectory::begin(to.path, ResultKind::Run, to.force)?;
    let (set, notes) = draw(file, mocap_directory, watch)?;
    let seeds: Vec<u64> = file.scenario.all_seeds().collect();
    let attempt = MethodRun { directory: &directory, folder: "", scenario: &file.scenario, set: &set, seeds: &seeds };
    let record = attempt.run(&mut Models::new(file, &set.truth.recordings), watch)?.record;
    directory.finish()?;
    Ok(RunOutcome { record, notes })
}

/// One tracker to be run on a set with all seeds.
pub(super) struct MethodRun<'a> {
    pub(super) directory: &'a PartialDirectory,
    /// Folder of the run inside the directory, which is there; empty for the directory itself.
    pub(super) folder: &'a str,
    pub(super) scenario: &'a Scenario,
    pub(super) set: &'a BenchmarkSet,
    pub(super) seeds: &'a [u64],
}

/// What came of an attempt.
pub(super) struct MethodOutcome {
    pub(super) record: RunRecord,
    pub(super) tracked: Tracked,
    pub(super) tracker_in_words: String,
    /// HumanEva error, mm, `[seed][frame]`.
    pub(super) errors: Vec<Vec<Option<f64>>>,
}

impl MethodRun<'_> {
    /// Tracks, measures and writes the run's files.
    pub(super) fn run(&self, models: &mut Models, watch: &dyn Watch) -> Result<MethodOutcome, ExperimentError> {
        let truth = self.set.truth.refitted.as_ref();
        let tracked = track(&self.set.blind, &self.scenario.tracker(), self.seeds, truth, models, watch)?;
        // As when tracking and evaluating separately: the files on disk are measured.
        self.write(&tracked.files(&self.set.blind)?)?;
        let folder = self.directory.folder().join(self.folder);
        let tracked = Tracked::read(&folder, &self.set.blind.start.body)?;
        let measures = Measures::new(self.set, &tracked, watch)?;
        let results = RunResults::of_command(self.set, &tracked, &measures, watch.command())?;
        self.write(&vec![(SCENARIO_FILE, scenario_text(self.scenario)?.into_bytes())])?;
        self.write(&results.files)?;
        if !self.folder.is_empty() {
            ownership::sign(&folder).map_err(output(&folder, "list the files of the directory"))?;
        }
        let error = |seed: &SeedMeasures| seed.evaluation.metrics.get("humaneva_mm").map(|m| m.per_frame.clone());
        Ok(MethodOutcome {
            record: results.record,
            tracker_in_words: tracker_in_words(&tracked),
            errors: measures.seeds.iter().filter_map(error).collect(),
            tracked,
        })
    }

    fn write(&self, files: &NamedFiles) -> Result<(), ExperimentError> {
        let path = |name: &str| Path::new(self.folder).join(name).to_string_lossy().into_owned();
        files.iter().try_for_each(|(name, bytes)| self.directory.write(&path(name), bytes))
    }
}

pub(super) fn measure(set: &BenchmarkSet, tracked: &Tracked, watch: &dyn Watch) -> Result<RunResults, ExperimentError> {
    let measures = Measures::new(set, tracked, watch)?;
    RunResults::of_command(set, tracked, &measures, watch.command())
}

/// The scenario with its overrides, to be run again.
pub(super) fn scenario_text(scenario: &Scenario) -> Result<String, ExperimentError> {
    let malformed = |detail| ExperimentError::Malformed { path: SCENARIO_FILE.into(), detail };
    let tree = serde_json::to_value(scenario).map_err(|e| malformed(e.to_string()))?;
    toml::to_string(&tree).map_err(|e| malformed(e.to_string()))
}

pub(super) fn write_all(directory: &PartialDirectory, files: &NamedFiles) -> Result<(), ExperimentError> {
    files.iter().try_for_each(|(name, bytes)| directory.write(name, bytes))
}

/// Puts files into a directory that is there already: all of them or none. Each is written beside its place first, and
/// only when all are on the disk are they moved; `run.json`, the last, is what makes a run. A file that is there must
/// be listed as ours. The listing knows both the old and the new files while they are moved, so that a run is ours
/// whenever the process dies.
fn replace_files(folder: &Path, listing: &Listing, files: &NamedFiles) -> Result<(), ExperimentError> {
    let path = |name: &str| folder.join(name);
    let foreign = files.iter().find(|(name, _)| path(name).symlink_metadata().is_ok() && !listing.holds(folder, name));
    if let Some((name, _)) = foreign {
        return Err(ExperimentError::Occupied { path: path(name) });
    }
    let mut both = listing.clone();
    files.iter().for_each(|(name, bytes)| both.add(name, bytes));
    let partial = |name: &str| folder.join(format!(".{name}.partial"));
    let replaced = write_partial(&partial, files).and_then(|()| {
        both.store(folder).map_err(output(&path(LISTING), "write"))?;
        files
            .iter()
            .try_for_each(|(name, _)| fs::rename(partial(name), path(name)).map_err(output(&path(name), "write")))?;
        listing.with(files).store(folder).map_err(output(&path(LISTING), "write"))
    });
    if replaced.is_err() {
        files.iter().for_each(|(name, _)| drop(fs::remove_file(partial(name))));
    }
    replaced
}

fn write_partial(partial: &impl Fn(&str) -> PathBuf, files: &NamedFiles) -> Result<(), ExperimentError> {
    files.iter().try_for_each(|(name, bytes)| {
        let path = partial(name);
        write_synced(&path, bytes).map_err(output(&path, "write"))
    })
}
