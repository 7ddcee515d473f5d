//! `skiagraph render`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use clap::builder::PossibleValuesParser;
use serde_json::Value;

use super::output_arguments::OutputArguments;
use super::progress::TerminalProgress;
use super::scenario_arguments::ScenarioArguments;
use super::volume::Volume;
use super::{CommandError, output};
use crate::benchmark_set::{BenchmarkSet, BlindSet, is_set};
use crate::common::ExperimentError;
use crate::experiment::{KeySource, LadderProgress, RenderOptions, render_with};
use crate::observation::{AXES, CorruptionAxis, KEYPOINT_AXES, KeypointAxis};
use crate::rng::{KeyError, ObservationKey};
use crate::scenario::ScenarioFile;

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
                        skiagraph render scenarios/walk.toml layers='[\"depth\"]' --shards 8 --out sets/training\n  \
                        skiagraph render scenarios/walk.toml observation.silhouette=corrupted boundary_px=2 --out sets/rough\n  \
                        skiagraph render scenarios/walk.toml --ladder boundary_px --levels 0,1,2,4 --out sets/ladder\n  \
                        skiagraph render scenarios/walk.toml observation.keypoints.layout=halpe26 --ladder keypoints.slow_percent --out sets/noisy")]
pub(super) struct Arguments {
    #[command(flatten)]
    scenario: ScenarioArguments,

    /// Output directory of the set; an existing set is replaced only with --force, which moves output of another
    /// command aside, to SET~
    #[arg(long, value_name = "SET")]
    out: PathBuf,

    /// Keep the ground truth separate: write the complete set, for skiagraph evaluate, to DIR and the set without
    /// ground truth to --out
    #[arg(long, value_name = "DIR", conflicts_with = "ladder")]
    truth: Option<PathBuf>,

    /// Store silhouettes and truth images in N tar shards each instead of single files:
    /// SET/observations/shards/NNNNNN.tar for trackers, and SET/truth/shards/NNNNNN.tar for WebDataset, with one sample
    /// per frame and camera: mask, camera, joints, markers and truth images
    #[arg(long, value_name = "N")]
    shards: Option<usize>,

    /// Secret key of the observations' random numbers: 32 hexadecimal digits, or "default" for the public key. Defaults
    /// to the scenario's observation.key. If there is none, and the set has random errors that trackers must not
    /// know or --truth is given, a fresh key is drawn and stored in SET/truth/key.txt
    #[arg(long, value_name = "HEX", value_parser = key_named)]
    key: Option<ObservationKey>,

    /// Make one set per level of a corruption or of an error of keypoints, SET/AXIS-LEVEL. All sets share one key, so
    /// they differ only in the level
    #[arg(long, value_name = "AXIS", value_parser = PossibleValuesParser::new(ladder_names()))]
    ladder: Option<String>,

    /// Levels of the ladder, in the unit of its axis [default: five levels from mild to severe]
    #[arg(long, value_name = "LEVEL,...", value_delimiter = ',', requires = "ladder")]
    levels: Vec<f64>,

    #[command(flatten)]
    output: OutputArguments,
}

/// What `--ladder` varies.
struct RenderedLadder {
    name: String,
    unit: &'static str,
    levels: [f64; 5],
    /// The key of its strength.
    key: String,
    /// A setting that the axis needs.
    needs: Option<&'static str>,
}

/// Precedes the names of axes of keypoints.
const OF_KEYPOINTS: &str = "keypoints.";

fn ladder_names() -> Vec<&'static str> {
    let keypoints = KEYPOINT_AXES.iter().map(|axis| axis.ladder_name);
    AXES.iter().map(|axis| axis.name).chain(keypoints).collect()
}

impl RenderedLadder {
    fn named(name: &str) -> Option<Self> {
        let named = |unit, levels, key: String, needs| Self { name: name.to_owned(), unit, levels, key, needs };
        if let Some(key) = name.strip_prefix(OF_KEYPOINTS) {
            let axis = KeypointAxis::named(key)?;
            return Some(named(axis.unit, axis.levels, format!("observation.{name}"), None));
        }
        let axis = CorruptionAxis::named(name)?;
        let needs = axis.of_masks.then_some("observation.silhouette=\"corrupted\"");
        Some(named(axis.unit, axis.levels, format!("observation.corruption.{name}"), needs))
    }
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
    match arguments.ladder.as_deref().and_then(RenderedLadder::named) {
        None => {
            let (_, made) =
                one_set(arguments, (&arguments.scenario.open()?, &arguments.out), source(arguments), volume)?;
            if arguments.output.json {
                output::print_json(&made)?;
            }
        }
        Some(axis) => ladder(arguments, &axis, volume)?,
    }
    Ok(ExitCode::SUCCESS)
}

