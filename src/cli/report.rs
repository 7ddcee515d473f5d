//! `skiagraph report`.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;

use super::file_access::FileAccess;
use super::folders::{expect_run, is_run};
use super::progress::TerminalProgress;
use super::volume::Volume;
use super::{CommandError, output};
use crate::artefacts::{Destination, PLAN_FILE, put_file};
use crate::common::ExperimentError;
use crate::experiment::run_reading::expect_measured;
use crate::experiment::{
    COMPARISON_FILE, MoreOf, baseline_versions, figures_of_runs, overlaid_runs, run_picture, stored_figures,
    write_figures,
};
use crate::measure::REPORT_FILE;
use crate::report::{FigureFile, history_page};
use crate::sweep::PlannedSweep;
use crate::sweep::page::{SweepPageInput, ask, own_page, sweep_figures, sweep_markdown, sweep_page, sweep_picture};

/// Report on a sweep: error against cost, best settings, effects of the settings, failures; several runs on one page;
/// or a picture of a run or sweep
///
/// Writes one self-contained HTML page: settings by error and cost with their Pareto front, the cheapest setting that
/// is about as good as the best, a heat map of particles by layers, the objective along every axis, effects and
/// interactions, failures, and every cell with a link to its report if it has one. Writes Markdown instead if --out
/// ends in .md. Also works while the sweep is running. For a ladder or a suite it also writes their own page again,
/// DIR/ladder.html or DIR/suite.html, from the results alone.
///
/// A run already has its report.html. --png draws one picture: for a run, its verdict, main metrics, error over time
/// and selected frames; for a run with several methods, their errors with intervals and over time; for a sweep, the
/// recommended settings, error against cost, heat maps and the best settings.
///
/// --figures writes the plots as SVG files, for papers and slides, with their captions in README.txt: for a run, error
/// over time, error per joint, share of markers within a distance, energies and the search; for several runs of one
/// set, or a run with several methods, their errors with intervals and over time; for a sweep, error against cost, heat
/// maps and the axes. The directory must be new, empty, or unchanged since --figures wrote it.
///
/// Several runs of one set (2 to 6, of any trackers, or one directory with several methods) give one page: the
/// skeletons of all runs over the images or silhouettes of every camera, in the frames in which each run has its
/// greatest errors; the errors of all runs over time; and their metrics and errors by marker side by side.
///
/// --history writes a page with a baseline's values over the commits of its file, or over several files.
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  skiagraph report sweeps/mine\n  skiagraph report sweeps/mine --within 10\n  \
                        skiagraph report sweeps/mine --out results/particles.md\n  \
                        skiagraph report sweeps/mine --ask\n  \
                        skiagraph report runs/mine runs/theirs --set sets/walk --out both.html\n  \
                        skiagraph report runs/walk --png walk.png\n  \
                        skiagraph report runs/walk --figures figures/walk\n  \
                        skiagraph report sweeps/mine --png mine.png\n  \
                        skiagraph report --history results/baselines/walk.json --out history.html")]
pub(super) struct Arguments {
    /// Directory of a sweep; with --png or --figures, also of a run; or directories of several runs
    #[arg(value_name = "SWEEP|RUN", required_unless_present = "history")]
    sweep: Vec<PathBuf>,

    /// The set of several runs [default: rendered again from the first run's scenario.toml]
    #[arg(long, value_name = "SET")]
    set: Vec<PathBuf>,

    /// Directory that the paths in that scenario.toml are relative to
    #[arg(long, value_name = "DIR", conflicts_with = "set")]
    scenario_dir: Option<PathBuf>,

    /// Directory to search recursively for clips of that scenario [default: $SKIAGRAPH_MOCAP]
    #[arg(long, value_name = "DIR", conflicts_with = "set")]
    mocap_dir: Option<PathBuf>,

    #[command(flatten)]
    access: FileAccess,

    /// Plot a baseline's values over the commits of its file, by git; or over several files, in their order
    #[arg(long, value_name = "BASELINE", num_args = 1.., conflicts_with_all = ["sweep", "png", "figures", "ask", "within"])]
    history: Vec<PathBuf>,

