//! Estimates of other programs in the formats that they write: CSV, TRC, C3D and BVH besides NumPy's.
//!
//! A file gives points by names. Units and axes are those that the file declares, unless the user declares others;
//! names are markers of HumanEva or joints of the tracker's body, as they are or through a joint map. A body whose size
//! is not that of the start pose is refused: its units are wrong.

mod angles;
mod csv_file;
mod names;
mod scale;

use std::path::{Path, PathBuf};

use nalgebra::Point3;

use self::names::NameKind;
use super::ExperimentError;
use super::error::read_file;
use super::tracking::Tracked;
use crate::benchmark_set::{BenchmarkSet, Estimates};
use crate::body::Humanoid;
use crate::input::{self, limits};
use crate::mocap::{MOST_POINTS, PointFile, ReadOptions, UpAxis, parse_c3d, parse_trc, read};
use crate::npz::{Array, Npz};

pub(super) use angles::check_angles;
pub(super) use scale::check_scale;

/// What a user declares about a file of poses.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PosesDeclared {
    /// Metres per unit of length.
    pub metres_per_unit: Option<f64>,
    /// The vertical axis.
    pub up: Option<UpAxis>,
    /// A TOML file of names: `"theirs" = "ours"`.
    pub joint_map: Option<PathBuf>,
    /// Radians per unit of joint angles; of `.npz` files alone, the others have points.
    pub radians_per_unit: Option<f64>,
}

impl PosesDeclared {
    /// Whether nothing is said of points.
    fn is_of_angles_alone(&self) -> bool {
        self.metres_per_unit.is_none() && self.up.is_none() && self.joint_map.is_none()
    }
}

/// Reads the estimates of a file by the end of its name, for the tracker's body of a set.
///
/// # Errors
/// [`ExperimentError`] with file, line or name.
pub(super) fn read_poses(
    path: &Path,
    set: &BenchmarkSet,
    declared: &PosesDeclared,
) -> Result<Tracked, ExperimentError> {
    let malformed = |detail: String| ExperimentError::Malformed { path: path.to_owned(), detail };
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    let text = || {
        input::read_to_string(path, limits::ARRAYS)
            .map_err(|source| ExperimentError::Unreadable { path: path.to_owned(), source })
    };
    let points = match extension.as_str() {
        "npz" if declared.is_of_angles_alone() => return from_npz(path, &set.blind.start.body, declared),
        other if declared.radians_per_unit.is_some() && ["csv", "trc", "c3d", "bvh"].contains(&other) => {
            return Err(malformed("it is read as points, without joint angles; leave out --angles".to_owned()));
        }
        "npz" => {
            let detail = "units, axes and names of an .npz file are those of this program: metres, Z up; leave out \
                --units, --up and --joint-map";
            return Err(malformed(detail.to_owned()));
        }
        "csv" => {
            let (mut points, is_numbered) = csv_file::parse(&text()?).map_err(malformed)?;
            if is_numbered {
                points.check_numbers(set.blind.frame_count).map_err(malformed)?;
                points.extend_to(set.blind.frame_count);
            }
            points
        }
        "trc" => parse_trc(&text()?).map_err(malformed)?,
        "c3d" => parse_c3d(&read_file(path, limits::RECORDING)?).map_err(malformed)?,
        "bvh" => from_bvh(path, declared)?,
        _ if !path.exists() => return Err(malformed("there is no such file or folder".to_owned())),
        other => {
            let detail = format!("expected a file that ends in .npz, .csv, .trc, .c3d or .bvh, found {other:?}");
            return Err(malformed(detail));
        }
    };
    let first = if extension == "bvh" { NameKind::Joint } else { NameKind::Marker };
    let estimates = points.into_estimates(path, set, declared, first)?;
    Ok(Tracked { record: None, estimates, search: Vec::new(), sources: Vec::new(), program: None, estimate: None })
}

fn from_npz(path: &Path, body: &Humanoid, declared: &PosesDeclared) -> Result<Tracked, ExperimentError> {
    let bytes = angles::in_radians(path, read_file(path, limits::ARRAYS)?, declared.radians_per_unit)?;
    let estimates = Estimates::from_bytes(&path.display().to_string(), &bytes, body)?;
    Ok(Tracked { record: None, estimates, search: Vec::new(), sources: Vec::new(), program: None, estimate: None })
}

