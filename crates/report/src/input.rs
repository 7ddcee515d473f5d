//! The input of a report.

use skiagraph_core::body::Markers;
use skiagraph_core::camera::CameraRig;
use skiagraph_core::raster::Mask;
use skiagraph_eval::{Evaluation, SeedRun, Summary};
use skiagraph_track::motion_model::ModelOccupancy;
use skiagraph_track::tracker::LayerRecord;
use skiagraph_truth::observing::Image;

use super::Playback;

/// Says whether actor and tracker have the same body (`matched`).
pub fn describe_bodies(matched: bool) -> &'static str {
    if matched { "tracker's body equal to the actor's" } else { "tracker's body differs from the actor's" }
}

/// The content of a page. All runs have the same clip and differ in their seed.
#[derive(Clone, Copy, Debug)]
pub struct ReportInput<'a> {
    /// The scenario's title.
    pub title: &'a str,
    /// Description of the tracker: its name and its main settings.
    pub tracker: &'a str,
    /// Whether actor and tracker have the same body.
    pub matched: bool,
    /// Further facts, in groups: bodies, cameras, noise, settings, version.
    pub facts: &'a [FactGroup],
    /// One entry per seed, at least one.
    pub runs: &'a [ReportRun<'a>],
    /// Summary over all runs.
    pub summary: &'a Summary,
    /// Whether energies come from the tracker's own likelihood; else from skiagraph's likelihood on the set's body.
    pub own_likelihood: bool,
    /// A tracker that never moves, on the same clip.
    pub frozen: Option<&'a Evaluation>,
    /// The pictures.
    pub sheet: Option<&'a Sheet<'a>>,
    /// The sheet as PNG.
    pub picture: &'a [u8],
    /// Every frame in every camera of the sheet, for the run with the median error and, if different, the run with the
    /// worst frame.
    pub playbacks: &'a [Playback],
    /// Provenance of this run, if known: values that differ from run to run.
    pub this_run: &'a [(String, String)],
    /// A hint if reading the estimate differently would remove most of the error.
    pub hint: Option<&'a str>,
}

impl<'a> ReportInput<'a> {
    /// Input with runs and their summary only.
    pub fn of_runs(title: &'a str, tracker: &'a str, runs: &'a [ReportRun<'a>], summary: &'a Summary) -> Self {
        Self {
            title,
            tracker,
            matched: false,
            facts: &[],
            runs,
            summary,
            own_likelihood: false,
            frozen: None,
            sheet: None,
            picture: &[],
            playbacks: &[],
            this_run: &[],
            hint: None,
        }
    }
}

/// A group of facts.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct FactGroup {
    /// Heading.
    pub title: String,
    /// Name and value.
    pub facts: Vec<(String, String)>,
}

/// One seed's run.
#[derive(Clone, Debug)]
pub struct ReportRun<'a> {
    /// Clip, seed and evaluation.
    pub run: SeedRun<'a>,
    /// Energy of the truth, refitted to the tracker's body, per frame; empty where unknown.
    pub truth_energy: &'a [Option<f64>],
    /// Energy of the estimate per frame; empty where unknown.
    pub estimate_energy: &'a [Option<f64>],
    /// Records of every annealing layer, `[frame][layer]`; empty for trackers without layers.
    pub layers: Vec<&'a [LayerRecord]>,
    /// Number of particles in every motion model, `[frame][model]`; empty for trackers without learned models.
    pub occupancy: Vec<&'a [ModelOccupancy]>,
    /// Stances of the feet, one entry per foot; empty if the bodies have no feet.
    pub stances: &'a [FootStances],
}

/// Stances of one foot: first frame and the frame after the last.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FootStances {
    /// The foot's name.
    pub foot: String,
    /// The actor's.
    pub truth: Vec<[usize; 2]>,
    /// The estimate's.
    pub estimate: Vec<[usize; 2]>,
}

/// Observed and estimated bodies in some frames.
#[derive(Clone, Debug)]
pub struct Sheet<'a> {
    /// The cameras; moving ones at their position in frame 0.
    pub rig: &'a CameraRig,
    /// Frames per second.
    pub frames_per_second: f64,
    /// Masks of the props in every camera's image; empty without props.
    pub props: Vec<Mask>,
    /// The columns, from left to right ([`frames_to_show`]).
    pub frames: Vec<SheetFrame>,
}

/// One frame of a sheet.
#[derive(Clone, Debug)]
pub struct SheetFrame {
    /// The seed of the run whose estimate is shown.
    pub seed: u64,
    /// Frame number.
    pub frame: usize,
    /// If any camera moves, the cameras in this frame and the masks of the props in their images (empty without props).
    pub moved: Option<(CameraRig, Vec<Mask>)>,
    /// The observation of every camera.
    pub observed: Vec<Mask>,
    /// The image of every camera, if trackers are given images; `None` for a camera that took none. Empty otherwise.
    pub images: Vec<Option<Image>>,
    /// The estimate's silhouette in every camera, drawn with the tracker's body; `None` without a pose to draw.
    pub estimated: Option<Vec<Mask>>,
    /// The actor's markers.
    pub truth: Markers,
    /// The estimated markers.
    pub estimate: Markers,
}

/// Errors of reports.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// There is nothing to show.
    #[error("a report needs at least one run")]
    NoRun,
    /// The number of silhouettes of a frame differs from the number of cameras.
    #[error("frame {frame}: {found} silhouettes for {cameras} cameras; give one for every camera")]
    Views {
        /// Frame number.
        frame: usize,
        /// Silhouettes found.
        found: usize,
        /// Cameras of the rig.
        cameras: usize,
    },
    /// A picture or plot has an invalid size.
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
    #[error("cannot render the page: {0}")]
    Template(#[from] minijinja::Error),
}

