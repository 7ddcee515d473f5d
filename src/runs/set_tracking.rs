//! `skiagraph track`: runs a tracker of this program or an external program over a set on disk, seed by seed.

use std::path::{Path, PathBuf};

use serde_json::json;

use crate::artefacts::{Artefact, ArtefactKind, Destination, Inputs, MadeBy};
use crate::common::{ExperimentError, Progress, read_file};
use crate::external::{Conformance, ExternalRecord, ProgramOptions, ProgramSettings, dry_run};
use crate::measure::Tracked;
use crate::measure::hints::hint_from_start;
use crate::scenario::TrackerSettings;
use crate::tracking::program::{hashes_in, run_program, seed_by_seed, with_hidden};
use crate::tracking::track::track;
use crate::tracking::unfinished_run::UnfinishedRun;
use crate::train::Models;
use skiagraph_core::input::{hex_sha256, limits};
use skiagraph_set::{BlindSet, TruthSet, is_public};

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
    blind.expect_silhouettes()?;
    if calibrate == Some(true) && !matches!(settings, TrackerSettings::AnnealedParticleFilter(_)) {
        let name = settings.name();
        progress.note(&format!("--calibrate: {name} does not calibrate the body; annealed_particle_filter does"));
    }
    blind.start.calibrate = calibrate.unwrap_or(blind.start.calibrate);
    let made_by = made_by_track(&blind, settings, seeds);
    let directory = Artefact::begin_folder(to, ArtefactKind::Run, made_by.clone())?;
    let truth = if settings.kind().needs_truth { TruthSet::read(set)?.refitted } else { None };
    let mut models = Models::default();
    let mut one = |seeds: &[u64]| track(&blind, settings, seeds, truth.as_ref(), &mut models, progress);
    let (tracked, unfinished) = match seeds {
        [] | [_] => (one(seeds)?, None),
        several => {
            let mut made_by = made_by;
            made_by.inputs.extend(model_hash(settings)?.map(|hash| ("model file".to_owned(), hash)));
            let unfinished = UnfinishedRun::begin(to, &made_by)?;
            let kept = unfinished.of_method("");
            let all = seed_by_seed(several, Some(kept), progress, |seed, folder| match folder {
                Some(folder) => Tracked::read(&folder, &blind.start.body),
                None => {
                    let folder = kept.put(seed, &one(&[seed])?.files(&blind)?)?;
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
    let settings = &with_hidden(settings.clone(), &[set])?;
    Inputs::new([set.to_owned()]).keep_from(to.path)?;
    let blind = BlindSet::read(set)?;
    blind.expect_silhouettes()?;
    let mut own = json!(ProgramOptions::of(settings));
    (own["--exec"], own["seeds"]) = (json!(settings.command), json!(seeds));
    let mut made_by = MadeBy::new("skiagraph track --exec", own).of("set", &blind.set_hash);
    let directory = Artefact::begin_folder(to, ArtefactKind::Run, made_by.clone())?;
    made_by.inputs.extend(hashes_in(&settings.command));
    let unfinished = match seeds {
        [] | [_] => None,
        _ if settings.anew => None,
        _ => Some(UnfinishedRun::begin(to, &made_by)?),
    };
    let kept = unfinished.as_ref().map(|run| run.of_method(""));
    let done = run_program(&blind, settings, seeds, kept, progress);
    let mut done = done.map_err(|error| unfinished.iter().fold(error, |error, run| run.with_progress(error)))?;
    done.record.without_truth = is_public(set);
    let record = done.record.clone();
    let tracked = done.tracked();
    tracked.estimates.notes.iter().for_each(|note| progress.note(note));
    hint_from_start(&blind, &tracked).iter().for_each(|hint| progress.note(&hint.text));
    directory.write_all(&tracked.files(&blind)?)?;
    directory.finish()?;
    unfinished.into_iter().for_each(UnfinishedRun::finish);
    Ok(record)
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
    dry_run(&BlindSet::read(set)?, &with_hidden(settings.clone(), &[set])?, progress)
}

/// A tracker of this program on a set.
pub(crate) fn made_by_track(set: &BlindSet, tracker: &TrackerSettings, seeds: &[u64]) -> MadeBy {
    let calibrate = set.start.calibrate && matches!(tracker, TrackerSettings::AnnealedParticleFilter(_));
    let mut settings = json!(tracker);
    (settings["--calibrate"], settings["seeds"]) = (json!(calibrate), json!(seeds));
    MadeBy::new("skiagraph track", settings).of("set", &set.set_hash)
}

/// The hash of a tracker's model file, if it has one.
fn model_hash(settings: &TrackerSettings) -> Result<Option<String>, ExperimentError> {
    let Some(name) = settings.kind().model_file() else { return Ok(None) };
    Ok(Some(hex_sha256(&read_file(Path::new(name), limits::ARRAYS)?)))
}