/// Joint positions of a BVH file, turned to metres, Z up. Y is up unless the user declares otherwise, and then Z is the
/// set's x and X its y, as `export --to bvh` writes them: a BVH body faces +Z with its left at +X.
fn from_bvh(path: &Path, declared: &PosesDeclared) -> Result<PointFile, ExperimentError> {
    let up = declared.up.unwrap_or(UpAxis::Y);
    let options = ReadOptions { metres_per_unit: declared.metres_per_unit, up: Some(up), ..ReadOptions::default() };
    let clip = read(path, &options)?;
    // recordings are read as x, -z, y
    let place = |place: &Point3<f64>| match up {
        UpAxis::Y => [-place.y, place.x, place.z],
        UpAxis::Z => place.coords.into(),
    };
    let frame = |frame: usize| clip.joint_positions(frame).iter().map(|at| Some(place(at))).collect();
    Ok(PointFile {
        names: clip.skeleton.joints.iter().map(|joint| joint.name.clone()).collect(),
        frames_per_second: Some(clip.frames_per_second),
        metres_per_unit: Some(1.0),
        up: Some(UpAxis::Z),
        up_is_usual: false,
        frames: (0..clip.frames.len()).map(frame).collect(),
        notes: clip.notes.clone(),
    })
}

impl PointFile {
    /// Refuses numbers of frames that the set does not have.
    fn check_numbers(&self, frames: usize) -> Result<(), String> {
        let found = self.frames.len();
        if found <= frames {
            return Ok(());
        }
        let first = self.frames.iter().position(|frame| frame.iter().any(Option::is_some)).unwrap_or(0);
        let hint = if first > 0 { format!("; its first is {first}: subtract {first} from all") } else { String::new() };
        Err(format!("its last frame is {}, the set's is {}: frames count from 0{hint}", found - 1, frames - 1))
    }

    /// Frames after the last one of a file that numbers its frames have no estimate, as have those between.
    fn extend_to(&mut self, frames: usize) {
        let found = self.frames.len();
        if (1..frames).contains(&found) {
            self.frames.resize(frames, vec![None; self.names.len()]);
            self.notes.push(format!(
                "the file's last frame is {} (from 0); frames {found} to {} are lost",
                found - 1,
                frames - 1
            ));
        }
    }

    fn into_estimates(
        self,
        path: &Path,
        set: &BenchmarkSet,
        declared: &PosesDeclared,
        first: NameKind,
    ) -> Result<Estimates, ExperimentError> {
        let malformed = |detail: String| ExperimentError::Malformed { path: path.to_owned(), detail };
        let body = &set.blind.start.body;
        let map = declared.joint_map.as_deref().map(names::read_map).transpose()?;
        let columns = names::columns(&self.names, map.as_ref(), body, first).map_err(malformed)?;
        // the reader of BVH has applied what is declared
        let is_done = self.metres_per_unit == Some(1.0) && self.up == Some(UpAxis::Z);
        let metres = if is_done { 1.0 } else { declared.metres_per_unit.or(self.metres_per_unit).unwrap_or(1.0) };
        let up = if is_done { UpAxis::Z } else { declared.up.or(self.up).unwrap_or(UpAxis::Z) };
        let place = |[x, y, z]: [f64; 3]| match up {
            UpAxis::Z => [metres * x, metres * y, metres * z],
            UpAxis::Y => [metres * x, -metres * z, metres * y],
        };
        let frames = self.frames.len();
        let rate = self.frames_per_second.unwrap_or(set.blind.frames_per_second);
        let mut npz = Npz::from_iter([("fps", Array::new(&[], vec![rate])), ("seeds", Array::new(&[1], vec![0_i64]))]);
        for (array, names_array, kind) in [
            ("estimate_markers", "marker_names", &columns.markers),
            ("estimate_joints", "estimate_joint_names", &columns.joints),
        ] {
            if kind.is_empty() {
                continue;
            }
            let numbers = self
                .frames
                .iter()
                .flat_map(|frame| kind.iter().flat_map(|(column, _)| frame[*column].map_or([f64::NAN; 3], place)));
            npz.push(array, Array::new(&[1, frames, kind.len(), 3], numbers.collect::<Vec<f64>>()));
            npz.push(names_array, Array::names(kind.iter().map(|(_, name)| name.as_str())));
        }
        let file = path.display().to_string();
        let mut estimates = Estimates::from_bytes(&file, &npz.to_bytes(&file)?, body)?;
        estimates.notes.extend(self.notes);
        estimates.notes.extend(columns.note.map(|note| format!("{file} {note}")));
        Ok(estimates)
    }
}

/// A point's distance from another, metres.
fn distance(a: Point3<f64>, b: Point3<f64>) -> f64 {
    (a - b).norm()
}
