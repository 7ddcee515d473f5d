//! Several measured runs of one set on one page, from their files: the skeletons over the images of the set, errors.

use std::path::{Path, PathBuf};

use nalgebra::Point3;

use super::run_picture::{read_listed, stored_columns};
use super::run_reading::{folders_with_runs, is_unmeasured, names, read_record, unmeasured_message};
use super::{COMPARISON_FILE, MoreOf, set_of_run::set_of_run};
use crate::benchmark_set::BenchmarkSet;
use crate::body::{LANDMARKS, Markers};
use crate::common::{ExperimentError, Progress};
use crate::input::{limits, plain};
use crate::measure::measuring::Painters;
use crate::measure::tracked::POSES_FILE;
use crate::measure::{PER_FRAME_FILE, RUN_FILE, RunRecord};
use crate::npz::Npz;
use crate::report::{
    ComparedMethod, MOST_OVERLAID, OverlaidEstimate, OverlaidMoment, OverlaidRuns, overlaid_runs_page,
};
use crate::scenario::TrackerSettings;

/// Number of frames with pictures.
const MOMENTS: usize = 8;
/// Smallest distance between two of these frames.
const APART: usize = 10;

/// A measured run and its estimates.
struct StoredRun {
    record: RunRecord,
    method: ComparedMethod,
    /// `[seed][frame]`.
    markers: Vec<Vec<Markers>>,
}

/// `skiagraph report RUN RUN ...`: the page of several runs of one set, in their order. A single folder stands for the
/// runs in it (the methods of a scenario).
///
/// # Errors
/// [`ExperimentError`] if the runs are not of one set, if there are too few or too many, or that names the missing or
/// damaged file.
pub fn overlaid_runs(paths: &[PathBuf], from: MoreOf<'_>, progress: &dyn Progress) -> Result<String, ExperimentError> {
    let paths = match paths {
        [folder] if folder.join(COMPARISON_FILE).is_file() => folders_with_runs(folder),
        several => several.to_vec(),
    };
    let ([first, others @ ..], 2..=MOST_OVERLAID) = (paths.as_slice(), paths.len()) else {
        let detail = format!("expected 2 to {MOST_OVERLAID} runs, found {}", paths.len());
        return Err(ExperimentError::Argument { argument: "RUN", detail });
    };
    let names = names(&paths);
    let runs: Vec<StoredRun> =
        paths.iter().zip(names).map(|(path, name)| StoredRun::read(path, name)).collect::<Result<_, _>>()?;
    let set_hash = &runs[0].record.set_hash;
    if let Some((run, other)) = others.iter().zip(&runs[1..]).find(|(_, other)| other.record.set_hash != *set_hash) {
        let detail = format!(
            "{} is a run of another set than {} (hashes {} and {set_hash}); give runs of one set, or compare them with \
             skiagraph compare --across-sets",
            run.display(),
            first.display(),
            other.record.set_hash
        );
        return Err(ExperimentError::Argument { argument: "RUN", detail });
    }
    let (set, _) = set_of_run(first, set_hash, "--set", from, progress)?;
    let errors: Vec<&[Vec<Option<f64>>]> = runs.iter().map(|run| run.method.errors.as_slice()).collect();
    let frames = worst_moments(&errors, set.blind.frame_count);
    let moments = frames.into_iter().map(|frame| moment(&set, &runs, frame)).collect::<Result<Vec<_>, _>>()?;
    let hint = |run: &StoredRun| Some(format!("{}: {}", run.method.name, plain(&run.record.hint.as_ref()?.text)));
    let hints: Vec<String> = runs.iter().filter_map(hint).collect();
    let methods: Vec<ComparedMethod> = runs.into_iter().map(|run| run.method).collect();
    Ok(overlaid_runs_page(&OverlaidRuns {
        title: &set.blind.name,
        frames_per_second: set.blind.frames_per_second,
        runs: &methods,
        hints: &hints,
        moments: &moments,
    })?)
}

impl StoredRun {
    fn read(run: &Path, name: String) -> Result<Self, ExperimentError> {
        if is_unmeasured(run) {
            return Err(ExperimentError::Malformed { path: run.to_owned(), detail: unmeasured_message(run) });
        }
        let record = read_record(&run.join(RUN_FILE))?;
        let errors = stored_columns(&run.join(PER_FRAME_FILE), &record.seeds, "humaneva_mm", true)?;
        let markers = stored_markers(&run.join(POSES_FILE), [record.seeds.len(), record.frames])?;
        let program = record.program.as_ref();
        let tracker = program.map_or_else(|| record.tracker.clone(), |program| plain(&program.command));
        let method = ComparedMethod {
            name,
            tracker,
            knows_truth: TrackerSettings::named(&record.tracker).is_ok_and(|known| known.kind().needs_truth),
            summary: record.summary.clone(),
            frozen: record.frozen.clone(),
            errors,
        };
        Ok(Self { record, method, markers })
    }

