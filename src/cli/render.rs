//! `skiagraph render`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use serde_json::Value;

use super::output_arguments::OutputArguments;
use super::progress::TerminalProgress;
use super::scenario_arguments::ScenarioArguments;
use super::volume::Volume;
use super::{CommandError, output};
use crate::common::ExperimentError;
use crate::rendering::{KeySource, RenderOptions, render_with};
use skiagraph_core::rng::{KeyError, ObservationKey};
use skiagraph_set::{BenchmarkSet, BlindSet};

/// Make a benchmark set on disk
///
/// Frames are drawn and written one by one, so memory use does not grow with their number. If rendering is interrupted
/// (Ctrl-C, a killed process, a full disk), finished files stay in SET.partial and the same command resumes; the result
/// has the same bytes as without the interruption. Resuming with other settings is refused; --force starts again.
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  skiagraph render scenarios/walk.toml --out sets/walk\n  \
                        skiagraph render scenarios/walk.toml rig.ring.count=8 --out sets/walk8\n  \
                        skiagraph render scenarios/walk.toml calibration_mm=20 --key default --out sets/same-for-all\n  \
                        skiagraph render scenarios/walk.toml --out public/walk --truth secret/walk\n  \
                        skiagraph render scenarios/walk.toml truth_images='[\"depth\"]' --out sets/training\n  \
                        skiagraph render scenarios/walk.toml observation.silhouette=corrupted boundary_px=2 --out sets/rough")]
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

    /// Secret key of the observations' random numbers: 32 hexadecimal digits, or "default" for the public key. Defaults
    /// to the scenario's observation.key. If there is none, and the set has random errors that trackers must not
    /// know or --truth is given, a fresh key is drawn and stored in SET/truth/key.txt
    #[arg(long, value_name = "HEX", value_parser = key_named)]
    key: Option<ObservationKey>,

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
        render_with(&file, arguments.scenario.mocap_directory().as_deref(), to, &options, &progress)
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
