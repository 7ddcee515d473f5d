//! Measures runs on disk, and renders, tracks and measures in one step; results appear atomically.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::json;

use super::leave_one_out::leave_one_out;
use super::run_place::free_place;
use crate::artefacts::{Artefact, ArtefactKind, Destination, Inputs, LISTING, Listing, MADE_BY, MadeBy, sibling, sign};
use crate::common::{ExperimentError, NamedFiles, Progress};
use crate::external::EXTERNAL_FILE;
use crate::external::start_check::StartDistance;
use crate::measure::footage::FootageMeasures;
use crate::measure::hints::with_hint;
use crate::measure::measuring::check_fit;
use crate::measure::poses_file::{check_angles, check_scale, read_poses};
use crate::measure::reference::{Reference, ReferenceChoice, RunAgainstReference};
use crate::measure::tracked::{BODIES_FILE, POSES_FILE, SEARCH_FILE, TRACK_FILE};
use crate::measure::{Measures, PosesDeclared, RunRecord, RunResults, SeedMeasures, Tracked};
use crate::prepare::scenario_copy::{inputs_of, made_by_run};
use crate::rendering::draw;
use crate::scenario::{Scenario, ScenarioFile};
use crate::tracking::program::{ProgramRun, check_trackers, unfinished_run_of};
use crate::tracking::track::track_running;
use crate::tracking::unfinished_run::UnfinishedRun;
use crate::train::Models;
use skiagraph_set::{BenchmarkSet, BlindSet, SetPlace, is_footage};

#[derive(Clone, Debug)]
pub struct RunOutcome {
    pub record: RunRecord,
    pub notes: Vec<String>,
}

#[derive(Clone, Debug)]
pub struct Evaluated {
    pub record: RunRecord,
    pub place: PathBuf,
    pub notes: Vec<String>,
}

/// What `skiagraph evaluate` is asked to do.
#[derive(Clone, Debug, Default)]
pub struct EvaluateOptions {
    /// How another program's file of poses is read.
    pub declared: PosesDeclared,
    /// The folder of the results, if it is not the usual one.
    pub out: Option<PathBuf>,
    /// Whether existing output of another command is moved aside.
    pub force: bool,
    /// On a recording: what the run is also compared with.
    pub reference: Option<ReferenceChoice>,
    /// On a recording: whether each camera is left out once, and tracked again without it.
    pub leave_one_out: bool,
}

enum MeasuredSet {
    Known(Box<BenchmarkSet>),
    Footage(Box<BlindSet>),
}

impl MeasuredSet {
    fn read(set: SetPlace<'_>) -> Result<Self, ExperimentError> {
        if set.truth.is_none() && is_footage(set.folder) {
            return Ok(Self::Footage(Box::new(BlindSet::read(set.folder)?)));
        }
        Ok(Self::Known(Box::new(set.read()?)))
    }

    fn blind(&self) -> &BlindSet {
        match self {
            Self::Known(set) => &set.blind,
            Self::Footage(set) => set,
        }
    }

    fn measure(
        &self,
        run: &Path,
        tracked: &Tracked,
        reference: Option<&Reference>,
        leave_out_each: bool,
        progress: &dyn Progress,
    ) -> Result<RunResults, ExperimentError> {
        match self {
            Self::Known(set) => measure(set, tracked, progress),
            Self::Footage(set) => {
                let mut measures = FootageMeasures::new(set, tracked, progress)?;
                measures.reference =
                    reference.map(|reference| RunAgainstReference::new(tracked, reference)).transpose()?;
                if leave_out_each {
                    measures.left_out = leave_one_out(set, run, tracked, progress)?;
                }
                measures.results(set, tracked, progress.command())
            }
        }
    }

    /// Refuses what is only for recordings.
    fn expect_options(&self, options: &EvaluateOptions) -> Result<(), ExperimentError> {
        let of_recordings = [("--reference", options.reference.is_some()), ("--leave-one-out", options.leave_one_out)];
        match of_recordings.into_iter().find(|(_, is_given)| *is_given && matches!(self, Self::Known(_))) {
            None => Ok(()),
            Some((argument, _)) => Err(ExperimentError::Argument {
                argument,
                detail: "expected the set of a recording, found one whose truth is known; leave it out".to_owned(),
            }),
        }
    }
}

