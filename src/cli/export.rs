//! `skiagraph export`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use clap::builder::PossibleValue;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use serde_json::json;

use super::folders::expect_set;
use super::output_arguments::OutputArguments;
use super::progress::TerminalProgress;
use super::volume::Volume;
use super::{CommandError, output};
use crate::common::ExperimentError;
use crate::export::{ExportTo, export_set};
use skiagraph_set::SetPlace;

/// Write a benchmark set in other tools' formats
///
/// Each format's folder has a README.txt that states axes, units and omissions. Exports contain the ground truth: use
/// them for evaluation, not as tracker input. Only openpose, pose2sim, anipose and caliscope (the keypoints of a set
/// with `[observation.keypoints]`), opencv and humaneva (cameras) and video contain just what trackers are given; they
/// need no truth, so a public set suffices. This project's tests read each format back with the format's own reader.
///
/// An earlier export is replaced by one of the same set to the same format; any other is kept and the new one refused.
#[derive(Args, Debug)]
#[command(
    after_help = "Examples:\n  skiagraph export sets/walk --to coco                    # into sets/walk-coco\n  \
                        skiagraph export sets/walk --to opencv,c3d,bvh --out exported    # exported/opencv and so on\n  \
                        skiagraph export sets/walk --to pose2sim                # a project that Pose2Sim runs\n  \
                        skiagraph export sets/walk --to video                   # MP4, by your ffmpeg"
)]
pub(super) struct Arguments {
    /// Directory of the set
    #[arg(value_name = "SET")]
    set: PathBuf,

    /// Directory of the complete set, for formats with the truth, if the set was rendered with --truth
    #[arg(long, value_name = "DIR")]
    truth: Option<PathBuf>,

    /// Formats, separated by commas
    #[arg(long, value_name = "FORMAT", required = true, value_delimiter = ',', value_parser = formats())]
    to: Vec<ExportTo>,

    /// Output directory; each of several formats gets a subdirectory [default: SET-FORMAT]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,

    #[command(flatten)]
    output: OutputArguments,
}

fn formats() -> impl TypedValueParser<Value = ExportTo> {
    let values = ExportTo::names().map(|(name, what)| PossibleValue::new(name).help(what));
    PossibleValuesParser::new(values).try_map(|name| ExportTo::named(&name).ok_or("no such format"))
}

pub(super) fn run(arguments: &Arguments, volume: Volume) -> Result<ExitCode, CommandError> {
    expect_set(&arguments.set)?;
    let set = SetPlace { folder: &arguments.set, truth: arguments.truth.as_deref() };
    let mut places = Vec::new();
    let mut formats: Vec<ExportTo> = Vec::new();
    for to in &arguments.to {
        if !formats.contains(to) {
            formats.push(*to);
        }
    }
    for to in &formats {
        let place = place(arguments, *to, formats.len())?;
        let progress = TerminalProgress::new(volume);
        export_set(set, *to, arguments.output.destination(&place), &progress).map_err(|e| e.about(&arguments.set))?;
        drop(progress);
        volume.written(&place);
        if !arguments.output.json {
            output::print(&format!("{}: {}", place.display(), to.name()))?;
        }
        places.push(json!({ "format": to.name(), "path": place.display().to_string() }));
    }
    if arguments.output.json {
        let set = arguments.set.display().to_string();
        output::print_json(&json!({ "schema": "skiagraph.export/1", "set": set, "exports": places }))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn place(arguments: &Arguments, to: ExportTo, formats: usize) -> Result<PathBuf, ExperimentError> {
    match &arguments.out {
        Some(out) if formats == 1 => Ok(out.clone()),
        Some(out) => Ok(out.join(to.name())),
        None => beside(&arguments.set, to.name()),
    }
}

fn beside(set: &Path, format: &str) -> Result<PathBuf, ExperimentError> {
    let name = set.file_name().ok_or_else(|| ExperimentError::Argument {
        argument: "--out",
        detail: format!("cannot derive an output directory from {}; give one", set.display()),
    })?;
    let mut name = name.to_owned();
    name.push(format!("-{format}"));
    Ok(set.with_file_name(name))
}
