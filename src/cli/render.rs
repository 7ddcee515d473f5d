//! `skiagraph render`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use serde_json::Value;

use super::output_arguments::OutputArguments;
use super::progress::TerminalProgress;
use super::scenario_arguments::ScenarioArguments;
use super::sweep::{Definition, PartOf, jobs_or_all_cores};
use super::volume::Volume;
use super::{CommandError, output};
use crate::artefacts::ArtefactError;
use crate::common::ExperimentError;
use crate::rendering::{KeySource, RenderOptions, render};
use crate::sweep::{Collected, CollectionOptions, SweepFile, make_sets};
use skiagraph_core::rng::{KeyError, ObservationKey};
use skiagraph_set::{BenchmarkSet, BlindSet};

/// Make a benchmark set, or all sets of a sweep
///
/// Frames are drawn and written one by one, so memory use does not grow with their number. If rendering is interrupted
/// (Ctrl-C, a killed process, a full disk), finished files stay in SET.partial and the same command resumes; the result
/// has the same bytes as without the interruption. Resuming with other settings is refused; --force starts again.
///
/// A sweep file makes a set for every different scene, one on each core, with a key of its own if its errors are
/// random: --out gets sets/ID, sets.csv, croissant.json, and lists of the sets of every split. Sets that are there are
/// kept, so the same command resumes; skiagraph sweep run DIR then tracks them. With --truth, the plan is in that
/// folder, and public sets have other names.
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  skiagraph render scenarios/walk.toml --out sets/walk\n  \
                        skiagraph render scenarios/walk.toml rig.ring.count=8 --out sets/walk8\n  \
                        skiagraph render scenarios/walk.toml calibration_mm=20 --key default --out sets/same-for-all\n  \
                        skiagraph render scenarios/walk.toml --out public/walk --truth secret/walk\n  \
                        skiagraph render scenarios/walk.toml truth_images='[\"depth\"]' --out sets/training\n  \
                        skiagraph render scenarios/walk.toml observation.silhouette=corrupted boundary_px=2 --out sets/rough\n  \
                        skiagraph render scenarios/sweeps/training.toml --out training\n  \
                        skiagraph render scenarios/sweeps/training.toml --out training --part $SLURM_ARRAY_TASK_ID/20 -j 1\n\n\
                        Exit code 1: some scenes of a sweep cannot be rendered.")]
pub(super) struct Arguments {
    #[command(flatten)]
    scenario: ScenarioArguments,

    /// Output directory of the set; an existing set is replaced only with --force, which moves output of another
    /// command aside, to SET~
    #[arg(long, value_name = "SET")]
    out: PathBuf,

    /// Keep the ground truth separate: write the complete set, for skiagraph evaluate, to DIR and the set without
    /// ground truth to --out
    #[arg(long, value_name = "DIR")]
    truth: Option<PathBuf>,

    /// Secret key of the observations' random numbers, of a sweep that of all its sets: 32 hexadecimal digits, or
    /// "default" for the public key. Defaults to the scenario's observation.key. If there is none, and the set has
    /// random errors that trackers must not know or --truth is given, a fresh key is drawn and stored in
    /// SET/truth/key.txt
    #[arg(long, value_name = "HEX", value_parser = key_named)]
    key: Option<ObservationKey>,

    /// Of a sweep, make only part K of M, from 1. Parts may be made at the same time on machines that share --out
    #[arg(long, value_name = "K/M")]
    part: Option<PartOf>,

    /// Of a sweep, parallel jobs, each on one core [default: all cores]
    #[arg(short, long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,

    #[command(flatten)]
    output: OutputArguments,
}

fn key_named(text: &str) -> Result<ObservationKey, String> {
    match text {
        "default" => Ok(ObservationKey::PUBLIC),
        digits => digits.parse().map_err(|e: KeyError| format!("{e}, and no \"default\"")),
    }
}

