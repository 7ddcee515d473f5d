//! Parses camera files of other tools.
//!
//! | format | description | default unit | pixel (0, 0) | axes |
//! |---|---|---|---|---|
//! | [`CameraFileFormat::OpenCv`] | OpenCV's `FileStorage` in YAML, one camera a file | metre | centre of the top-left pixel | `x_camera = R x_world + t`, x right, y down, z forward |
//! | [`CameraFileFormat::HumanEva`] | `.cal`: fc cc alpha kc R T, one camera a file | millimetre | the same | the same |
//! | [`CameraFileFormat::Qualisys`] | Qualisys' calibration in XML, all cameras in one file | millimetre | the same | `x_camera = R (x_world - C)`, x right, y **up**, z **backward** |
//!
//! All are converted to [`Camera`]s in metres with OpenCV's axes and the world's Z up. Features of a format that
//! [`Camera`] cannot represent (skew, fisheye lenses, more than five coefficients) are refused, never dropped.

mod humaneva;
mod opencv_yaml;
mod qualisys;

use nalgebra::Matrix3;

use super::{Camera, CameraError};

/// A format of camera files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum CameraFileFormat {
    /// OpenCV's `FileStorage` in YAML.
    OpenCv,
    /// HumanEva's and PARSEC bodytrack's `.cal`.
    HumanEva,
    /// Qualisys' calibration in XML.
    Qualisys,
}

/// Information that a camera file may lack.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CameraFileOptions {
    /// Name of the camera, for files with one camera; `None`: the name in the file, else `camera`.
    pub name: Option<String>,
    /// Width and height of the images, pixels; required if the file lacks them, and must not contradict the file.
    pub size: Option<[u32; 2]>,
    /// Length of the file's unit, metres; `None`: the default of the format.
    pub metres_per_unit: Option<f64>,
    /// Whether the file's world has Y up (x is kept, -z becomes y).
    pub y_up: bool,
    /// Row of `extrinsic_parameters` that gives the camera's pose, for an OpenCV file without R and T.
    pub view: Option<usize>,
}

impl CameraFileFormat {
    /// The format by file name: `.yml` and `.yaml`, `.cal`, `.xml` and `.qca.txt`.
    pub fn from_name(name: &str) -> Option<Self> {
        let name = name.to_lowercase();
        let ends = |endings: &[&str]| endings.iter().any(|ending| name.ends_with(ending));
        if ends(&[".yml", ".yaml"]) {
            Some(Self::OpenCv)
        } else if ends(&[".cal"]) {
            Some(Self::HumanEva)
        } else {
            ends(&[".xml", ".qca.txt", ".qca"]).then_some(Self::Qualisys)
        }
    }

    fn metres_per_unit(self) -> f64 {
        if self == Self::OpenCv { 1.0 } else { 0.001 }
    }
}

/// Parses the text of a camera file; returns at least one camera.
///
/// # Errors
/// What was expected, where, and what was found; a [`CameraError`]'s message for invalid cameras.
pub fn read_cameras(text: &str, format: CameraFileFormat, options: &CameraFileOptions) -> Result<Vec<Camera>, String> {
    let plain = match format {
        CameraFileFormat::OpenCv => vec![opencv_yaml::read(text, options)?],
        CameraFileFormat::HumanEva => vec![humaneva::read(text)?],
        CameraFileFormat::Qualisys => qualisys::read(text)?,
    };
    if plain.len() > 1 && options.name.is_some() {
        return Err(format!("name: the file has names for its {} cameras; remove this key", plain.len()));
    }
    let unit = options.metres_per_unit.unwrap_or(format.metres_per_unit());
    plain.into_iter().map(|camera| camera.camera(options, unit)).collect()
}

/// A camera as in the file: OpenCV's axes, the file's unit and world.
struct PlainCamera {
    name: Option<String>,
    size: Option<[u32; 2]>,
    k: [[f64; 3]; 3],
    /// k1 k2 p1 p2 k3.
    distortion: [f64; 5],
    r: [[f64; 3]; 3],
    t: [f64; 3],
}

