//! Checks the numbers of `cameras.json`.

use nalgebra::{Isometry3, Matrix3, Vector3};
use serde_json::Value;

use super::parts::ReadParts;
use super::{CheckOutcome, Fault, filming};
use crate::cameras_file::{self, AXES, PIXEL_CENTRES};
use crate::files::SetFiles;
use crate::input::excerpt;

/// How far a rotation's `R^T R` may be from the identity.
const TOLERANCE: f64 = 1e-9;

/// A camera of the JSON file, read without this program's own reader.
#[derive(Clone)]
pub(super) struct ListedCamera {
    pub(super) name: String,
    pub(super) size: [f64; 2],
    pub(super) k: Matrix3<f64>,
    pub(super) r: Matrix3<f64>,
    pub(super) t: Vector3<f64>,
    /// k1 k2 p1 p2 k3.
    pub(super) distortion: [f64; 5],
    pub(super) near: f64,
    observations: String,
}

impl ListedCamera {
    fn from_json(value: &Value) -> Option<Self> {
        let k = numbers::<9>(&value["K"])?;
        let r = numbers::<9>(&value["R"])?;
        Some(Self {
            name: value["name"].as_str()?.to_owned(),
            size: [value["width"].as_f64()?, value["height"].as_f64()?],
            k: Matrix3::from_row_slice(&k),
            r: Matrix3::from_row_slice(&r),
            t: Vector3::from(numbers::<3>(&value["t"])?),
            distortion: numbers(&value["distortion"])?,
            near: value["near"].as_f64()?,
            observations: value["observations"].as_str()?.to_owned(),
        })
    }

    /// OpenCV's `projectPoints`, from its documentation: pixel coordinates with centres at integers, and depth along z.
    pub(super) fn project(&self, point: &Vector3<f64>) -> ([f64; 2], f64) {
        let p = self.r * point + self.t;
        let [x, y] = self.bent(p.x / p.z, p.y / p.z);
        ([self.k[(0, 0)] * x + self.k[(0, 2)], self.k[(1, 1)] * y + self.k[(1, 2)]], p.z)
    }

    /// The lens, in normalised coordinates.
    fn bent(&self, x: f64, y: f64) -> [f64; 2] {
        let [k1, k2, p1, p2, k3] = self.distortion;
        let r2 = x * x + y * y;
        let radial = 1.0 + k1 * r2 + k2 * r2.powi(2) + k3 * r2.powi(3);
        let bent_x = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x);
        let bent_y = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y;
        [bent_x, bent_y]
    }

    /// Whether the lens model folds back between its centre and a point, by differences in 16 places.
    fn is_folded(&self, point: &Vector3<f64>) -> bool {
        const STEP: f64 = 1e-6;
        let p = self.r * point + self.t;
        let turns_over = |share: f64| {
            let (x, y) = (share * p.x / p.z, share * p.y / p.z);
            let slope = |along: [f64; 2], axis: usize| {
                let [after, before] = [STEP, -STEP].map(|h| self.bent(x + h * along[0], y + h * along[1])[axis]);
                after - before
            };
            let [across, down] = [[1.0, 0.0], [0.0, 1.0]];
            slope(across, 0) * slope(down, 1) <= slope(across, 1) * slope(down, 0)
        };
        self.distortion != [0.0; 5] && (1..=16).any(|place| turns_over(f64::from(place) / 16.0))
    }

    /// Distance of a point inside the borders of the image and the near plane, pixels or metres; negative outside, and
    /// infinitely so beyond the fold of the lens model.
    pub(super) fn margin(&self, point: &Vector3<f64>) -> f64 {
        if self.is_folded(point) {
            return f64::NEG_INFINITY;
        }
        let ([u, v], depth) = self.project(point);
        let [width, height] = self.size;
        // the image extends from -0.5 to its size minus 0.5
        let margins = [u + 0.5, width - 0.5 - u, v + 0.5, height - 0.5 - v, depth - self.near];
        margins.into_iter().fold(f64::INFINITY, f64::min)
    }

    /// The same camera at another pose.
    pub(super) fn placed(&self, camera_from_world: &Isometry3<f64>) -> Self {
        let r = camera_from_world.rotation.to_rotation_matrix().into_inner();
        Self { r, t: camera_from_world.translation.vector, ..self.clone() }
    }

    fn faults(&self, index: usize) -> Vec<String> {
        let mut faults = Vec::new();
        let mut say = |detail: String| faults.push(format!("camera {:?}: {detail}", excerpt(&self.name)));
        let off = (self.r.transpose() * self.r - Matrix3::identity()).amax();
        if off.is_nan() || off > TOLERANCE {
            say(format!("R is not a rotation: R^T R differs from the identity by {off:.1e}"));
        } else if self.r.determinant() < 0.0 {
            say("R has determinant -1: its axes are left-handed, so its images are mirrored".to_owned());
        }
        let (fx, fy) = (self.k[(0, 0)], self.k[(1, 1)]);
        if fx.is_nan() || fy.is_nan() || fx <= 0.0 || fy <= 0.0 {
            say(format!("the focal lengths are {fx} and {fy} pixels; both must be greater than 0"));
        }
        let [width, height] = self.size;
        if width < 1.0 || height < 1.0 {
            say(format!("the image is {width} x {height} pixels"));
        }
        if self.near.is_nan() || self.near <= 0.0 {
            say(format!("the near plane is at {} m; it must be greater than 0", self.near));
        }
        let expected = cameras_file::observations_directory(index);
        if self.observations != expected {
            say(format!(
                "its observations are listed in {:?}, expected {expected:?} for camera {index}",
                excerpt(&self.observations)
            ));
        }
        faults
    }
}

