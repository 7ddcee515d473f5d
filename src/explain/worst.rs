//! The worst seconds of a run, as sets of their own on which the tracker fails again.

use std::path::Path;

use super::cell::Cells;
use super::cut::{cut, first_with_images, rig_from};
use super::errors::ErrorProfile;
use super::explanation::WorstSecond;
use super::landscape::landscape;
use super::source::RepeatableRun;
use crate::artefacts::Artefact;
use crate::common::{ExperimentError, Progress};
use crate::prepare::retargeting::refit;
use crate::tracking::calibrating::Beginning;
use skiagraph_core::body::{Humanoid, Pose};

/// The worst seconds of a run, at most `count`, worst first. With `from_start` their sets begin with the first frame of
/// the run's set. Nothing is tracked or written yet.
pub(super) fn choose_worst(
    run: &RepeatableRun,
    cells: &Cells<'_>,
    (count, from_start): (usize, bool),
    progress: &dyn Progress,
) -> Result<Vec<WorstWindow>, ExperimentError> {
    let windows = windows(run, cells, count);
    if windows.len() < count {
        let found = windows.len();
        progress.note(&format!("--worst {count}: only {found}, because the run has no more that do not overlap"));
    }
    windows.into_iter().map(|window| window.beginning(run, from_start)).collect()
}

/// Writes each of these seconds as a set, and tracks it again.
pub(super) fn worst_seconds(
    run: &RepeatableRun,
    cells: &mut Cells<'_>,
    windows: Vec<WorstWindow>,
    directory: &Artefact,
    progress: &dyn Progress,
) -> Result<Vec<WorstSecond>, ExperimentError> {
    let mut found = Vec::new();
    for (number, window) in windows.into_iter().enumerate() {
        progress.set_status(&format!("worst second {}", number + 1));
        let folder = format!("worst-{}", number + 1);
        found.push(window.replay(run, cells, directory.folder(), &folder, progress)?);
    }
    Ok(found)
}

#[derive(Clone, Copy, Debug)]
pub(super) struct WorstWindow {
    seed: usize,
    first: usize,
    last: usize,
    error_mm: f64,
    /// The frame with which its set begins.
    begin: usize,
}

/// The worst seconds of all seeds that do not overlap in time, worst first.
fn windows(run: &RepeatableRun, cells: &Cells<'_>, count: usize) -> Vec<WorstWindow> {
    let length = (run.set.blind.frames_per_second.round() as usize).max(1);
    let sequences = run.tracked.estimates.sequences.iter().take(cells.seeds.len());
    let mut all: Vec<WorstWindow> =
        sequences.enumerate().flat_map(|(seed, s)| of_seed(seed, &cells.error(s), length)).collect();
    all.sort_by(|a, b| b.error_mm.total_cmp(&a.error_mm));
    let mut chosen: Vec<WorstWindow> = Vec::new();
    for window in all {
        if chosen.len() < count && chosen.iter().all(|other| other.last < window.first || window.last < other.first) {
            chosen.push(window);
        }
    }
    chosen
}

/// Every second of a seed, or all of its frames if they are fewer, with its mean error. Frame 0 is never scored.
fn of_seed(seed: usize, errors: &ErrorProfile, length: usize) -> Vec<WorstWindow> {
    let scored = errors.frames.get(1..).unwrap_or_default();
    let length = length.min(scored.len()).max(1);
    let window = |(index, frames): (usize, &[f64])| WorstWindow {
        seed,
        first: index + 1,
        last: index + frames.len(),
        error_mm: frames.iter().sum::<f64>() / frames.len() as f64,
        begin: 0,
    };
    scored.windows(length).enumerate().map(window).filter(|window| window.error_mm.is_finite()).collect()
}

impl WorstWindow {
    /// The same second with the frame with which its set begins.
    fn beginning(self, run: &RepeatableRun, from_start: bool) -> Result<Self, ExperimentError> {
        // a set cannot give corrected cameras; the frame before the second, whose pose is given, is not scored
        let is_whole = from_start || !run.beginning(self.seed).cameras.is_empty();
        let begin = if is_whole { 0 } else { first_with_images(&run.set, self.first - 1) };
        let window = Self { begin, ..self };
        rig_from(&run.set, begin)?;
        window.start(run)?;
        Ok(window)
    }

