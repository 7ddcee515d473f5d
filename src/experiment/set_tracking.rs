//! `skiagraph track`: runs a tracker of this program or an external program over a set on disk, seed by seed.

use std::path::{Path, PathBuf};

use serde_json::Value;

use super::made_by::MadeBy;
use super::tracking::track;
use super::unfinished_run::UnfinishedRun;
use crate::artefacts::{Artefact, ArtefactKind, Destination, Inputs};
use crate::benchmark_set::{BlindSet, TruthSet, is_public};
use crate::common::{ExperimentError, Progress, read_file, to_json};
use crate::external::{
    ANSWERS_FILE, Conformance, ExternalRecord, ProgramSeed, ProgramSettings, Programmed, dry_run,
    track_seed_with_program,
};
use crate::input::{hex_sha256, limits};
use crate::measure::Tracked;
use crate::measure::hints::hint_from_start;
use crate::scenario::TrackerSettings;
use crate::train::Models;

/// The file of a program's finished seed.
const SEED_FILE: &str = "answers.json";
/// Files in a program's command are identified by their content up to this size, bytes.
const LARGEST_PROGRAM: u64 = 64 << 20;

/// `skiagraph track`: runs a tracker over a set. It reads only the blind side of the set, except for reference trackers
/// such as the oracle.
///
/// # Errors
/// [`ExperimentError`]; no run on disk is changed then. It is [`ExperimentError::Unfinished`] or an interruption with
/// saved progress if some seeds are finished, from which the same call would resume.
pub fn track_set(
    set: &Path,
    settings: &TrackerSettings,
    seeds: &[u64],
    to: Destination<'_>,
    progress: &dyn Progress,
) -> Result<Tracked, ExperimentError> {
    track_set_calibrating(set, settings, seeds, None, to, progress)
}

/// As [`track_set`]; `calibrate` overrides the set's setting whether the tracker calibrates its body.
///
/// # Errors
/// As [`track_set`].
pub fn track_set_calibrating(
    set: &Path,
    settings: &TrackerSettings,
    seeds: &[u64],
    calibrate: Option<bool>,
    to: Destination<'_>,
    progress: &dyn Progress,
) -> Result<Tracked, ExperimentError> {
    let model_file = settings.kind().model_file().map(PathBuf::from);
    Inputs::new(model_file.into_iter().chain([set.to_owned()])).keep_from(to.path)?;
    let mut blind = BlindSet::read(set)?;
    blind.start.calibrate = calibrate.unwrap_or(blind.start.calibrate);
    let made_by = MadeBy::track(&blind, settings, seeds);
    let directory = Artefact::begin_unless(to, ArtefactKind::Run, made_by.difference_at(to.path))?;
    let truth = if settings.kind().needs_truth { TruthSet::read(set)?.refitted } else { None };
    let mut models = Models::default();
    let mut one = |seeds: &[u64]| track(&blind, settings, seeds, truth.as_ref(), &mut models, progress);
    let (tracked, unfinished) = match seeds {
        [] | [_] => (one(seeds)?, None),
        several => {
            let unfinished = UnfinishedRun::begin(to, &made_by.of_each_seed("model file", model_hash(settings)?))?;
            let all = seed_by_seed(several, &unfinished, progress, |seed, folder| match folder {
                Some(folder) => Tracked::read(&folder, &blind.start.body),
                None => {
                    let folder = unfinished.put(seed, &one(&[seed])?.files(&blind)?)?;
                    Tracked::read(&folder, &blind.start.body)
                }
            });
            let all = all.map_err(|error| unfinished.with_progress(error))?;
            (Tracked::of_seeds(&blind, all)?, Some(unfinished))
        }
    };
    directory.write_all(&tracked.files(&blind)?)?;
    directory.finish()?;
    unfinished.into_iter().for_each(UnfinishedRun::finish);
    Ok(tracked)
}

