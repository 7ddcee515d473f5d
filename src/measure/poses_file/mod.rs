//! Estimates of other programs: `.npz`, CSV, TRC, C3D and BVH.
//!
//! Files have named points. The user's declared units and axes override those of the file. Names are HumanEva markers,
//! joints of the tracker's body, or mapped to these by a joint map. A body whose size differs too much from the start
//! pose is refused: its units are wrong.

mod angles;
mod csv_file;
mod layouts;
mod names;
mod npz_names;
mod pipelines;
mod read_as;
mod rewriting;
mod row_times;
mod scale;
mod trc_rows;

use std::path::{Path, PathBuf};

use nalgebra::{Isometry3, Point3, Translation3};

use self::names::NameKind;
use self::read_as::FormatUsage;
use super::tracked::Tracked;
use crate::common::{ExperimentError, read_file};
use skiagraph_core::body::Humanoid;
use skiagraph_core::input::{self, limits};
use skiagraph_core::npz::{Array, Npz, Values};
use skiagraph_eval::{AxisOrder, Root};
use skiagraph_set::{Articulation, BlindSet, Estimates, with_seed_axis, zeros_as_missing};
use skiagraph_truth::mocap::{MOST_POINTS, PointFile, ReadOptions, UpAxis, parse_c3d, parse_trc, read};

pub(crate) use angles::check_angles;
pub use pipelines::{PIPELINES, Pipeline};
pub use read_as::{ReadAs, UNITS_OF_LENGTH};
pub(crate) use rewriting::other_side;
pub(crate) use scale::check_scale;

/// Positions whose root is nearer than this to the origin in every frame are relative to it, metres.
const AT_ORIGIN_M: f64 = 0.001;

/// The user's declarations about a file of poses.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PosesDeclared {
    /// The pipeline that wrote the file; every other declaration overrides it.
    pub from: Option<&'static Pipeline>,
    pub metres_per_unit: Option<f64>,
    pub up: Option<UpAxis>,
    /// The file's coordinates as axes of the set; overrides `up`.
    pub axes: Option<AxisOrder>,
    /// Whether left and right are exchanged in the file.
    pub swap_sides: bool,
    /// The set's frame that is the file's frame 0. Then the file may have more or fewer frames than the set.
    pub shift: Option<i64>,
    /// The file's origin in the set, metres.
    pub offset_m: Option<[f64; 3]>,
    /// The camera in whose axes the positions are; relative to the pelvis if that is at the origin.
    pub camera: Option<String>,
    /// A TOML file with lines `"name in the file" = "marker or joint"`.
    pub joint_map: Option<PathBuf>,
    /// Radians per unit of joint angles; only for `.npz` files, because the others have points.
    pub radians_per_unit: Option<f64>,
}

impl PosesDeclared {
    /// Whether anything is declared that only applies to files of other programs.
    pub(crate) fn is_of_file(&self) -> bool {
        Self { radians_per_unit: self.radians_per_unit, ..Self::default() } != *self
    }
}

/// Reads the estimates of a file in the format of its extension, for the tracker's body of a set.
pub(crate) fn read_poses(path: &Path, set: &BlindSet, declared: &PosesDeclared) -> Result<Tracked, ExperimentError> {
    let malformed = |detail: String| ExperimentError::Malformed { path: path.to_owned(), detail };
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    let text = || {
        input::read_to_string(path, limits::ARRAYS)
            .map_err(|source| ExperimentError::Unreadable { path: path.to_owned(), source })
    };
    let cameras: Vec<&str> = set.rig.cameras.iter().map(|camera| camera.name.as_str()).collect();
    if let Some(camera) = declared.camera.as_deref().filter(|camera| !cameras.contains(camera)) {
        return Err(malformed(format!("--camera {camera}: expected a camera of the set: {}", cameras.join(", "))));
    }
    // by the numbers of its rows; `None`: by their times
    let mut counts_from_one = None;
    if let Some(pipeline) = declared.from {
        pipeline.check_file(&extension).map_err(malformed)?;
    }
    let points = match extension.as_str() {
        "npz" => return from_npz(path, set, declared),
        other if declared.radians_per_unit.is_some() && ["csv", "trc", "c3d", "bvh"].contains(&other) => {
            return Err(malformed("this format has points and no joint angles; leave out --angles".to_owned()));
        }
        "csv" => {
            let (mut points, is_numbered) = csv_file::parse(&text()?).map_err(malformed)?;
            if is_numbered {
                counts_from_one = Some(declared.shift.is_none() && first_given(&points) == Some(1));
                number_frames(&mut points, set, declared).map_err(malformed)?;
            }
            points
        }
        _ if !path.exists() => return Err(malformed("there is no such file or folder".to_owned())),
        "trc" => {
            let text = text()?;
            let points = parse_trc(&text, declared.metres_per_unit).map_err(malformed)?;
            // number 2 at the time of frame 1 does count from 1, and is right
            let first = trc_rows::check(&text).map_err(malformed)?;
            counts_from_one = first.filter(|number| *number > 1.0).map(|_| false);
            points
        }
        "c3d" => parse_c3d(&read_file(path, limits::RECORDING)?).map_err(malformed)?,
        "sto" | "mot" => return Err(malformed(OPENSIM.to_owned())),
        "bvh" => from_bvh(path, declared)?,
        other => {
            let detail = format!("expected a file that ends in .npz, .csv, .trc, .c3d or .bvh, found {other:?}");
            return Err(malformed(detail));
        }
    };
    let (rate, frames) = (set.frames_per_second, set.frame_count);
    let placed = row_times::at_frames(points, rate, frames, declared.shift).map_err(malformed)?;
    let points = placed.points;
    let npz = archive_of(&points, points.frames_per_second.unwrap_or(set.frames_per_second));
    let first = if extension == "bvh" { NameKind::Joint } else { NameKind::Marker };
    let read_as = ReadAs {
        begins_at_one: counts_from_one.unwrap_or(placed.begins_at_one),
        ..ReadAs::new(path, usage(&points, &extension), declared)
    };
    let shift = declared.shift.filter(|_| !placed.is_by_time);
    tracked_from(npz, Some(first), path, set, &PosesDeclared { shift, ..declared.clone() }, read_as, points.notes)
}

