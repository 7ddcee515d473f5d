//! Plants one fault after another in what a tracker is given, and compares its estimates with those without a fault.

mod catalogue;
mod page;

use nalgebra::Point3;
use serde::Serialize;

use self::catalogue::{CatalogueFault, Extent, FAULTS, FaultChange, KeypointImage};
pub(crate) use self::page::{faults_markdown, faults_source, faults_text};
use crate::common::{ExperimentError, OnlyInterruption, Progress, Stage, advance};
use crate::external::AnswerCount;
use crate::measure::Tracked;
use crate::scenario::{TrackerSettings, did_you_mean};
use crate::tracking::track;
use crate::train::Models;
use skiagraph_core::body::{KeypointLayout, Markers};
use skiagraph_core::observation::FoundKeypoint;
use skiagraph_set::{BlindChange, BlindSet};

/// A smaller change is none, millimetres.
const NO_CHANGE_MM: f64 = 0.1;
/// A change must be greater than that between repetitions at one seed by this factor.
const ABOVE_NOISE: f64 = 2.0;

/// What became of a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum FaultVerdict {
    /// The estimates change, and the tracker says nothing.
    Silent,
    /// The estimates change, and the tracker says so: an error, incidents, or more frames that it declares lost.
    Noticed,
    /// The estimates do not change.
    NoEffect,
    /// They change, but hardly more than between repetitions at one seed without a fault.
    Undecided,
    /// The set cannot have this fault.
    NotApplicable,
}

#[derive(Clone, Debug, Serialize)]
pub struct PlantedFault {
    /// Its name, as in `--only`.
    pub fault: &'static str,
    pub what: &'static str,
    /// What became of it.
    pub verdict: FaultVerdict,
    /// Mean distance of all markers from those without the fault with the same seed, mean over seeds, millimetres;
    /// absent without frames that both estimate.
    pub change_mm: Option<f64>,
    /// The same by seed.
    pub change_by_seed_mm: Vec<Option<f64>>,
    /// Share of frames without an estimate.
    pub lost: Option<f64>,
    /// What the tracker said, or why the set cannot have the fault.
    pub message: Option<String>,
}

#[derive(Clone, Debug, Serialize)]
pub struct FaultReport {
    /// `skiagraph.faults/2`.
    pub schema: &'static str,
    pub set: String,
    /// Hash of the set's files.
    pub set_hash: String,
    pub tracker: String,
    pub seeds: Vec<u64>,
    /// Greatest mean distance of all markers between two runs with one seed and without a fault, millimetres; 0 of a
    /// tracker that repeats to the bit.
    pub noise_mm: f64,
    /// Share of frames without an estimate when there is no fault.
    pub lost: f64,
    /// The faults, in the order of the catalogue.
    pub faults: Vec<PlantedFault>,
}

/// Names of all faults, and what is wrong.
pub fn fault_names() -> impl Iterator<Item = (&'static str, &'static str)> {
    FAULTS.iter().map(|fault| (fault.name, fault.what))
}

/// Runs a tracker on the blind side of a set, without a fault and with each of the faults of these names; with all if
/// there are none.
pub(crate) fn plant_faults(
    set: &BlindSet,
    settings: &TrackerSettings,
    seeds: &[u64],
    only: &[String],
    progress: &dyn Progress,
) -> Result<FaultReport, ExperimentError> {
    let chosen = chosen(only)?;
    if settings.kind().needs_truth {
        let detail = format!("{} is given the truth, which no fault changes; choose another tracker", settings.name());
        return Err(ExperimentError::Argument { argument: "--tracker", detail });
    }
    let has_images = set.observation.as_ref().is_some_and(|facts| facts.colour_images.is_some());
    if has_images && matches!(settings, TrackerSettings::Program(_)) {
        let detail = "it has images, which no fault changes; render it without observation.colour_images".to_owned();
        return Err(ExperimentError::Argument { argument: "SET", detail });
    }
    progress.begin(Stage::Faults, chosen.len() + 2);
    let quiet = OnlyInterruption(progress);
    let mut models = Models::default();
    let mut sound = Answers::new(track(set, settings, seeds, None, &mut models, &quiet)?);
    if sound.markers.iter().all(|seed| seed.is_empty()) || sound.lost() >= 1.0 {
        let detail = "it estimates no frame without a fault; try it with skiagraph track first".to_owned();
        return Err(ExperimentError::Argument { argument: "--tracker or --exec", detail });
    }
    advance(progress)?;
    let noise_mm = sound.repeated(&Answers::new(track(set, settings, seeds, None, &mut models, &quiet)?));
    advance(progress)?;
    let mut faults = Vec::with_capacity(chosen.len());
    for fault in chosen {
        progress.set_status(fault.name);
        faults.push(match fault.obstacle(set) {
            Some(obstacle) => outcome(fault, FaultVerdict::NotApplicable, Some(obstacle.to_owned())),
            None => {
                let changed = planted(set, fault)?;
                let found = track(&changed, settings, seeds, None, &mut models, &quiet);
                compared(fault, &sound, noise_mm, found)?
            }
        });
        advance(progress)?;
    }
    Ok(FaultReport {
        schema: "skiagraph.faults/2",
        set: set.name.clone(),
        set_hash: set.set_hash.clone(),
        tracker: sound.name.clone().unwrap_or_else(|| settings.name().to_owned()),
        seeds: seeds.to_vec(),
        noise_mm,
        lost: sound.lost(),
        faults,
    })
}

