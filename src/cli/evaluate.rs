//! `skiagraph evaluate`.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;

use super::progress::Progress;
use super::volume::Volume;
use super::{CommandError, output, summary};
use crate::experiment::{REPORT_FILE, evaluate_run};

/// Measure a run against the truth of its set
///
/// RUN is the folder of a run, or what another program estimated: a folder with a poses.npz, or an .npz file. Results of a run
/// of this program go into its folder. Results of another program's estimate go beside it, into NAME-evaluation: nothing that
/// this program did not write is changed.
///
/// Another program's file needs fps, seeds and estimate_root with estimate_angles (and estimate_angle_names), or
/// estimate_markers with marker_names, or estimate_joints with estimate_joint_names. NaN says that a frame has no estimate.
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  skiagraph evaluate sets/walk runs/walk\n  \
                        skiagraph evaluate sets/walk runs/walk --json\n  \
                        skiagraph evaluate sets/walk mine.npz --out results/mine")]
pub(super) struct Arguments {
    /// The benchmark set's directory
    #[arg(value_name = "SET")]
    set: PathBuf,

    /// The run's directory, or an .npz file
    #[arg(value_name = "RUN")]
    run: PathBuf,

    /// Where the results go [default: RUN for a run of this program, else RUN-evaluation]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,

    /// Move aside to NAME~ what is there and is not ours
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
