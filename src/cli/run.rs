//! `skiagraph run`.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;

use super::output_arguments::OutputArguments;
use super::program_arguments::TrackerArguments;
use super::progress::TerminalProgress;
use super::scenario_arguments::ScenarioArguments;
use super::track::incident_lines;
use super::volume::Volume;
use super::{CommandError, output, parameters, summary};
use crate::common::{ExperimentError, read_file};
use crate::external::{EXTERNAL_FILE, ExternalRecord};
use crate::measure::REPORT_FILE;
use crate::runs::{COMPARISON_PAGE, RunPlace, compare, run as run_experiment};
use skiagraph_core::input::{foreign, limits};

/// Render, track, evaluate and report in one step
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  skiagraph run\n  skiagraph run scenarios/walk.toml --seeds 5\n  \
                        skiagraph run scenarios/walk.toml particles=400 --out runs/400\n  \
                        skiagraph run scenarios/cmu/walk4.toml --mocap-dir ~/cmu tracker_body.mismatch=none\n  \
                        skiagraph run scenarios/walk.toml tracker.frozen={}\n  \
                        skiagraph run scenarios/walk.toml --exec \"python3 mine.py\"\n  \
                        skiagraph run scenarios/walk.toml --exec \"python3 mine.py --alpha {alpha}\" alpha=0.1 --name mine\n  \
                        skiagraph run scenarios/walk.toml --exec ./a --exec ./b --name a --name b --tracker frozen\n  \
                        echo '{\"particles\": 50}' | skiagraph run scenarios/walk.toml --params-json - --json")]
pub(super) struct Arguments {
    #[command(flatten)]
    scenario: ScenarioArguments,

    #[command(flatten)]
    trackers: TrackerArguments,

    /// More overrides as a JSON object such as {"particles": 50}: the object itself, a file, or - for standard input
    #[arg(long, value_name = "FILE")]
    params_json: Option<PathBuf>,

    /// First random seed, overriding the scenario
    #[arg(long, value_name = "N")]
    seed: Option<u32>,

    /// Number of seeds, overriding the scenario
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    seeds: Option<u32>,

    /// Output directory; replaced if it holds output of the same scenario and settings [default: runs/NAME, or
    /// runs/NAME-2 and so on if runs/NAME holds results of another scenario or of other settings]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,

    #[command(flatten)]
    output: OutputArguments,
}

pub(super) fn run(arguments: &Arguments, volume: Volume) -> Result<ExitCode, CommandError> {
    let mut more = arguments.params_json.as_deref().map(parameters::read).transpose()?.unwrap_or_default();
    more.extend(arguments.seed.map(|seed| format!("seed={seed}")));
    more.extend(arguments.seeds.map(|seeds| format!("seeds={seeds}")));
    let file = arguments.scenario.open_tracked_by(&arguments.trackers, more)?;
    let RunPlace { path: out, note } = RunPlace::new(&file.scenario, arguments.out.as_deref())?;
    let progress = TerminalProgress::new(volume);
    let (to, mocap) = (arguments.output.destination(&out), arguments.scenario.mocap_directory());
    if file.scenario.methods.is_empty() {
        let done = run_experiment(&file, mocap.as_deref(), to, &progress).map_err(|e| e.about(&file.origin))?;
        drop(progress);
        volume.notes(&done.notes);
        volume.notes(note.as_slice());
        volume.written(&out);
        let page = out.join(REPORT_FILE);
        let told = |record: &_| format!("{}\n\n  report: {}", summary::table(record), page.display());
        output::print_as(arguments.output.json, &done.record, told)?;
        return told_of_programs(&[out], volume);
    }
    let done = compare(&file, mocap.as_deref(), to, &progress).map_err(|e| e.about(&file.origin))?;
    drop(progress);
    volume.notes(&done.notes);
    volume.notes(note.as_slice());
    volume.written(&out);
    let page = out.join(COMPARISON_PAGE);
    let told = |comparison: &_| format!("{}\n\n  report: {}", summary::methods(comparison), page.display());
    output::print_as(arguments.output.json, &done.comparison, told)?;
    let folders: Vec<PathBuf> = file.scenario.methods.keys().map(|name| out.join(name)).collect();
    told_of_programs(&folders, volume)
}

/// Notes the incidents of programs that were run; exit code 1 if one of them answered no frame with a pose.
fn told_of_programs(folders: &[PathBuf], volume: Volume) -> Result<ExitCode, CommandError> {
    let mut answered = true;
    for folder in folders.iter().filter(|folder| folder.join(EXTERNAL_FILE).is_file()) {
        let path = folder.join(EXTERNAL_FILE);
        let malformed = |e| ExperimentError::Malformed { path: path.clone(), detail: foreign(e) };
        let record: ExternalRecord = serde_json::from_slice(&read_file(&path, limits::RECORD)?).map_err(malformed)?;
        let lines = incident_lines(&record);
        if !lines.is_empty() {
            let name = record.name.as_deref().unwrap_or(&record.command);
            volume.notes(&[format!("{name}: {} frames failed\n{}", record.answers.failed, lines.join("\n"))]);
        }
        answered &= record.answers.poses > 0;
    }
    Ok(ExitCode::from(u8::from(!answered)))
}