    /// The estimate of the seed with the greatest error in this frame.
    fn worst_at(&self, frame: usize) -> OverlaidEstimate {
        let error = |seed: usize| self.method.errors.get(seed).and_then(|errors| errors.get(frame).copied().flatten());
        let seeds = 0..self.record.seeds.len();
        // the first one if several are equal
        let worst = seeds.rev().max_by(|a, b| error(*a).unwrap_or(-1.0).total_cmp(&error(*b).unwrap_or(-1.0)));
        let seed = worst.unwrap_or_default();
        OverlaidEstimate {
            seed: self.record.seeds.get(seed).copied().unwrap_or_default(),
            error_mm: error(seed),
            markers: self.markers.get(seed).and_then(|all| all.get(frame).copied()).unwrap_or([None; LANDMARKS.len()]),
        }
    }
}

/// The estimated markers of a measured run, `[seed][frame]`.
fn stored_markers(path: &Path, [seeds, frames]: [usize; 2]) -> Result<Vec<Vec<Markers>>, ExperimentError> {
    let file = path.display().to_string();
    let npz = Npz::from_bytes(&file, &read_listed(path, limits::ARRAYS)?)?;
    let shape = [Some(seeds), Some(frames), Some(LANDMARKS.len()), Some(3)];
    let numbers = npz.f64s(&file, "estimate_markers", &shape)?;
    let (places, _) = numbers.as_chunks::<3>();
    let known = |place: &[f64; 3]| place.iter().all(|c| c.is_finite()).then(|| Point3::from(*place));
    let (markers, _) = places.as_chunks::<{ LANDMARKS.len() }>();
    let all: Vec<Markers> = markers.iter().map(|markers| std::array::from_fn(|at| known(&markers[at]))).collect();
    Ok(all.chunks(frames.max(1)).map(<[Markers]>::to_vec).collect())
}

/// The frames to show, in their order: the worst of every run, and then the worst of all; `errors` are
/// `[run][seed][frame]`.
fn worst_moments(errors: &[&[Vec<Option<f64>>]], frames: usize) -> Vec<usize> {
    let greatest = |seeds: &[Vec<Option<f64>>], frame: usize| {
        seeds.iter().filter_map(|errors| errors.get(frame).copied().flatten()).max_by(f64::total_cmp)
    };
    let ranked = |runs: &[&[Vec<Option<f64>>]]| {
        let of_frame = |frame| runs.iter().filter_map(|seeds| greatest(seeds, frame)).max_by(f64::total_cmp);
        let mut all: Vec<(f64, usize)> = (0..frames).filter_map(|frame| Some((of_frame(frame)?, frame))).collect();
        all.sort_by(|a, b| b.0.total_cmp(&a.0));
        all
    };
    let of_each = errors.iter().filter_map(|run| ranked(&[*run]).first().copied());
    let mut chosen: Vec<usize> = Vec::new();
    for (_, frame) in of_each.chain(ranked(errors)) {
        if chosen.len() < MOMENTS && chosen.iter().all(|other| other.abs_diff(frame) >= APART) {
            chosen.push(frame);
        }
    }
    chosen.sort_unstable();
    chosen
}

fn moment(set: &BenchmarkSet, runs: &[StoredRun], frame: usize) -> Result<OverlaidMoment, ExperimentError> {
    let observed = set.blind.observation(frame)?;
    let mut painters = Painters::new(&set.blind);
    painters.place(&observed);
    let cameras = 0..observed.silhouettes.len();
    let images = cameras.filter(|_| set.blind.has_colour()).map(|camera| set.blind.colour(camera, frame));
    Ok(OverlaidMoment {
        frame,
        rig: set.blind.rig_at(frame).into_owned(),
        images: images.collect::<Result<_, _>>()?,
        props: painters.props(&set.truth.ground_truth.props),
        truth: set.truth.ground_truth.frames[frame].markers,
        estimates: runs.iter().map(|run| run.worst_at(frame)).collect(),
        observed: observed.silhouettes,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_worst_frame_of_every_run_is_shown_although_another_run_is_always_worse() {
        let (mut good, mut bad) = (vec![Some(1.0); 200], vec![Some(500.0); 200]);
        (good[120], bad[40], bad[44]) = (Some(3.0), Some(900.0), Some(899.0));
        bad[120] = None;
        let (good, bad) = ([good], [vec![Some(0.0); 200], bad]);
        let shown = worst_moments(&[&good, &bad], 200);
        assert!(shown.contains(&120) && shown.contains(&40) && !shown.contains(&44), "{shown:?}");
        assert_eq!(shown.len(), MOMENTS);
        assert!(shown.windows(2).all(|pair| pair[1] - pair[0] >= APART));
        assert_eq!(worst_moments(&[&[], &[]], 200), Vec::<usize>::new());
    }
}
