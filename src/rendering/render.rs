//! Renders the set of a scenario, in memory or directly to disk.

use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use super::key_source::{KeySource, has_secrets, note, with_key, without_key};
use super::observer::observer;
use super::same_set::{is_public_side_of, kept, set_difference};
use super::unfinished_set::UnfinishedSet;
use crate::artefacts::{Artefact, ArtefactKind, Destination, MadeBy};
use crate::common::{ExperimentError, Progress, Stage};
use crate::prepare::PreparedScene;
use crate::prepare::scenario_copy::{inputs_of, made_by_render};
use crate::prepare::scene_check::{CamerasInside, unseen_in};
use crate::scenario::ScenarioFile;
use skiagraph_core::observation::Observation;
use skiagraph_core::rng::ObservationKey;
use skiagraph_set::{BenchmarkSet, BlindSet, SetDrawing, SetError, SetParts, is_set};
use skiagraph_truth::observing::ObservationFacts;

/// Renders the benchmark set of a scenario in memory. Returns it and notes for the user.
pub fn draw(
    file: &ScenarioFile,
    mocap_directory: Option<&Path>,
    progress: &dyn Progress,
) -> Result<(BenchmarkSet, Vec<String>), ExperimentError> {
    draw_by(file, mocap_directory, progress, |parts, observe| {
        BenchmarkSet::assemble_unless(parts, &|| progress.interrupted(), |frame| {
            progress.advance();
            observe(frame)
        })
    })
}

/// Prepares the scene of a scenario and calls `make` with its observer. Returns the result of `make` and notes for the
/// user.
fn draw_by<T>(
    file: &ScenarioFile,
    mocap_directory: Option<&Path>,
    progress: &dyn Progress,
    make: impl FnOnce(&SetParts<'_>, &(dyn Fn(usize) -> Observation + Sync)) -> Result<T, SetError>,
) -> Result<(T, Vec<String>), ExperimentError> {
    let scene = PreparedScene::new(file, mocap_directory)?;
    let inside = CamerasInside::new(file.scenario.rig.ring.as_ref(), &scene);
    if let Some(refused) = inside.errors.into_iter().next() {
        return Err(file.located(&refused).into());
    }
    let settings = &file.scenario.observation;
    let others = scene.ground_truth.distractors.len();
    let facts =
        (!settings.is_exact() || others > 0).then(|| ObservationFacts { distractors: others, ..settings.facts() });
    progress.begin(Stage::Render, scene.frames());
    let parts = scene.set_parts(&file.scenario.name, facts.as_ref());
    let observer = observer(&scene.ground_truth, &scene.rig, settings)?;
    let (seen, observed) = (AtomicBool::new(false), AtomicUsize::new(0));
    let shows = |observation: &Observation| observation.silhouettes.iter().any(|silhouette| !silhouette.is_empty());
    let made = make(&parts, &|frame| {
        let observation = observer.observe(frame);
        seen.fetch_or(shows(&observation), Ordering::Relaxed);
        observed.fetch_add(1, Ordering::Relaxed);
        observation
    })?;
    if progress.interrupted() {
        return Err(ExperimentError::Interrupted);
    }
    // the actor may be visible only in frames that were drawn before an interruption
    let others = observed.into_inner() < scene.frames();
    let is_seen = seen.into_inner() || (others && (0..scene.frames()).any(|frame| shows(&observer.observe(frame))));
    if !is_seen {
        return Err(file.located(&unseen_in(&file.scenario.rig, scene.frames())).into());
    }
    Ok((made, [scene.notes, inside.notes].concat()))
}

#[derive(Clone, Copy, Debug, Default)]
pub struct RenderOptions<'a> {
    /// Place of the complete set, if the set's own place gets it without the truth, for a public challenge. This needs
    /// a secret key, fresh or given.
    pub whole: Option<&'a Path>,
    /// The source of the key of the observations' random numbers.
    pub key: KeySource,
}

