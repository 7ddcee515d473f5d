//! Runs an external program over a set, seed by seed; finished seeds are kept until all are finished.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::unfinished_run::{KeptSeeds, UnfinishedRun};
use crate::artefacts::{Destination, MadeBy};
use crate::common::{ExperimentError, ONE_CAMERA, Progress, read_file, to_json};
use crate::external::{ProgramSeed, ProgramSettings, Programmed, track_seed_with_program};
use crate::measure::Tracked;
use crate::scenario::{KeyError, ProgramTrackerSettings, Scenario, TrackerSettings};
use skiagraph_core::input::{hex_sha256, limits};
use skiagraph_set::BlindSet;

const SEED_FILE: &str = "answers.json";
/// Files in a program's command are identified by their content up to this size, bytes.
const LARGEST_PROGRAM: u64 = 64 << 20;

impl Programmed {
    pub(crate) fn tracked(self) -> Tracked {
        Tracked { program: Some(self.record), answers: self.answers, ..Tracked::from_estimates(self.estimates) }
    }
}

/// Runs a program over a set. With `kept`, finished seeds are kept there, and are not run again.
///
/// # Errors
/// [`ExperimentError`] if the program cannot be run or differs from that of the kept seeds, or a file cannot be read or
/// written.
pub(crate) fn run_program(
    set: &BlindSet,
    settings: &ProgramSettings,
    seeds: &[u64],
    kept: Option<KeptSeeds<'_>>,
    progress: &dyn Progress,
) -> Result<Programmed, ExperimentError> {
    let (mut kind, mut before): (Option<String>, Option<String>) = (None, None);
    let all = seed_by_seed(seeds, kept, progress, |seed, folder| {
        let done = match (folder, kept) {
            (Some(folder), _) => {
                let done = read_seed(&folder)?;
                before = Some(done.program());
                done
            }
            (None, kept) => {
                let done = track_seed_with_program(set, settings, seed, kind.as_deref(), progress)?;
                match kept {
                    None => done,
                    Some(kept) => {
                        let now = done.program();
                        before.as_ref().map_or(Ok(()), |before| kept.run.check_same("program", before, &now))?;
                        read_seed(&kept.put(seed, &vec![(SEED_FILE.into(), to_json(&done)?)])?)?
                    }
                }
            }
        };
        kind = kind.take().or(done.kind().map(str::to_owned));
        Ok(done)
    });
    Programmed::new(set, settings, all?)
}

#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ProgramRun<'a> {
    pub(crate) kept: Option<KeptSeeds<'a>>,
    /// Paths that they may not see in a sandbox, besides the recordings.
    pub(crate) hidden: &'a [&'a Path],
}

impl<'a> ProgramRun<'a> {
    pub(crate) fn hiding(hidden: &'a [&'a Path]) -> Self {
        Self { kept: None, hidden }
    }
}

pub(super) fn track_program(
    set: &BlindSet,
    program: &ProgramTrackerSettings,
    seeds: &[u64],
    run: ProgramRun<'_>,
    progress: &dyn Progress,
) -> Result<Tracked, ExperimentError> {
    let settings = with_hidden(ProgramSettings::new(program, Vec::new()), run.hidden)?;
    let mut done = run_program(set, &settings, seeds, run.kept, progress)
        .map_err(|error| run.kept.iter().fold(error, |error, kept| kept.run.with_progress(error)))?;
    done.record.name = program.name.clone().or(done.record.name);
    Ok(done.tracked())
}

/// The same settings with a checked sandbox, if any, that hides these paths and the recordings.
pub(crate) fn with_hidden(mut settings: ProgramSettings, paths: &[&Path]) -> Result<ProgramSettings, ExperimentError> {
    if let Some(sandbox) = &mut settings.sandbox {
        let recordings = std::env::var_os("SKIAGRAPH_MOCAP").map(PathBuf::from);
        sandbox.hidden.extend(paths.iter().map(|path| (*path).to_owned()).chain(recordings));
        sandbox.check()?;
    }
    Ok(settings)
}

