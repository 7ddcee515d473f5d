//! Table 1 of `[GPDM graph]`: division of motions into models.

use faer::Mat;
use nalgebra::UnitQuaternion;

use super::super::gpdm::{Gpdm, GpdmError, Round, TrainingOptions, train_watched};
use super::super::pose_chart::{PoseChart, distance};
use super::graph::{GraphSegment, SegmentRange};

/// Observation vectors and joint rotations of one training motion.
pub(super) struct TrainingMotion {
    pub(super) index: usize,
    pub(super) observations: Mat<f64>,
    pub(super) rotations: Vec<Vec<UnitQuaternion<f64>>>,
}

/// The longest model from frame `first` on, grown by `clip` frames at a time, whose simulation stays within
/// `threshold` of the recording in *all* frames. The first clip is always accepted; a remainder after the last whole
/// clip is added to that clip.
///
/// Errors do not grow steadily with length, so the last passing model is kept instead of bisecting.
pub(super) fn grow_segment(
    motion: &TrainingMotion,
    chart: &PoseChart,
    first: usize,
    clip: usize,
    threshold: f64,
    options: &TrainingOptions,
    should_continue: &mut dyn FnMut(SegmentRange, Round) -> bool,
) -> Result<GraphSegment, GpdmError> {
    let frames = motion.observations.nrows();
    // a remainder shorter than a clip is too short for a separate model
    let end_after = |end: usize| if frames - end < clip { frames } else { end };
    let mut best = learn(motion, chart, first, end_after((first + clip).min(frames)), options, should_continue)?;
    while best.range.end < frames {
        let longer =
            learn(motion, chart, first, end_after((best.range.end + clip).min(frames)), options, should_continue)?;
        if longer.errors.iter().any(|error| *error >= threshold || error.is_nan()) {
            break;
        }
        best = longer;
    }
    Ok(best)
}

/// One model of frames `first .. end`.
pub(super) fn learn(
    motion: &TrainingMotion,
    chart: &PoseChart,
    first: usize,
    end: usize,
    options: &TrainingOptions,
    should_continue: &mut dyn FnMut(SegmentRange, Round) -> bool,
) -> Result<GraphSegment, GpdmError> {
    let range = SegmentRange { motion: motion.index, first, end };
    let rows = motion.observations.as_ref().subrows(first, end - first);
    let gpdm = train_watched(rows, &[end - first], options, &mut |round| should_continue(range, round))?;
    let rotations = motion.rotations[first..end].to_vec();
    let errors = reconstruction_errors(&gpdm, chart, 0, &rotations);
    Ok(GraphSegment { range, gpdm, errors, rotations })
}

/// One model of all frames of all motions, without transitions between motions.
pub(super) fn learn_jointly(
    motions: &[TrainingMotion],
    chart: &PoseChart,
    options: &TrainingOptions,
    should_continue: &mut dyn FnMut(SegmentRange, Round) -> bool,
) -> Result<GraphSegment, GpdmError> {
    let lengths: Vec<usize> = motions.iter().map(|motion| motion.observations.nrows()).collect();
    let range = SegmentRange { motion: 0, first: 0, end: lengths.first().copied().unwrap_or(0) };
    let mut rows = Mat::zeros(lengths.iter().sum(), chart.dimensions());
    let starts = lengths.iter().scan(0, |next, length| Some(std::mem::replace(next, *next + length)));
    let starts: Vec<usize> = starts.collect();
    for (motion, start) in motions.iter().zip(&starts) {
        rows.subrows_mut(*start, motion.observations.nrows()).copy_from(&motion.observations);
    }
    let gpdm = train_watched(rows.as_ref(), &lengths, options, &mut |round| should_continue(range, round))?;
    let errors_of =
        |(index, motion): (usize, &TrainingMotion)| reconstruction_errors(&gpdm, chart, index, &motion.rotations);
    let errors = motions.iter().enumerate().flat_map(errors_of).collect();
    let rotations = motions.iter().flat_map(|motion| motion.rotations.iter().cloned()).collect();
    Ok(GraphSegment { range, gpdm, errors, rotations })
}

/// `[GPDM graph]` Eqs. 9 and 10: distance between a sequence's recording and its simulation, frame by frame.
fn reconstruction_errors(
    gpdm: &Gpdm,
    chart: &PoseChart,
    sequence: usize,
    recording: &[Vec<UnitQuaternion<f64>>],
) -> Vec<f64> {
    let Some(latents) = gpdm.simulate(sequence) else { return Vec::new() };
    let mapped = gpdm.map_mean(latents.as_ref());
    recording
        .iter()
        .enumerate()
        .map(|(t, truth)| {
            let row: Vec<f64> = mapped.row(t).iter().copied().collect();
            distance(&chart.rotations_of(&row), truth)
        })
        .collect()
}
