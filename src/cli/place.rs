//! `skiagraph place`.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, ValueEnum};

use super::bound::{outline_px, positive, scene};
use super::output_arguments::OutputArguments;
use super::progress::TerminalProgress;
use super::scenario_arguments::ScenarioArguments;
use super::volume::Volume;
use super::{CommandError, output};
use crate::bound::{Candidates, Placement, PlacementOptions, place, write_placement};
use crate::common::ExperimentError;
use skiagraph_set::is_set;

/// Choose where cameras should stand, by the expected error over the motion
///
/// Takes places on circles around the path, on a grid, or the scenario's own cameras, and chooses the N that together
/// tell most about the pose: one after the other, then by exchanging single cameras. The expected error is that of an
/// efficient estimate from one frame alone (see skiagraph bound). New cameras have the lens and image of the scenario's
/// first camera, look at the middle of the path, and never stand within 0.5 m of the body. Writes placement.json, a
/// picture from above, and the scenario with the chosen cameras.
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  skiagraph place scenarios/walk.toml --cameras 2 --out placed\n  \
                        skiagraph place scenarios/walk.toml --cameras 4 --heights 0.5,1.6,3 --azimuths 36\n  \
                        skiagraph place scenarios/walk.toml --cameras 3 --candidates grid --spacing 1 --radius 4\n  \
                        skiagraph place lab.toml --cameras 4 --candidates own    # of the cameras in lab.toml")]
pub(super) struct Arguments {
    #[command(flatten)]
    scenario: ScenarioArguments,

    /// Number of cameras to place
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=64))]
    cameras: u16,

    /// Places to choose from: a ring, a grid, or the scenario's own cameras (of camera files, for example)
    #[arg(long, value_enum, default_value_t = CandidateKind::Ring)]
    candidates: CandidateKind,

    /// Radius of the ring, or half the side of the grid [default: mean distance of the scenario's cameras]
    #[arg(long, value_name = "M", value_parser = positive)]
    radius: Option<f64>,

    /// Heights of the places, metres
    #[arg(long, value_name = "M,M", value_delimiter = ',', default_value = "0.6,1.6,2.6", value_parser = positive)]
    heights: Vec<f64>,

    /// Number of places on each circle of the ring
    #[arg(long, value_name = "N", default_value_t = 24, value_parser = clap::value_parser!(u32).range(1..=720))]
    azimuths: u32,

    /// Distance between neighbours on the grid, metres
    #[arg(long, value_name = "M", default_value_t = 1.0, value_parser = positive)]
    spacing: f64,

    /// Number of frames of the motion to consider, spread evenly
    #[arg(long, value_name = "N", default_value_t = 12, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    frames: u32,

    /// Standard deviation of the outline's error [default: that of the scenario]
    #[arg(long, value_name = "PX", value_parser = positive)]
    outline_px: Option<f64>,

    /// Length along the outline over which that error is correlated
    #[arg(long, value_name = "PX", value_parser = positive)]
    correlation_px: Option<f64>,

    /// Folder for placement.json, placement.svg and scenario.toml
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,

    #[command(flatten)]
    output: OutputArguments,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum CandidateKind {
    Ring,
    Grid,
    Own,
}

pub(super) fn run(arguments: &Arguments, volume: Volume) -> Result<ExitCode, CommandError> {
    if arguments.scenario.file().is_some_and(is_set) {
        let detail = "expected a scenario: the cameras of a set cannot be moved".to_owned();
        return Err(ExperimentError::Argument { argument: "SCENARIO", detail }.into());
    }
    let (radius_m, heights_m) = (arguments.radius, arguments.heights.clone());
    let options = PlacementOptions {
        cameras: arguments.cameras.into(),
        candidates: match arguments.candidates {
            CandidateKind::Ring => Candidates::Ring { radius_m, heights_m, azimuths: arguments.azimuths },
            CandidateKind::Grid => Candidates::Grid { radius_m, heights_m, spacing_m: arguments.spacing },
            CandidateKind::Own => Candidates::Own,
        },
        frames: arguments.frames as usize,
        outline_px: outline_px(arguments.outline_px, arguments.correlation_px)?,
    };
    let scene = scene(&arguments.scenario, None)?;
    let progress = TerminalProgress::new(volume);
    let placement = place(&scene, &options, &progress)?;
    drop(progress);
    volume.notes(&placement.notes);
    if let Some(path) = &arguments.out {
        let file = arguments.scenario.open()?;
        write_placement(&placement, &file.scenario, arguments.output.destination(path))?;
        volume.written(path);
    }
    output::print_as(arguments.output.json, &placement, describe)?;
    Ok(ExitCode::SUCCESS)
}

fn describe(placement: &Placement) -> String {
    let mut lines = vec![
        format!(
            "{}: {} of {} places{} ({})",
            placement.name,
            placement.chosen.len(),
            placement.candidates,
            left_out(placement.too_near),
            placement.noise
        ),
        format!("  {:<12} {:>22}  {:>18}  {:>16}", "camera", "centre, m", "expected error, mm", "without it, mm"),
    ];
    lines.extend(placement.chosen.iter().map(|camera| {
        let [x, y, z] = camera.centre_m;
        let centre = format!("{x:.2}, {y:.2}, {z:.2}");
        format!("  {:<12} {centre:>22}  {:>18.2}  {:>16.2}", camera.name, camera.expected_mm, camera.without_mm)
    }));
    let (count, expected) = placement.own;
    lines.push(format!(
        "  expected error {:.2} mm; of the scenario's own {} {expected:.2} mm",
        placement.expected_mm,
        output::counted(count, "camera")
    ));
    lines.join("\n")
}

fn left_out(too_near: usize) -> String {
    if too_near == 0 { String::new() } else { format!(", without {too_near} that the body comes too near to") }
}