/// Refuses trackers that cannot run: programs whose command line has a placeholder without a value, and the tracker
/// `keypoints` with one camera.
pub(crate) fn check_trackers(scenario: &Scenario) -> Result<(), KeyError> {
    for (name, tracker) in scenario.trackers() {
        if let TrackerSettings::Program(program) = &tracker
            && let Some(message) = program.unset_placeholder()
        {
            return Err(KeyError::new(format!("{}.program.command", table_of(scenario, name)), message));
        }
    }
    let rig = &scenario.rig;
    // how many cameras a file has is not known yet
    let found = if rig.file.is_empty() { keypoints_of_one_camera(scenario, rig.count()) } else { None };
    found.map_or(Ok(()), Err)
}

/// The error of the tracker `keypoints` with this number of cameras; `None` if it can triangulate, or is not used.
pub(crate) fn keypoints_of_one_camera(scenario: &Scenario, cameras: usize) -> Option<KeyError> {
    let trackers = scenario.trackers();
    let (name, _) = trackers.iter().find(|(_, tracker)| matches!(tracker, TrackerSettings::Keypoints(_)))?;
    let key = format!("{}.keypoints", table_of(scenario, name));
    (cameras < 2).then(|| KeyError::new(key, ONE_CAMERA))
}

/// The table of a tracker's settings: `tracker`, or `methods.NAME`.
fn table_of(scenario: &Scenario, name: &str) -> String {
    if scenario.methods.is_empty() { name.to_owned() } else { format!("methods.{name}") }
}

/// Calls `one` for every seed in order, with the folder of the seed if it is finished. Returns the results.
pub(crate) fn seed_by_seed<T>(
    seeds: &[u64],
    kept: Option<KeptSeeds<'_>>,
    progress: &dyn Progress,
    mut one: impl FnMut(u64, Option<PathBuf>) -> Result<T, ExperimentError>,
) -> Result<Vec<T>, ExperimentError> {
    let finished = |seed: &u64| kept.and_then(|kept| kept.seed(*seed));
    let there = seeds.iter().filter(|seed| finished(seed).is_some()).count();
    if there > 0 {
        progress.note(&format!("resumed: {there} of {} seeds were finished before the interruption", seeds.len()));
    }
    let mut all = Vec::with_capacity(seeds.len());
    for (index, seed) in seeds.iter().enumerate() {
        if seeds.len() > 1 {
            progress.set_status(&format!("seed {} of {}", index + 1, seeds.len()));
        }
        all.push(one(*seed, finished(seed))?);
    }
    Ok(all)
}

/// The files that a program's command line names, if they are small.
pub(crate) fn files_in(command: &str) -> Vec<PathBuf> {
    let named = command.split_whitespace().map(|word| word.trim_matches(['"', '\'']));
    let is_small =
        |word: &&str| std::fs::metadata(word).is_ok_and(|found| found.is_file() && found.len() <= LARGEST_PROGRAM);
    named.filter(is_small).map(PathBuf::from).collect()
}

pub(crate) fn hashes_in(command: &str) -> BTreeMap<String, String> {
    let hash = |path: PathBuf| {
        let bytes = std::fs::read(&path).ok()?;
        Some((format!("SHA-256 of {}", path.display()), hex_sha256(&bytes)))
    };
    files_in(command).into_iter().filter_map(hash).collect()
}

/// The unfinished run of a scenario with programs and several seeds; `None` for others, which are not resumed.
/// The run's place must be locked.
pub(crate) fn unfinished_run_of(
    scenario: &Scenario,
    made_by: &MadeBy,
    set: &BlindSet,
    to: Destination<'_>,
) -> Result<Option<UnfinishedRun>, ExperimentError> {
    let trackers = scenario.trackers();
    let commands = trackers.iter().filter_map(|(_, tracker)| match tracker {
        TrackerSettings::Program(program) => Some(program.command.as_str()),
        _ => None,
    });
    let commands: Vec<&str> = commands.collect();
    if commands.is_empty() || scenario.seeds < 2 {
        return Ok(None);
    }
    let mut made_by = made_by.clone().of("set", &set.set_hash);
    made_by.inputs.extend(commands.into_iter().flat_map(hashes_in));
    Ok(Some(UnfinishedRun::begin(to, &made_by)?))
}

fn read_seed(folder: &Path) -> Result<ProgramSeed, ExperimentError> {
    let path = folder.join(SEED_FILE);
    let bytes = read_file(&path, limits::ARRAYS)?;
    serde_json::from_slice(&bytes).map_err(|e| ExperimentError::Malformed { path, detail: e.to_string() })
}