/// `skiagraph evaluate`: measures a run against the truth of its set, or by the images of a recording. `run` is a run
/// of this program, another program's folder with a `poses.npz`, or a file of poses (`.npz`, `.csv`, `.trc`, `.c3d`,
/// `.bvh`), whose units, axes and names the user may declare. Results of a run of this program go into its folder, or
/// into `out`; nothing else there is changed. Results of another program's estimate go beside it, into
/// `NAME-evaluation` or `out`, never into it.
pub fn evaluate_run(
    set: SetPlace<'_>,
    run: &Path,
    options: &EvaluateOptions,
    progress: &dyn Progress,
) -> Result<Evaluated, ExperimentError> {
    let EvaluateOptions { declared, force, .. } = options;
    let out = options.out.as_deref();
    let whole = MeasuredSet::read(set)?;
    whole.expect_options(options)?;
    let rate = whole.blind().frames_per_second;
    let reference = options.reference.as_ref().map(|choice| Reference::read(choice, rate)).transpose()?;
    let reference = reference.as_ref();
    let blind = whole.blind();
    let listing = Listing::read(run);
    let holds = |names: &[&str]| names.iter().all(|name| listing.holds(run, name));
    let bodies = !run.join(BODIES_FILE).exists() || listing.holds(run, BODIES_FILE);
    let is_tracked = holds(&[TRACK_FILE, POSES_FILE, SEARCH_FILE]) && bodies;
    let is_own_output = is_tracked || holds(&[EXTERNAL_FILE, POSES_FILE]);
    let place = match out {
        Some(out) => out.to_owned(),
        None if is_own_output => run.to_owned(),
        None => beside_estimate(run)?,
    };
    let body = &blind.start.body;
    let mut tracked = if is_tracked {
        Tracked::read(run, body)?
    } else if is_own_output {
        Tracked::read_program(run, body)?
    } else {
        read_poses(&if run.is_dir() { run.join(POSES_FILE) } else { run.to_owned() }, blind, declared)?
    };
    if !is_own_output && run.join(TRACK_FILE).exists() {
        tracked.estimates.notes.push(format!(
            "{run}/{POSES_FILE} was changed after the run (its hash differs from {run}/{LISTING}): it is measured \
            without {run}/{TRACK_FILE}, as another program's estimate",
            run = run.display()
        ));
    }
    check_fit(blind, &tracked).map_err(|detail| ExperimentError::AnotherSet {
        run: run.to_owned(),
        set: set.folder.to_owned(),
        detail,
    })?;
    let malformed = |detail| ExperimentError::Malformed { path: run.to_owned(), detail };
    if is_own_output && declared.is_of_file() {
        let detail = "it is a run of skiagraph, whose units, axes, names and frames are known; leave out --units, --up, \
            --axes, --swap-sides, --shift, --offset, --camera and --joint-map";
        return Err(malformed(detail.to_owned()));
    }
    if is_own_output && !is_tracked {
        check_angles(&tracked.estimates, declared.radians_per_unit).map_err(malformed)?;
    }
    if !is_own_output {
        // a program has no option that corrects its unit: it is measured as by `run`, with a hint
        let unit = tracked.read_as.as_ref().and_then(|read_as| read_as.metres_per_unit);
        check_scale(blind, &tracked.estimates, unit, declared.metres_per_unit).map_err(|detail| match &whole {
            MeasuredSet::Known(known) => malformed(with_hint(known, &tracked, detail)),
            MeasuredSet::Footage(_) => malformed(detail),
        })?;
    }
    if !is_tracked {
        let note = start_note(&whole, &tracked);
        tracked.estimates.notes.extend(note);
    }
    if let MeasuredSet::Known(known) = &whole {
        check_sources(known, &tracked, run, progress)?;
    }
    if is_own_output && out.is_none() {
        let results = whole.measure(run, &tracked, reference, options.leave_one_out, progress)?;
        Listing::replace(run, &results.files)?;
        return Ok(Evaluated { record: results.record, place, notes: tracked.estimates.notes });
    }
    let of_reference = reference.iter().flat_map(|reference| reference.files.clone());
    Inputs::new(set.folders().chain([run.to_owned()]).chain(of_reference)).keep_from(&place)?;
    tracked.estimate = Some(run.display().to_string());
    let made_by = MadeBy::new("skiagraph evaluate", json!({})).of("set", &blind.set_hash);
    let (place, made_by, other) = match out {
        Some(_) => {
            let made_by = made_by.of("estimate", run.display().to_string());
            let there = MadeBy::at(&place).map(with_real_path);
            let other = there
                .map_or_else(|| made_by.difference_at(&place), |it| it.difference(&with_real_path(made_by.clone())));
            (place, made_by, other)
        }
        // results are beside the estimate, so the name of its file identifies it, however its path was given
        None => {
            let made_by = made_by.of("estimate", run.file_name().unwrap_or_default().to_string_lossy());
            (free_place(&place, |path| made_by.difference_at(path).is_some()), made_by, None)
        }
    };
    let to = Destination { path: &place, force: *force };
    let directory = Artefact::begin_unless(to, ArtefactKind::Run, other)?.made_by(made_by);
    let results = whole.measure(run, &tracked, reference, options.leave_one_out, progress)?;
    directory.write_all(&results.files)?;
    directory.finish()?;
    Ok(Evaluated { record: results.record, place, notes: tracked.estimates.notes })
}