fn numbers<const N: usize>(value: &Value) -> Option<[f64; N]> {
    let flat: Vec<f64> = if value.as_array()?.iter().all(Value::is_array) {
        value
            .as_array()?
            .iter()
            .flat_map(|row| row.as_array().into_iter().flatten())
            .filter_map(Value::as_f64)
            .collect()
    } else {
        value.as_array()?.iter().filter_map(Value::as_f64).collect()
    };
    flat.try_into().ok()
}

/// The cameras of a file, read without this program's own reader.
pub(super) fn plain(files: &SetFiles, path: &str) -> Result<Vec<ListedCamera>, String> {
    let (_, cameras) = read(files, path)?;
    cameras.into_iter().collect::<Option<_>>().ok_or_else(|| format!("not checked: {path} cannot be read"))
}

fn read(files: &SetFiles, path: &str) -> Result<(Value, Vec<Option<ListedCamera>>), String> {
    let unreadable = || format!("not checked: {path} cannot be read");
    let bytes = files.read(path).map_err(|_| unreadable())?;
    let value: Value = serde_json::from_slice(&bytes).map_err(|_| unreadable())?;
    let cameras = value["cameras"].as_array().ok_or_else(unreadable)?.iter().map(ListedCamera::from_json).collect();
    Ok((value, cameras))
}

pub(super) fn check(files: &SetFiles, parts: &ReadParts) -> CheckOutcome {
    let (value, cameras) = read(files, cameras_file::PATH)?;
    let mut faults = Vec::new();
    for (key, expected) in [("axes", AXES), ("pixel_centres", PIXEL_CENTRES)] {
        if value[key].as_str() != Some(expected) {
            let found = excerpt(value[key].as_str().unwrap_or("nothing"));
            faults.push(format!("{key}: expected {expected:?}, found {found:?}"));
        }
    }
    for (index, camera) in cameras.iter().enumerate() {
        match camera {
            Some(camera) => faults.extend(camera.faults(index)),
            None => faults.push(format!(
                "camera {index}: expected name, width, height, K, R, t, distortion, near and observations"
            )),
        }
    }
    let mut faults: Vec<Fault> = faults.into_iter().map(|detail| Fault::new(cameras_file::PATH, detail)).collect();
    faults.extend(filming::faults(parts));
    let over = parts.moments.as_ref().map(|moments| format!(" over {} frames", moments.frames.len()));
    Ok((format!("{} cameras{}", cameras.len(), over.unwrap_or_default()), faults))
}