/// What to do with a file of an OpenSim model's coordinates.
const OPENSIM: &str = "OpenSim's .mot and .sto are not read; write the positions of its model as .trc, with the Python of \
                       docs/estimates.md (OpenSim)";

/// The units and axes of `.npz` files, and of other files that do not declare them.
const ASSUMED: FormatUsage = FormatUsage {
    metres: Some(1.0),
    units_from: "assumed",
    order: AxisOrder::SAME,
    axes_from: "assumed",
    y_up: AxisOrder::Y_UP,
};

fn from_npz(path: &Path, set: &BlindSet, declared: &PosesDeclared) -> Result<Tracked, ExperimentError> {
    let file = path.display().to_string();
    let npz = Npz::from_bytes(&file, &read_file(path, limits::ARRAYS)?)?;
    let npz = angles::in_radians(npz, &file, declared.radians_per_unit)
        .map_err(|detail| ExperimentError::Malformed { path: path.to_owned(), detail })?;
    let npz = with_seed_axis(&file, npz)?;
    let begins_at_one = declared.shift.is_none() && first_estimate(&npz) == Some(1);
    let read_as = ReadAs { begins_at_one, ..ReadAs::new(path, ASSUMED, declared) };
    tracked_from(npz, None, path, set, declared, read_as, Vec::new())
}

/// The first frame that any repetition has an estimate of.
fn first_estimate(npz: &Npz) -> Option<usize> {
    let array = ["estimate_markers", "estimate_joints", "estimate_root"].iter().find_map(|name| npz.get(name))?;
    let (Values::F64(values), [_, frames, one_frame @ ..]) = (&array.values, array.shape.as_slice()) else {
        return None;
    };
    // an array without values may have axes of any length
    let length = Some(one_frame.iter().product()).filter(|_| !values.is_empty())?;
    let rows = values.chunks_exact(length).enumerate();
    let given = rows.filter(|(_, row)| row.iter().any(|value| value.is_finite()));
    given.map(|(index, _)| index % frames).min()
}

/// The estimates of an archive with the file's names, units, axes and frames. `points` is the preferred kind of names
/// if it is a file of points.
fn tracked_from(
    npz: Npz,
    points: Option<NameKind>,
    path: &Path,
    set: &BlindSet,
    declared: &PosesDeclared,
    read_as: ReadAs,
    notes: Vec<String>,
) -> Result<Tracked, ExperimentError> {
    let malformed = |detail: String| ExperimentError::Malformed { path: path.to_owned(), detail };
    let file = path.display().to_string();
    let body = &set.start.body;
    let own = declared.joint_map.as_deref().map(names::read_map).transpose()?;
    let joint_map = own.clone().unwrap_or_default();
    let map = match (declared.from, npz.names(&file, "marker_names")?) {
        (Some(pipeline), Some(names)) => {
            let mut map = pipeline.joint_map(names);
            map.extend(own.into_iter().flatten());
            Some(map)
        }
        _ => own,
    };
    let named = npz_names::named(npz, &file, map.as_ref(), body, points).map_err(malformed)?;
    let (columns, layout, left_out) = (named.columns, named.layout.map(str::to_owned), named.left_out);
    let read_as = ReadAs { columns, layout, left_out, joint_map, ..read_as };
    // the BVH reader has already applied the unit
    let unit = read_as.metres_per_unit.filter(|_| points != Some(NameKind::Joint));
    // and the rows of a file with times are shifted
    let in_file = ReadAs { metres_per_unit: unit, shift_frames: declared.shift, ..read_as.clone() };
    let (npz, zeros) = zeros_as_missing(&named.npz, &file)?;
    let npz = rewriting::rewritten(npz, &file, &in_file, body, set.frame_count).map_err(malformed)?;
    let mut estimates = Estimates::from_npz(&file, npz, body, Vec::new())?;
    if let Some(camera) = &declared.camera {
        from_camera(&mut estimates, camera, set);
    }
    let left_out = read_as.left_out.as_ref().map(|names| format!("{file} has names that are not used: {names}"));
    estimates.notes.extend(notes.into_iter().chain(left_out).chain(zeros));
    Ok(Tracked { read_as: Some(read_as), ..Tracked::from_estimates(estimates) })
}

