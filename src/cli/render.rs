//! `skiagraph render`.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;

use super::output_arguments::OutputArguments;
use super::progress::Progress;
use super::scenario_arguments::ScenarioArguments;
use super::volume::Volume;
use super::{CommandError, output};
use crate::experiment::render_apart;

/// Make a benchmark set on disk
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  skiagraph render scenarios/walk.toml --out sets/walk\n  \
                        skiagraph render scenarios/walk.toml rig.ring.count=8 --out sets/walk8\n  \
                        skiagraph render scenarios/walk.toml --out public/walk --truth secret/walk")]
pub(super) struct Arguments {
    #[command(flatten)]
    scenario: ScenarioArguments,

    /// Output directory of the set; an existing set is replaced only with --force
    #[arg(long, value_name = "SET")]
    out: PathBuf,

    /// Keep the truth apart: write the complete set here, for skiagraph evaluate, and --out without its truth
    #[arg(long, value_name = "DIR")]
    truth: Option<PathBuf>,

    #[command(flatten)]
    output: OutputArguments,
}

pub(super) fn run(arguments: &Arguments, volume: Volume) -> Result<ExitCode, CommandError> {
    let file = arguments.scenario.open()?;
    let progress = Progress::new(volume);
    let to = arguments.output.destination(&arguments.out);
    let mocap = arguments.scenario.mocap_directory();
    let (set, notes) = render_apart(&file, mocap.as_deref(), to, arguments.truth.as_deref(), &progress)
        .map_err(|e| e.about(&file.origin))?;
    drop(progress);
    volume.notes(&notes);
    volume.written(&arguments.out);
    let (blind, place) = (&set.blind, arguments.out.display());
    let (frames, cameras) = (blind.frame_count, blind.rig.cameras.len());
    if arguments.output.json {
        output::print_json(&serde_json::json!({
            "schema": "skiagraph.render/1",
            "set": place.to_string(),
            "set_hash": blind.set_hash,
            "frames": frames,
            "frames_per_second": blind.frames_per_second,
            "cameras": cameras,
            "notes": notes,
        }))?;
    } else {
        output::print(&format!("{place}: {frames} frames of {cameras} cameras, hash {}", blind.set_hash))?;
    }
    Ok(ExitCode::SUCCESS)
}