impl PlainCamera {
    fn camera(self, options: &CameraFileOptions, metres_per_unit: f64) -> Result<Camera, String> {
        let name = options.name.clone().or(self.name).unwrap_or_else(|| "camera".to_owned());
        let [width, height] = match (self.size, options.size) {
            (Some(own), Some(given)) if own != given => {
                return Err(format!(
                    "size_px: the file has {own:?} pixels for camera {name:?}, not {given:?}; remove this key"
                ));
            }
            (Some(size), _) | (None, Some(size)) => size,
            (None, None) => {
                return Err(format!("size_px: the file lacks the image size of camera {name:?}; add this key"));
            }
        };
        let mut r = self.r;
        if options.y_up {
            // the file's point is (x, z, -y) of the world's, so columns are exchanged
            r = r.map(|[a, b, c]| [a, -c, b]);
        }
        let t = self.t.map(|t| t * metres_per_unit);
        let camera = Camera::from_opencv(&name, self.k, r, t, self.distortion, width, height);
        camera.map_err(|e: CameraError| e.to_string())
    }
}

/// Nine numbers as three rows.
fn rows(numbers: &[f64; 9]) -> [[f64; 3]; 3] {
    std::array::from_fn(|row| std::array::from_fn(|column| numbers[3 * row + column]))
}

fn rows_of(matrix: &Matrix3<f64>) -> [[f64; 3]; 3] {
    std::array::from_fn(|row| std::array::from_fn(|column| matrix[(row, column)]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Point3, Vector3};

    #[test]
    fn a_world_with_y_up_is_converted() {
        let text = "fx 1";
        assert!(read_cameras(text, CameraFileFormat::HumanEva, &CameraFileOptions::default()).is_err());
        // looks along -z of a world with y up
        let cal = "500 500 319.5 239.5 0 0 0 0 0 0 1 0 0 0 -1 0 0 0 -1 0 0 0";
        let options = CameraFileOptions { size: Some([640, 480]), y_up: true, ..CameraFileOptions::default() };
        let [camera] = &read_cameras(cal, CameraFileFormat::HumanEva, &options).unwrap()[..] else { panic!() };
        // its up is the world's Z, its view the world's +Y
        let up = camera.camera_from_world.inverse_transform_vector(&-Vector3::y());
        let view = camera.camera_from_world.inverse_transform_vector(&Vector3::z());
        assert!((up - Vector3::z()).norm() < 1e-12 && (view - Vector3::y()).norm() < 1e-12, "{up} {view}");
        assert!(camera.sees(&Point3::new(0.0, 3.0, 0.5)));
    }

    #[test]
    fn the_size_is_required_and_must_not_contradict_the_file() {
        let cal = "500 500 319.5 239.5 0 0 0 0 0 0 1 0 0 0 1 0 0 0 1 0 0 0";
        let read = |options: &CameraFileOptions| read_cameras(cal, CameraFileFormat::HumanEva, options);
        assert!(read(&CameraFileOptions::default()).unwrap_err().contains("size_px"));
        let yaml = super::opencv_yaml::tests::SAMPLE;
        let options = CameraFileOptions { size: Some([3, 4]), ..CameraFileOptions::default() };
        let refused = read_cameras(yaml, CameraFileFormat::OpenCv, &options).unwrap_err();
        assert!(refused.contains("[640, 480]") && refused.contains("remove this key"), "{refused}");
    }

    #[test]
    fn formats_are_recognised_by_file_names() {
        let of = CameraFileFormat::from_name;
        assert_eq!(of("a/left.YML"), Some(CameraFileFormat::OpenCv));
        assert_eq!(of("C1.cal"), Some(CameraFileFormat::HumanEva));
        assert_eq!((of("Calib.qca.txt"), of("notes.txt")), (Some(CameraFileFormat::Qualisys), None));
    }
}
