//! `skiagraph suite`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;

use super::file_access::FileAccess;
use super::program_arguments::TrackerArguments;
use super::sweep::{Definition, ExecutionOptions, planned, run_and_gather};
use super::volume::Volume;
use super::{CommandError, output};
use crate::artefacts::{Destination, SUITE_PAGE, put_file};
use crate::common::ExperimentError;
use crate::evaluation::Metric;
use crate::sweep::SuiteResults;
use crate::sweep::page::{SweepPageInput, suite_page};

/// The page in the folder of a suite.
/// Failures that are printed; the page has all.
const SHOWN: usize = 10;

/// Run trackers on a suite: clips x places x bodies x cameras, with intervals over clips
///
/// Every combination of the suite's conditions is rendered once and tracked by all trackers. Writes DIR/suite.html:
/// failures first, then every condition with its interval over clips (the clip is the unit), then all runs with links
/// to their reports. A clip that is missing or cannot be run leaves the suite incomplete (exit code 1); the others go
/// on. DIR is a sweep: an interrupted suite resumes with the same command, skiagraph sweep status, run and submit take
/// it, and compare, gate and baseline take the runs of a suite of clips alone.
#[derive(Args, Debug)]
#[command(
    after_help = "Examples:\n  skiagraph suite scenarios/suites/quick.toml --exec \"python3 mine.py\" --name mine\n  \
                        skiagraph suite scenarios/suites/quick.toml --exec ./a --exec ./b --name a --name b --tracker frozen\n  \
                        skiagraph suite scenarios/suites/full.toml --mocap-dir ~/cmu --exec ./mine -j 2\n\n\
                        Exit code 1: the suite is incomplete."
)]
pub(super) struct Arguments {
    /// Suite file
    #[arg(value_name = "SUITE")]
    suite: PathBuf,

    /// Overrides of scenario keys for all runs, and settings of programs
    #[arg(value_name = "KEY=VALUE")]
    overrides: Vec<String>,

    #[command(flatten)]
    trackers: TrackerArguments,

    /// Number of seeds of every run, overriding the suite; each draws its own noise
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    seeds: Option<u32>,

    /// Metric of the table [default: humaneva_mm]
    #[arg(long, value_name = "METRIC")]
    objective: Option<String>,

    /// Directory of the suite's results [default: suites/NAME, or suites/NAME-2 and so on if it holds others]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,

    /// Directory to search recursively for clips [default: $SKIAGRAPH_MOCAP]
    #[arg(long, value_name = "DIR")]
    mocap_dir: Option<PathBuf>,

    #[command(flatten)]
    access: FileAccess,

    #[command(flatten)]
    options: ExecutionOptions,
}

pub(super) fn run(arguments: &Arguments, volume: Volume) -> Result<ExitCode, CommandError> {
    let definition = Definition {
        file: Some(arguments.suite.clone()),
        assignments: arguments.overrides.clone(),
        seeds: arguments.seeds,
        trackers: arguments.trackers.clone(),
        objective: arguments.objective.clone(),
        mocap_dir: arguments.mocap_dir.clone(),
        access: arguments.access,
        is_suite: true,
        ..Definition::default()
    };
    let options = &arguments.options;
    let root = planned(&definition, Path::new("suites"), arguments.out.as_deref(), options, volume)?;
    let (sweep, _) = run_and_gather(&root, options, arguments.access, volume)?;
    let results = SuiteResults::new(&sweep)?;
    let page = root.join(SUITE_PAGE);
    let input = SweepPageInput::new(&sweep, None)?;
    let text = suite_page(&results, &input).map_err(ExperimentError::from)?;
    put_file(Destination { path: &page, force: false }, text.as_bytes())?;
    volume.written(&page);
    if options.json {
        output::print_json(&results)?;
    } else {
        output::print(&format!("{}\n\n  page: {}", describe(&results, input.objective), page.display()))?;
    }
    Ok(if results.incomplete == 0 { ExitCode::SUCCESS } else { ExitCode::from(1) })
}

/// Failures, then a line per condition and tracker.
fn describe(results: &SuiteResults, metric: &Metric) -> String {
    let runs = output::counted(results.cells, "run");
    let incomplete = match results.incomplete {
        0 => String::new(),
        missing => format!("; INCOMPLETE: {missing} without a value"),
    };
    let mut lines = vec![format!("{}: {runs}, {}{incomplete}", results.name, metric.title)];
    for run in results.failures().take(SHOWN) {
        let error = run.error.as_deref().map(|error| format!(": {error}")).unwrap_or_default();
        lines.push(format!("  {:<8}  {}, {}, seed {}{error}", run.state, run.tracker, run.conditions, run.seed));
    }
    let more = results.failures().count().saturating_sub(SHOWN);
    lines.extend((more > 0).then(|| format!("  and {more} more")));
    let longest = |lengths: &mut dyn Iterator<Item = usize>| lengths.max().unwrap_or(0).max(9);
    let name = longest(&mut results.strata.iter().map(|stratum| stratum.name.chars().count()));
    let tracker = longest(&mut results.trackers.iter().map(|name| name.chars().count()));
    lines.push(format!("\n  {:<name$}  {:<tracker$}  {:>8}  95 % interval", "condition", "tracker", "mean"));
    for stratum in &results.strata {
        for (own, value) in results.trackers.iter().zip(&stratum.values) {
            let (mean, note) = (value.mean_text(metric), value.note(metric));
            lines.push(format!("  {:<name$}  {own:<tracker$}  {mean:>8}  {note}", stratum.name));
        }
    }
    lines.extend(results.remarks.iter().map(|remark| format!("\n  {remark}")));
    lines.join("\n")
}
