//! `skiagraph track`: a tracker of ours or a program, seed by seed, over a set on disk.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::error::read_file;
use super::external::{
    ANSWERS_FILE, Conformance, ExternalRecord, ProgramSeed, ProgramSettings, Programmed, dry_run,
    track_seed_with_program,
};
use super::hints::told_by_the_start;
use super::made_by::MadeBy;
use super::progress::Progress;
use super::tracking::{Tracked, track};
use super::unfinished_run::UnfinishedRun;
use super::{ExperimentError, Models, to_json};
use crate::artefacts::{Artefact, ArtefactKind, Destination, Inputs};
use crate::benchmark_set::{BlindSet, TruthSet, is_public};
use crate::input::{hex_sha256, limits};
use crate::scenario::TrackerSettings;

/// What a finished seed of a program is kept in.
const SEED_FILE: &str = "answers.json";
/// Files that a program's command names are known by what they hold up to this size, bytes.
const LARGEST_PROGRAM: u64 = 64 << 20;

/// `skiagraph track`: runs a tracker over a set. Of the set it reads cameras, observations and start alone, unless the
/// tracker is the oracle.
///
/// # Errors
/// [`ExperimentError`]; then no run has changed on the disk. [`ArtefactError::ProgressSaved`] and
/// [`ExperimentError::Unfinished`] where seeds are finished, with which the same call would go on.
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
    let other = MadeBy::track(&blind, settings, seeds).difference_at(to.path);
    let directory = Artefact::begin_unless(to, ArtefactKind::Run, other)?;
    let truth = if settings.kind().needs_truth() { TruthSet::read(set)?.refitted } else { None };
    let mut models = Models::default();
    let mut one = |seeds: &[u64]| track(&blind, settings, seeds, truth.as_ref(), &mut models, progress);
    let (tracked, unfinished) = match seeds {
        [] | [_] => (one(seeds)?, None),
        several => {
            let unfinished = UnfinishedRun::begin(to, &settings_of(&blind, settings)?)?;
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
    let other = MadeBy::program(&blind, settings, seeds).difference_at(to.path);
    let directory = Artefact::begin_unless(to, ArtefactKind::Run, other)?;
    let (all, unfinished) = match seeds {
        [seed] => (vec![track_seed_with_program(&blind, settings, *seed, None, progress)?], None),
        several => {
            let unfinished = UnfinishedRun::begin(to, &program_settings_of(&blind, settings))?;
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
    told_by_the_start(&blind, &tracked).iter().for_each(|hint| progress.note(hint));
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

/// What makes one tracker the same as another, for seeds of one run.
fn settings_of(set: &BlindSet, settings: &TrackerSettings) -> Result<Value, ExperimentError> {
    let model = settings
        .kind()
        .model_file()
        .map(|name| Ok::<_, ExperimentError>(hex_sha256(&read_file(Path::new(name), limits::ARRAYS)?)));
    let made_by = json!({
        "command": "skiagraph track", "tracker": settings, "--calibrate": set.start.calibrate,
        "set hash": set.set_hash, "model file": model.transpose()?,
    });
    Ok(made_by)
}

/// What makes one program the same as another: its command, options, and what the files hold that the command names.
fn program_settings_of(set: &BlindSet, settings: &ProgramSettings) -> Value {
    let named = settings.command.split_whitespace().map(|word| word.trim_matches(['"', '\'']));
    let hash = |word: &str| {
        let is_small = std::fs::metadata(word).is_ok_and(|found| found.is_file() && found.len() <= LARGEST_PROGRAM);
        let bytes = is_small.then(|| std::fs::read(word).ok()).flatten()?;
        Some((format!("SHA-256 of {word}"), Value::String(hex_sha256(&bytes))))
    };
    let files: serde_json::Map<String, Value> = named.filter_map(hash).collect();
    json!({
        "command": "skiagraph track --exec", "--exec": settings.command,
        "options": super::external::ProgramOptions::of(settings), "files": files, "set hash": set.set_hash,
    })
}

fn read_seed(folder: &Path) -> Result<ProgramSeed, ExperimentError> {
    let path = folder.join(SEED_FILE);
    let bytes = read_file(&path, limits::ARRAYS)?;
    serde_json::from_slice(&bytes).map_err(|e| ExperimentError::Malformed { path, detail: e.to_string() })
}
