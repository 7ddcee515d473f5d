//! `skiagraph plan-seeds`: how many seeds a comparison needs, and how long they take.

use std::path::PathBuf;

use serde::Serialize;

use super::Baseline;
use crate::common::ExperimentError;
use crate::runs::reading::{read_record, run_files_at};
use skiagraph_eval::{GateOutcome, GateRules, Margin, PlanRefusal, PlannedTest, SamplePlan, Unit};

/// Numbers of seeds in the table of powers.
const TABLE: [usize; 9] = [5, 6, 8, 10, 15, 20, 30, 50, 100];
/// Probabilities of passing for which the least number of seeds is computed.
const POWERS: [f64; 2] = [0.8, 0.9];

/// Seeds that a comparison within a margin needs: `plan-seeds --json`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SeedPlan {
    /// `skiagraph.seed_plan/1`.
    pub schema: String,
    pub metric: String,
    /// Unit of the margin, the mean and the deviations.
    pub unit: Unit,
    pub margin: f64,
    pub mean: f64,
    /// Standard deviation over the pilot's seeds.
    pub deviation: f64,
    /// Upper 80 % limit of that deviation.
    pub upper_deviation: Option<f64>,
    /// Mean share of the markers with an estimate in the pilot, whose error is theirs alone.
    pub coverage: Option<f64>,
    /// Number of clips, each of which is run with every seed.
    pub clips: usize,
    /// Seconds to track all clips with one seed, on the computer and threads of the pilot; `None` if it has no times.
    pub seconds_per_seed: Option<f64>,
    /// The least numbers of seeds, of each clip.
    pub needed: Vec<NeededSeeds>,
    /// Powers for some numbers of seeds, with the pilot's deviation.
    pub powers: Vec<SeedPower>,
}

/// The least number of seeds a side for a power; `None` if more than a thousand.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct NeededSeeds {
    /// The statement to support.
    pub test: PlannedTest,
    /// Probability that an unchanged tracker passes.
    pub power: f64,
    /// With the pilot's deviation.
    pub seeds: Option<usize>,
    /// With the upper limit of the deviation.
    pub seeds_at_upper: Option<usize>,
}

/// The probability that an unchanged tracker passes, by the number of seeds a side.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SeedPower {
    /// Seeds a side.
    pub seeds: usize,
    /// Of the gate: not worse by the margin.
    pub not_worse: Option<f64>,
    /// Of equivalence: neither worse nor better by the margin.
    pub equivalent: Option<f64>,
    /// Seconds to track all of them, for one side.
    pub seconds: Option<f64>,
}

impl From<PlanRefusal> for ExperimentError {
    fn from(refusal: PlanRefusal) -> Self {
        let argument = match &refusal {
            PlanRefusal::Metric(_) => "--metric",
            PlanRefusal::Margin(_) | PlanRefusal::ZeroMargin => "--margin",
            PlanRefusal::NoValues(_) | PlanRefusal::Seeds { .. } | PlanRefusal::Copies => "RUN",
        };
        Self::Argument { argument, detail: refusal.to_string() }
    }
}

/// Plans a comparison with the spread of the runs at these paths.
pub fn plan_seeds(runs: &[PathBuf], metric: &str, margin: Margin) -> Result<SeedPlan, ExperimentError> {
    let pilot = crate::runs::read_runs(runs)?;
    let plan = SamplePlan::new(&pilot, metric, margin)?;
    let seconds_per_seed = seconds_per_seed(runs);
    let upper = plan.upper_factor();
    let needed = |test, power| NeededSeeds {
        test,
        power,
        seeds: plan.seeds_for(test, power, 1.0),
        seeds_at_upper: upper.and_then(|upper| plan.seeds_for(test, power, upper)),
    };
    let row = |seeds: usize| SeedPower {
        seeds,
        not_worse: plan.power(PlannedTest::NotWorse, seeds, 1.0),
        equivalent: plan.power(PlannedTest::Equivalent, seeds, 1.0),
        seconds: seconds_per_seed.map(|each| each * seeds as f64),
    };
    let tests = [PlannedTest::NotWorse, PlannedTest::Equivalent];
    Ok(SeedPlan {
        schema: "skiagraph.seed_plan/1".to_owned(),
        metric: metric.to_owned(),
        unit: plan.unit,
        margin: plan.margin,
        mean: plan.mean,
        deviation: plan.deviation(),
        upper_deviation: upper.map(|upper| upper * plan.deviation()),
        coverage: pilot.mean_of("coverage"),
        clips: plan.clips(),
        seconds_per_seed,
        needed: tests.into_iter().flat_map(|test| POWERS.map(|power| needed(test, power))).collect(),
        powers: TABLE.into_iter().map(row).collect(),
    })
}

/// Seconds to track every set of the runs with one seed; `None` if a run has no times.
fn seconds_per_seed(runs: &[PathBuf]) -> Option<f64> {
    let mut sets: Vec<(String, f64, usize)> = Vec::new();
    for file in runs.iter().flat_map(|run| run_files_at(run)) {
        let record = read_record(&file).ok()?;
        let (seconds, seeds) = (record.timing?.seconds, record.seeds.len());
        match sets.iter_mut().find(|(hash, ..)| *hash == record.set_hash) {
            Some((_, all, count)) => (*all, *count) = (*all + seconds, *count + seeds),
            None => sets.push((record.set_hash, seconds, seeds)),
        }
    }
    let each = sets.iter().map(|(_, seconds, seeds)| seconds / (*seeds).max(1) as f64);
    (!sets.is_empty()).then(|| each.sum())
}

/// The note of an inconclusive gate: how many seeds its margins need, by the baseline's spread.
pub(super) fn planned_note(baseline: &Baseline, rules: &GateRules, outcome: &GateOutcome) -> Option<String> {
    let is_open =
        |metric: &str| outcome.checks.iter().any(|check| check.metric == metric && check.more_seeds.is_some());
    let budget = rules.budgets.iter().find(|budget| is_open(&budget.metric))?;
    let plan = SamplePlan::new(&baseline.runs, &budget.metric, budget.margin).ok()?;
    let [likely, surely] = POWERS.map(|power| plan.seeds_for(PlannedTest::NotWorse, power, 1.0));
    let margin = String::from(budget.margin).replace(' ', "");
    let of_each = if plan.clips() > 1 { format!(" of each of the {} clips", plan.clips()) } else { String::new() };
    Some(format!(
        "by the baseline's spread an unchanged tracker passes {margin} of {} in 80 % of cases with {} seeds a side\
         {of_each}, and in 90 % with {} (plan-seeds has a table with times)",
        budget.metric,
        count(likely),
        count(surely),
    ))
}

pub(crate) fn count(seeds: Option<usize>) -> String {
    seeds.map_or("more than 1000".to_owned(), |seeds| seeds.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_that_is_not_there_is_named() {
        let nowhere = PathBuf::from("nowhere");
        let refused = plan_seeds(&[nowhere], "humaneva_mm", "2mm".parse().unwrap()).unwrap_err().to_string();
        assert!(refused.contains("nowhere"), "{refused}");
    }
}
