//! Marker recordings in C3D and TRC files. [`joints`] computes a skeleton from the markers.

mod anatomical;
mod c3d;
mod frames;
mod gaps;
mod joints;
mod labels;
mod names;
mod trc;

use std::fmt::Display;

use skiagraph_core::input::plain;

use super::{Clip, MocapError, ReadOptions, UpAxis};

pub use c3d::parse as parse_c3d;
pub use joints::IN_VIEW;
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

/// Metres per unit of length of this name, as marker files spell it; long names may be cut to four letters.
fn metres_per_unit(unit: &str) -> Option<f64> {
    let unit = unit.trim().to_ascii_lowercase();
    let names: [(f64, &[&str]); 5] = [
        (1.0, &["m", "meters", "metres"]),
        (0.01, &["cm", "centimeters", "centimetres"]),
        (0.001, &["mm", "millimeters", "millimetres"]),
        (0.0254, &["in", "inch", "inches"]),
        (0.3048, &["ft", "foot", "feet"]),
    ];
    let is_name = |name: &&str| *name == unit || unit.len() >= 4 && name.starts_with(&unit);
    names.iter().find(|(_, names)| names.iter().any(&is_name)).map(|(metres, _)| *metres)
}

/// An error about the whole file.
pub(super) fn malformed(file: &str, detail: impl Display) -> MocapError {
    MocapError::Refused(format!("{}: {}", plain(file), plain(detail)))
}

/// Parses a marker recording: TRC if `file` ends in `.trc`, else C3D. Joint centres are computed from the markers,
/// which are identified by name (Plug-in Gait, CMU, or joint centres) or by [`ReadOptions::markers`].
pub fn parse_markers(bytes: &[u8], file: &str, options: &ReadOptions) -> Result<Clip, MocapError> {
    options.check()?;
    let is_text = file.len() >= 4 && file.as_bytes()[file.len() - 4..].eq_ignore_ascii_case(b".trc");
    let points = if is_text {
        trc::parse(&String::from_utf8_lossy(bytes), options.metres_per_unit)
            .and_then(|points| trc::with_missing_rows(points, options.frames_per_second))
    } else {
        c3d::parse(bytes)
    };
    let mut points = points.map(zeros_as_missing).map_err(|detail| malformed(file, detail))?;
    let count = points.frames.len();
    let used = options.used_frames.clone().unwrap_or(0..count);
    let used = used.start..used.end.min(count);
    let used = if used.len() < 2 { 0..count } else { used };
    points.frames = points.frames.drain(used.clone()).collect();
    labels::make_unique(&mut points, options).map_err(|detail| malformed(file, detail))?;
    let mut clip = joints::clip_from_points(file, points, used.start, options)?;
    if let (Some(first), Some(last)) = (clip.frames.first().cloned(), clip.frames.last().cloned()) {
        // the frames keep their numbers
        clip.frames.splice(..0, vec![first; used.start]);
        clip.frames.resize(count.max(clip.frames.len()), last);
    }
    Ok(clip)
}

/// Treats points exactly at the origin as missing, since many programs write missing points so, with a note. Only for
/// recordings: pose estimates may have their root at the origin in every frame.
fn zeros_as_missing(mut points: PointFile) -> PointFile {
    let mut zeros = 0;
    for point in points.frames.iter_mut().flatten().filter(|point| **point == Some([0.0; 3])) {
        *point = None;
        zeros += 1;
    }
    if zeros > 0 {
        points.notes.push(format!("{zeros} points at exactly 0, 0, 0 in all frames treated as missing"));
    }
    points
}