/// With links in the path of the estimate resolved, as it may have been given in another way.
fn with_real_path(mut made_by: MadeBy) -> MadeBy {
    if let Some(path) = made_by.inputs.get_mut("estimate")
        && let Ok(real) = fs::canonicalize(&*path)
    {
        *path = real.display().to_string();
    }
    made_by
}

/// A note if the first frame of another program's estimate is far from the start pose, unless errors of the start pose
/// explain it. `track --exec --dry-run` makes the same check.
fn start_note(set: &MeasuredSet, tracked: &Tracked) -> Option<String> {
    let of_seeds = tracked.estimates.sequences.iter().filter_map(|sequence| sequence.markers.first());
    let found = of_seeds.filter_map(|markers| StartDistance::new(set.blind(), markers));
    let farthest = found.max_by(|a, b| a.farthest_m.total_cmp(&b.farthest_m))?;
    let of_truth = match set {
        MeasuredSet::Known(known) => {
            let truth = known.truth.ground_truth.frames.first();
            truth.and_then(|frame| StartDistance::new(&known.blind, &frame.markers))
        }
        MeasuredSet::Footage(_) => None,
    };
    farthest.note().filter(|_| of_truth.is_none_or(|of_truth| of_truth.is_near()))
}

/// The place of the results of another program's estimate: `NAME-evaluation` beside it, with the file's whole name, so
/// that `mine.npz` and `mine.trc` have different places.
fn beside_estimate(run: &Path) -> Result<PathBuf, ExperimentError> {
    run.file_name().map(|_| sibling(run, "", "-evaluation")).ok_or_else(|| ExperimentError::Argument {
        argument: "--out",
        detail: format!("cannot derive an output directory from {}; give one", run.display()),
    })
}

/// Refuses a run whose model file was learned from frames of the test. `track` cannot check this, because the
/// fingerprints of the test are on the truth side.
pub(crate) fn check_sources(
    set: &BenchmarkSet,
    tracked: &Tracked,
    run: &Path,
    progress: &dyn Progress,
) -> Result<(), ExperimentError> {
    if tracked.sources.is_empty() {
        return Ok(());
    }
    let tests = &set.truth.recordings;
    if tests.is_empty() {
        progress.note(
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
            progress.note(&format!(
                "overlap of `{clip}` (training) with the test was checked by file names and hashes only"
            ));
        }
    }
    Ok(())
}

