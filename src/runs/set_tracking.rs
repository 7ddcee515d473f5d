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
use skiagraph_core::body::Calibrated;
use skiagraph_core::input::{hex_sha256, limits};
use skiagraph_set::{BlindSet, TruthSet, is_public};

/// What a tracker is given other than the set says.
#[derive(Clone, Copy, Debug, Default)]
pub struct TrackOptions<'a> {
    pub calibrate: Option<Calibrated>,
    /// Names of cameras whose images it does not get.
    pub leave_out: &'a [String],
}

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
    TrackOptions { calibrate, leave_out }: TrackOptions<'_>,
    to: Destination<'_>,
    progress: &dyn Progress,
) -> Result<Tracked, ExperimentError> {
    let model_file = settings.kind().model_file().map(PathBuf::from);
    Inputs::new(model_file.into_iter().chain([set.to_owned()])).keep_from(to.path)?;
    let mut blind = BlindSet::read(set)?;
    blind.expect_silhouettes()?;
    if calibrate.is_some_and(|asked| !asked.is_nothing())
        && !matches!(settings, TrackerSettings::AnnealedParticleFilter(_))
    {
        let name = settings.name();
        progress.note(&format!("--calibrate: {name} does not calibrate the body; annealed_particle_filter does"));
    }
    blind.start.calibrate = calibrate.unwrap_or(blind.start.calibrate);
    let blind = without(blind, leave_out)?;
    let mut made_by = made_by_track(&blind, settings, seeds);
    if !leave_out.is_empty() {
        made_by.settings["--leave-out"] = json!(leave_out);
    }
    let directory = Artefact::begin_folder(to, ArtefactKind::Run, made_by.clone())?;
    let truth = if settings.kind().needs_truth { TruthSet::read(set)?.refitted } else { None };
    let mut models = Models::default();
    let mut one = |seeds: &[u64]| {
        let mut tracked = track(&blind, settings, seeds, truth.as_ref(), &mut models, progress)?;
        tracked.record.iter_mut().for_each(|record| record.left_out = leave_out.to_vec());
        Ok::<_, ExperimentError>(tracked)
    };
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

fn without(set: BlindSet, names: &[String]) -> Result<BlindSet, ExperimentError> {
    let refuse = |detail: String| ExperimentError::Argument { argument: "--leave-out", detail };
    let known: Vec<String> = set.rig.cameras.iter().map(|camera| camera.name.clone()).collect();
    let mut left_out = Vec::new();
    for name in names {
        let index = known.iter().position(|known| known == name);
        left_out.push(index.ok_or_else(|| refuse(format!("expected a camera of {}, found {name}", known.join(", "))))?);
    }
    if left_out.len() >= known.len() {
        return Err(refuse("expected at least one camera that is not left out".to_owned()));
    }
    Ok(set.without_images_of(&left_out))
}

/// `skiagraph track --exec`: runs a program over a set; the program gets a folder with the blind side only.
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
pub fn check_program(
    set: &Path,
    settings: &ProgramSettings,
    progress: &dyn Progress,
) -> Result<Conformance, ExperimentError> {
    dry_run(&BlindSet::read(set)?, &with_hidden(settings.clone(), &[set])?, progress)
}

/// A tracker of this program on a set.
pub(crate) fn made_by_track(set: &BlindSet, tracker: &TrackerSettings, seeds: &[u64]) -> MadeBy {
    let can_calibrate = matches!(tracker, TrackerSettings::AnnealedParticleFilter(_));
    let calibrate = if can_calibrate { set.start.calibrate } else { Calibrated::Nothing };
    let mut settings = json!(tracker);
    (settings["--calibrate"], settings["seeds"]) = (json!(calibrate), json!(seeds));
    MadeBy::new("skiagraph track", settings).of("set", &set.set_hash)
}

fn model_hash(settings: &TrackerSettings) -> Result<Option<String>, ExperimentError> {
    let Some(name) = settings.kind().model_file() else { return Ok(None) };
    Ok(Some(hex_sha256(&read_file(Path::new(name), limits::ARRAYS)?)))
}
