//! `skiagraph evaluate`.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{Args, ValueEnum};

use super::caller::print_written;
use super::folders::expect_set_and_run;
use super::progress::TerminalProgress;
use super::volume::Volume;
use super::{CommandError, output, summary};
use crate::measure::reference::ReferenceChoice;
use crate::measure::{PIPELINES, Pipeline, PosesDeclared, REPORT_FILE, RUN_FILE};
use crate::runs::{EvaluateOptions, evaluate_run, reading::read_record};
use skiagraph_eval::AxisOrder;
use skiagraph_set::{FARTHEST_M, SetPlace};
use skiagraph_truth::mocap::UpAxis;

/// Measure a run against the ground truth of its set
///
/// On the set of a recording, which has no truth, it measures how well the estimate explains the images
/// (docs/recordings.md).
///
/// RUN is the directory of a run, or another program's estimate: a directory with a poses.npz, or a .npz, .csv, .trc,
/// .c3d or .bvh file. Results of a skiagraph run go into its directory. Results of another program's estimate go into
/// NAME-evaluation beside it; files that skiagraph did not write are never changed.
///
/// A CSV file has columns such as pelvis_x, pelvis_y, pelvis_z (and frame), or rows of frame, name, x, y, z. Names are
/// HumanEva's markers, or joints or links of the set's body; keypoints of COCO-17, HALPE-26, BODY-25, Human3.6M and
/// SMPL are also recognised. --joint-map maps other names: a TOML file with lines such as "LKnee" = "left_knee";
/// unmapped names are used unchanged. If a name in a BVH file is that of a joint and of a marker, the joint is meant.
/// Frames missing from a CSV file with frame numbers count as lost, as do those of a TRC or C3D file with fewer rows
/// than the set has frames, or with gaps: its rows belong to frames by their times.
///
/// Coordinates are in metres with Z up unless the file, --units, --up or --axes declare otherwise; TRC files declare
/// their unit and are Y up. A body of impossible size is refused, because its unit must be wrong. Joint angles that
/// look like degrees are refused unless --angles gives their unit. The output states what was declared and what was
/// assumed. If another reading of the file would remove 90 % of the error, the output begins with a hint that names it
/// and the option to use.
///
/// Another program's .npz needs fps and estimate_root with estimate_angles (and estimate_angle_names), or
/// estimate_markers with marker_names, or estimate_joints with estimate_joint_names. NaN marks a frame without an
/// estimate. The first axis of an array is the seed; it may be omitted if there is one repetition.
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  skiagraph evaluate sets/walk runs/walk\n  \
                        skiagraph evaluate sets/walk runs/walk --json\n  \
                        skiagraph evaluate sets/walk mine.npz --out results/mine\n  \
                        skiagraph evaluate public/walk runs/walk --truth secret/walk\n  \
                        skiagraph evaluate sets/walk --poses mine.csv --units mm --up y --joint-map joints.toml\n  \
                        skiagraph evaluate sets/walk mine.trc --axes y,z,x\n  \
                        skiagraph evaluate sets/walk pose-3d/walk_0-300_filt_butterworth.trc --from pose2sim\n  \
                        skiagraph evaluate sets/person runs/person --leave-one-out --reference mocap.c3d\n  \
                        skiagraph evaluate sets/walk mine.npz --swap-sides --shift 5 --offset=-1.5,0,0")]
pub(super) struct Arguments {
    /// Directory of the benchmark set
    #[arg(value_name = "SET")]
    set: PathBuf,

    /// Directory of the complete set, if the set was rendered with --truth
    #[arg(long, value_name = "DIR")]
    truth: Option<PathBuf>,

    /// Directory of the run, or a pose file
    #[arg(value_name = "RUN", required_unless_present = "poses", conflicts_with = "poses")]
    run: Option<PathBuf>,

    /// Pose file: .npz, .csv, .trc, .c3d or .bvh
    #[arg(long, value_name = "FILE")]
    poses: Option<PathBuf>,

    /// The pipeline that wrote the file, given the cameras of `skiagraph export`: its axes and names. Other options
    /// override them. Files that it does not write are refused
    #[arg(long, value_name = "PIPELINE", value_parser = pipelines())]
    from: Option<&'static Pipeline>,

    /// Unit of length [default: the file's declared unit, else m]
    #[arg(long, value_enum, value_name = "UNITS")]
    units: Option<Units>,

    /// Vertical axis; y means --axes x,z,-y (y,z,x for .bvh) [default: z; y for .trc and .bvh]
    #[arg(long, value_enum, value_name = "AXIS", conflicts_with = "axes")]
    up: Option<UpArgument>,

    /// For each of the file's three coordinates, the set's axis (z up) that it lies on: y,z,x means that the file's
    /// first coordinate is the set's y; - reverses, as in -x,z,y [default: from --up]
    #[arg(long, value_name = "ORDER", allow_hyphen_values = true)]
    axes: Option<AxisOrder>,

    /// Exchange left and right in all names
    #[arg(long)]
    swap_sides: bool,

    /// Add N to the frame numbers: the file's frame 0 is the set's frame N (N < 0 if the estimate is late). Frames
    /// outside the set are dropped; frames of the set without an estimate count as lost
    #[arg(long, value_name = "N", allow_hyphen_values = true, value_parser = clap::value_parser!(i64).range(-10_000_000..=10_000_000))]
    shift: Option<i64>,