    /// Draw a picture instead, 1200 pixels wide
    #[arg(long, value_name = "FILE", conflicts_with_all = ["out", "ask"])]
    png: Option<PathBuf>,

    /// Write the plots as SVG files into this directory instead
    #[arg(long, value_name = "DIR", conflicts_with_all = ["out", "ask", "png"])]
    figures: Option<PathBuf>,

    /// Page to write, .html or, for a sweep, .md [default: SWEEP/report.html, the only place where links to the reports
    /// of cells work; for several runs, runs.html]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,

    /// How much worse than the best a recommended setting may be, in the unit of the objective [default: 5 mm, or 0.02
    /// for shares]
    #[arg(long, value_name = "X")]
    within: Option<f64>,

    /// Print one JSON object for an optimiser (ask-and-tell interface): axes, direction, and the settings tried so far
    /// with their means
    #[arg(long, conflicts_with_all = ["out", "within"])]
    ask: bool,

    /// Move an existing file or folder that skiagraph did not write aside, to NAME~
    #[arg(long)]
    force: bool,
}

pub(super) fn run(arguments: &Arguments, volume: Volume) -> Result<ExitCode, CommandError> {
    if !arguments.history.is_empty() {
        return history(arguments, volume);
    }
    let [sweep_or_run] = arguments.sweep.as_slice() else { return several(arguments, volume) };
    expect_run(sweep_or_run)?;
    expect_measured(sweep_or_run)?;
    if arguments.png.is_none() && arguments.figures.is_none() && sweep_or_run.join(COMPARISON_FILE).is_file() {
        return several(arguments, volume);
    }
    if let Some(within) = arguments.within.filter(|within| !(*within >= 0.0 && within.is_finite())) {
        let detail = format!("expected a number from 0, found {within}");
        return Err(ExperimentError::Argument { argument: "--within", detail }.into());
    }
    if let Some(path) = &arguments.png {
        check_ending("--png", path, &["png"])?;
        expect_sweep_or_run(sweep_or_run)?;
        put_file(Destination { path, force: arguments.force }, &picture(sweep_or_run, arguments.within)?)
            .map_err(|error| CommandError::from(error).of_option("--png"))?;
        volume.written(path);
        output::print(&path.display().to_string())?;
        return Ok(ExitCode::SUCCESS);
    }
    if let Some(path) = &arguments.figures {
        return put_figures(arguments, path, || figures(sweep_or_run, arguments.within), volume);
    }
    let page = sweep_or_run.join(REPORT_FILE);
    if page.is_file() && !sweep_or_run.join(PLAN_FILE).is_file() {
        let detail = format!(
            "expected a sweep, found a run: its report is {}; use --png FILE for a picture of it or --figures DIR for its \
             plots",
            page.display()
        );
        return Err(ExperimentError::Argument { argument: "SWEEP", detail }.into());
    }
    let sweep = PlannedSweep::open_results(sweep_or_run)?;
    if arguments.ask {
        output::print_json(&ask(&sweep)?)?;
        return Ok(ExitCode::SUCCESS);
    }
    let path = arguments.out.clone().unwrap_or_else(|| sweep_or_run.join("report.html"));
    check_ending("--out", &path, &["html", "htm", "md"])?;
    let input = SweepPageInput::new(&sweep, arguments.within)?;
    let text = if path.extension() == Some(OsStr::new("md")) {
        sweep_markdown(&input)
    } else {
        sweep_page(&input).map_err(ExperimentError::from)?
    };
    put_file(Destination { path: &path, force: arguments.force }, text.as_bytes())?;
    volume.written(&path);
    output::print(&format!("{}: {} settings", path.display(), input.settings().len()))?;
    if arguments.out.is_none()
        && let Some((name, page)) = own_page(&sweep, &input)?
    {
        let path = sweep_or_run.join(name);
        put_file(Destination { path: &path, force: arguments.force }, page.as_bytes())?;
        volume.written(&path);
        output::print(&path.display().to_string())?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Writes figures into the directory of --figures.
fn put_figures(
    arguments: &Arguments,
    path: &Path,
    draw: impl FnOnce() -> Result<Vec<FigureFile>, ExperimentError>,
    volume: Volume,
) -> Result<ExitCode, CommandError> {
    let count = write_figures(&arguments.sweep, draw, Destination { path, force: arguments.force })
        .map_err(|error| CommandError::from(error).of_option("--figures"))?;
    volume.written(path);
    output::print(&format!("{}: {count} figures", path.display()))?;
    Ok(ExitCode::SUCCESS)
}

/// Writes the page of several runs, or their figures.
fn several(arguments: &Arguments, volume: Volume) -> Result<ExitCode, CommandError> {
    arguments.sweep.iter().try_for_each(|run| expect_run(run))?;
    let of_one =
        [("--png", arguments.png.is_some()), ("--ask", arguments.ask), ("--within", arguments.within.is_some())];
    if let Some((argument, _)) = of_one.into_iter().find(|(_, given)| *given) {
        let detail = format!("expected one directory, found {}", arguments.sweep.len());
        return Err(ExperimentError::Argument { argument, detail }.into());
    }
    if let Some(path) = &arguments.figures {
        return put_figures(arguments, path, || figures_of_runs(&arguments.sweep), volume);
    }
    let path = arguments.out.clone().unwrap_or_else(|| PathBuf::from("runs.html"));
    check_ending("--out", &path, &["html", "htm"])?;
    let environment = std::env::var_os("SKIAGRAPH_MOCAP").map(PathBuf::from);
    let from = MoreOf {
        sets: &arguments.set,
        scenario_folder: arguments.scenario_dir.as_deref(),
        mocap_directory: arguments.mocap_dir.as_deref().or(environment.as_deref()),
        allow_outside: arguments.access.allow_outside,
    };
    let progress = TerminalProgress::new(volume);
    let page = overlaid_runs(&arguments.sweep, from, &progress)?;
    drop(progress);
    put_file(Destination { path: &path, force: arguments.force }, page.as_bytes())?;
    volume.written(&path);
    output::print(&path.display().to_string())?;
    Ok(ExitCode::SUCCESS)
}

/// Writes the page of a baseline's history.
fn history(arguments: &Arguments, volume: Volume) -> Result<ExitCode, CommandError> {
    let newest = arguments.history.last().map_or_else(PathBuf::new, Clone::clone);
    let name = newest.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let path = arguments.out.clone().unwrap_or_else(|| newest.with_file_name(format!("{name}-history.html")));
    check_ending("--out", &path, &["html", "htm"])?;
    let versions = baseline_versions(&arguments.history)?;
    let page = history_page(&name, &versions).map_err(ExperimentError::from)?;
    put_file(Destination { path: &path, force: arguments.force }, page.as_bytes())?;
    volume.written(&path);
    output::print(&format!("{}: {}", path.display(), output::counted(versions.len(), "version")))?;
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

/// Refuses a missing path, and a directory that is neither a sweep nor a run.
fn expect_sweep_or_run(source: &Path) -> Result<(), ExperimentError> {
    let is_methods = || source.join(COMPARISON_FILE).is_file();
    if is_run(source) || is_methods() || source.join(PLAN_FILE).is_file() {
        return Ok(());
    }
    let found = if source.exists() { "found neither in" } else { "found nothing at" };
    let detail = format!("expected the directory of a sweep or of a run, {found} {}", source.display());
    Err(ExperimentError::Argument { argument: "SWEEP|RUN", detail })
}

/// The picture of a sweep if there is a plan, else of a run.
fn picture(source: &Path, within: Option<f64>) -> Result<Vec<u8>, CommandError> {
    if !source.join(PLAN_FILE).is_file() {
        return Ok(run_picture(source)?);
    }
    Ok(sweep_picture(&SweepPageInput::new(&PlannedSweep::open_results(source)?, within)?)
        .map_err(ExperimentError::from)?)
}

/// The figures of a sweep if there is a plan, else of a run.
fn figures(source: &Path, within: Option<f64>) -> Result<Vec<FigureFile>, ExperimentError> {
    if !source.join(PLAN_FILE).is_file() {
        return stored_figures(source);
    }
    Ok(sweep_figures(&SweepPageInput::new(&PlannedSweep::open_results(source)?, within)?)?)
}
