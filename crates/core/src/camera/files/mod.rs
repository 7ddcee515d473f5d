//! Parses camera files of other tools.
//!
//! `docs/bring-your-data.md` has the table of formats: their files, units and what is assumed.
//!
//! All are converted to [`Camera`]s in metres with OpenCV's axes and the world's Z up. Features of a format that
//! [`Camera`] cannot represent (skew, fisheye lenses, more than five coefficients) are refused, never dropped.

mod camera_toml;
mod colmap;
mod human36m;
mod humaneva;
mod opencv_yaml;
mod placing;
mod qualisys;
mod storage;

use nalgebra::{Rotation3, Vector3};

pub use self::placing::{CameraFile, FirstCamera, PoseDirection, with_first_camera};
use super::Camera;

const MOST_CAMERAS: usize = 999;

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
    /// The TOML of anipose and aniposelib.
    #[serde(alias = "aniposelib")]
    Anipose,
    /// The TOML of Pose2Sim.
    Pose2Sim,
    /// The TOML of Caliscope.
    Caliscope,
    /// COLMAP's text model.
    Colmap,
    /// EasyMocap's pair of YAML files.
    EasyMocap,
    /// JARVIS' YAML.
    Jarvis,
    /// The pair of YAML files of OpenCV's `stereo_calib`.
    Stereo,
    /// Human3.6M's cameras as JSON.
    #[serde(alias = "h36m")]
    Human36M,
}

impl CameraFileFormat {
    /// The format that files with this name have.
    pub fn from_name(name: &str) -> Option<Self> {
        let name = name.to_lowercase();
        let endings = [
            (".yml", Self::OpenCv),
            (".yaml", Self::OpenCv),
            (".cal", Self::HumanEva),
            (".xml", Self::Qualisys),
            (".qca.txt", Self::Qualisys),
            (".qca", Self::Qualisys),
            (".toml", Self::Anipose),
            (".json", Self::Human36M),
            ("cameras.txt", Self::Colmap),
            ("images.txt", Self::Colmap),
        ];
        endings.iter().find(|(ending, _)| name.ends_with(ending)).map(|(_, format)| *format)
    }

    /// The format of a file with these texts, by what is in them.
    pub fn from_texts(texts: &[&str]) -> Option<Self> {
        let lines =
            || texts.iter().flat_map(|text| text.lines()).map(|line| line.trim_start_matches('\u{feff}').trim());
        let has = |starts: &[&str]| lines().any(|line| starts.iter().any(|start| line.starts_with(start)));
        let first = lines().find(|line| !line.is_empty() && !line.starts_with('#'))?;
        let is_yaml = ["%YAML", "---"].iter().any(|start| first.starts_with(start));
        if first.starts_with('<') {
            Some(Self::Qualisys)
        } else if first.starts_with('{') {
            Some(Self::Human36M)
        } else if !is_yaml && has(&["["]) {
            Some(if has(&["[cameras."]) { Self::Caliscope } else { Self::Anipose })
        } else if has(&["intrinsicMatrix:"]) {
            Some(Self::Jarvis)
        } else if has(&["M1:", "M2:", "R1:", "P1:"]) {
            Some(Self::Stereo)
        } else if has(&["K_", "R_", "Rot_", "T_"]) {
            Some(Self::EasyMocap)
        } else if is_yaml || has(&["camera_matrix:", "K:", "cameraMatrix:", "Camera_Matrix:"]) {
            Some(Self::OpenCv)
        } else if colmap::is_line(first) {
            Some(Self::Colmap)
        } else {
            let mut words = first.split(|c: char| c.is_whitespace() || c == ',').filter(|word| !word.is_empty());
            words.all(|word| word.parse::<f64>().is_ok()).then_some(Self::HumanEva)
        }
    }

    /// The name of the file that has the other half of a format of two files, beside one with this name.
    pub fn other_file(name: &str) -> Option<String> {
        let lower = name.to_lowercase();
        let halves = match () {
            () if lower.ends_with(".txt") => ["cameras", "images"],
            () if lower.ends_with(".yml") || lower.ends_with(".yaml") => ["intri", "extri"],
            () => return None,
        };
        let [one, two] = halves;
        [(one, two), (two, one)].iter().find(|(own, _)| name.contains(own)).map(|(own, other)| name.replace(own, other))
    }
}