/// `skiagraph track --exec`: runs a program over a set; the program gets a folder with the blind side only.
///
/// # Errors
/// As [`track_set`].
pub fn track_set_with_program(
    set: &Path,
    settings: &ProgramSettings,
    seeds: &[u64],
    to: Destination<'_>,
    progress: &dyn Progress,
) -> Result<ExternalRecord, ExperimentError> {
    let settings = &with_hidden_set(settings, set)?;
    Inputs::new([set.to_owned()]).keep_from(to.path)?;
    let blind = BlindSet::read(set)?;
    let made_by = MadeBy::program(&blind, settings, seeds);
    let directory = Artefact::begin_unless(to, ArtefactKind::Run, made_by.difference_at(to.path))?;
    let (all, unfinished) = match seeds {
        [seed] => (vec![track_seed_with_program(&blind, settings, *seed, None, progress)?], None),
        several => {
            let unfinished = UnfinishedRun::begin(to, &made_by.of_each_seed("files", hashes_in(&settings.command)))?;
            let (mut kind, mut before): (Option<String>, Option<String>) = (None, None);
            let all = seed_by_seed(several, &unfinished, progress, |seed, folder| {
                let done = match folder {
                    Some(folder) => {
                        let done = read_seed(&folder)?;
                        before = Some(done.program());
                        done
                    }
                    None => {
                        let done = track_seed_with_program(&blind, settings, seed, kind.as_deref(), progress)?;
                        let now = done.program();
                        before.as_ref().map_or(Ok(()), |before| unfinished.check_same("program", before, &now))?;
                        read_seed(&unfinished.put(seed, &vec![(SEED_FILE, to_json(&done)?)])?)?
                    }
                };
                kind = kind.take().or(done.kind().map(str::to_owned));
                Ok(done)
            });
            (all.map_err(|error| unfinished.with_progress(error))?, Some(unfinished))
        }
    };
    let mut done = Programmed::new(&blind, settings, all)?;
    done.record.without_truth = is_public(set);
    let tracked = Tracked { program: Some(done.record.clone()), ..Tracked::from_estimates(done.estimates) };
    hint_from_start(&blind, &tracked).iter().for_each(|hint| progress.note(hint));
    directory.write_all(&tracked.files(&blind)?)?;
    directory.write(ANSWERS_FILE, &done.answers)?;
    directory.finish()?;
    unfinished.into_iter().for_each(UnfinishedRun::finish);
    Ok(done.record)
}

/// `skiagraph track --exec --dry-run`: checks whether a program follows the protocol.
///
/// # Errors
/// [`ExperimentError`] if the program never becomes ready, or the set cannot be read.
pub fn check_program(
    set: &Path,
    settings: &ProgramSettings,
    progress: &dyn Progress,
) -> Result<Conformance, ExperimentError> {
    dry_run(&BlindSet::read(set)?, &with_hidden_set(settings, set)?, progress)
}

/// The same settings with a checked sandbox, if any, that hides the set and the recordings.
fn with_hidden_set(settings: &ProgramSettings, set: &Path) -> Result<ProgramSettings, ExperimentError> {
    let mut settings = settings.clone();
    if let Some(sandbox) = &mut settings.sandbox {
        let recordings = std::env::var_os("SKIAGRAPH_MOCAP").map(PathBuf::from);
        sandbox.hidden.extend([set.to_owned()].into_iter().chain(recordings));
        sandbox.check()?;
    }
    Ok(settings)
}

/// Calls `one` for every seed in order, with the folder of the seed if it is finished. Returns the results.
fn seed_by_seed<T>(
    seeds: &[u64],
    unfinished: &UnfinishedRun,
    progress: &dyn Progress,
    mut one: impl FnMut(u64, Option<PathBuf>) -> Result<T, ExperimentError>,
) -> Result<Vec<T>, ExperimentError> {
    let there = seeds.iter().filter(|seed| unfinished.seed(**seed).is_some()).count();
    if there > 0 {
        progress.note(&format!("resumed: {there} of {} seeds were finished before the interruption", seeds.len()));
    }
    let mut all = Vec::with_capacity(seeds.len());
    for (index, seed) in seeds.iter().enumerate() {
        progress.set_status(&format!("seed {} of {}", index + 1, seeds.len()));
        all.push(one(*seed, unfinished.seed(*seed))?);
    }
    Ok(all)
}

/// The hash of a tracker's model file; null without one.
fn model_hash(settings: &TrackerSettings) -> Result<Value, ExperimentError> {
    let Some(name) = settings.kind().model_file() else { return Ok(Value::Null) };
    Ok(hex_sha256(&read_file(Path::new(name), limits::ARRAYS)?).into())
}

/// The hashes of the files in a program's command.
fn hashes_in(command: &str) -> Value {
    let named = command.split_whitespace().map(|word| word.trim_matches(['"', '\'']));
    let hash = |word: &str| {
        let is_small = std::fs::metadata(word).is_ok_and(|found| found.is_file() && found.len() <= LARGEST_PROGRAM);
        let bytes = is_small.then(|| std::fs::read(word).ok()).flatten()?;
        Some((format!("SHA-256 of {word}"), Value::String(hex_sha256(&bytes))))
    };
    Value::Object(named.filter_map(hash).collect())
}

fn read_seed(folder: &Path) -> Result<ProgramSeed, ExperimentError> {
    let path = folder.join(SEED_FILE);
    let bytes = read_file(&path, limits::ARRAYS)?;
    serde_json::from_slice(&bytes).map_err(|e| ExperimentError::Malformed { path, detail: e.to_string() })
}