fn chosen(only: &[String]) -> Result<Vec<&'static CatalogueFault>, ExperimentError> {
    let unknown = only.iter().find(|name| !FAULTS.iter().any(|fault| fault.name == **name));
    if let Some(name) = unknown {
        let known: Vec<&str> = FAULTS.iter().map(|fault| fault.name).collect();
        let guess = did_you_mean(name, known.iter().copied())
            .map(|guess| format!(", did you mean `{guess}`?"))
            .unwrap_or_default();
        let detail = format!("no fault `{name}`{guess} (known: {})", known.join(", "));
        return Err(ExperimentError::Argument { argument: "--only", detail });
    }
    Ok(FAULTS.iter().filter(|fault| only.is_empty() || only.iter().any(|name| name == fault.name)).collect())
}

fn planted(set: &BlindSet, fault: &CatalogueFault) -> Result<BlindSet, ExperimentError> {
    let extent = Extent { frames: set.frame_count };
    let layout = set.keypoints.as_ref().map_or(KeypointLayout::Coco17, |own| own.layout);
    let image = |camera: usize| KeypointImage {
        layout,
        camera,
        width: set.rig.cameras.get(camera).map_or(0.0, |own| own.pinhole.width.into()),
    };
    let nothing = BlindChange { camera: &|_, _| {}, shown: &|at| at, silhouette: None, keypoints: &|_, _| {} };
    let found = |change: fn(KeypointImage, &mut [Option<FoundKeypoint>])| {
        move |camera: usize, points: &mut [Option<FoundKeypoint>]| change(image(camera), points)
    };
    Ok(match fault.change {
        FaultChange::Camera(change) => set.changed(&BlindChange { camera: &change, ..nothing })?,
        FaultChange::Shown(change) => set.changed(&BlindChange { shown: &|at| change(extent, at), ..nothing })?,
        FaultChange::Silhouette(change) => set.changed(&BlindChange { silhouette: Some(change), ..nothing })?,
        FaultChange::Keypoints(change) => set.changed(&BlindChange { keypoints: &found(change), ..nothing })?,
        FaultChange::Image(mask, change) => {
            set.changed(&BlindChange { silhouette: Some(mask), keypoints: &found(change), ..nothing })?
        }
    })
}

/// The outcome of a fault by the tracker's answers; an error of the tracker is one, but not an interruption.
fn compared(
    fault: &CatalogueFault,
    sound: &Answers,
    noise_mm: f64,
    found: Result<Tracked, ExperimentError>,
) -> Result<PlantedFault, ExperimentError> {
    let found = match found {
        Ok(found) => Answers::new(found),
        Err(error @ (ExperimentError::Interrupted | ExperimentError::Artefact(_))) => return Err(error),
        Err(error) => return Ok(outcome(fault, FaultVerdict::Noticed, Some(error.to_string()))),
    };
    let change_by_seed_mm: Vec<Option<f64>> =
        sound.markers.iter().zip(&found.markers).map(|(a, b)| apart_mm(a, b)).collect();
    let known: Vec<f64> = change_by_seed_mm.iter().copied().flatten().collect();
    let change_mm = (!known.is_empty()).then(|| known.iter().sum::<f64>() / known.len() as f64);
    let said = found.said(sound);
    let verdict = if said.is_some() { FaultVerdict::Noticed } else { silent_verdict(change_mm, noise_mm) };
    Ok(PlantedFault { change_mm, change_by_seed_mm, lost: Some(found.lost()), ..outcome(fault, verdict, said) })
}

