//! `skiagraph report`.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;

use super::folders::expect_run;
use super::volume::Volume;
use super::{CommandError, output};
use crate::artefacts::{Destination, PLAN_FILE, put_file};
use crate::common::ExperimentError;
use crate::measure::{REPORT_FILE, RUN_FILE};
use crate::runs::reading::expect_measured;
use crate::runs::{COMPARISON_PAGE, has_methods, stored_figures, write_figures};
use crate::sweep::PlannedSweep;
use crate::sweep::page::SweepReport;

/// Report on a sweep: failures, which setting to choose, means along the axes; or the plots of runs
///
/// Writes SWEEP/report.html from the results of a sweep: cells that failed or left frames out, the best setting and the
/// cheapest that is about as good, error against cost, every value of every axis for every tracker with intervals over
/// clips, draws or seeds, and all settings with links to the reports of their cells. Writes Markdown instead if --out
/// ends in .md. Also works while the sweep is running.
///
/// --figures writes the plots as SVG files, for papers and slides, with their captions in README.txt: for a run, error
/// over time, error per joint, share of markers within a distance, energies and the search; for two to seven runs of
/// one set, or a run with several methods, their errors with intervals and over time; for a sweep, error against cost
/// and the axes. The directory must be new, empty, or unchanged since --figures wrote it.
///
/// A run already has its report.html; skiagraph compare RUN RUN --html FILE compares runs on one page.
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  skiagraph report sweeps/mine\n  skiagraph report sweeps/mine --within 10\n  \
                        skiagraph report sweeps/mine --out results/particles.md\n  \
                        skiagraph report runs/walk --figures figures/walk\n  \
                        skiagraph report runs/mine runs/theirs --figures figures/both")]
pub(super) struct Arguments {
    /// Directory of a sweep; with --figures, also of one or more runs
    #[arg(value_name = "SWEEP|RUN", required = true)]
    sweep: Vec<PathBuf>,

    /// Write the plots as SVG files into this directory instead
    #[arg(long, value_name = "DIR", conflicts_with = "out")]
    figures: Option<PathBuf>,

    /// Page to write, .html or .md [default: SWEEP/report.html, where alone links to the reports of cells work]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,

    /// How much worse than the best a recommended setting may be, in the unit of the objective [default: 5 mm, or 0.02
    /// for shares]
    #[arg(long, value_name = "X")]
    within: Option<f64>,

    /// Move an existing file or folder that skiagraph did not write aside, to NAME~
    #[arg(long)]
    force: bool,
}

pub(super) fn run(arguments: &Arguments, volume: Volume) -> Result<ExitCode, CommandError> {
    arguments.sweep.iter().try_for_each(|path| expect_run(path))?;
    if let Some(within) = arguments.within.filter(|within| !(*within >= 0.0 && within.is_finite())) {
        let detail = format!("expected a number from 0, found {within}");
        return Err(ExperimentError::Argument { argument: "--within", detail }.into());
    }
    if let Some(path) = &arguments.figures {
        return put_figures(arguments, path, volume);
    }
    let sweep_or_run = only_sweep(&arguments.sweep)?;
    let sweep = PlannedSweep::open_results(sweep_or_run)?;
    let path = arguments.out.clone().unwrap_or_else(|| sweep_or_run.join("report.html"));
    check_ending("--out", &path, &["html", "htm", "md"])?;
    let report = SweepReport::new(&sweep, arguments.within)?;
    let is_markdown = path.extension() == Some(OsStr::new("md"));
    let text = if is_markdown { report.markdown() } else { report.html() }.map_err(ExperimentError::from)?;
    put_file(Destination { path: &path, force: arguments.force }, text.as_bytes())?;
    volume.written(&path);
    output::print(&format!("{}: {} settings", path.display(), sweep.plan.settings))?;
    Ok(ExitCode::SUCCESS)
}

/// The one sweep to report on. Runs have their own page, and comparisons another.
fn only_sweep(paths: &[PathBuf]) -> Result<&Path, ExperimentError> {
    if let [path] = paths
        && !path.join(RUN_FILE).is_file()
        && !has_methods(path)
    {
        expect_measured(path)?;
        return Ok(path);
    }
    let detail = match paths {
        [run] if run.join(RUN_FILE).is_file() => format!("its page is {}", run.join(REPORT_FILE).display()),
        [methods] => format!("its page is {}", methods.join(COMPARISON_PAGE).display()),
        _ => "skiagraph compare RUN RUN --html FILE writes the page of several runs".to_owned(),
    };
    let detail = format!("expected a sweep, found runs: {detail}; --figures DIR writes the plots of runs");
    Err(ExperimentError::Argument { argument: "SWEEP", detail })
}

/// Writes the figures of a sweep if there is a plan, else of runs, into the directory of --figures.
fn put_figures(arguments: &Arguments, path: &Path, volume: Volume) -> Result<ExitCode, CommandError> {
    let draw = || match arguments.sweep.as_slice() {
        [sweep] if sweep.join(PLAN_FILE).is_file() => {
            Ok(SweepReport::new(&PlannedSweep::open_results(sweep)?, arguments.within)?.figures()?)
        }
        runs => stored_figures(runs),
    };
    let count = write_figures(&arguments.sweep, draw, Destination { path, force: arguments.force })?;
    volume.written(path);
    output::print(&format!("{}: {count} figures", path.display()))?;
    Ok(ExitCode::SUCCESS)
}

/// Refuses a file name that ends in none of these.
fn check_ending(argument: &'static str, path: &Path, expected: &[&str]) -> Result<(), ExperimentError> {
    let extension = path.extension().unwrap_or_default().to_string_lossy();
    if expected.iter().any(|expected| extension.eq_ignore_ascii_case(expected)) {
        return Ok(());
    }
    let found = if extension.is_empty() { "none".to_owned() } else { format!(".{extension}") };
    let detail = format!("{}: expected a file that ends in .{}, found {found}", path.display(), expected.join(" or ."));
    Err(ExperimentError::Argument { argument, detail })
}
