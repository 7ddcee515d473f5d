//! `skiagraph segment`.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;

use super::output_arguments::OutputArguments;
use super::progress::TerminalProgress;
use super::volume::Volume;
use super::{CommandError, output};
use crate::segmentation::{SegmentInput, segment};
use skiagraph_truth::observing::{BackgroundSettings, Cleaning};

/// Extract silhouettes from camera images by background subtraction
///
/// Reads grey or colour PNG, PPM, PGM and JPEG images of one static camera, turned as their EXIF data say. Writes one
/// mask per image (8-bit grey PNG, 255 foreground) and segment.json.
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  skiagraph segment --background empty/ --frames walk/ --out masks/\n  \
                        skiagraph segment --background monday/ --background friday/ --frames walk/ --out masks/\n  \
                        skiagraph segment --background empty/ --frames grey/ --risk 1e4 --out masks/")]
pub(super) struct Arguments {
    /// Directory with images of the empty background, at least one per component, preferably 20. Repeat the option for
    /// each period of the background; if given once, its images, ordered by name, are divided into --components periods
    /// of equal length
    #[arg(long, value_name = "DIR", required = true)]
    background: Vec<PathBuf>,

    /// Directory with the images to segment, ordered by name
    #[arg(long, value_name = "DIR")]
    frames: PathBuf,

    /// Output directory; replaced if it holds output of the same command
    #[arg(long, value_name = "DIR")]
    out: PathBuf,

    /// Components of the mixture, if --background is given once
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u16).range(1..=16))]
    components: u16,

    /// Cost of a false alarm relative to a miss; higher values find less foreground [default: 1]
    #[arg(long, value_name = "R", value_parser = positive)]
    risk: Option<f64>,

    /// Keep pixels that look like the background in shadow
    #[arg(long)]
    keep_shadows: bool,

    /// Write raw masks, without shadow removal, opening, closing, hole filling or speck removal
    #[arg(long)]
    raw: bool,

    #[command(flatten)]
    output: OutputArguments,
}

fn positive(text: &str) -> Result<f64, String> {
    let number: f64 = text.parse().map_err(|_| "expected a number".to_owned())?;
    if number > 0.0 && number.is_finite() { Ok(number) } else { Err("expected a number above 0".to_owned()) }
}

pub(super) fn run(arguments: &Arguments, volume: Volume) -> Result<ExitCode, CommandError> {
    let cleaning = if arguments.raw { Cleaning::NONE } else { Cleaning::default() };
    let settings = BackgroundSettings {
        risk: arguments.risk,
        remove_shadows: !arguments.keep_shadows && !arguments.raw,
        cleaning,
    };
    let input = SegmentInput {
        background: &arguments.background,
        frames: &arguments.frames,
        components: arguments.components.into(),
        settings,
    };
    let progress = TerminalProgress::new(volume);
    let segmented = segment(&input, arguments.output.destination(&arguments.out), &progress)?;
    drop(progress);
    volume.written(&arguments.out);
    if arguments.output.json {
        output::print_json(&segmented)?;
        return Ok(ExitCode::SUCCESS);
    }
    let background: Vec<String> = segmented.background_frames.iter().map(usize::to_string).collect();
    let [width, height] = segmented.size_px;
    output::print(&format!(
        "{}: {} masks of {width} x {height} pixels, {:.2} % foreground, {:.0} images a second; background: {} images",
        arguments.out.display(),
        segmented.frames,
        100.0 * segmented.foreground,
        segmented.frames_per_second,
        background.join(" + ")
    ))?;
    Ok(ExitCode::SUCCESS)
}
