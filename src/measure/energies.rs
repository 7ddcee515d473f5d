//! Energies of true and estimated poses, frame by frame.

use super::SearchRecord;
use super::tracked::Tracked;
use crate::common::ExperimentError;
use crate::prepare::retargeting::refit;
use skiagraph_core::body::{Humanoid, Markers, Motion};
use skiagraph_set::{BenchmarkSet, BlindSet, EstimatedSequence};
use skiagraph_track::tracker::{Likelihood, SilhouetteLikelihood, SilhouetteSettings};

/// The energies that a tracker recorded; empty for trackers without a likelihood.
pub(super) fn recorded_energies(records: &[SearchRecord]) -> Vec<Option<f64>> {
    if records.iter().all(|r| r.energy.is_none()) { Vec::new() } else { records.iter().map(|r| r.energy).collect() }
}

/// The truth refitted to a calibrated body.
pub(super) fn refitted(body: &Humanoid, set: &BenchmarkSet) -> Motion {
    let truth = &set.truth.ground_truth;
    let markers: Vec<Markers> = truth.frames.iter().map(|frame| frame.markers).collect();
    refit(body, &markers, truth.frames_per_second)
}

/// The energy of the truth by the tracker's own likelihood, with the body and cameras as given or as calibrated by the
/// seed at an index; empty for trackers without a likelihood.
pub(super) fn truth_energy(
    tracked: &Tracked,
    set: &BlindSet,
    calibrated: Option<usize>,
    refitted: Option<&Motion>,
) -> Result<Vec<Option<f64>>, ExperimentError> {
    let search = tracked.record.as_ref().and_then(|record| record.tracker.kind().search);
    let (Some(search), Some(refitted)) = (search, refitted) else { return Ok(Vec::new()) };
    let body = calibrated.map_or(&set.start.body, |seed| tracked.estimates.body(seed, &set.start.body));
    let calibrations = tracked.record.iter().flat_map(|record| &record.calibration);
    let cameras =
        calibrated.and_then(|seed| calibrations.into_iter().nth(seed)).map_or(&[][..], |report| &report.cameras);
    let mut likelihood =
        SilhouetteLikelihood::new(body.clone(), &set.rig, search.likelihood)?.with_corrected_cameras(cameras);
    if let Some(plausibility) = search.plausibility {
        likelihood = likelihood.with_plausibility(plausibility)?;
    }
    energies_of(refitted, likelihood, set)
}

/// The energy of the truth, refitted to the set's body, by the default silhouette likelihood, because the likelihood of
/// another program is unknown; empty if there are no poses.
pub(super) fn program_truth_energy(
    set: &BenchmarkSet,
    sequences: &[EstimatedSequence],
) -> Result<Vec<Option<f64>>, ExperimentError> {
    if sequences.iter().all(|sequence| sequence.poses().is_none()) {
        return Ok(Vec::new());
    }
    let motion = match &set.truth.refitted {
        Some(motion) => motion.clone(),
        None => refitted(&set.blind.start.body, set),
    };
    energies_of(&motion, default_likelihood(&set.blind)?, &set.blind)
}

/// The energy of a program's poses by the default silhouette likelihood.
pub(super) fn program_energy(
    set: &BlindSet,
    sequence: &EstimatedSequence,
) -> Result<Vec<Option<f64>>, ExperimentError> {
    if sequence.poses().is_none() {
        return Ok(Vec::new());
    }
    let mut likelihood = default_likelihood(set)?;
    let mut scratch = likelihood.scratch();
    let mut energies = Vec::with_capacity(set.frame_count);
    for (frame, observation) in set.observations().enumerate() {
        likelihood.prepare(&observation?)?;
        energies.push(sequence.pose(frame).map(|pose| likelihood.energy_unrejected(pose, &mut scratch)));
    }
    Ok(energies)
}

/// Removes the energies of frames in which no camera took an image: there is nothing to compare.
pub(super) fn clear_without_images(energies: &mut [Option<f64>], set: &BlindSet) {
    let is_blind = |frame: usize| (0..set.rig.cameras.len()).all(|camera| !set.has_image(camera, frame));
    energies.iter_mut().enumerate().filter(|(frame, _)| is_blind(*frame)).for_each(|(_, energy)| *energy = None);
}

fn default_likelihood(set: &BlindSet) -> Result<SilhouetteLikelihood, ExperimentError> {
    Ok(SilhouetteLikelihood::new(set.start.body.clone(), &set.rig, SilhouetteSettings::default())?)
}

fn energies_of(
    motion: &Motion,
    mut likelihood: SilhouetteLikelihood,
    set: &BlindSet,
) -> Result<Vec<Option<f64>>, ExperimentError> {
    let mut scratch = likelihood.scratch();
    let mut energies = Vec::with_capacity(set.frame_count);
    for (observation, pose) in set.observations().zip(&motion.poses) {
        likelihood.prepare(&observation?)?;
        energies.push(Some(likelihood.energy_unrejected(pose, &mut scratch)));
    }
    Ok(energies)
}
