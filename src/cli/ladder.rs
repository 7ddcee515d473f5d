//! `skiagraph ladder`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;

use super::file_access::FileAccess;
use super::program_arguments::TrackerArguments;
use super::sweep::{Definition, ExecutionOptions, describe_failures, planned, run_and_gather};
use super::volume::Volume;
use super::{CommandError, output};
use crate::artefacts::{Destination, put_file};
use crate::common::ExperimentError;
use crate::evaluation::Metric;
use crate::sweep::page::{SweepPageInput, ladder_page};
use crate::sweep::{Ladder, LadderAxis, LadderCurve};

/// The page in the folder of a ladder.
const PAGE: &str = "ladder.html";

/// Run trackers over rising strengths of corruptions, and show where their error doubles
///
/// Renders the scenario clean and at every level of every axis, runs all trackers on the same draws of the noise, and
/// writes DIR/ladder.html: a curve per tracker and axis, with intervals over draws. DIR is a sweep: an interrupted
/// ladder resumes with the same command, and skiagraph sweep status, run and submit and skiagraph report take it.
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  skiagraph ladder scenarios/walk.toml --axis boundary_px\n  \
                        skiagraph ladder scenarios/walk.toml --axis boundary_px=1,2,4,8 --axis start_mm --draws 5\n  \
                        skiagraph ladder scenarios/walk.toml --axis keypoints.slow_percent --tracker keypoints observation.keypoints.layout=halpe26\n  \
                        skiagraph ladder scenarios/walk.toml --axis holes --exec \"python3 mine.py\" --name mine --tracker frozen\n\n\
                        scenarios/README.md lists the axes with their units and default levels. Exit code 1: some cells\n\
                        cannot be run.")]
pub(super) struct Arguments {
    /// Scenario file [default: the built-in walk]
    #[arg(value_name = "SCENARIO")]
    scenario: Option<PathBuf>,

    /// Overrides of scenario keys, and settings of programs
    #[arg(value_name = "KEY=VALUE")]
    overrides: Vec<String>,

    /// Corruption or error of keypoints, with its levels in its unit or its default ones; may be repeated. The clean
    /// level is added
    #[arg(long, value_name = "AXIS[=LEVEL,...]", required = true)]
    axis: Vec<LadderAxis>,

    /// Draws of the noise per level, each also with its own seed of the tracker; an interval needs three
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    draws: u32,

    /// First random seed, overriding the scenario
    #[arg(long, value_name = "N")]
    seed: Option<u32>,

    #[command(flatten)]
    trackers: TrackerArguments,

    /// Metric of the curves [default: humaneva_mm]
    #[arg(long, value_name = "METRIC")]
    objective: Option<String>,

    /// Keep a complete run with its report for every cell, about 1 MB each
    #[arg(long)]
    reports: bool,

    /// Directory of the ladder [default: ladders/NAME, or ladders/NAME-2 and so on if it holds another]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,

    /// Directory to search recursively for clips of the scenario [default: $SKIAGRAPH_MOCAP]
    #[arg(long, value_name = "DIR")]
    mocap_dir: Option<PathBuf>,

    #[command(flatten)]
    access: FileAccess,

    #[command(flatten)]
    options: ExecutionOptions,
}

pub(super) fn run(arguments: &Arguments, volume: Volume) -> Result<ExitCode, CommandError> {
    let definition = Definition {
        file: arguments.scenario.clone(),
        assignments: arguments.overrides.clone(),
        seed: arguments.seed,
        seeds: Some(arguments.draws),
        trackers: arguments.trackers.clone(),
        objective: arguments.objective.clone(),
        reports: arguments.reports,
        mocap_dir: arguments.mocap_dir.clone(),
        access: arguments.access,
        ladder: arguments.axis.clone(),
        ..Definition::default()
    };
    let options = &arguments.options;
    let root = planned(&definition, Path::new("ladders"), arguments.out.as_deref(), options, volume)?;
    let (sweep, ran) = run_and_gather(&root, options, arguments.access, volume)?;
    let ladder = Ladder::new(&sweep)?;
    let page = root.join(PAGE);
    let input = SweepPageInput::new(&sweep, None)?;
    let text = ladder_page(&ladder, &input).map_err(ExperimentError::from)?;
    put_file(Destination { path: &page, force: false }, text.as_bytes())?;
    volume.written(&page);
    if options.json {
        output::print_json(&ladder)?;
    } else {
        let failures = describe_failures(&ran.failed);
        output::print(&format!("{}{failures}\n\n  page: {}", describe(&ladder, input.objective), page.display()))?;
    }
    Ok(if ladder.incomplete == 0 { ExitCode::SUCCESS } else { ExitCode::from(1) })
}

/// A table per axis: the mean of every tracker by level, and where its error doubles.
fn describe(ladder: &Ladder, metric: &Metric) -> String {
    let width = ladder.curves.iter().map(|curve| curve.tracker.chars().count()).max().unwrap_or(0).max(7);
    let draws = output::counted(ladder.draws, "draw");
    let mut lines = vec![format!("{}: {}, means over {draws} of the noise", ladder.name, metric.title)];
    for curves in ladder.curves.chunk_by(|a, b| a.axis == b.axis) {
        let Some(first) = curves.first() else { continue };
        let levels: String = first.levels.iter().map(|level| format!("  {:>8}", level.level)).collect();
        lines.push(format!("\n  {}\n  {:<width$}{levels}  {:>12}", first.title(), "tracker", "doubles at"));
        lines.extend(curves.iter().map(|curve| row(curve, width, metric)));
    }
    lines.extend(ladder.remarks.iter().map(|remark| format!("\n  {remark}")));
    lines.join("\n")
}

fn row(curve: &LadderCurve, width: usize, metric: &Metric) -> String {
    let means: String = curve.levels.iter().map(|level| format!("  {:>8}", level.mean_text(metric))).collect();
    format!("  {:<width$}{means}  {:>12}", curve.tracker, curve.doubling())
}
