//! What a report is made from.

use crate::body::Markers;
use crate::camera::CameraRig;
use crate::evaluation::{Evaluation, Run, Summary};
use crate::raster::Mask;
use crate::tracker::{LayerRecord, ModelOccupancy};

/// Everything a page shows. All runs are of one clip and differ in their seed.
#[derive(Clone, Copy, Debug)]
pub struct ReportInput<'a> {
    /// The scenario's title.
    pub title: &'a str,
    /// The tracker, in words: its name and its main settings.
    pub tracker: &'a str,
    /// Whether actor and tracker share body and flesh.
    pub matched: bool,
    /// The rest of what a reader should know, in groups: bodies, cameras, noise, settings, version.
    pub facts: &'a [FactGroup],
    /// One entry a seed, at least one.
    pub runs: &'a [ReportRun<'a>],
    /// All runs together.
    pub summary: &'a Summary,
    /// A tracker that never moves, on the same clip.
    pub frozen: Option<&'a Evaluation>,
    /// The pictures.
    pub sheet: Option<&'a Sheet<'a>>,
}

/// Some facts that belong together.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct FactGroup {
    /// Heading.
    pub title: String,
    /// Name and value.
    pub facts: Vec<(String, String)>,
}

/// One seed's run.
#[derive(Clone, Copy, Debug)]
pub struct ReportRun<'a> {
    /// Clip, seed and what was measured.
    pub run: Run<'a>,
    /// Energy of the truth, refitted to the tracker's body, per frame; empty where unknown.
    pub truth_energy: &'a [Option<f64>],
    /// Energy of the estimate per frame; empty where unknown.
    pub estimate_energy: &'a [Option<f64>],
    /// What happened in every annealing layer, `[frame][layer]`; empty for trackers without layers.
    pub layers: &'a [Vec<LayerRecord>],
    /// How many particles were in every motion model, `[frame][model]`; empty for trackers without learned models.
    pub occupancy: &'a [Vec<ModelOccupancy>],
    /// When the feet stand, one entry a foot; empty where the bodies have no feet to stand on.
    pub stances: &'a [FootStances],
}

/// When one foot stands: first frame and the frame after the last, of every stance.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FootStances {
    /// The foot's name.
    pub foot: String,
    /// The actor's.
    pub truth: Vec<[usize; 2]>,
    /// The estimate's.
    pub estimate: Vec<[usize; 2]>,
}

/// Observed and estimated bodies in some frames of one run.
#[derive(Clone, Debug)]
pub struct Sheet<'a> {
    /// The run's seed.
    pub seed: u64,
    /// The cameras.
    pub rig: &'a CameraRig,
    /// Frames a second.
    pub frames_per_second: f64,
    /// Where what stands about is in every camera's image; empty where nothing does.
    pub props: Vec<Mask>,
    /// The frames, in order.
    pub frames: Vec<SheetFrame>,
}

/// One frame of a sheet.
#[derive(Clone, Debug)]
pub struct SheetFrame {
    /// Frame number.
    pub frame: usize,
    /// What every camera saw.
    pub observed: Vec<Mask>,
    /// The estimate's silhouette in every camera, drawn with the tracker's body; `None` without a pose to draw.
    pub estimated: Option<Vec<Mask>>,
    /// Where the actor's markers were.
    pub truth: Markers,
    /// Where the estimate puts them.
    pub estimate: Markers,
}

/// Why no report was made.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// There is nothing to show.
    #[error("a report needs at least one run")]
    NoRun,
    /// A frame has another number of silhouettes than the rig has cameras.
    #[error("frame {frame}: {found} silhouettes for {cameras} cameras; give one for every camera")]
    Views {
        /// Frame number.
        frame: usize,
        /// Silhouettes found.
        found: usize,
        /// Cameras of the rig.
        cameras: usize,
    },
    /// A picture or plot of no size.
    #[error("cannot draw a picture of {width} x {height} pixels")]
    Size {
        /// Width in pixels.
        width: u32,
        /// Height in pixels.
        height: u32,
    },
    /// A plot could not be drawn.
    #[error("cannot draw the plot: {0}")]
    Plot(String),
    /// A picture could not be encoded.
    #[error("cannot encode the picture: {0}")]
    Png(String),
    /// The page's template failed.
    #[error("cannot fill the page: {0}")]
    Template(#[from] minijinja::Error),
}

/// The frames a sheet should show: `count` spread evenly over the scored frames, and the worst one.
pub fn frames_to_show(evaluation: &Evaluation, count: usize) -> Vec<usize> {
    let (first, end) = (evaluation.first_scored, evaluation.frames);
    if end <= first {
        return vec![];
    }
    let span = end - 1 - first;
    let mut frames: Vec<usize> = (0..count).map(|i| first + span * i / (count - 1).max(1)).collect();
    frames.extend(worst_frame(evaluation));
    frames.sort_unstable();
    frames.dedup();
    frames
}

/// The frame of the greatest HumanEva error.
pub(super) fn worst_frame(evaluation: &Evaluation) -> Option<usize> {
    let errors = evaluation.metrics.get("humaneva_mm")?.per_frame.iter().enumerate();
    let present = errors.filter_map(|(frame, error)| Some((frame, (*error)?)));
    present.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(frame, _)| frame)
}

/// Index of the run whose mean HumanEva error is the (lower) median: the one to show where only one can be shown.
pub fn typical_run(runs: &[Run<'_>]) -> Option<usize> {
    let error = |run: &Run<'_>| run.evaluation.metrics.get("humaneva_mm").map_or(f64::INFINITY, |value| value.mean);
    let mut order: Vec<usize> = (0..runs.len()).collect();
    order.sort_by(|a, b| error(&runs[*a]).total_cmp(&error(&runs[*b])));
    order.get(runs.len().checked_sub(1)? / 2).copied()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluation::fixture::{evaluate_markers, standing, translated};
    use nalgebra::Vector3;

    fn with_worst(frame: usize, metres: f64) -> Evaluation {
        let truth = vec![standing(); 101];
        let mut estimate = truth.clone();
        estimate[frame] = translated(&truth[frame], Vector3::new(metres, 0.0, 0.0));
        evaluate_markers(&truth, &estimate)
    }

    #[test]
    fn the_frames_are_spread_evenly_and_hold_the_worst() {
        assert_eq!(frames_to_show(&with_worst(42, 0.3), 4), [1, 34, 42, 67, 100]);
        assert_eq!(frames_to_show(&with_worst(34, 0.3), 4), [1, 34, 67, 100]);
        assert_eq!(frames_to_show(&with_worst(42, 0.3), 0), [42]);
    }

    #[test]
    fn the_typical_run_is_the_middle_one() {
        let evaluations = [0.3, 0.1, 0.2].map(|metres| with_worst(5, metres));
        let runs: Vec<_> = evaluations.iter().map(|evaluation| Run { clip: "c", seed: 0, evaluation }).collect();
        assert_eq!(typical_run(&runs), Some(2));
        assert_eq!(typical_run(&[]), None);
    }
}
