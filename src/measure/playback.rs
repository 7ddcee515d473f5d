//! The frames of the run with the median error and of the run with the worst frame, packed for the report.

use rayon::prelude::*;

use super::measuring::{Measures, Painters};
use super::tracked::Tracked;
use crate::common::ExperimentError;
use skiagraph_core::raster::Mask;
use skiagraph_report::{PackedView, Playback, PlaybackBudget, PlaybackPlan, typical_run, worst_frames};
use skiagraph_set::BenchmarkSet;

const SAMPLES: usize = 6;

/// The frames of the seed with the median error, then of the seed with the worst frame if it is another one; empty
/// without seeds.
pub(crate) fn playbacks(
    set: &BenchmarkSet,
    tracked: &Tracked,
    measures: &Measures,
) -> Result<Vec<Playback>, ExperimentError> {
    let runs = measures.runs();
    let Some(typical) = typical_run(&runs).filter(|_| set.blind.frame_count > 0) else { return Ok(Vec::new()) };
    let worst = worst_frames(&runs, 1).first().map(|worst| worst.run).filter(|worst| *worst != typical);
    let shown: Vec<usize> = std::iter::once(typical).chain(worst).collect();
    shown.iter().map(|run| playback(set, tracked, measures, *run, shown.len())).collect()
}

/// Observed masks of a frame, and the masks of the estimate if there is one.
pub(crate) type SeenMasks = (Vec<Mask>, Option<Vec<Mask>>);

/// The resolution and stride at which `frames` frames of `cameras` cameras are kept, by the size of some sampled
/// frames.
pub(crate) fn plan_of(
    frames: usize,
    cameras: usize,
    budget: PlaybackBudget,
    mut masks_of: impl FnMut(usize) -> Result<SeenMasks, ExperimentError>,
) -> Result<PlaybackPlan, ExperimentError> {
    let samples = (0..SAMPLES.min(frames)).map(|index| masks_of(index * (frames - 1) / (SAMPLES - 1)));
    let samples: Vec<SeenMasks> = samples.collect::<Result<_, _>>()?;
    let mut pairs: Vec<(&Mask, Option<&Mask>)> = Vec::new();
    for (observed, estimated) in &samples {
        let estimate = |index: usize| estimated.as_ref().and_then(|masks| masks.get(index));
        pairs.extend(observed.iter().enumerate().map(|(index, mask)| (mask, estimate(index))));
    }
    Ok(PlaybackPlan::new(frames, cameras, &pairs, budget))
}

/// What the cameras saw in a frame, and would see of the estimate of a run.
fn masks_of(
    set: &BenchmarkSet,
    tracked: &Tracked,
    run: usize,
    painters: &mut Painters,
    frame: usize,
) -> Result<SeenMasks, ExperimentError> {
    let body = tracked.estimates.body(run, &set.blind.start.body);
    let observed = set.blind.observation(frame)?;
    let pose = tracked.estimates.sequences[run].pose(frame);
    let estimated = pose.map(|pose| painters.seen(&observed, body, pose));
    Ok((observed.silhouettes, estimated))
}

/// The frames of a run, one of `on_page` runs on the page.
fn playback(
    set: &BenchmarkSet,
    tracked: &Tracked,
    measures: &Measures,
    run: usize,
    on_page: usize,
) -> Result<Playback, ExperimentError> {
    let frames = set.blind.frame_count;
    let mut painters = Painters::new(&set.blind);
    let plan = plan_of(frames, on_page * set.blind.rig.cameras.len(), PlaybackBudget::PAGE, |frame| {
        masks_of(set, tracked, run, &mut painters, frame)
    })?;
    let kept: Vec<usize> = plan.kept().collect();
    let packed: Vec<Vec<PackedView>> = kept
        .par_iter()
        .map_init(
            || Painters::new(&set.blind),
            |painters, frame| {
                let (observed, estimated) = masks_of(set, tracked, run, painters, *frame)?;
                let estimate = |index: usize| estimated.as_ref().and_then(|masks| masks.get(index));
                let packed = observed.iter().enumerate().map(|(index, mask)| plan.pack(mask, estimate(index)));
                Ok(packed.collect())
            },
        )
        .collect::<Result<_, ExperimentError>>()?;
    let is_moving = set.blind.moments.is_some();
    Ok(Playback {
        seed: measures.seeds[run].seed,
        plan,
        views: packed,
        props: if is_moving { Vec::new() } else { painters.props(&set.truth.ground_truth.props) },
        moved: kept.iter().filter(|_| is_moving).map(|frame| set.blind.rig_at(*frame).into_owned()).collect(),
        truth: kept.iter().map(|frame| set.truth.ground_truth.frames[*frame].markers).collect(),
        estimate: kept.iter().map(|frame| measures.seeds[run].markers[*frame]).collect(),
    })
}
