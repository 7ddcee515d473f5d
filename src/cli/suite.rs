//! `skiagraph suite`.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;

use super::sweep::{Definition, PageCommand};
use super::volume::Volume;
use super::{CommandError, output};
use crate::artefacts::SUITE_PAGE;
use crate::common::ExperimentError;
use crate::evaluation::Metric;
use crate::sweep::SuiteResults;
use crate::sweep::page::{SweepPageInput, suite_page};

/// Failures that are printed; the page has all.
const SHOWN: usize = 10;

/// Run trackers on a suite: clips x places x bodies x cameras, with intervals over clips
///
/// Every combination of the suite's conditions is rendered once and tracked by all trackers. Writes DIR/suite.html:
/// failures first, then every condition with its interval over clips (the clip is the unit), then all runs with links
/// to their reports. A clip that is missing or cannot be run leaves the suite incomplete (exit code 1); the others go
/// on. DIR is a sweep: an interrupted suite resumes with the same command, skiagraph sweep status, run and submit take
/// it, and compare, gate and baseline take it, with one value per clip. skiagraph report DIR writes its page again.
/// For a cluster: skiagraph sweep plan SUITE --exec COMMAND --out DIR, skiagraph sweep submit DIR, then skiagraph
/// report DIR.
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

    /// Number of seeds of every run, overriding the suite; each draws its own noise
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    seeds: Option<u32>,

    #[command(flatten)]
    command: PageCommand,
}

pub(super) fn run(arguments: &Arguments, volume: Volume) -> Result<ExitCode, CommandError> {
    let (file, seeds) = (Some(arguments.suite.clone()), arguments.seeds);
    let definition = Definition { file, seeds, is_suite: true, ..Definition::default() };
    let (sweep, _) = arguments.command.run(definition, "suites", volume)?;
    let results = SuiteResults::new(&sweep)?;
    let input = SweepPageInput::new(&sweep, None)?;
    let page = suite_page(&results, &input).map_err(ExperimentError::from)?;
    let (path, words) = (sweep.root.join(SUITE_PAGE), describe(&results, input.objective));
    arguments.command.finish((&path, &page), &results, &words, results.incomplete, volume)
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