/// The verdict on a tracker that says nothing. Change and noise are distances at equal seeds: how far the seeds are
/// from each other does not matter.
fn silent_verdict(change_mm: Option<f64>, noise_mm: f64) -> FaultVerdict {
    match change_mm {
        Some(change) if change <= NO_CHANGE_MM => FaultVerdict::NoEffect,
        Some(change) if change <= ABOVE_NOISE * noise_mm => FaultVerdict::Undecided,
        _ => FaultVerdict::Silent,
    }
}

fn outcome(fault: &CatalogueFault, verdict: FaultVerdict, message: Option<String>) -> PlantedFault {
    let (fault, what) = (fault.name, fault.what);
    PlantedFault { fault, what, verdict, change_mm: None, change_by_seed_mm: Vec::new(), lost: None, message }
}

struct Answers {
    /// By seed and frame.
    markers: Vec<Vec<Markers>>,
    name: Option<String>,
    counted: Option<AnswerCount>,
    incidents: Vec<String>,
}

impl Answers {
    fn new(tracked: Tracked) -> Self {
        let markers = tracked.estimates.sequences.into_iter().map(|sequence| sequence.markers).collect();
        let (mut name, mut counted, mut incidents) = (None, None, Vec::new());
        if let Some(program) = tracked.program {
            incidents = program.incidents.iter().map(|incident| incident.describe()).collect();
            (name, counted) = (program.name.or(Some(program.command)), Some(program.answers));
        }
        Self { markers, name, counted, incidents }
    }

    /// Share of frames without any marker.
    fn lost(&self) -> f64 {
        let frames = || self.markers.iter().flatten();
        let lost = frames().filter(|markers| markers.iter().all(Option::is_none)).count();
        lost as f64 / frames().count().max(1) as f64
    }

    /// The noise by a repetition with the same seeds, millimetres. What either of the two says is usual from then on.
    fn repeated(&mut self, again: &Self) -> f64 {
        if let (Some(usual), Some(count)) = (&mut self.counted, again.counted) {
            usual.lost = usual.lost.max(count.lost);
            usual.failed = usual.failed.max(count.failed);
        }
        if again.incidents.len() > self.incidents.len() {
            self.incidents.clone_from(&again.incidents);
        }
        self.markers.iter().zip(&again.markers).filter_map(|(a, b)| apart_mm(a, b)).fold(0.0, f64::max)
    }

    /// What the tracker says that it does not say without the fault.
    fn said(&self, sound: &Self) -> Option<String> {
        let of = |own: &Self| own.counted.map_or((0, 0), |count| (count.lost, count.failed));
        let ((lost, failed), (usual_lost, usual_failed)) = (of(self), of(sound));
        let lost = (lost > usual_lost).then(|| format!("{} more frames declared lost", lost - usual_lost));
        let failed = (failed > usual_failed).then(|| format!("{} more frames failed", failed - usual_failed));
        let incident = self.incidents.iter().find(|_| self.incidents.len() > sound.incidents.len()).cloned();
        let words: Vec<String> = [lost, failed, incident].into_iter().flatten().collect();
        (!words.is_empty()).then(|| words.join("; "))
    }
}

/// Mean distance of the markers that both sequences have, millimetres; `None` without any.
fn apart_mm(a: &[Markers], b: &[Markers]) -> Option<f64> {
    let pairs = a.iter().zip(b).flat_map(|(a, b)| a.iter().zip(b));
    let apart = |(a, b): (&Option<Point3<f64>>, &Option<Point3<f64>>)| Some((a.as_ref()? - b.as_ref()?).norm());
    let (sum, count) = pairs.filter_map(apart).fold((0.0, 0.0), |(sum, count), d| (sum + d, count + 1.0));
    (count > 0.0).then(|| 1e3 * sum / count)
}

#[cfg(test)]
mod tests;
