//! `skiagraph plan-seeds`.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;

use super::folders::expect_run;
use super::summary::partly_covered;
use super::volume::duration;
use super::{CommandError, output};
use crate::gating::seed_plan::count;
use crate::gating::{SeedPlan, plan_seeds};
use skiagraph_eval::{Margin, PlannedTest};

/// Plan how many seeds a comparison needs, from a pilot of a few
///
/// Reads the spread over seeds of a measured run (five seeds are a usual pilot) and computes how often an unchanged
/// tracker would pass: with the 95 % intervals of skiagraph gate, by the noncentral t distribution. A gate asks that a
/// run is not worse by the margin or more; equivalence also asks that it is not better by that much. The spread of a
/// small pilot is uncertain, so the numbers are also given for its upper 80 % limit. Both sides have the same seeds,
/// which the gate pairs; the runs of a pair are taken to vary independently, each with the spread of the pilot: a
/// changed tracker whose error varies more needs more seeds. With several clips, each is run with every seed, and the
/// tables also have the number of runs of a side. Clips count as independent, as in the gate, also with equal seeds.
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  skiagraph plan-seeds runs/pilot --margin 2mm\n  \
                        skiagraph plan-seeds runs/walk runs/jog --margin 5%\n  \
                        skiagraph plan-seeds runs/pilot --metric pck150 --margin 1% --json")]
pub(super) struct Arguments {
    /// Run directories of the pilot, or directories that contain runs: clips, further seeds
    #[arg(value_name = "RUN", required = true)]
    runs: Vec<PathBuf>,

    /// Difference that must not be missed: 2mm, 1.5deg, 0.02, or 5% of the pilot's mean
    #[arg(long, value_name = "MARGIN", allow_hyphen_values = true)]
    margin: Margin,

    /// Metric that --margin applies to
    #[arg(long, value_name = "NAME", default_value = "humaneva_mm")]
    metric: String,

    /// Print one JSON object instead of text
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<ExitCode, CommandError> {
    arguments.runs.iter().try_for_each(|run| expect_run(run))?;
    let plan = plan_seeds(&arguments.runs, &arguments.metric, arguments.margin)?;
    output::print_as(arguments.json, &plan, describe)?;
    Ok(ExitCode::SUCCESS)
}

fn describe(plan: &SeedPlan) -> String {
    let symbol = match plan.unit.symbol() {
        "" => String::new(),
        symbol => format!(" {symbol}"),
    };
    let upper = plan.upper_deviation.map(|upper| format!(", at most {upper:.3}{symbol} with 80 % confidence"));
    // with several clips, a column with the number of runs
    let has_clips = plan.clips > 1;
    let of_each = if has_clips { format!(", of each of the {} clips,", plan.clips) } else { String::new() };
    let runs = |cell: String| if has_clips { format!("  {cell:>8}") } else { String::new() };
    let of_clips = |seeds: usize| (seeds * plan.clips).to_string();
    let mut lines = vec![
        format!(
            "{}: mean {:.2}{symbol}, standard deviation over seeds {:.3}{symbol}{}; {}",
            plan.metric,
            plan.mean,
            plan.deviation,
            upper.unwrap_or_default(),
            output::counted(plan.clips, "clip")
        ),
        format!("margin {:.4}{symbol}; seeds a side{of_each} for an unchanged tracker to pass:\n", plan.margin),
        format!("  {:<44} {:>14}  {:>14}{}  {:>10}", "", "seeds", "wider spread", runs("runs".to_owned()), "time"),
    ];
    for needed in &plan.needed {
        let what = match needed.test {
            PlannedTest::NotWorse => "not worse (the gate)",
            PlannedTest::Equivalent => "neither worse nor better (equivalence)",
        };
        let what = format!("{what}, {:.0} %", 100.0 * needed.power);
        let seconds = needed.seeds.zip(plan.seconds_per_seed).map(|(seeds, each)| each * seeds as f64);
        let all = runs(needed.seeds.map_or("-".to_owned(), of_clips));
        let [seeds, upper] = [needed.seeds, needed.seeds_at_upper].map(count);
        lines.push(format!("  {what:<44} {seeds:>14}  {upper:>14}{all}  {:>10}", time(seconds)));
    }
    let head = runs("runs".to_owned());
    lines.push(format!("\n  {:<8} {:>12} {:>12}{head}  {:>10}", "seeds", "not worse", "equivalent", "time"));
    let percent = |power: Option<f64>| power.map_or("-".to_owned(), |power| format!("{:.0} %", 100.0 * power));
    for row in &plan.powers {
        let [not_worse, equivalent] = [row.not_worse, row.equivalent].map(percent);
        let all = runs(of_clips(row.seeds));
        lines.push(format!("  {:<8} {not_worse:>12} {equivalent:>12}{all}  {:>10}", row.seeds, time(row.seconds)));
    }
    let independent = "\nruns: of one side, every clip with every seed; clips count as independent of each other, as \
                       in the gate, also if they have equal seeds";
    lines.extend(has_clips.then(|| independent.to_owned()));
    lines.push("\nboth sides are taken to have the pilot's spread".to_owned());
    lines.extend(plan.coverage.filter(|share| *share < 1.0).map(partly_covered));
    lines.push(match plan.seconds_per_seed {
        Some(_) => "time: to track one side, as fast as the pilot was tracked".to_owned(),
        None => "time: unknown, because the pilot has no times".to_owned(),
    });
    lines.join("\n")
}

fn time(seconds: Option<f64>) -> String {
    seconds.map_or("-".to_owned(), duration)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gating::{NeededSeeds, SeedPower};
    use skiagraph_eval::Unit;

    #[test]
    fn columns_stay_in_line_with_many_seeds_and_several_clips_have_a_column_of_runs() {
        let needed = |seeds| NeededSeeds { test: PlannedTest::NotWorse, power: 0.8, seeds, seeds_at_upper: None };
        let plan = SeedPlan {
            schema: String::new(),
            metric: "humaneva_mm".to_owned(),
            unit: Unit::Millimetre,
            margin: 2.0,
            mean: 40.0,
            deviation: 1.0,
            upper_deviation: None,
            coverage: Some(0.179),
            clips: 3,
            seconds_per_seed: None,
            needed: vec![needed(Some(7)), needed(None)],
            powers: vec![SeedPower { seeds: 5, not_worse: Some(0.5), equivalent: None, seconds: None }],
        };
        let told = describe(&plan);
        let rows: Vec<&str> = told.lines().filter(|line| line.contains("(the gate), 80 %")).collect();
        assert_eq!(rows[0].chars().count(), rows[1].chars().count(), "{told}");
        assert!(rows[0].contains(" 21 ") && rows[1].contains("more than 1000"), "{told}");
        // a pilot that estimates every sixth frame had no word about it
        assert!(told.contains("\ncoverage 17.9 %: errors are those of the markers with an estimate only"), "{told}");
        assert!(told.contains("seeds a side, of each of the 3 clips, for an unchanged tracker"), "{told}");
        let single = describe(&SeedPlan { clips: 1, ..plan });
        assert!(!single.contains("runs") && single.contains("seeds a side for an unchanged tracker"), "{single}");
    }
}
