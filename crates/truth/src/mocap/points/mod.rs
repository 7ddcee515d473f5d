//! Recordings of points: markers of C3D and TRC files. [`joints`] makes a skeleton of them.

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

/// Points times frames that a file may have.
pub const MOST_POINTS: usize = 20_000_000;

/// Points by names, frame by frame, as a file has them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PointFile {
    /// Of the points.
    pub names: Vec<String>,
    /// As the file declares it.
    pub frames_per_second: Option<f64>,
    /// As the file declares it.
    pub metres_per_unit: Option<f64>,
    /// As the file declares it.
    pub up: Option<UpAxis>,
    /// Whether that is only what its format usually has.
    pub up_is_usual: bool,
    /// One entry a frame, one a name; `None` where a point is not seen.
    pub frames: Vec<Vec<Option<[f64; 3]>>>,
    /// What was noticed.
    pub notes: Vec<String>,
}

/// An error of a whole file of points.
pub(super) fn malformed(file: &str, detail: impl Into<String>) -> MocapError {
    MocapError::Points { file: file.to_owned(), detail: detail.into() }
}

/// Reads a recording of markers: C3D, or TRC where `file` ends so. Markers become joint centres by their names
/// (Plug-in Gait, CMU, or joint centres), or by [`ReadOptions::markers`].
///
/// # Errors
/// [`MocapError`] that names the file, what was expected and found.
pub fn parse_markers(bytes: &[u8], file: &str, options: &ReadOptions) -> Result<Clip, MocapError> {
    options.check()?;
    let is_text = file.len() >= 4 && file.as_bytes()[file.len() - 4..].eq_ignore_ascii_case(b".trc");
    let of_text = || trc::parse(&String::from_utf8_lossy(bytes)).map(trc::without_zeros);
    let points = if is_text { of_text() } else { c3d::parse(bytes) };
    joints::clip_of(file, points.map_err(|detail| malformed(file, detail))?, options)
}
