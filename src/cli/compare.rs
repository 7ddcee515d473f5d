//! `skiagraph compare`.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;

use super::folders::expect_run;
use super::volume::Volume;
use super::{CommandError, output};
use crate::experiment::{Destination, ExperimentError, compare_sides, put_file};
use crate::report::{comparison_markdown, comparison_text, difference_page};

/// Compare measured runs: every metric's difference with its 95 % interval
///
/// RUN is the directory of a run, or a directory of runs (one clip each, or several seeds of one). All are compared
/// with the first. If there is a single RUN, the runs in it are compared with each other: the methods of a scenario.
///
/// Runs are paired by clip and seed where both sides share most of their seeds; seeds of one side are then left out,
/// unless all runs tell more. Intervals are over clip x seed, never over frames: Student's or Welch's t below ten
/// seeds, a BCa bootstrap from ten on, none below three. p values are adjusted for the number of metrics (Holm). The
/// share of runs that lose the body is compared by itself.
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  skiagraph compare runs/main runs/mine\n  \
                        skiagraph compare runs/200 runs/400 runs/800 --html particles.html\n  \
                        skiagraph compare runs/main runs/mine --markdown > comment.md\n  \
                        skiagraph compare runs/methods\n  \
                        skiagraph compare runs/4-cameras runs/2-cameras --across-sets")]
pub(super) struct Arguments {
    /// Directories of runs; the first is the base
    #[arg(value_name = "RUN", required = true)]
    runs: Vec<PathBuf>,

    /// Compare runs on different sets of the same name (other cameras, other noise), unpaired
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

    /// Also write an HTML page
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,

    /// Move an existing FILE that skiagraph did not write aside, to FILE~
    #[arg(long)]
    force: bool,
}

pub(super) fn run(arguments: &Arguments, volume: Volume) -> Result<ExitCode, CommandError> {
    arguments.runs.iter().try_for_each(|run| expect_run(run))?;
    let comparison = compare_sides(&arguments.runs, arguments.across_sets)?;
    if let Some(path) = &arguments.html {
        let page = difference_page(&comparison).map_err(ExperimentError::from)?;
        put_file(Destination { path, force: arguments.force }, page.as_bytes())?;
        volume.written(path);
    }
    if arguments.json {
        output::print_json(&comparison)?;
    } else if arguments.markdown {
        output::print(comparison_markdown(&comparison).trim_end())?;
    } else {
        output::print(&comparison_text(&comparison, arguments.all))?;
    }
    Ok(ExitCode::SUCCESS)
}
