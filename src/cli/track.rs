//! `skiagraph track`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;

use super::folders::expect_set;
use super::output_arguments::OutputArguments;
use super::program_arguments::{ProgramOptionArguments, command_line};
use super::progress::TerminalProgress;
use super::volume::Volume;
use super::{CommandError, output};
use crate::common::ExperimentError;
use crate::external::{Conformance, ExternalRecord, ProgramSettings};
use crate::runs::{TrackOptions, check_program, track_set, track_set_with_program};
use crate::scenario::{ScenarioError, TrackerSettings};
use skiagraph_core::body::Calibrated;
use skiagraph_set::is_public;

/// Run one tracker on a set, without access to the ground truth
///
/// Reads the set's cameras, observations and start pose. Only reference trackers such as oracle (the truth plus a
/// chosen error) read the ground truth.
///
/// --exec runs any program as the tracker: it reads JSON lines from standard input and answers on standard output
/// (docs/protocol.md). It is started once per seed in a fresh folder with the set's files except the ground truth. A
/// frame is lost if its answer is late or invalid; after a crash the program is restarted. The exit code is 1 if no
/// frame was answered. --dry-run sends five frames and reports whether the program follows the protocol.
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  skiagraph track sets/walk --tracker annealed_particle_filter --out runs/walk\n  \
                        skiagraph track sets/walk --tracker annealed_particle_filter particles=400 --seeds 5 --out runs/400\n  \
                        skiagraph track sets/walk --tracker annealed_particle_filter --calibrate --out runs/fitted\n  \
                        skiagraph track sets/walk --exec \"python my_tracker.py\" --dry-run\n  \
                        skiagraph track sets/walk --exec \"python my_tracker.py\" --seeds 5 --out runs/mine\n  \
                        skiagraph track sets/walk --exec \"python my_tracker.py\" --sandbox --readable my_tracker.py --out runs/mine")]
pub(super) struct Arguments {
    /// Directory of the benchmark set
    #[arg(value_name = "SET")]
    set: PathBuf,

    /// Overrides of the tracker's settings; settings of the program with --exec
    #[arg(value_name = "KEY=VALUE")]
    overrides: Vec<String>,

    /// Tracker: annealed_particle_filter, keypoints, gpdm, switching_gpdm, gpdm_graph, frozen, nearest_training_pose or
    /// oracle; or use --exec
    #[arg(long, value_name = "NAME", conflicts_with = "exec")]
    tracker: Option<String>,

    /// Program to run as the tracker: a shell command line
    #[arg(long, value_name = "COMMAND", value_parser = command_line)]
    exec: Option<String>,

    /// Send the program five frames and report whether it follows the protocol (exit code 1 if not); writes nothing
    #[arg(long, requires = "exec", conflicts_with = "tracker")]
    dry_run: bool,

    #[command(flatten)]
    options: ProgramOptionArguments,

    /// First random seed
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u32,

    /// Number of seeds
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    seeds: u32,

    /// Whether to calibrate the tracker's body and the cameras' poses at the beginning of the video, or one of them
    /// [default: the set's setting]
    ///
    /// Lengths, girths, joint positions and one offset in mm added to all radii (with a skin: along its normals) are
    /// estimated together with the poses of 20 frames, 1/15 s apart, from the beginning (fewer in a short video). The
    /// calibrated body is used only if the energy of the next 10 such frames is at least 10 % lower.
    #[arg(long, value_name = "body|cameras|both|false", num_args = 0..=1, default_missing_value = "both", conflicts_with = "exec")]
    calibrate: Option<Calibrated>,

    /// A camera whose images the tracker does not get; may be repeated. On a recording, evaluate measures the overlap
    /// there apart
    #[arg(long, value_name = "CAMERA", conflicts_with = "exec")]
    leave_out: Vec<String>,

    /// Output directory of the run; replaced if it holds output of the same command
    ///
    /// With several seeds, finished seeds are kept in RUN.partial until all are done; the same command resumes after an
    /// interruption.
    #[arg(long, value_name = "RUN", required_unless_present = "dry_run", conflicts_with = "dry_run")]
    out: Option<PathBuf>,

    #[command(flatten)]
    output: OutputArguments,

    /// Neither keep finished seeds nor resume: for callers whose program is not what the command line says
    #[arg(long, requires = "exec", hide = true)]
    anew: bool,
}

pub(super) fn run(arguments: &Arguments, volume: Volume) -> Result<ExitCode, CommandError> {
    expect_set(&arguments.set)?;
    arguments.options.check(arguments.tracker.as_deref(), arguments.exec.as_deref())?;
    let first = u64::from(arguments.seed);
    let seeds: Vec<u64> = (first..first + u64::from(arguments.seeds)).collect();
    match (&arguments.exec, &arguments.out) {
        (Some(command), None) => run_dry(arguments, command, volume),
        (Some(command), Some(out)) => run_program(arguments, command, &seeds, out, volume),
        (None, out) => run_tracker(arguments, &seeds, out.as_deref().unwrap_or(&PathBuf::new()), volume),
    }
}