pub(super) fn run(arguments: &Arguments, volume: Volume) -> Result<ExitCode, CommandError> {
    if let Some(truth) = &arguments.truth {
        check_apart(&arguments.out, truth)?;
    }
    if arguments.scenario.file().is_some_and(SweepFile::is_one) {
        return all_sets(arguments, volume);
    }
    let of_sweep = [("--part", arguments.part.is_some()), ("--jobs", arguments.jobs.is_some())];
    if let Some((argument, _)) = of_sweep.into_iter().find(|(_, given)| *given) {
        let detail = "expected a sweep file, found a scenario, which is one set".to_owned();
        return Err(ExperimentError::Argument { argument, detail }.into());
    }
    let made = one_set(arguments, volume)?;
    if arguments.output.json {
        output::print_json(&made)?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Refuses a truth directory that equals the other set's, contains it or lies within it.
fn check_apart(out: &Path, truth: &Path) -> Result<(), ExperimentError> {
    let whole = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let (public, complete) = (whole(out), whole(truth));
    if !public.starts_with(&complete) && !complete.starts_with(&public) {
        return Ok(());
    }
    let detail = format!(
        "expected a directory that neither contains nor lies within that of --out, found {} and --out {}",
        truth.display(),
        out.display()
    );
    Err(ExperimentError::Argument { argument: "--truth", detail })
}

/// Makes the set; prints its summary, or returns it as an object.
fn one_set(arguments: &Arguments, volume: Volume) -> Result<Value, CommandError> {
    let file = arguments.scenario.open()?;
    let progress = TerminalProgress::new(volume);
    let to = arguments.output.destination(&arguments.out);
    let key = arguments.key.map_or(KeySource::Fresh, KeySource::Given);
    let options = RenderOptions { whole: arguments.truth.as_deref(), key };
    let (BenchmarkSet { blind, .. }, notes) =
        render(&file, arguments.scenario.mocap_directory().as_deref(), to, &options, &progress)
            .map_err(|e| e.about(&file.origin))?;
    drop(progress);
    volume.notes(&notes);
    volume.written(&arguments.out);
    let Some(truth) = &arguments.truth else { return report_set(arguments, &blind, &notes) };
    // the two sets have one set hash, but different files
    let public = BlindSet::read(&arguments.out).map_err(ExperimentError::from)?;
    let mut summary = report_set(arguments, &public, &notes)?;
    if !arguments.output.json {
        output::print(&format!("{}: the same set with its truth, full hash {}", truth.display(), blind.full_hash))?;
    }
    summary["truth"] = serde_json::json!({ "set": truth.to_string_lossy(), "full_hash": blind.full_hash });
    Ok(summary)
}

fn all_sets(arguments: &Arguments, volume: Volume) -> Result<ExitCode, CommandError> {
    if arguments.output.destination(&arguments.out).force {
        let detail = "expected no --force with a sweep, whose sets are kept; give another --out, or change the plan with \
                      skiagraph sweep plan --extend";
        return Err(ExperimentError::Argument { argument: "--force", detail: detail.to_owned() }.into());
    }
    let definition = Definition {
        file: arguments.scenario.file().map(Path::to_owned),
        assignments: arguments.scenario.assignments(),
        mocap_dir: arguments.scenario.mocap_directory(),
        ..Definition::default()
    };
    let draft = definition.draft()?;
    let progress = TerminalProgress::new(volume);
    let options = CollectionOptions {
        whole: arguments.truth.as_deref(),
        key: arguments.key.map_or(KeySource::Fresh, KeySource::Given),
        jobs: jobs_or_all_cores(arguments.jobs),
        part: arguments.part.map(|PartOf { part, parts }| [part, parts]),
    };
    let made = make_sets(&draft, &arguments.out, options, &progress);
    drop(progress);
    let out = &arguments.out;
    let made = made.map_err(|error| match error {
        ExperimentError::Interrupted => ArtefactError::ProgressSaved { partial: out.clone() }.into(),
        other => other,
    })?;
    volume.notes(&made.notes);
    volume.written(out);
    if arguments.output.json {
        output::print_json(&serde_json::json!({
            "schema": "skiagraph.render_sweep/1",
            "out": out,
            "sets": made.sets,
            "made": made.made,
            "left": made.left,
            "splits": made.splits,
            "failed": made.failed.iter().map(|(axes, error)| serde_json::json!({ "axes": axes, "error": error })).collect::<Vec<_>>(),
            "notes": made.notes,
        }))?;
    } else {
        output::print(&describe_sets(&made, out))?;
    }
    Ok(if made.failed.is_empty() { ExitCode::SUCCESS } else { ExitCode::from(1) })
}

fn describe_sets(made: &Collected, out: &Path) -> String {
    let place = out.display();
    let there = made.sets - made.left - made.failed.len() - made.made;
    let mut text = format!("{place}: {} of {} made, {there} were there", made.made, output::counted(made.sets, "set"));
    if !made.failed.is_empty() {
        text.push_str(&format!(", {} cannot be rendered (see failed/ID.txt)", made.failed.len()));
    }
    if made.left > 0 {
        return format!("{text}; {} missing, of other parts; tables follow when all are there", made.left);
    }
    let splits =
        made.splits.iter().map(|(name, count)| format!("\n  {place}/{name}.txt: {}", output::counted(*count, "set")));
    format!("{text}\n  table: {place}/sets.csv{}", splits.collect::<String>())
}

/// Prints the summary of a set unless `--json` is given, and returns it as an object.
fn report_set(arguments: &Arguments, blind: &BlindSet, notes: &[String]) -> Result<Value, CommandError> {
    let (place, frames, cameras) = (arguments.out.display(), blind.frame_count, blind.rig.cameras.len());
    if !arguments.output.json {
        output::print(&format!(
            "{place}: {frames} frames of {cameras} cameras, set hash {}, full hash {}",
            blind.set_hash, blind.full_hash
        ))?;
    }
    Ok(serde_json::json!({
        "schema": "skiagraph.render/1",
        "set": place.to_string(),
        "set_hash": blind.set_hash,
        "full_hash": blind.full_hash,
        "frames": frames,
        "frames_per_second": blind.frames_per_second,
        "cameras": cameras,
        "observation": blind.observation,
        "notes": notes,
    }))
}
