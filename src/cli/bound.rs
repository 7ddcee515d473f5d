//! `skiagraph bound`.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;

use super::output_arguments::OutputArguments;
use super::progress::TerminalProgress;
use super::scenario_arguments::ScenarioArguments;
use super::volume::Volume;
use super::{CommandError, output};
use crate::bound::{BoundOptions, BoundReport, BoundScene, SourceBound, bound, write_bound};
use crate::common::ExperimentError;
use skiagraph_set::{SetPlace, is_set};

/// Most lines of what the cameras cannot see, and of markers.
const MOST_LINES: usize = 12;

/// Compute the least error that any tracker can have with these cameras
///
/// From the outlines of the tracker's body in every frame of the truth, and the deviation and correlation length of
/// their noise, follows the Fisher information about the pose, and from it the least mean error of an unbiased
/// estimate (the Cramér-Rao bound): of the frame alone, and of a filter that knows the start pose and the spread of the
/// motion. Both means leave out frame 0, as the errors of runs do: its pose is given. Keypoints are treated in the same
/// way if the scenario or set has them. Angles and directions that the cameras cannot see are listed by name. --run
/// says how near a tracker comes. A biased tracker, such as one whose prior holds for this motion, can have a smaller
/// error than the bound of the frame alone. SCENARIO may be the directory of a benchmark set.
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  skiagraph bound scenarios/walk.toml rig.ring.count=2\n  \
                        skiagraph bound sets/walk --run runs/walk --out bounds/walk\n  \
                        skiagraph bound sets/walk --outline-px 2 --correlation-px 8 --json")]
pub(super) struct Arguments {
    #[command(flatten)]
    scenario: ScenarioArguments,

    /// Directory of the complete set, if SCENARIO is a set that was rendered with --truth
    #[arg(long, value_name = "DIR")]
    truth: Option<PathBuf>,

    /// Measured run to compare with the bound
    #[arg(long, value_name = "RUN")]
    run: Option<PathBuf>,

    /// Standard deviation of the outline's error [default: that of the scenario or set]
    #[arg(long, value_name = "PX", value_parser = positive)]
    outline_px: Option<f64>,

    /// Length along the outline over which that error is correlated: the integral of its correlation
    #[arg(long, value_name = "PX", value_parser = positive)]
    correlation_px: Option<f64>,

    /// Compute every Nth frame only
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    every: u32,

    /// Folder for bound.json and a page with the bound over time
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,

    #[command(flatten)]
    output: OutputArguments,
}

pub(super) fn positive(text: &str) -> Result<f64, String> {
    let number: f64 = text.parse().map_err(|_| "expected a number".to_owned())?;
    if number > 0.0 && number <= 1000.0 {
        Ok(number)
    } else {
        Err("expected a number above 0, at most 1000".to_owned())
    }
}

/// The noise of outlines, if it is given: their deviation and correlation length in pixels.
pub(super) fn outline_px(deviation: Option<f64>, length: Option<f64>) -> Result<Option<[f64; 2]>, ExperimentError> {
    let (argument, detail) = match (deviation, length) {
        (Some(deviation), Some(length)) => return Ok(Some([deviation, length])),
        (None, None) => return Ok(None),
        (Some(_), None) => (
            "--outline-px",
            "expected --correlation-px too: the length along the outline over which its error stays about the same; 1 if \
             every pixel errs on its own, about 8 for segmented images",
        ),
        (None, Some(_)) => {
            ("--correlation-px", "expected --outline-px too: the standard deviation of the outline's error, in pixels")
        }
    };
    Err(ExperimentError::Argument { argument, detail: detail.to_owned() })
}

pub(super) fn scene(
    arguments: &ScenarioArguments,
    truth: Option<&std::path::Path>,
) -> Result<BoundScene, CommandError> {
    let Some(set) = arguments.file().filter(|path| is_set(path)) else {
        if truth.is_some() {
            let detail = "only for the folder of a set; a scenario has its truth".to_owned();
            return Err(ExperimentError::Argument { argument: "--truth", detail }.into());
        }
        let file = arguments.open()?;
        let scene = BoundScene::of_scenario(&file, arguments.mocap_directory().as_deref());
        return Ok(scene.map_err(|e| e.about(&file.origin))?);
    };
    if arguments.has_overrides() {
        let detail = "a set cannot be changed by KEY=VALUE; give its scenario instead".to_owned();
        return Err(ExperimentError::Argument { argument: "KEY=VALUE", detail }.into());
    }
    Ok(BoundScene::of_set(SetPlace { folder: set, truth })?)
}

pub(super) fn run(arguments: &Arguments, volume: Volume) -> Result<ExitCode, CommandError> {
    let outline_px = outline_px(arguments.outline_px, arguments.correlation_px)?;
    let scene = scene(&arguments.scenario, arguments.truth.as_deref())?;
    let options = BoundOptions { outline_px, every: arguments.every as usize, run: arguments.run.as_deref() };
    let progress = TerminalProgress::new(volume);
    let report = bound(&scene, options, &progress)?;
    drop(progress);
    if let Some(path) = &arguments.out {
        write_bound(&report, arguments.output.destination(path))?;
        volume.written(path);
    }
    output::print_as(arguments.output.json, &report, describe)?;
    if !arguments.output.json {
        volume.notes(&report.notes);
    }
    Ok(ExitCode::SUCCESS)
}

fn describe(report: &BoundReport) -> String {
    let mut lines = vec![format!(
        "{}: {} frames at {} Hz, {}",
        report.name,
        report.frames,
        report.frames_per_second,
        output::counted(report.cameras.len(), "camera")
    )];
    for (index, source) in report.sources.iter().enumerate() {
        lines.push(describe_source(source));
        if let Some(run) = &report.run {
            let [alone, filter] = run.times_the_bound.get(index).copied().unwrap_or_default();
            lines.push(format!(
                "  {}: {:.1} mm, {alone:.1} times the bound of the frame alone, {filter:.1} times that of a filter",
                run.tracker, run.error_mm
            ));
        }
    }
    lines.join("\n")
}

fn describe_source(source: &SourceBound) -> String {
    let mut lines = vec![
        format!("\n{} ({})", source.source, source.noise),
        format!("  {:<20} {:>14} {:>10}", "least mean error, mm", "frame alone", "filter"),
        format!("  {:<20} {:>14.2} {:>10.2}", "mean", source.mean.alone_mm, source.mean.filtered_mm),
    ];
    let joint = |joint: &crate::bound::JointBound| {
        format!("  {:<20} {:>14.2} {:>10.2}", joint.joint, joint.bound.alone_mm, joint.bound.filtered_mm)
    };
    lines.extend(source.joints.iter().map(joint));
    if source.unseen.is_empty() {
        lines.push("  the cameras see every angle and place".to_owned());
    } else {
        lines.push("  the cameras cannot see:".to_owned());
        lines.extend(source.unseen.iter().take(MOST_LINES).map(|direction| format!("    {}", direction.describe())));
        let more = source.unseen.len().saturating_sub(MOST_LINES);
        lines.extend((more > 0).then(|| format!("    and {more} more; --json has all")));
    }
    lines.join("\n")
}