/// Parses the text of a camera file, or both texts of a format that has two files, in any order; returns at least one
/// camera, without a name if it has none. The file's path is not used.
///
/// # Errors
/// What was expected, where, and what was found; a [`super::CameraError`]'s message for invalid cameras.
pub fn read_cameras(texts: &[&str], format: CameraFileFormat, options: &CameraFile) -> Result<Vec<Camera>, String> {
    let text = texts.first().copied().unwrap_or_default();
    if options.subject.is_some() && format != CameraFileFormat::Human36M {
        return Err("subject: only valid for a file of Human3.6M; remove this key".to_owned());
    }
    let has_views = [CameraFileFormat::OpenCv, CameraFileFormat::Jarvis, CameraFileFormat::Colmap].contains(&format);
    if options.view.is_some() && !has_views {
        return Err("view: only valid for files of OpenCV and COLMAP; remove this key".to_owned());
    }
    let plain = match format {
        CameraFileFormat::OpenCv => vec![opencv_yaml::read(texts, options, 1.0)?],
        CameraFileFormat::Jarvis => vec![opencv_yaml::read(texts, options, 0.001)?],
        CameraFileFormat::HumanEva => vec![humaneva::read(text)?],
        CameraFileFormat::Qualisys => qualisys::read(text)?,
        CameraFileFormat::Anipose | CameraFileFormat::Pose2Sim | CameraFileFormat::Caliscope => {
            camera_toml::read(text)?
        }
        CameraFileFormat::Colmap => colmap::read(texts, options)?,
        CameraFileFormat::EasyMocap => opencv_yaml::read_easymocap(texts)?,
        CameraFileFormat::Stereo => opencv_yaml::read_stereo(texts, options)?,
        CameraFileFormat::Human36M => human36m::read(text, options)?,
    };
    if !(1..=MOST_CAMERAS).contains(&plain.len()) {
        return Err(format!(
            "expected 1 to {MOST_CAMERAS} cameras in the format {format:?}, found {}; if the file is of another program, \
             `format` takes those that are read",
            plain.len()
        ));
    }
    if plain.len() > 1 && options.name.is_some() {
        return Err(format!("name: the file has names for its {} cameras; remove this key", plain.len()));
    }
    let cameras = plain.into_iter().map(|camera| camera.placed(options)).collect::<Result<Vec<_>, _>>()?;
    placing::with_first_camera(cameras, options.first_camera.as_ref())
}

/// A camera as in the file: OpenCV's axes, the file's unit and world.
#[derive(Clone)]
struct PlainCamera {
    name: Option<String>,
    size: Option<[u32; 2]>,
    k: [[f64; 3]; 3],
    /// k1 k2 p1 p2 k3.
    distortion: [f64; 5],
    r: [[f64; 3]; 3],
    t: [f64; 3],
    /// Length of the file's unit, unless the user knows another.
    metres_per_unit: f64,
}

fn rows(numbers: &[f64; 9]) -> [[f64; 3]; 3] {
    std::array::from_fn(|row| std::array::from_fn(|column| numbers[3 * row + column]))
}

fn transposed(rows: [[f64; 3]; 3]) -> [[f64; 3]; 3] {
    std::array::from_fn(|row| std::array::from_fn(|column| rows[column][row]))
}

/// The rotation of OpenCV's `rvec`, axis times angle, row by row.
fn turned(rvec: [f64; 3]) -> [f64; 9] {
    Rotation3::from_scaled_axis(Vector3::from(rvec))
        .matrix()
        .transpose()
        .data
        .0
        .as_flattened()
        .try_into()
        .unwrap_or_default()
}

/// k1 k2 p1 p2 k3 of the coefficients under `key`; those beyond the fifth must be 0.
fn coefficients(key: &str, numbers: &[f64]) -> Result<[f64; 5], String> {
    const COUNTS: [usize; 8] = [0, 1, 2, 4, 5, 8, 12, 14];
    if !COUNTS.contains(&numbers.len()) {
        return Err(format!("{key}: expected {COUNTS:?} numbers, found {}", numbers.len()));
    }
    if numbers.iter().skip(5).any(|number| *number != 0.0) {
        return Err(format!(
            "{key}: a lens of {} coefficients; only k1 k2 p1 p2 k3 are supported: calibrate again without \
             CALIB_RATIONAL_MODEL and the like, or undistort the images and give five zeros",
            numbers.len()
        ));
    }
    Ok(std::array::from_fn(|i| numbers.get(i).copied().unwrap_or_default()))
}

/// The message that refuses a lens of another kind, which `what` names.
fn other_lens(what: &str) -> String {
    format!(
        "{what}: the lens is a fisheye or of another model; only OpenCV's k1 k2 p1 p2 k3 are supported: undistort the \
         images and give their new K, or calibrate with that model"
    )
}

/// A width or height, which some files write with decimals.
fn pixels(size: [f64; 2]) -> Result<[u32; 2], String> {
    let most = f64::from(super::MAX_IMAGE_SIZE);
    if size.iter().all(|side| (1.0..=most).contains(side) && side.fract() == 0.0) {
        Ok(size.map(|side| side as u32))
    } else {
        Err(format!("size: expected whole numbers from 1 to {most}, found {size:?}"))
    }
}

#[cfg(test)]
mod tests;
