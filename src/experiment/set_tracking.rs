//! `skiagraph track`: a tracker of ours or a program, seed by seed, over a set on disk.

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

/// What a finished seed of a program is kept in.
const SEED_FILE: &str = "answers.json";
/// Files that a program's command names are known by what they hold up to this size, bytes.
const LARGEST_PROGRAM: u64 = 64 << 20;

/// `skiagraph track`: runs a tracker over a set. Of the set it reads cameras, observations and start alone, unless the
/// tracker is the oracle.
///
/// # Errors
/// [`ExperimentError`]; then no run has changed on the disk. It is [`ExperimentError::Unfinished`] or an interruption
/// whose progress is saved where seeds are finished, with which the same call would go on.
pub fn track_set(
    set: &Path,
    settings: &TrackerSettings,
    seeds: &[u64],
    to: Destination<'_>,
    progress: &dyn Progress,
) -> Result<Tracked, ExperimentError> {
    track_set_calibrating(set, settings, seeds, None, to, progress)
}

/// As [`track_set`]; `calibrate` says whether the tracker calibrates its body, whatever the set says of it.
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
            let all = all.map_err(|error| unfinished.told(error))?;
            (Tracked::of_seeds(&blind, all)?, Some(unfinished))
        }
    };
    directory.write_all(&tracked.files(&blind)?)?;
    directory.finish()?;
    unfinished.into_iter().for_each(UnfinishedRun::finish);
    Ok(tracked)
}

/// `skiagraph track --exec`: runs a program over a set, handed a folder that holds the blind side alone.
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
    let settings = &hiding(settings, set)?;
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
            (all.map_err(|error| unfinished.told(error))?, Some(unfinished))
        }
    };
    let mut done = Programmed::new(&blind, settings, all)?;
    done.record.without_truth = is_public(set);
    let tracked = Tracked {
        record: None,
        estimates: done.estimates,
        search: Vec::new(),
        sources: Vec::new(),
        program: Some(done.record.clone()),
        estimate: None,
        read_as: None,
    };
    hint_from_start(&blind, &tracked).iter().for_each(|hint| progress.note(hint));
    directory.write_all(&tracked.files(&blind)?)?;
    directory.write(ANSWERS_FILE, &done.answers)?;
    directory.finish()?;
    unfinished.into_iter().for_each(UnfinishedRun::finish);
    Ok(done.record)
}

/// `skiagraph track --exec --dry-run`: whether a program keeps to the protocol.
///
/// # Errors
/// [`ExperimentError`] if the program never becomes ready, or the set cannot be read.
pub fn check_program(
    set: &Path,
    settings: &ProgramSettings,
    progress: &dyn Progress,
) -> Result<Conformance, ExperimentError> {
    dry_run(&BlindSet::read(set)?, &hiding(settings, set)?, progress)
}

/// The same settings; a sandbox hides the set and the recordings, and can be made here.
fn hiding(settings: &ProgramSettings, set: &Path) -> Result<ProgramSettings, ExperimentError> {
    let mut settings = settings.clone();
    if let Some(sandbox) = &mut settings.sandbox {
        let recordings = std::env::var_os("SKIAGRAPH_MOCAP").map(PathBuf::from);
        sandbox.hidden.extend([set.to_owned()].into_iter().chain(recordings));
        sandbox.check()?;
    }
    Ok(settings)
}

/// Every seed in order, with the folder of those that are finished; what `one` made of them.
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

/// What the model file of a tracker holds.
fn model_hash(settings: &TrackerSettings) -> Result<Value, ExperimentError> {
    let Some(name) = settings.kind().model_file() else { return Ok(Value::Null) };
    Ok(hex_sha256(&read_file(Path::new(name), limits::ARRAYS)?).into())
}

/// What the files hold that a program's command names.
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
