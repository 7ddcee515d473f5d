//! `skiagraph track`.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;

use super::output_arguments::OutputArguments;
use super::progress::Progress;
use super::volume::Volume;
use super::{CommandError, output};
use crate::experiment::track_set_calibrating;
use crate::scenario::{ScenarioError, TrackerSettings};

/// Run one tracker on a set, without access to the ground truth
///
/// Reads the set's cameras, observations and start pose. Only oracle trackers read the ground truth.
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  skiagraph track sets/walk --tracker annealed_particle_filter --out runs/walk\n  \
                        skiagraph track sets/walk --tracker annealed_particle_filter particles=400 --seeds 5 --out runs/400\n  \
                        skiagraph track sets/walk --tracker annealed_particle_filter --calibrate --out runs/fitted")]
pub(super) struct Arguments {
    /// Directory of the benchmark set
    #[arg(value_name = "SET")]
    set: PathBuf,

    /// Overrides of the tracker's settings
    #[arg(value_name = "KEY=VALUE")]
    overrides: Vec<String>,

    /// Tracker: annealed_particle_filter, gpdm, switching_gpdm, gpdm_graph, frozen, nearest_training_pose or oracle
    #[arg(long, value_name = "NAME")]
    tracker: String,

    /// First random seed
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u32,

    /// Number of seeds
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    seeds: u32,

    /// Calibrate the tracker's body on the first frames, or do not [default: what the set says]
    ///
    /// Lengths, girths, places of joints and one inflation of all radii are solved together with the poses of the first
    /// 20 frames, a fifteenth of a second apart. A gate decides whether the body that was found is kept.
    #[arg(long, value_name = "true|false", num_args = 0..=1, default_missing_value = "true")]
    calibrate: Option<bool>,

    /// Output directory of the run; an existing skiagraph run is replaced
    #[arg(long, value_name = "RUN")]
    out: PathBuf,

    #[command(flatten)]
    output: OutputArguments,
}

pub(super) fn run(arguments: &Arguments, volume: Volume) -> Result<ExitCode, CommandError> {
    let settings = TrackerSettings::named(&arguments.tracker)
        .and_then(|settings| settings.overridden(&arguments.overrides))
        .map_err(ScenarioError::from)?;
    let first = u64::from(arguments.seed);
    let seeds: Vec<u64> = (first..first + u64::from(arguments.seeds)).collect();
    let progress = Progress::new(volume);
    let to = arguments.output.destination(&arguments.out);
    let tracked = track_set_calibrating(&arguments.set, &settings, &seeds, arguments.calibrate, to, &progress)
        .map_err(|e| e.about(&arguments.set))?;
    drop(progress);
    volume.written(&arguments.out);
    if arguments.output.json {
        output::print_json(&tracked.record)?;
    } else if let Some(record) = &tracked.record {
        let frames = tracked.estimates.frames();
        output::print(&format!(
            "{}: {} on {frames} frames, {} seed(s), {:.1} frames a second{}\n  measure it: skiagraph evaluate {} {}",
            arguments.out.display(),
            settings.name(),
            seeds.len(),
            record.timing.frames_per_second,
            match record.learned_from.is_empty() {
                true => String::new(),
                false => format!("\n  learned from: {}", record.learned_from.join("; ")),
            },
            arguments.set.display(),
            arguments.out.display(),
        ))?;
    }
    Ok(ExitCode::SUCCESS)
}
