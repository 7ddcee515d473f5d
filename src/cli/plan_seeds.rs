//! `skiagraph plan-seeds`.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;

use super::folders::expect_run;
use super::volume::duration;
use super::{CommandError, output};
use crate::evaluation::{Margin, PlannedTest};
use crate::experiment::seed_plan::count;
use crate::experiment::{SeedPlan, plan_seeds};

/// Plan how many seeds a comparison needs, from a pilot of a few
///
/// Reads the spread over seeds of a measured run (five seeds are a usual pilot) and computes how often an unchanged
/// tracker would pass: with the 95 % intervals of skiagraph gate, by the noncentral t distribution. A gate asks that a
/// run is not worse by the margin or more; equivalence also asks that it is not better by that much. The spread of a
/// small pilot is uncertain, so the numbers are also given for its upper 80 % limit. Seeds that both sides share are
/// paired by the gate, and may then need fewer. Clips count as independent, as in the gate, also with equal seeds.
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
    if arguments.json {
        output::print_json(&plan)?;
    } else {
        output::print(&describe(&plan))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn describe(plan: &SeedPlan) -> String {
    let symbol = match plan.unit.symbol() {
        "" => String::new(),
        symbol => format!(" {symbol}"),
    };
    let upper = plan.upper_deviation.map(|upper| format!(", at most {upper:.3}{symbol} with 80 % confidence"));
    let mut lines = vec![
        format!(
            "{}: mean {:.2}{symbol}, standard deviation over seeds {:.3}{symbol}{}; {}",
            plan.metric,
            plan.mean,
            plan.deviation,
            upper.unwrap_or_default(),
            output::counted(plan.clips, "clip")
        ),
        format!("margin {:.4}{symbol}; seeds a side for an unchanged tracker to pass:\n", plan.margin),
        format!("  {:<44} {:>8}  {:>14}  {:>10}", "", "seeds", "wider spread", "time"),
    ];
    for needed in &plan.needed {
        let what = match needed.test {
            PlannedTest::NotWorse => "not worse (the gate)",
            PlannedTest::Equivalent => "neither worse nor better (equivalence)",
        };
        let what = format!("{what}, {:.0} %", 100.0 * needed.power);
        let seconds = needed.seeds.zip(plan.seconds_per_seed).map(|(seeds, each)| each * seeds as f64);
        let [seeds, upper] = [needed.seeds, needed.seeds_at_upper].map(count);
        lines.push(format!("  {what:<44} {seeds:>8}  {upper:>14}  {:>10}", time(seconds)));
    }
    lines.push(format!("\n  {:<8} {:>12} {:>12}  {:>10}", "seeds", "not worse", "equivalent", "time"));
    let percent = |power: Option<f64>| power.map_or("-".to_owned(), |power| format!("{:.0} %", 100.0 * power));
    for row in &plan.powers {
        let [not_worse, equivalent] = [row.not_worse, row.equivalent].map(percent);
        lines.push(format!("  {:<8} {not_worse:>12} {equivalent:>12}  {:>10}", row.seeds, time(row.seconds)));
    }
    let independent = "\nclips count as independent of each other, as in the gate, also if they have equal seeds";
    lines.extend((plan.clips > 1).then(|| independent.to_owned()));
    lines.push(match plan.seconds_per_seed {
        Some(_) => "\ntime: to track one side, as fast as the pilot was tracked".to_owned(),
        None => "\ntime: unknown, because the pilot has no times".to_owned(),
    });
    lines.join("\n")
}

fn time(seconds: Option<f64>) -> String {
    seconds.map_or("-".to_owned(), duration)
}