/// Turns estimates from the axes of a camera to those of the set, and moves them from its centre, unless they are
/// relative to a point of the body.
fn from_camera(estimates: &mut Estimates, camera: &str, set: &BlindSet) {
    let set_from_file = places_of_camera(estimates, camera, set);
    for sequence in &mut estimates.sequences {
        for (frame, markers) in sequence.markers.iter_mut().enumerate() {
            let world = set_from_file[frame];
            *markers = markers.map(|marker| marker.map(|point| world * point));
            match &mut sequence.articulation {
                Articulation::Poses(poses) => {
                    poses[frame].iter_mut().for_each(|pose| pose.world_from_root = world * pose.world_from_root);
                }
                Articulation::Roots(roots) => roots[frame].iter_mut().for_each(|root| *root = world * *root),
                Articulation::Unknown => {}
            }
        }
    }
}

/// The set from the axes of a camera in every frame, only turned for estimates relative to a point of the body: before
/// and after they are turned.
pub(crate) fn places_of_camera(estimates: &Estimates, camera: &str, set: &BlindSet) -> Vec<Isometry3<f64>> {
    let markers = || estimates.sequences.iter().flat_map(|sequence| &sequence.markers);
    let is_relative = Root::ALL.iter().any(|root| {
        let mut places = markers().filter_map(|markers| root.of(markers, markers)).peekable();
        places.peek().is_some() && places.all(|place| place.norm() < AT_ORIGIN_M)
    });
    let place = |frame: usize| {
        let rig = set.rig_at(frame);
        let camera = rig.cameras.iter().find(|known| known.name == camera);
        let mut world = camera.map_or_else(Isometry3::identity, |camera| camera.camera_from_world.inverse());
        if is_relative {
            world.translation = Translation3::identity();
        }
        world
    };
    (0..estimates.frames()).map(place).collect()
}

/// Joint positions of a BVH file in metres and its own axes. Y is up unless the user declares otherwise; then Z is the
/// set's x and X its y, as in `export --to bvh`: a BVH body faces +Z with its left at +X.
fn from_bvh(path: &Path, declared: &PosesDeclared) -> Result<PointFile, ExperimentError> {
    let is_y_up = match (declared.axes, declared.up) {
        (Some(order), _) => order.set_from_file()[(2, 2)] == 0.0,
        (None, up) => up != Some(UpAxis::Z),
    };
    let up = if is_y_up { UpAxis::Y } else { UpAxis::Z };
    let options = ReadOptions { metres_per_unit: declared.metres_per_unit, up: Some(up), ..ReadOptions::default() };
    let clip = read(path, &options)?;
    // the reader turned the file's axes to x, -z, y
    let place = |place: &Point3<f64>| match up {
        UpAxis::Y => [place.x, place.z, -place.y],
        _ => place.coords.into(),
    };
    let frame = |frame: usize| clip.joint_positions(frame).iter().map(|at| Some(place(at))).collect();
    Ok(PointFile {
        names: clip.skeleton.joints.iter().map(|joint| joint.name.clone()).collect(),
        frames_per_second: Some(clip.frames_per_second),
        metres_per_unit: Some(1.0),
        up: None,
        up_is_usual: false,
        times_s: (0..clip.frames.len()).map(|frame| frame as f64 / clip.frames_per_second).collect(),
        frames: (0..clip.frames.len()).map(frame).collect(),
        notes: clip.notes.clone(),
    })
}

/// Makes the rows of a file the frames of the set with their numbers, unless the user shifts them.
fn number_frames(points: &mut PointFile, set: &BlindSet, declared: &PosesDeclared) -> Result<(), String> {
    if declared.shift.is_none() {
        check_numbers(points, set.frame_count)?;
        extend_to(points, set.frame_count);
    }
    Ok(())
}

