//! `skiagraph evaluate`.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;

use super::progress::Progress;
use super::volume::Volume;
use super::{CommandError, output, summary};
use crate::experiment::{REPORT_FILE, evaluate_run};

/// Measure a run against the ground truth of its set
///
/// RUN is the directory of a run, or another program's estimate: a directory with a poses.npz, or an .npz file. Results
/// of a skiagraph run go into its directory. Results of another program's estimate go beside it, into NAME-evaluation;
/// files that skiagraph did not write are never changed.
///
/// Another program's file needs fps, seeds and estimate_root with estimate_angles (and estimate_angle_names), or
/// estimate_markers with marker_names, or estimate_joints with estimate_joint_names. NaN marks a frame without an
/// estimate.
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  skiagraph evaluate sets/walk runs/walk\n  \
                        skiagraph evaluate sets/walk runs/walk --json\n  \
                        skiagraph evaluate sets/walk mine.npz --out results/mine")]
pub(super) struct Arguments {
    /// Directory of the benchmark set
    #[arg(value_name = "SET")]
    set: PathBuf,

    /// Directory of the run, or an .npz file
    #[arg(value_name = "RUN")]
    run: PathBuf,

    /// Output directory [default: RUN for a skiagraph run, else RUN-evaluation]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,

    /// Rename existing files that skiagraph did not write to NAME~
    #[arg(long)]
    force: bool,

    /// Print run.json instead of a table
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &Arguments, volume: Volume) -> Result<ExitCode, CommandError> {
    let progress = Progress::new(volume);
    let (out, force) = (arguments.out.as_deref(), arguments.force);
    let done =
        evaluate_run(&arguments.set, &arguments.run, out, force, &progress).map_err(|e| e.about(&arguments.run))?;
    drop(progress);
    volume.notes(&done.notes);
    volume.written(&done.place);
    if arguments.json {
        output::print_json(&done.record)?;
    } else {
        output::print(&summary::table(&done.record))?;
        output::print(&format!("\n  report: {}", done.place.join(REPORT_FILE).display()))?;
    }
    Ok(ExitCode::SUCCESS)
}