/// `skiagraph render`: writes a scenario's benchmark set. Returns it and notes for the user. After an interruption, or
/// if the disk is full, the rendered part is kept beside the place, and the same call resumes. The default key is the
/// scenario's `observation.key`, else the public key: the same scenario gives the same bytes.
///
/// # Errors
/// [`ExperimentError`]; no set on disk is changed then. It is [`ExperimentError::Unfinished`] or an interruption with
/// saved progress if the same call would resume.
pub fn render(
    file: &ScenarioFile,
    mocap_directory: Option<&Path>,
    to: Destination<'_>,
    options: &RenderOptions<'_>,
    progress: &dyn Progress,
) -> Result<(BenchmarkSet, Vec<String>), ExperimentError> {
    // a run can be repeated in minutes, but the runs of a set are worthless without the set
    if let Some(path) = [Some(to.path), options.whole].into_iter().flatten().find(|path| is_set(path) && !to.force) {
        return Err(ExperimentError::SetThere { path: path.to_owned() });
    }
    let inputs = inputs_of(file, mocap_directory);
    inputs.keep_from(to.path)?;
    options.whole.map_or(Ok(()), |path| inputs.keep_from(path))?;
    let stated = options.key.stated(&file.scenario.observation);
    if options.whole.is_some() && stated.is_some_and(|key| key.is_public()) {
        let detail = "expected a secret key for a set whose truth is kept apart, found the public key, with which a \
                      guess of the truth could be confirmed by its hash; leave out `default`, or give 32 hexadecimal \
                      digits";
        return Err(ExperimentError::Argument { argument: "--key", detail: detail.to_owned() });
    }
    let is_secret = options.whole.is_some() || has_secrets(&file.scenario);
    let mut made_by = made_by_render(&without_key(&file.scenario).of_set())?;
    made_by.inputs = inputs.hashes(file.path.as_deref());
    let complete = Destination { path: options.whole.unwrap_or(to.path), ..to };
    let public_key = (!is_secret).then_some(ObservationKey::PUBLIC);
    let mut unfinished = UnfinishedSet::begin(complete, &made_by, stated.or(public_key))?;
    let file = &with_key(file.clone(), unfinished.key());
    let public = options.whole.map(|_| Artefact::begin(to, ArtefactKind::Set)).transpose()?;
    let notes = draw_to_disk(file, mocap_directory, &made_by, &unfinished, progress);
    let mut notes = notes.map_err(|e| unfinished.with_progress(e))?;
    if stated.is_none() && !unfinished.key().is_public() {
        notes.push(note(complete.path));
    }
    let difference = set_difference(complete.path, &made_by, stated.or(public_key));
    if let Some(difference) = &difference {
        notes.push(kept(complete.path, difference));
        unfinished.keep_other();
    }
    if let Some(mut public) = public {
        if is_set(to.path) && (difference.is_some() || !is_public_side_of(to.path, complete.path)) {
            notes.push(kept(to.path, "it does not belong to the replaced complete set"));
            public.keep_other();
        }
        BlindSet::read(unfinished.folder())?.write_without_truth(public.folder())?;
        unfinished.finish()?;
        public.finish()?;
    } else {
        unfinished.finish()?;
    }
    Ok((BenchmarkSet::read(complete.path)?, notes))
}

/// Draws the missing frames. Returns notes for the user.
fn draw_to_disk(
    file: &ScenarioFile,
    mocap_directory: Option<&Path>,
    made_by: &MadeBy,
    unfinished: &UnfinishedSet,
    progress: &dyn Progress,
) -> Result<Vec<String>, ExperimentError> {
    let (folder, journal) = (unfinished.folder(), unfinished.journal());
    let (truth_images, record) = (&file.scenario.truth_images, made_by.text()?);
    let (there, mut notes) = draw_by(file, mocap_directory, progress, |parts, observe| {
        let (frames, cameras) = (parts.ground_truth.frames.len(), parts.rig.cameras());
        let done = AtomicUsize::new(0);
        let tick = || {
            unfinished.keep();
            progress.advance();
            if done.fetch_add(1, Ordering::Relaxed) + 1 == frames && !truth_images.is_empty() {
                progress.begin(Stage::TruthImages, frames * cameras);
            }
        };
        let stop = || progress.interrupted();
        let drawing = SetDrawing { truth_images, made_by: &record, journal: Some(&journal), stop: &stop, tick: &tick };
        BenchmarkSet::draw_into(folder, parts, &drawing, observe)
    })?;
    if there > 0 {
        notes.push(format!("resumed: {there} frames were drawn before the interruption"));
    }
    Ok(notes)
}