fn source(arguments: &Arguments) -> KeySource {
    arguments.key.map_or(KeySource::Fresh, KeySource::Given)
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

/// Makes one set per level. All scenarios are read before the first set is made.
fn ladder(arguments: &Arguments, axis: &RenderedLadder, volume: Volume) -> Result<(), CommandError> {
    let levels = if arguments.levels.is_empty() { &axis.levels[..] } else { &arguments.levels };
    let of_level = |level: &f64| {
        let strength = format!("{}={level:?}", axis.key);
        let more = axis.needs.map(str::to_owned).into_iter().chain([strength]).collect();
        let file = arguments.scenario.open_with(more)?;
        Ok((file, arguments.out.join(format!("{}-{level}", axis.name))))
    };
    let sets = levels.iter().map(of_level).collect::<Result<Vec<_>, ExperimentError>>()?;
    let mut progress = LadderProgress::read(&arguments.out, &axis.name);
    let (key, note) = progress.settle_key(source(arguments), &sets)?;
    volume.notes(note.as_slice());
    for (file, place) in &sets {
        let is_others = is_set(place) && !progress.has(file, arguments.shards, place)?;
        if is_others && !arguments.output.destination(place).force {
            return Err(ExperimentError::SetThere { path: place.clone() }.into());
        }
    }
    let mut made = Vec::with_capacity(sets.len());
    for (file, place) in &sets {
        if progress.has(file, arguments.shards, place)? {
            let note = format!("{}: already made before the interruption", place.display());
            volume.notes(std::slice::from_ref(&note));
            made.push(report_set(arguments, place, &BlindSet::read(place).map_err(ExperimentError::from)?, &[note])?);
            continue;
        }
        let (blind, summary) = one_set(arguments, (file, place), KeySource::Given(key), volume)?;
        progress.add(file, arguments.shards, &blind.set_hash)?;
        made.push(summary);
    }
    progress.finish()?;
    if arguments.output.json {
        let (name, unit) = (&axis.name, axis.unit);
        let ladder = serde_json::json!({ "schema": "skiagraph.ladder/1", "axis": name, "unit": unit, "levels": levels, "sets": made });
        output::print_json(&ladder)?;
    }
    Ok(())
}

/// Makes a set; prints its summary, or returns it as an object.
fn one_set(
    arguments: &Arguments,
    (file, place): (&ScenarioFile, &Path),
    key: KeySource,
    volume: Volume,
) -> Result<(BlindSet, Value), CommandError> {
    let progress = TerminalProgress::new(volume);
    let to = arguments.output.destination(place);
    let options = RenderOptions { whole: arguments.truth.as_deref(), shards: arguments.shards, key };
    let (BenchmarkSet { blind, .. }, notes) =
        render_with(file, arguments.scenario.mocap_directory().as_deref(), to, &options, &progress)
            .map_err(|e| e.about(&file.origin))?;
    drop(progress);
    volume.notes(&notes);
    volume.written(place);
    let Some(truth) = &arguments.truth else {
        let summary = report_set(arguments, place, &blind, &notes)?;
        return Ok((blind, summary));
    };
    // the two sets have one set hash, but different files
    let public = BlindSet::read(place).map_err(ExperimentError::from)?;
    let mut summary = report_set(arguments, place, &public, &notes)?;
    if !arguments.output.json {
        output::print(&format!("{}: the same set with its truth, full hash {}", truth.display(), blind.full_hash))?;
    }
    summary["truth"] = serde_json::json!({ "set": truth.to_string_lossy(), "full_hash": blind.full_hash });
    Ok((public, summary))
}

/// Prints the summary of a set unless `--json` is given, and returns it as an object.
fn report_set(arguments: &Arguments, place: &Path, blind: &BlindSet, notes: &[String]) -> Result<Value, CommandError> {
    let (place, frames, cameras) = (place.display(), blind.frame_count, blind.rig.cameras.len());
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
