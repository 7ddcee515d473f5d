//! `skiagraph ladder`.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;

use super::sweep::{Definition, PageCommand, describe_failures};
use super::volume::Volume;
use super::{CommandError, output};
use crate::artefacts::LADDER_PAGE;
use crate::common::ExperimentError;
use crate::evaluation::Metric;
use crate::sweep::page::{SweepPageInput, ladder_page};
use crate::sweep::{Ladder, LadderAxis, LadderCurve};

/// Run trackers over rising strengths of corruptions, and show where their error doubles
///
/// Renders the scenario clean and at every level of every axis, runs all trackers on the same draws of the noise, and
/// writes DIR/ladder.html: a curve per tracker and axis, with intervals over draws. DIR is a sweep: an interrupted
/// ladder resumes with the same command, and skiagraph sweep status, run and submit take it. skiagraph report DIR
/// writes its page again from the results, without running any tracker.
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

    /// Keep a complete run with its report for every cell, about 1 MB each
    #[arg(long)]
    reports: bool,

    #[command(flatten)]
    command: PageCommand,
}

pub(super) fn run(arguments: &Arguments, volume: Volume) -> Result<ExitCode, CommandError> {
    let definition = Definition {
        file: arguments.scenario.clone(),
        seed: arguments.seed,
        seeds: Some(arguments.draws),
        reports: arguments.reports,
        ladder: arguments.axis.clone(),
        ..Definition::default()
    };
    let (sweep, ran) = arguments.command.run(definition, "ladders", volume)?;
    let ladder = Ladder::new(&sweep)?;
    let input = SweepPageInput::new(&sweep, None)?;
    let page = ladder_page(&ladder, &input).map_err(ExperimentError::from)?;
    let words = format!("{}{}", describe(&ladder, input.objective), describe_failures(&ran.failed));
    let path = sweep.root.join(LADDER_PAGE);
    arguments.command.finish((&path, &page), &ladder, &words, ladder.incomplete, volume)
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
