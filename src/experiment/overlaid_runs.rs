//! Several measured runs of one set on one page, from their files: the skeletons over the images of the set, errors.

use std::path::{Path, PathBuf};

use nalgebra::Point3;

use super::run_picture::{read_listed, stored_columns};
use super::run_reading::{folders_with_runs, is_unmeasured, names, no_runs_message, read_record};
use super::set_of_run::{refuse_other_sets, set_of_run};
use super::{COMPARISON_FILE, MoreOf};
use crate::artefacts::PLAN_FILE;
use crate::benchmark_set::BenchmarkSet;
use crate::body::{LANDMARKS, Markers};
use crate::common::{ExperimentError, Progress};
use crate::input::{limits, plain};
use crate::measure::measuring::Painters;
use crate::measure::tracked::POSES_FILE;
use crate::measure::{PER_FRAME_FILE, RUN_FILE, RunRecord};
use crate::npz::Npz;
use crate::report::{
    ComparedMethod, ComparisonInput, FigureFile, MOST_OVERLAID, OverlaidEstimate, OverlaidMoment, OverlaidRuns,
    comparison_figures, overlaid_runs_page,
};
use crate::scenario::TrackerSettings;

/// Number of frames with pictures.
const MOMENTS: usize = 8;
/// Smallest distance of a frame from the others, unless a run has its greatest error there.
const APART: usize = 10;

/// A frame with pictures.
#[derive(Debug)]
struct WorstMoment {
    frame: usize,
    /// The runs for which it was chosen.
    runs: Vec<usize>,
}

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
    let (first, runs) = read_runs(paths)?;
    let set_hash = &runs[0].record.set_hash;
    refuse_other_sets(&first, set_hash, from.sets)?;
    let (set, _) = set_of_run(&first, set_hash, "--set", from, progress)?;
    let errors: Vec<&[Vec<Option<f64>>]> = runs.iter().map(|run| run.method.errors.as_slice()).collect();
    let worst = worst_moments(&errors, set.blind.frame_count);
    let moments = worst.into_iter().map(|worst| moment(&set, &runs, worst)).collect::<Result<Vec<_>, _>>()?;
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

/// `skiagraph report RUN RUN ... --figures`: the figures of several runs of one set, those of a run with several
/// methods.
///
/// # Errors
/// Those of [`overlaid_runs`].
pub fn figures_of_runs(paths: &[PathBuf]) -> Result<Vec<FigureFile>, ExperimentError> {
    let (_, runs) = read_runs(paths)?;
    let RunRecord { scenario, frames, seeds, matched, .. } = &runs[0].record;
    let (title, frames, seeds, matched) = (scenario.clone(), *frames, seeds.len(), *matched);
    let methods: Vec<ComparedMethod> = runs.into_iter().map(|run| run.method).collect();
    Ok(comparison_figures(&ComparisonInput { title: &title, frames, seeds, matched, methods: &methods })?)
}

/// The runs in their order, and the folder of the first; they are of one set.
fn read_runs(paths: &[PathBuf]) -> Result<(PathBuf, Vec<StoredRun>), ExperimentError> {
    let paths = match paths {
        [folder] if folder.join(COMPARISON_FILE).is_file() => folders_with_runs(folder),
        several => several.to_vec(),
    };
    let ([first, others @ ..], 2..=MOST_OVERLAID) = (paths.as_slice(), paths.len()) else {
        let detail = format!("expected 2 to {MOST_OVERLAID} runs, found {}", paths.len());
        return Err(ExperimentError::Argument { argument: "RUN", detail });
    };
    paths.iter().try_for_each(|path| expect_one_run(path))?;
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
    Ok((first.clone(), runs))
}

/// Refuses a folder that has no run of its own.
fn expect_one_run(path: &Path) -> Result<(), ExperimentError> {
    if path.is_file() || path.join(RUN_FILE).is_file() || is_unmeasured(path) {
        return Ok(());
    }
    let refused = |detail| Err(ExperimentError::Argument { argument: "RUN", detail });
    if path.join(PLAN_FILE).is_file() {
        let found = path.display();
        return refused(format!("only runs can be drawn over each other, and {found} is a sweep, a ladder or a suite"));
    }
    match folders_with_runs(path).as_slice() {
        [only] if only == path => {
            Err(ExperimentError::Malformed { path: path.to_owned(), detail: no_runs_message(path) })
        }
        runs => {
            let names: Vec<String> = runs.iter().take(MOST_OVERLAID).map(|run| run.display().to_string()).collect();
            let alone = if path.join(COMPARISON_FILE).is_file() { ", or give it alone" } else { "" };
            refused(format!(
                "expected runs, found a folder of runs, {}: name its runs ({}){alone}",
                path.display(),
                names.join(", ")
            ))
        }
    }
}