fn first_given(points: &PointFile) -> Option<usize> {
    points.frames.iter().position(|frame| frame.iter().any(Option::is_some))
}

/// Refuses frame numbers that the set does not have.
fn check_numbers(points: &PointFile, frames: usize) -> Result<(), String> {
    let found = points.frames.len();
    if found <= frames {
        return Ok(());
    }
    let first = first_given(points).unwrap_or(0);
    let hint = match first {
        0 => String::new(),
        _ => format!("; its first is {first}: subtract {first} from all, or use --shift -{first}"),
    };
    Err(format!("its last frame is {}, the set's is {}: frames count from 0{hint}", found - 1, frames - 1))
}

/// Adds frames without an estimate after the last frame of a file that numbers its frames, and notes how many are lost.
fn extend_to(points: &mut PointFile, frames: usize) {
    if points.frames.is_empty() {
        return;
    }
    points.frames.resize(frames, vec![None; points.names.len()]);
    let lost = || points.frames.iter().enumerate().filter(|(_, frame)| frame.iter().all(Option::is_none));
    let (count, first) = (lost().count(), lost().next().map(|(frame, _)| frame));
    points.notes.extend(first.map(|first| {
        format!(
            "no row with a position is at {count} of the set's {frames} frames (the first: {first}), which are lost"
        )
    }));
}

fn usage(points: &PointFile, extension: &str) -> FormatUsage {
    if extension == "bvh" {
        return FormatUsage {
            metres: None,
            units_from: "guessed from the size of the body",
            order: AxisOrder::BVH,
            axes_from: "assumed for .bvh",
            y_up: AxisOrder::BVH,
        };
    }
    let is_declared = points.up.is_some() && !points.up_is_usual;
    FormatUsage {
        metres: points.metres_per_unit.or(Some(1.0)),
        units_from: if points.metres_per_unit.is_some() { "declared in the file" } else { "assumed" },
        order: if points.up == Some(UpAxis::Y) { AxisOrder::Y_UP } else { AxisOrder::SAME },
        axes_from: match extension {
            "trc" => "assumed for .trc",
            _ if is_declared => "declared in the file",
            _ => "assumed",
        },
        ..ASSUMED
    }
}

/// Points as the arrays of a `poses.npz`, with the names of the file.
fn archive_of(points: &PointFile, frames_per_second: f64) -> Npz {
    let places = points.frames.iter().flatten().flat_map(|place| place.unwrap_or([f64::NAN; 3]));
    let shape = [1, points.frames.len(), points.names.len(), 3];
    Npz::from_iter([
        ("fps", Array::new(&[], vec![frames_per_second])),
        ("seeds", Array::new(&[1], vec![0_i64])),
        ("estimate_markers", Array::new(&shape, places.collect::<Vec<f64>>())),
        ("marker_names", Array::names(points.names.iter().map(String::as_str))),
    ])
}

fn markers_on(body: &Humanoid, joint: &str) -> Vec<&'static str> {
    let joint = body.joints.iter().position(|known| known.name == joint);
    let markers = joint.into_iter().flat_map(|joint| body.markers_on_joint(joint));
    markers.map(|marker| skiagraph_core::body::LANDMARKS[marker].name()).collect()
}

fn distance(a: Point3<f64>, b: Point3<f64>) -> f64 {
    (a - b).norm()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_estimate_is_found_in_any_repetition_and_in_an_empty_array_at_once() {
        let first = |shape: &[usize], values: Vec<f64>| {
            first_estimate(&Npz::from_iter([("estimate_markers", Array::new(shape, values))]))
        };
        let nan = f64::NAN;
        assert_eq!(first(&[2, 3, 1, 1], vec![nan, nan, 1.0, nan, 1.0, nan]), Some(1));
        assert_eq!(first(&[1, 2, 1, 1], vec![nan, nan]), None);
        assert_eq!(first(&[1 << 31, 1 << 31, 0, 3], Vec::new()), None);
    }

    #[test]
    fn missing_rows_of_a_table_are_noted() {
        let note = |text: &str| {
            let (mut points, _) = csv_file::parse(text).unwrap();
            extend_to(&mut points, 4);
            assert_eq!(points.frames.len(), 4);
            points.notes
        };
        let words = |count: usize, first: usize| {
            format!("no row with a position is at {count} of the set's 4 frames (the first: {first}), which are lost")
        };
        assert_eq!(note("frame,p_x,p_y,p_z\n0,1,1,1\n3,1,1,1\n"), [words(2, 1)]);
        assert_eq!(note("frame,name,x,y,z\n0,p,1,1,1\n1,p,1,1,1\n2,p,1,1,1\n"), [words(1, 3)]);
        assert!(note("frame,p_x,p_y,p_z\n0,1,1,1\n1,1,1,1\n2,1,1,1\n3,1,1,1\n").is_empty());
    }
}