    /// The body and the pose with which its set starts; `None` for those of the run's set.
    fn start(self, run: &RepeatableRun) -> Result<Option<(&Humanoid, &Pose)>, ExperimentError> {
        if self.begin == 0 {
            return Ok(None);
        }
        let estimates = &run.tracked.estimates;
        let pose = estimates.sequences.get(self.seed).and_then(|sequence| sequence.pose(self.begin));
        let pose = pose.ok_or_else(|| no_pose(self.begin))?;
        Ok(Some((estimates.body(self.seed, &run.set.blind.start.body), pose)))
    }

    /// Writes the set of this second into a folder, and tracks it again.
    fn replay(
        self,
        run: &RepeatableRun,
        cells: &mut Cells<'_>,
        directory: &Path,
        folder: &str,
        progress: &dyn Progress,
    ) -> Result<WorstSecond, ExperimentError> {
        let Self { seed: index, first, last, error_mm, begin } = self;
        let missing =
            || ExperimentError::Argument { argument: "--worst", detail: "a seed has no estimates".to_owned() };
        let sequence = run.tracked.estimates.sequences.get(index).ok_or_else(missing)?;
        let seed = cells.seeds.get(index).copied().ok_or_else(missing)?;
        let used = run.beginning(index);
        let start = self.start(run)?;
        let set = cut(&run.set, begin..=last, &format!("{}-{folder}", run.set.blind.name), start, progress)?;
        let set = set.with_readme(&origin(run, [begin, last], seed))?;
        let place = directory.join(folder);
        std::fs::create_dir(&place).map_err(|source| ExperimentError::Unreadable { path: place.clone(), source })?;
        set.write(&place)?;
        let tracked = cells.track(&set, &[seed], false, progress)?;
        let again = tracked.estimates.sequences.first().ok_or_else(missing)?;
        let here = first - begin..=last - begin;
        let of_run = cells.error(sequence).frames;
        let worst = (first..=last).max_by(|a, b| of_run[*a].total_cmp(&of_run[*b])).unwrap_or(first);
        let landscape = match (self.truth(run, &used, worst), sequence.pose(worst)) {
            (Some(truth), Some(pose)) => landscape(&run.set, &run.tracker, &used, worst, [&truth, pose], progress)?,
            _ => None,
        };
        let errors = ErrorProfile::new(&set.truth.ground_truth, again);
        let frames = errors.frames.get(here.clone()).unwrap_or_default();
        Ok(WorstSecond {
            folder: folder.to_owned(),
            seed,
            first_frame: first,
            last_frame: last,
            set_begins_at: begin,
            error_mm,
            again_mm: frames.iter().sum::<f64>() / frames.len().max(1) as f64,
            is_identical: again.markers.get(here) == sequence.markers.get(first..=last),
            landscape,
        })
    }

    /// The pose nearest to the truth in a frame, of the body that the tracker used.
    fn truth(self, run: &RepeatableRun, used: &Beginning, frame: usize) -> Option<Pose> {
        let truth = &run.set.truth;
        if !used.is_calibrated {
            return truth.refitted.as_ref()?.poses.get(frame).cloned();
        }
        let second = truth.ground_truth.frames.get(self.first..=self.last)?;
        let markers: Vec<_> = second.iter().map(|frame| frame.markers).collect();
        let refitted = refit(&used.body, &markers, truth.ground_truth.frames_per_second);
        refitted.poses.get(frame - self.first).cloned()
    }
}

/// What `README.txt` says about the origin of a set.
fn origin(run: &RepeatableRun, [begin, last]: [usize; 2], seed: u64) -> String {
    format!(
        "\nCut out by skiagraph explain --worst: frames {begin} to {last} of {} (set hash {}),\nwith a second in which \
         the tracker {} has great errors with seed {seed}. Observations, visibility and spread are copies\nof those of \
         that set, so skiagraph verify may say that they, and the start pose, are not those of a set of its own.\n",
        run.set.blind.name, run.set.blind.set_hash, run.record.tracker
    )
}

fn no_pose(frame: usize) -> ExperimentError {
    ExperimentError::Argument {
        argument: "--worst",
        detail: format!(
            "the estimate of frame {frame} is not a pose, so nothing can start from it; use --from-start for sets that \
             begin with the run's first frame"
        ),
    }
}