impl StoredRun {
    fn read(run: &Path, name: String) -> Result<Self, ExperimentError> {
        let record = read_record(&run.join(RUN_FILE))?;
        let errors = stored_columns(&run.join(PER_FRAME_FILE), &record.seeds, "humaneva_mm", true)?;
        let markers = stored_markers(&run.join(POSES_FILE), [record.seeds.len(), record.frames])?;
        let program = record.program.as_ref();
        let tracker = program.map_or_else(|| record.tracker.clone(), |program| plain(program.command_and_settings()));
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

/// The frames to show, in their order: the one of each run's greatest error, and then in turn the next worst of each
/// run that is apart from those chosen before. `errors` are `[run][seed][frame]`.
fn worst_moments(errors: &[&[Vec<Option<f64>>]], frames: usize) -> Vec<WorstMoment> {
    let ranked: Vec<Vec<usize>> = errors.iter().map(|run| worst_first(run, frames)).collect();
    let mut chosen: Vec<WorstMoment> = Vec::new();
    for (run, ranked) in ranked.iter().enumerate() {
        let Some(frame) = ranked.first().copied() else { continue };
        match chosen.iter_mut().find(|other| other.frame == frame) {
            Some(same) => same.runs.push(run),
            None => chosen.push(WorstMoment { frame, runs: vec![run] }),
        }
    }
    for _ in 1..MOMENTS {
        for (run, ranked) in ranked.iter().enumerate() {
            let apart = |frame: &usize| chosen.iter().all(|other| other.frame.abs_diff(*frame) >= APART);
            let next = ranked.iter().copied().find(apart).filter(|_| chosen.len() < MOMENTS);
            chosen.extend(next.map(|frame| WorstMoment { frame, runs: vec![run] }));
        }
    }
    chosen.sort_by_key(|moment| moment.frame);
    chosen
}

/// The frames with an error in any seed of a run, the greatest error first; without those that are neither among the
/// worst tenth nor at least half as wrong as the worst.
fn worst_first(seeds: &[Vec<Option<f64>>], frames: usize) -> Vec<usize> {
    let greatest =
        |frame: usize| seeds.iter().filter_map(|errors| errors.get(frame).copied().flatten()).max_by(f64::total_cmp);
    let mut all: Vec<(f64, usize)> = (0..frames).filter_map(|frame| Some((greatest(frame)?, frame))).collect();
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    let of_tenth = all.get(all.len().div_ceil(10).saturating_sub(1)).map_or(0.0, |(error, _)| *error);
    let least = all.first().map_or(0.0, |(worst, _)| (0.5 * worst).min(of_tenth));
    all.into_iter().filter(|(error, _)| *error >= least).map(|(_, frame)| frame).collect()
}

fn moment(set: &BenchmarkSet, runs: &[StoredRun], worst: WorstMoment) -> Result<OverlaidMoment, ExperimentError> {
    let frame = worst.frame;
    let observed = set.blind.observation(frame)?;
    let mut painters = Painters::new(&set.blind);
    painters.place(&observed);
    let cameras = 0..observed.silhouettes.len();
    let images = cameras.filter(|_| set.blind.has_colour()).map(|camera| set.blind.colour(camera, frame));
    Ok(OverlaidMoment {
        frame,
        worst_of: worst.runs,
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
    fn every_run_has_its_own_worst_frames_although_another_run_is_always_worse() {
        let (mut good, mut bad) = (vec![Some(1.0); 200], vec![Some(500.0); 200]);
        (good[120], good[124], good[90]) = (Some(9.0), Some(8.0), Some(7.0));
        (bad[40], bad[44], bad[120]) = (Some(900.0), Some(899.0), None);
        let (good, bad) = ([good], [vec![Some(0.0); 200], bad]);
        let shown = worst_moments(&[&good, &bad], 200);
        let of = |run: usize| shown.iter().filter(move |moment| moment.runs == [run]).map(|moment| moment.frame);
        assert_eq!((of(0).count(), of(1).count(), shown.len()), (4, 4, MOMENTS), "{shown:?}");
        assert!(of(0).any(|frame| frame == 120) && of(0).any(|frame| frame == 90), "{shown:?}");
        assert!(of(1).any(|frame| frame == 40), "{shown:?}");
        assert!(shown.windows(2).all(|pair| pair[1].frame - pair[0].frame >= APART), "{shown:?}");
        assert!(worst_moments(&[&[], &[]], 200).is_empty());
    }

    #[test]
    fn good_frames_of_a_short_run_are_not_called_worst() {
        let error = |frame: i32| Some(if frame < 12 { 200.0 } else { 50.0 - 0.1 * f64::from(frame) });
        let errors = [(0..60).map(error).collect::<Vec<_>>()];
        let frames: Vec<usize> = worst_moments(&[&errors], 60).iter().map(|moment| moment.frame).collect();
        assert_eq!(frames, [0, 10]);
        assert_eq!(worst_first(&errors, 60).len(), 12);
    }

    #[test]
    fn the_greatest_error_of_a_run_is_shown_beside_and_together_with_those_of_others() {
        let worst_at = |frame: usize| [(0..20).map(|at| Some(f64::from(u8::from(at == frame)))).collect::<Vec<_>>()];
        let (one, same, near) = (worst_at(7), worst_at(7), worst_at(9));
        let shown = worst_moments(&[&one, &same, &near], 20);
        assert_eq!((shown[0].frame, &shown[0].runs[..]), (7, &[0, 1][..]));
        assert_eq!((shown[1].frame, &shown[1].runs[..]), (9, &[2][..]));
    }
}
