//! `skiagraph import`.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use serde_json::json;

use super::output_arguments::OutputArguments;
use super::progress::TerminalProgress;
use super::volume::Volume;
use super::{CommandError, output};
use crate::import::import;
use crate::scenario::RecordingFile;

/// Make a set from a recording of a person: masks of calibrated cameras
///
/// RECORDING is a small TOML file (docs/recordings.md): camera files as in [[rig.file]] of a scenario, a folder or a
/// video of masks per camera (videos need ffmpeg), and keypoints if there are any. Masks come from a program of your
/// choice, or from skiagraph segment. The set has no ground truth: its body has the given or estimated stature, and its
/// start pose is an upright body where the person is in the first frame. track, evaluate, inspect, verify, compare and
/// export work on it.
///
/// Images of another size than the calibration's, inverted masks, cameras with different numbers of images and
/// recordings without anybody in view are refused with what to do; keypoints tell how well the cameras agree, which of
/// them is late, turned or mirrored, and in which frames left and right are exchanged.
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  skiagraph import balance.toml --out sets/balance\n  \
                        skiagraph import balance.toml stature_m=1.75 last_frame=99 --out sets/balance\n  \
                        skiagraph import balance.toml reduce=4 leave_out='[\"cam04\"]' --out sets/three")]
pub(super) struct Arguments {
    /// The recording's file
    #[arg(value_name = "RECORDING")]
    recording: PathBuf,

    /// Overrides of its keys
    #[arg(value_name = "KEY=VALUE")]
    overrides: Vec<String>,

    /// Output directory of the set; an existing set is replaced only with --force
    #[arg(long, value_name = "SET")]
    out: PathBuf,

    #[command(flatten)]
    output: OutputArguments,
}

pub(super) fn run(arguments: &Arguments, volume: Volume) -> Result<ExitCode, CommandError> {
    let file = RecordingFile::open(&arguments.recording, &arguments.overrides)?;
    let progress = TerminalProgress::new(volume);
    let made = import(&file, arguments.output.destination(&arguments.out), &progress)?;
    drop(progress);
    volume.notes(&made.notes);
    volume.written(&arguments.out);
    let (set, place) = (&made.set, arguments.out.display());
    if arguments.output.json {
        output::print_json(&json!({
            "schema": "skiagraph.import/1",
            "set": place.to_string(),
            "set_hash": set.set_hash,
            "full_hash": set.full_hash,
            "frames": set.frame_count,
            "frames_per_second": set.frames_per_second,
            "cameras": set.rig.cameras.len(),
            "notes": made.notes,
        }))?;
    } else {
        output::print(&format!(
            "{place}: {} frames of {} cameras, set hash {}\n  track it: skiagraph track {place} --tracker \
             annealed_particle_filter --out RUN",
            set.frame_count,
            set.rig.cameras.len(),
            set.set_hash
        ))?;
    }
    Ok(ExitCode::SUCCESS)
}
