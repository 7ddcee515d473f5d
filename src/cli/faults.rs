//! `skiagraph faults`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;

use super::folders::expect_set;
use super::output_arguments::OutputArguments;
use super::program_arguments::{ProgramOptionArguments, command_line};
use super::progress::TerminalProgress;
use super::volume::Volume;
use super::{CommandError, output};
use crate::artefacts::{Artefact, ArtefactKind};
use crate::common::ExperimentError;
use crate::faults::{fault_names, faults_markdown, faults_source, faults_text, plant_faults};
use crate::scenario::{ScenarioError, TrackerSettings};
use skiagraph_core::input::{self, hex_sha256, limits};
use skiagraph_set::BlindSet;

/// Plant faults in a set's cameras and observations, and show which of them a tracker notices
///
/// Runs the tracker without a fault, then once for every fault of the catalogue: exchanged cameras, a late camera,
/// millimetres for metres, left and right exchanged, and so on. The set itself and its truth are not changed. A fault
/// is SILENT if the estimates change at equal seeds and the tracker reports nothing: no error, no incident, no more
/// frames declared lost. Of a tracker that does not repeat its estimates at one seed, a change that this noise may
/// explain is undecided. docs/faults.md describes the faults and the words of the table.
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  skiagraph faults sets/walk --tracker keypoints\n  \
                        skiagraph faults sets/walk --tracker annealed_particle_filter particles=20 --only late-camera --only y-up\n  \
                        skiagraph faults sets/walk --exec \"python3 mine.py\" --seeds 3 --out faults.md\n  \
                        skiagraph faults --list\n\n\
                        Exit code 0 whatever is found, 2 for bad input.")]
pub(super) struct Arguments {
    /// Directory of the benchmark set
    #[arg(value_name = "SET", required_unless_present = "list")]
    set: Option<PathBuf>,

    /// Overrides of the tracker's settings; settings of the program with --exec
    #[arg(value_name = "KEY=VALUE")]
    overrides: Vec<String>,

    /// Built-in tracker, such as keypoints or annealed_particle_filter; or use --exec
    #[arg(long, value_name = "NAME", conflicts_with = "exec")]
    tracker: Option<String>,

    /// Program to run as the tracker: a shell command line
    #[arg(long, value_name = "COMMAND", value_parser = command_line)]
    exec: Option<String>,

    /// Plant only this fault; may be repeated
    #[arg(long, value_name = "FAULT")]
    only: Vec<String>,

    /// List the faults
    #[arg(long)]
    list: bool,

    #[command(flatten)]
    options: ProgramOptionArguments,

    /// First random seed
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u32,

    /// Number of seeds
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = clap::value_parser!(u32).range(1..=1000))]
    seeds: u32,

    /// Markdown file to write, with the same table; replaced only by the same command
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,

    #[command(flatten)]
    output: OutputArguments,
}

pub(super) fn run(arguments: &Arguments, volume: Volume) -> Result<ExitCode, CommandError> {
    let Some(set) = arguments.set.as_ref().filter(|_| !arguments.list) else {
        let lines: Vec<String> = fault_names().map(|(name, what)| format!("  {name:<19}  {what}")).collect();
        output::print(&lines.join("\n"))?;
        return Ok(ExitCode::SUCCESS);
    };
    expect_set(set)?;
    arguments.options.check(arguments.tracker.as_deref(), arguments.exec.as_deref())?;
    let settings = arguments.tracker()?;
    let blind = BlindSet::read(set).map_err(ExperimentError::from).map_err(|e| e.about(set))?;
    let first = u64::from(arguments.seed);
    let seeds: Vec<u64> = (first..first + u64::from(arguments.seeds)).collect();
    let source = faults_source(&blind.set_hash, &settings, &seeds, &arguments.only);
    // refused before the work
    let begin = |out: &Path| {
        Artefact::begin_unless(arguments.output.destination(out), ArtefactKind::File, other_table(out, &source))
    };
    let out = arguments.out.as_deref().map(begin).transpose()?;
    let progress = TerminalProgress::new(volume);
    let report = plant_faults(&blind, &settings, &seeds, &arguments.only, &progress).map_err(|e| e.about(set))?;
    drop(progress);
    if let (Some(path), Some(out)) = (&arguments.out, out) {
        out.put(faults_markdown(&report, &source).as_bytes())?;
        volume.written(path);
    }
    output::print_as(arguments.output.json, &report, faults_text)?;
    Ok(ExitCode::SUCCESS)
}

/// How the table in a file differs from that of this source; `None` if it is the same, or there is no file.
fn other_table(file: &Path, source: &str) -> Option<String> {
    let text = input::read_to_string(file, limits::RECORD).ok()?;
    let (first, body) = text.split_once('\n').unwrap_or((&text, ""));
    let what = if !first.contains(source) {
        "the set, the tracker, the seeds or the faults are others"
    } else if !first.contains(&hex_sha256(body.as_bytes())) {
        "the table was edited"
    } else {
        return None;
    };
    Some(what.to_owned())
}

impl Arguments {
    fn tracker(&self) -> Result<TrackerSettings, CommandError> {
        let tracker = match &self.exec {
            Some(command) => TrackerSettings::Program(self.options.program(command)),
            None => TrackerSettings::named(self.tracker.as_deref().unwrap_or_default()).map_err(ScenarioError::from)?,
        };
        let tracker = tracker.overridden(&self.overrides).map_err(ScenarioError::from)?;
        if let TrackerSettings::Program(program) = &tracker
            && let Some(detail) = program.unset_placeholder()
        {
            return Err(ExperimentError::Argument { argument: "--exec", detail }.into());
        }
        Ok(tracker)
    }
}