fn run_tracker(arguments: &Arguments, seeds: &[u64], out: &Path, volume: Volume) -> Result<ExitCode, CommandError> {
    let settings = TrackerSettings::named(arguments.tracker.as_deref().unwrap_or_default())
        .and_then(|settings| settings.overridden(&arguments.overrides))
        .map_err(ScenarioError::from)?;
    let progress = TerminalProgress::new(volume);
    let to = arguments.output.destination(out);
    let options = TrackOptions { calibrate: arguments.calibrate, leave_out: &arguments.leave_out };
    let tracked =
        track_set(&arguments.set, &settings, seeds, options, to, &progress).map_err(|e| e.about(&arguments.set))?;
    drop(progress);
    volume.written(out);
    if arguments.output.json {
        output::print_json(&tracked.record)?;
    } else if let Some(record) = &tracked.record {
        let frames = tracked.estimates.frames();
        let learned = record.learned_from.join("; ");
        let learned = if learned.is_empty() { learned } else { format!("\n  learned from: {learned}") };
        output::print(&format!(
            "{}: {} on {frames} frames, {}, {:.1} frames a second{learned}\n{}",
            out.display(),
            settings.name(),
            output::counted(seeds.len(), "seed"),
            record.timing.frames_per_second,
            arguments.how_to_measure(out),
        ))?;
    }
    Ok(ExitCode::SUCCESS)
}

impl Arguments {
    fn how_to_measure(&self, out: &Path) -> String {
        let truth = if is_public(&self.set) { " --truth DIR" } else { "" };
        format!("  measure it: skiagraph evaluate {} {}{truth}", self.set.display(), out.display())
    }

    fn program(&self, command: &str) -> Result<ProgramSettings, CommandError> {
        let program = TrackerSettings::Program(self.options.program(command));
        let refuse = |detail: String| ExperimentError::Argument { argument: "--exec", detail };
        match program.overridden(&self.overrides).map_err(ScenarioError::from)? {
            TrackerSettings::Program(program) => match program.unset_placeholder() {
                Some(message) => Err(refuse(message).into()),
                None => {
                    let hidden = self.out.iter().cloned().collect();
                    Ok(ProgramSettings { anew: self.anew, ..ProgramSettings::new(&program, hidden) })
                }
            },
            other => Err(refuse(format!("expected a program, found {}", other.name())).into()),
        }
    }
}

fn run_program(
    arguments: &Arguments,
    command: &str,
    seeds: &[u64],
    out: &Path,
    volume: Volume,
) -> Result<ExitCode, CommandError> {
    let progress = TerminalProgress::new(volume);
    let to = arguments.output.destination(out);
    let record = track_set_with_program(&arguments.set, &arguments.program(command)?, seeds, to, &progress)
        .map_err(|e| e.about(&arguments.set))?;
    drop(progress);
    volume.written(out);
    let answered = record.answers.poses > 0;
    if arguments.output.json {
        output::print_json(&record)?;
    } else {
        output::print(&summary(&record, seeds.len(), out))?;
        output::print(&if answered {
            arguments.how_to_measure(out)
        } else {
            "  no frame was answered with a pose, so there is nothing to measure; check the program with --dry-run"
                .to_owned()
        })?;
    }
    Ok(ExitCode::from(u8::from(!answered)))
}

/// Number of incidents printed; `program.json` has more.
const SHOWN_INCIDENTS: usize = 5;

fn summary(record: &ExternalRecord, seeds: usize, out: &Path) -> String {
    let name = record.name.as_deref().unwrap_or(&record.command);
    let (count, seeds) = (record.answers, output::counted(seeds, "seed"));
    let mut lines = vec![format!(
        "{}: {name}, {seeds}: {} frames with a pose, {} lost, {} failed, {:.1} frames a second",
        out.display(),
        count.poses,
        count.lost,
        count.failed,
        record.timing.frames_per_second
    )];
    lines.extend(incident_lines(record));
    lines.join("\n")
}

pub(super) fn incident_lines(record: &ExternalRecord) -> Vec<String> {
    let shown = record.incidents.iter().take(SHOWN_INCIDENTS);
    let mut lines: Vec<String> = shown.map(|incident| format!("  {}", incident.describe())).collect();
    let more = record.incidents.len().saturating_sub(SHOWN_INCIDENTS);
    lines.extend((more > 0).then(|| format!("  and {more} more in program.json")));
    lines
}

fn run_dry(arguments: &Arguments, command: &str, volume: Volume) -> Result<ExitCode, CommandError> {
    let progress = TerminalProgress::new(volume);
    let found =
        check_program(&arguments.set, &arguments.program(command)?, &progress).map_err(|e| e.about(&arguments.set))?;
    drop(progress);
    output::print_as(arguments.output.json, &found, describe)?;
    Ok(ExitCode::from(u8::from(!found.holds())))
}

fn describe(found: &Conformance) -> String {
    let name = found.name.as_deref().unwrap_or("the program");
    let verdict = if found.holds() { "follows the protocol" } else { "does not follow the protocol" };
    let mut lines = vec![format!("{name} {verdict}; {:.1} ms at most for a frame", found.slowest_ms)];
    lines.extend(
        found.checks.iter().map(|check| {
            format!("  {}  {}: {}", if check.holds { "ok    " } else { "FAILED" }, check.what, check.found)
        }),
    );
    lines.join("\n")
}
