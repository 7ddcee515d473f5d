//! Estimates the cost of a sweep from a timed sample of its settings.

use std::time::Instant;

use serde::Serialize;

use super::cell::thread_processor_s;
use super::plan::Draft;
use super::plan_file::{PlanRecord, SweepCell};
use crate::common::ExperimentError;
use crate::experiment::cost::cost;
use crate::prepare::PreparedScene;
use crate::scenario::ScenarioFile;

/// Number of settings to time, about a second each.
const SAMPLES: usize = 5;

/// Size and estimated cost of a sweep.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SweepCost {
    /// `skiagraph.sweep_check/1`.
    pub schema: &'static str,
    /// `true`.
    pub sound: bool,
    /// The sweep's name.
    pub name: String,
    /// Number of cells.
    pub cells: usize,
    /// Number of settings.
    pub settings: usize,
    /// Number of seeds.
    pub seeds: usize,
    /// Number of different sets.
    pub sets: usize,
    /// Number of timed settings; the time of the others is interpolated by their likelihood evaluations.
    pub sampled: usize,
    /// Seconds of one core for the cheapest and the most expensive cell of the sample.
    pub cell_s: [f64; 2],
    /// Seconds of one core for all cells and sets; without learning motion models.
    pub core_s: f64,
    /// Parallel jobs.
    pub jobs: usize,
    /// Wall-clock time of the whole sweep, s.
    pub run_s: f64,
    /// Settings in the sample that first learn a motion model, which takes additional seconds to many minutes.
    pub models_to_learn: usize,
}

/// One timed setting.
struct TimedSetting {
    weight: f64,
    cell_s: f64,
    set_s: f64,
    models: usize,
}

/// Estimates the cost of a sweep with this many parallel jobs; takes some seconds itself.
///
/// # Errors
/// [`ExperimentError`] if a setting of the sample cannot be drawn or tracked, or threads cannot be started.
pub fn sweep_cost(draft: &Draft, jobs: usize) -> Result<SweepCost, ExperimentError> {
    cost_of(&draft.cells, |cell| draft.scenario(cell), &draft.record, jobs)
}

/// Estimates the cost of these cells, at least one, and of all sets of the plan.
///
/// # Errors
/// Those of [`sweep_cost`].
pub(super) fn cost_of(
    cells: &[SweepCell],
    scenario: impl Fn(&SweepCell) -> Result<ScenarioFile, ExperimentError>,
    record: &PlanRecord,
    jobs: usize,
) -> Result<SweepCost, ExperimentError> {
    let mut by_weight: Vec<&SweepCell> = cells.iter().collect();
    by_weight.dedup_by_key(|cell| cell.setting);
    by_weight.sort_by_key(|cell| (cell.weight, cell.index));
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    let pool = pool.map_err(|e| ExperimentError::Malformed { path: "threads".into(), detail: e.to_string() })?;
    let mut samples: Vec<TimedSetting> = Vec::new();
    for cell in spread(&by_weight) {
        let file = scenario(cell)?;
        samples.push(pool.install(|| sample(cell, &file, record.mocap_directory.as_deref()))?);
    }
    let cells_s: f64 = cells.iter().map(|cell| interpolate(&samples, cell.weight as f64)).sum();
    let set_s = samples.iter().map(|sample| sample.set_s).sum::<f64>() / samples.len().max(1) as f64;
    let core_s = cells_s + set_s * record.sets as f64;
    let times = samples.iter().map(|sample| sample.cell_s);
    Ok(SweepCost {
        schema: "skiagraph.sweep_check/1",
        sound: true,
        name: record.name.clone(),
        cells: cells.len(),
        settings: record.settings,
        seeds: record.seeds.len(),
        sets: record.sets,
        sampled: samples.len(),
        cell_s: times.fold([f64::INFINITY, 0.0], |[low, high], s| [low.min(s), high.max(s)]),
        core_s,
        jobs,
        run_s: core_s / jobs.max(1) as f64,
        models_to_learn: samples.iter().map(|sample| sample.models).sum(),
    })
}

fn sample(
    cell: &SweepCell,
    file: &ScenarioFile,
    mocap_directory: Option<&std::path::Path>,
) -> Result<TimedSetting, ExperimentError> {
    let (begin, processor) = (Instant::now(), thread_processor_s());
    let scene = PreparedScene::new(file, mocap_directory)?;
    let cost = cost(file, &scene, begin.elapsed().as_secs_f64())?;
    let busy = own_share((thread_processor_s() - processor) / begin.elapsed().as_secs_f64());
    Ok(TimedSetting {
        weight: cell.weight as f64,
        cell_s: busy * (cost.track_s + cost.measure_s),
        set_s: busy * (cost.staging_s + cost.render_s),
        models: cost.models_to_learn,
    })
}

/// Share of the wall-clock time in which the sample had a core. On a loaded machine the rest went to other processes,
/// and the estimate is in seconds of one core.
fn own_share(busy: f64) -> f64 {
    if busy.is_finite() && busy > 0.0 { busy.min(1.0) } else { 1.0 }
}

/// The cheapest cell, the most expensive one, and some in between.
fn spread<'c>(sorted: &[&'c SweepCell]) -> Vec<&'c SweepCell> {
    if sorted.len() <= SAMPLES {
        return sorted.to_vec();
    }
    (0..SAMPLES).map(|n| sorted[n * (sorted.len() - 1) / (SAMPLES - 1)]).collect()
}

/// Time of a cell of this weight, s, interpolated linearly between the samples; samples of equal weight are averaged.
fn interpolate(samples: &[TimedSetting], weight: f64) -> f64 {
    let same = || samples.iter().filter(|sample| sample.weight == weight).map(|sample| sample.cell_s);
    if same().next().is_some() {
        return same().sum::<f64>() / same().count() as f64;
    }
    let above = samples.iter().position(|sample| sample.weight >= weight);
    match above {
        None => samples.last().map_or(0.0, |last| last.cell_s * weight / last.weight.max(1.0)),
        Some(0) => samples[0].cell_s,
        Some(at) => {
            let (a, b) = (&samples[at - 1], &samples[at]);
            let share = (weight - a.weight) / (b.weight - a.weight).max(1e-9);
            a.cell_s + share * (b.cell_s - a.cell_s)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn costs_between_samples_lie_on_a_line() {
        let sample = |weight: f64, cell_s: f64| TimedSetting { weight, cell_s, set_s: 0.0, models: 0 };
        let samples = [sample(100.0, 1.0), sample(200.0, 2.0), sample(400.0, 6.0)];
        let found = [50.0, 100.0, 150.0, 300.0, 400.0, 800.0].map(|weight| interpolate(&samples, weight));
        assert_eq!(found, [1.0, 1.0, 1.5, 4.0, 6.0, 12.0]);
        let twins = [sample(100.0, 1.0), sample(200.0, 2.0), sample(200.0, 6.0)];
        assert_eq!([100.0, 200.0].map(|weight| interpolate(&twins, weight)), [1.0, 4.0], "costs depend on the clip");
    }

    #[test]
    fn seconds_of_a_core_exclude_the_time_of_other_processes() {
        assert_eq!([0.25, 1.0, 1.01, 0.0, f64::NAN].map(own_share), [0.25, 1.0, 1.0, 1.0, 1.0]);
    }
}
