//! `skiagraph compare`.

use std::fs;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;

use super::folders::expect_run;
use super::volume::Volume;
use super::{CommandError, output};
use crate::artefacts::{Destination, put_file};
use crate::common::ExperimentError;
use crate::runs::{SidesToCompare, compare_sides, runs_of_one_set};
use skiagraph_eval::IntervalUnit;
use skiagraph_report::{comparison_markdown, comparison_text, difference_page};

/// Compare measured runs: every metric's difference with its 95 % interval
///
/// RUN is the directory of a run, or a directory that contains runs (clips, noise draws, further seeds). A draw is one
/// rendering with its own observation noise (observation.seed). All are compared with the first. If a single RUN is
/// given, the runs in it (the methods of a scenario) are compared with each other. With --vs, the RUNs before it form
/// one side and the RUNs after it the other.
///
/// Intervals are over clips (each the mean of its draws and seeds) if both sides have at least three in common;
/// otherwise over draws, at least three per clip; otherwise over seeds; never over frames. The output states what the
/// intervals do not cover. They use Student's or Welch's t and need at least three values.
///
/// Seeds are paired if both sides have the same seeds. They are also paired if, in every set, the sides share at least
/// three seeds and at least half of the seeds of the larger side; the other seeds are then left out. Whether seeds are
/// paired never depends on the results. Bit-identical runs count as one observation. p values are adjusted for the
/// number of metrics (Holm). The share of runs that lose the body (track_loss above 0, or no error that could be
/// measured) is compared separately.
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  skiagraph compare runs/main runs/mine\n  \
                        skiagraph compare runs/200 runs/400 runs/800 --html particles.html\n  \
                        skiagraph compare runs/main runs/mine --markdown > comment.md\n  \
                        skiagraph compare runs/methods\n  \
                        skiagraph compare runs/main-1 runs/main-2 runs/main-3 --vs runs/mine-1 runs/mine-2 runs/mine-3\n  \
                        skiagraph compare runs/main runs/mine --unit seeds\n  \
                        skiagraph compare runs/4-cameras runs/2-cameras --across-sets")]
pub(super) struct Arguments {
    /// Run directories; the first is the base
    #[arg(value_name = "RUN", required = true)]
    runs: Vec<PathBuf>,

    /// Run directories of the other side; those before --vs form the base
    #[arg(long, value_name = "RUN", num_args = 1..)]
    vs: Vec<PathBuf>,

    /// Unit of the intervals: seeds, draws or clips [default: clips if there are three, else draws, else seeds]
    #[arg(long, value_name = "UNIT")]
    unit: Option<IntervalUnit>,

    /// Compare runs on different sets of the same name (different cameras or noise), unpaired
    #[arg(long)]
    across_sets: bool,

    /// Show all metrics and markers in the table
    #[arg(long)]
    all: bool,

    /// Print one JSON object instead of a table
    #[arg(long, conflicts_with = "markdown")]
    json: bool,

    /// Print Markdown instead of a table
    #[arg(long)]
    markdown: bool,

    /// Also write an HTML page, with the errors of all runs over time if they are runs of one set
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,

    /// Move an existing FILE aside, to FILE~, if skiagraph did not write it
    #[arg(long)]
    force: bool,
}

pub(super) fn run(arguments: &Arguments, volume: Volume) -> Result<ExitCode, CommandError> {
    arguments.runs.iter().chain(&arguments.vs).try_for_each(|run| expect_run(run))?;
    let comparison = compare_sides(SidesToCompare {
        paths: &arguments.runs,
        versus: &arguments.vs,
        across_sets: arguments.across_sets,
        unit: arguments.unit,
    })?;
    volume.notes(&same_runs(arguments));
    if let Some(path) = &arguments.html {
        // errors over time are of one set
        let runs = if arguments.vs.is_empty() { runs_of_one_set(&arguments.runs)? } else { Vec::new() };
        let page = difference_page(&comparison, &runs).map_err(ExperimentError::from)?;
        put_file(Destination { path, force: arguments.force }, page.as_bytes())?;
        volume.written(path);
    }
    if arguments.json {
        output::print_json(&comparison)?;
    } else if arguments.markdown {
        let text = comparison_markdown(&comparison).map_err(ExperimentError::from)?;
        output::print(text.trim_end())?;
    } else {
        output::print(&comparison_text(&comparison, arguments.all))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Notes on runs that appear on both sides, so that their differences are zero.
fn same_runs(arguments: &Arguments) -> Vec<String> {
    let real = |path: &PathBuf| fs::canonicalize(path).unwrap_or_else(|_| path.clone());
    let (base, others) = match arguments.vs.as_slice() {
        [] => arguments.runs.split_at(arguments.runs.len().min(1)),
        vs => (arguments.runs.as_slice(), vs),
    };
    let is_in_base = |other: &&PathBuf| base.iter().any(|one| real(one) == real(other));
    let same = others.iter().filter(is_in_base).map(|other| other.display());
    same.map(|run| format!("{run} is the same run on both sides, so its differences are zero")).collect()
}