    /// Position of the file's origin in the set, in metres; added after --units and --axes
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = offset)]
    offset: Option<[f64; 3]>,

    /// The camera in whose axes the positions are: x right, y down, z forward. The pelvis at 0, 0, 0 in every frame
    /// means positions relative to it, which are only turned
    #[arg(long, value_name = "NAME", conflicts_with_all = ["up", "axes", "offset"])]
    camera: Option<String>,

    /// Unit of the joint angles of an .npz file [default: rad]
    #[arg(long, value_enum, value_name = "UNIT")]
    angles: Option<AngleUnit>,

    /// TOML file that maps joint names, one per line: "name in the file" = "name in skiagraph"
    #[arg(long, value_name = "FILE")]
    joint_map: Option<PathBuf>,

    /// On a recording: what another system recorded of the same motion, to compare with: a BVH, C3D, TRC or other
    /// recording, or a scenario whose [motion] is the recording
    ///
    /// Its clock and its place are estimated and said, as are its own errors: it is no truth.
    #[arg(long, value_name = "FILE")]
    reference: Option<PathBuf>,

    /// Time of the reference at the set's first frame, in seconds [default: estimated by the motion]
    #[arg(long, value_name = "SECONDS", requires = "reference", allow_hyphen_values = true, value_parser = seconds)]
    reference_offset: Option<f64>,

    /// On a recording: leave out each camera once, track again without it, and measure the overlap there
    ///
    /// It takes as long as tracking, once for each camera. If the run corrected the cameras, the corrected ones are
    /// used; the body is calibrated anew.
    #[arg(long)]
    leave_one_out: bool,

    /// Output directory [default: RUN for a skiagraph run, else RUN-evaluation, keeping the file's extension]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,

    /// Move existing output of another command aside, to NAME~
    #[arg(long)]
    force: bool,

    /// Print run.json instead of a table
    #[arg(long)]
    json: bool,

    /// Print the table of a run that is measured, whose folder is SET and RUN: for callers that show it again
    #[arg(long, hide = true)]
    stored: bool,
}

fn pipelines() -> impl TypedValueParser<Value = &'static Pipeline> {
    let values = PIPELINES.iter().map(|pipeline| PossibleValue::new(pipeline.name).help(pipeline.what));
    PossibleValuesParser::new(values).try_map(|name| Pipeline::named(&name).ok_or("no such pipeline"))
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Units {
    M,
    Cm,
    Mm,
    In,
    Ft,
}

/// Parses three comma-separated numbers in metres.
fn offset(text: &str) -> Result<[f64; 3], String> {
    let refuse = || format!("expected three numbers in metres, at most {FARTHEST_M}, separated by commas: 0.5,-1,0");
    let number = |part: &str| part.trim().parse::<f64>().ok().filter(|metres| metres.abs() <= FARTHEST_M);
    let numbers: Option<Vec<f64>> = text.split(',').map(number).collect();
    numbers.and_then(|numbers| numbers.try_into().ok()).ok_or_else(refuse)
}

fn seconds(text: &str) -> Result<f64, String> {
    let found = text.parse().ok().filter(|seconds: &f64| seconds.abs() <= 86_400.0);
    found.ok_or_else(|| "expected seconds, at most 86400".to_owned())
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum AngleUnit {
    Rad,
    Deg,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum UpArgument {
    Y,
    Z,
}

impl Arguments {
    fn declared(&self) -> PosesDeclared {
        PosesDeclared {
            from: self.from,
            metres_per_unit: self.units.map(|units| match units {
                Units::M => 1.0,
                Units::Cm => 0.01,
                Units::Mm => 0.001,
                Units::In => 0.0254,
                Units::Ft => 0.3048,
            }),
            up: self.up.map(|up| match up {
                UpArgument::Y => UpAxis::Y,
                UpArgument::Z => UpAxis::Z,
            }),
            axes: self.axes,
            swap_sides: self.swap_sides,
            shift: self.shift,
            offset_m: self.offset,
            camera: self.camera.clone(),
            joint_map: self.joint_map.clone(),
            radians_per_unit: self.angles.map(|unit| match unit {
                AngleUnit::Rad => 1.0,
                AngleUnit::Deg => 1_f64.to_radians(),
            }),
        }
    }
}

pub(super) fn run(arguments: &Arguments, volume: Volume) -> Result<ExitCode, CommandError> {
    let run = arguments.run.as_ref().or(arguments.poses.as_ref()).cloned().unwrap_or_default();
    if arguments.stored {
        output::print(&summary::table(&read_record(&run.join(RUN_FILE))?))?;
        return Ok(ExitCode::SUCCESS);
    }
    expect_set_and_run("evaluate", &arguments.set, &run)?;
    let progress = TerminalProgress::new(volume);
    let set = SetPlace { folder: &arguments.set, truth: arguments.truth.as_deref() };
    let choice = |file: &PathBuf| ReferenceChoice {
        file: file.clone(),
        offset_s: arguments.reference_offset,
        mocap_directory: std::env::var_os("SKIAGRAPH_MOCAP").map(PathBuf::from),
    };
    let options = EvaluateOptions {
        declared: arguments.declared(),
        out: arguments.out.clone(),
        force: arguments.force,
        reference: arguments.reference.as_ref().map(choice),
        leave_one_out: arguments.leave_one_out,
    };
    let done = evaluate_run(set, &run, &options, &progress).map_err(|e| e.about(&run))?;
    drop(progress);
    volume.notes(&done.notes);
    volume.written(&done.place);
    if arguments.json {
        output::print_json(&done.record)?;
    } else {
        output::print(&summary::table(&done.record))?;
        output::print(&format!("\n  report: {}", done.place.join(REPORT_FILE).display()))?;
        print_written(&done.place, &done.notes);
    }
    Ok(ExitCode::SUCCESS)
}
