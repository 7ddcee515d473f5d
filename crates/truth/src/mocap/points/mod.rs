//! Marker recordings in C3D and TRC files. [`joints`] computes a skeleton from the markers.

mod anatomical;
mod c3d;
mod frames;
mod gaps;
mod joints;
mod names;
mod trc;

use super::{Clip, MocapError, ReadOptions, UpAxis};

pub use c3d::parse as parse_c3d;
pub use trc::parse as parse_trc;

/// Limit on points times frames of a file.
pub const MOST_POINTS: usize = 20_000_000;

/// Named points of every frame, in the file's units and axes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PointFile {
    /// Names of the points.
    pub names: Vec<String>,
    /// Frames per second, if the file declares it.
    pub frames_per_second: Option<f64>,
    /// Length of the unit in metres, if the file declares it.
    pub metres_per_unit: Option<f64>,
    /// Up axis, if the file or its format defines it.
    pub up: Option<UpAxis>,
    /// Whether `up` is only the format's usual axis, not declared by the file.
    pub up_is_usual: bool,
    /// The time of every row of `frames`, seconds, increasing; empty if the file has no such times.
    pub times_s: Vec<f64>,
    /// Per frame and name; `None` where the point is missing.
    pub frames: Vec<Vec<Option<[f64; 3]>>>,
    /// Notes of the reader.
    pub notes: Vec<String>,
}

/// Metres per unit of length of this name, as marker files spell it.
fn metres_per_unit(unit: &str) -> Option<f64> {
    match unit.trim().to_ascii_lowercase().as_str() {
        "m" | "meter" | "meters" | "metre" | "metres" => Some(1.0),
        "cm" | "centimeter" | "centimeters" | "centimetre" | "centimetres" => Some(0.01),
        "mm" | "millimeter" | "millimeters" | "millimetre" | "millimetres" => Some(0.001),
        "in" | "inch" | "inches" => Some(0.0254),
        "ft" | "foot" | "feet" => Some(0.3048),
        _ => None,
    }
}

/// An error about the whole file.
pub(super) fn malformed(file: &str, detail: impl Into<String>) -> MocapError {
    MocapError::Points { file: file.to_owned(), detail: detail.into() }
}

/// Parses a marker recording: TRC if `file` ends in `.trc`, else C3D. Joint centres are computed from the markers,
/// which are identified by name (Plug-in Gait, CMU, or joint centres) or by [`ReadOptions::markers`].
///
/// # Errors
/// [`MocapError`] with the file, what was expected and what was found.
pub fn parse_markers(bytes: &[u8], file: &str, options: &ReadOptions) -> Result<Clip, MocapError> {
    options.check()?;
    let is_text = file.len() >= 4 && file.as_bytes()[file.len() - 4..].eq_ignore_ascii_case(b".trc");
    let points = if is_text {
        trc::parse(&String::from_utf8_lossy(bytes), options.metres_per_unit).map(trc::zeros_as_missing)
    } else {
        c3d::parse(bytes)
    };
    joints::clip_from_points(file, points.map_err(|detail| malformed(file, detail))?, options)
}