/// A frame of one of several runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shown {
    /// Index of the run.
    pub run: usize,
    /// Frame number.
    pub frame: usize,
}

/// Smallest distance between two listed worst frames of one run.
const APART: usize = 10;

/// The frames for a sheet: `count` frames spread evenly over the scored frames of the typical run, then the worst frame
/// of all runs.
pub fn frames_to_show(runs: &[SeedRun<'_>], count: usize) -> Vec<Shown> {
    let Some(run) = typical_run(runs) else { return vec![] };
    let evaluation = runs[run].evaluation;
    let (first, end) = (evaluation.first_scored, evaluation.frames);
    if end <= first {
        return vec![];
    }
    let span = end - 1 - first;
    let spread = (0..count).map(|i| Shown { run, frame: first + span * i / (count - 1).max(1) });
    let worst = worst_frames(runs, 1);
    let mut shown: Vec<Shown> = spread.filter(|frame| !worst.contains(frame)).collect();
    shown.dedup();
    shown.extend(worst);
    shown
}

/// The `count` frames with the largest HumanEva errors of all runs, worst first; no two frames of a run are within ten
/// frames of each other.
pub fn worst_frames(runs: &[SeedRun<'_>], count: usize) -> Vec<Shown> {
    let errors = |run: &SeedRun<'_>| {
        run.evaluation.metrics.get("humaneva_mm").map(|metric| metric.per_frame.clone()).unwrap_or_default()
    };
    let of_run = |(run, errors): (usize, Vec<Option<f64>>)| {
        errors.into_iter().enumerate().filter_map(move |(frame, error)| Some((error?, Shown { run, frame })))
    };
    let mut frames: Vec<(f64, Shown)> = runs.iter().map(errors).enumerate().flat_map(of_run).collect();
    frames.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut chosen: Vec<Shown> = Vec::new();
    for (_, next) in frames {
        if chosen.len() == count {
            break;
        }
        if chosen.iter().all(|other| other.run != next.run || other.frame.abs_diff(next.frame) > APART) {
            chosen.push(next);
        }
    }
    chosen
}

/// Index of the run whose mean HumanEva error is the (lower) median, for figures that show a single run.
pub fn typical_run(runs: &[SeedRun<'_>]) -> Option<usize> {
    let error = |run: &SeedRun<'_>| run.evaluation.metrics.get("humaneva_mm").map_or(f64::INFINITY, |value| value.mean);
    let mut order: Vec<usize> = (0..runs.len()).collect();
    order.sort_by(|a, b| error(&runs[*a]).total_cmp(&error(&runs[*b])));
    order.get(runs.len().checked_sub(1)? / 2).copied()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_figure::{evaluate_markers, standing, translated};
    use nalgebra::Vector3;

    fn with_worst(frame: usize, metres: f64) -> Evaluation {
        let truth = vec![standing(); 101];
        let mut estimate = truth.clone();
        estimate[frame] = translated(&truth[frame], Vector3::new(metres, 0.0, 0.0));
        evaluate_markers(&truth, &estimate)
    }

    fn runs_of(evaluations: &[Evaluation]) -> Vec<SeedRun<'_>> {
        evaluations.iter().zip(0..).map(|(evaluation, seed)| SeedRun { clip: "c", seed, evaluation }).collect()
    }

    #[test]
    fn the_frames_are_spread_evenly_over_the_typical_run_and_the_worst_of_all_runs_comes_last() {
        let evaluations = [with_worst(42, 0.3), with_worst(60, 0.1), with_worst(34, 0.2)];
        let numbers = |shown: Vec<Shown>| shown.iter().map(|s| (s.run, s.frame)).collect::<Vec<_>>();
        let of_all = numbers(frames_to_show(&runs_of(&evaluations), 4));
        assert_eq!(of_all, [(2, 1), (2, 34), (2, 67), (2, 100), (0, 42)]);
        assert_eq!(numbers(frames_to_show(&runs_of(&evaluations[2..]), 4)), [(0, 1), (0, 67), (0, 100), (0, 34)]);
        assert_eq!(numbers(frames_to_show(&runs_of(&evaluations[..1]), 0)), [(0, 42)]);
        assert_eq!(numbers(frames_to_show(&[], 4)), []);
    }

    #[test]
    fn the_worst_frames_come_from_all_runs_and_neighbours_are_left_out() {
        let (truth, mut estimate) = (vec![standing(); 101], vec![standing(); 101]);
        for (frame, metres) in [(20, 0.5), (30, 0.45), (31, 0.4)] {
            estimate[frame] = translated(&truth[frame], Vector3::new(metres, 0.0, 0.0));
        }
        let evaluations = [evaluate_markers(&truth, &estimate), with_worst(20, 0.47)];
        let found = worst_frames(&runs_of(&evaluations), 3);
        assert_eq!(found, [(0, 20), (1, 20), (0, 31)].map(|(run, frame)| Shown { run, frame }), "30 is too near to 20");
    }

    #[test]
    fn the_typical_run_is_the_middle_one() {
        let evaluations = [0.3, 0.1, 0.2].map(|metres| with_worst(5, metres));
        assert_eq!(typical_run(&runs_of(&evaluations)), Some(2));
        assert_eq!(typical_run(&[]), None);
    }
}