/// `skiagraph run`: renders, tracks and measures a scenario with all its seeds.
pub fn run(
    file: &ScenarioFile,
    mocap_directory: Option<&Path>,
    to: Destination<'_>,
    progress: &dyn Progress,
) -> Result<RunOutcome, ExperimentError> {
    check_trackers(&file.scenario).map_err(|error| file.located(&error))?;
    inputs_of(file, mocap_directory).keep_from(to.path)?;
    let made_by = made_by_run(&file.scenario)?;
    let directory = Artefact::begin_folder(to, ArtefactKind::Run, made_by.clone())?;
    let (set, notes) = draw(file, mocap_directory, progress)?;
    let seeds: Vec<u64> = file.scenario.all_seeds().collect();
    let unfinished = unfinished_run_of(&file.scenario, &made_by, &set.blind, to)?;
    let attempt = MethodRun {
        directory: &directory,
        folder: "",
        scenario: &file.scenario,
        set: &set,
        seeds: &seeds,
        unfinished: unfinished.as_ref(),
        hidden: directory.folder(),
    };
    let record = attempt.run(&mut Models::new(&file.folder, &set.truth.recordings), progress)?.record;
    directory.finish()?;
    unfinished.into_iter().for_each(UnfinishedRun::finish);
    Ok(RunOutcome { record, notes })
}

pub(crate) struct MethodRun<'a> {
    pub(crate) directory: &'a Artefact,
    /// Existing folder of the run inside the directory; empty for the directory itself.
    pub(crate) folder: &'a str,
    pub(crate) scenario: &'a Scenario,
    pub(crate) set: &'a BenchmarkSet,
    pub(crate) seeds: &'a [u64],
    /// Where finished seeds of programs are kept, if they are.
    pub(crate) unfinished: Option<&'a UnfinishedRun>,
    /// A folder that programs may not see in a sandbox.
    pub(crate) hidden: &'a Path,
}

pub(crate) struct MethodOutcome {
    pub(super) record: RunRecord,
    pub(super) tracked: Tracked,
    /// HumanEva error, mm, `[seed][frame]`.
    pub(super) errors: Vec<Vec<Option<f64>>>,
}

impl MethodRun<'_> {
    /// Tracks, measures and writes the run's files.
    pub(crate) fn run(&self, models: &mut Models, progress: &dyn Progress) -> Result<MethodOutcome, ExperimentError> {
        let truth = self.set.truth.refitted.as_ref();
        let kept = self.unfinished.map(|run| run.of_method(self.folder));
        let program = ProgramRun { kept, hidden: &[self.hidden] };
        let tracker = self.scenario.tracker();
        let tracked = track_running(&self.set.blind, &tracker, self.seeds, truth, models, program, progress)?;
        // as when tracking and evaluating separately, the files on disk are measured
        self.write(&tracked.files(&self.set.blind)?)?;
        let folder = self.directory.folder().join(self.folder);
        let body = &self.set.blind.start.body;
        let tracked = match tracked.program {
            Some(_) => Tracked::read_program(&folder, body),
            None => Tracked::read(&folder, body),
        }?;
        let measures = Measures::new(self.set, &tracked, progress)?;
        let results = RunResults::of_command(self.set, &tracked, &measures, progress.command())?;
        self.write(&results.files)?;
        if !self.folder.is_empty() {
            self.write(&vec![(MADE_BY.into(), made_by_run(self.scenario)?.text()?.into_bytes())])?;
            sign(&folder)?;
        }
        let error = |seed: &SeedMeasures| seed.evaluation.metrics.get("humaneva_mm").map(|m| m.per_frame.clone());
        Ok(MethodOutcome { record: results.record, errors: measures.seeds.iter().filter_map(error).collect(), tracked })
    }

    fn write(&self, files: &NamedFiles) -> Result<(), ExperimentError> {
        let path = |name: &str| Path::new(self.folder).join(name).to_string_lossy().into_owned();
        Ok(files.iter().try_for_each(|(name, bytes)| self.directory.write(&path(name), bytes))?)
    }
}

pub(crate) fn measure(
    set: &BenchmarkSet,
    tracked: &Tracked,
    progress: &dyn Progress,
) -> Result<RunResults, ExperimentError> {
    let measures = Measures::new(set, tracked, progress)?;
    RunResults::of_command(set, tracked, &measures, progress.command())
}
