//! Errors of recordings.

use std::path::PathBuf;

use skiagraph_core::input::plain;

/// Errors of reading and editing recordings. Each message gives the location, what was expected and what was found.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MocapError {
    /// The file is missing or not readable.
    #[error("{}: cannot be read: {source}", plain(path.display()))]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// The cause.
        source: std::io::Error,
    },
    /// No reader for this extension.
    #[error(
        "{}: expected a recording ending in .bvh, .amc (with its .asf), .c3d, .trc, DeepMimic's .txt or .json, AMASS's .npz, or an \
         animation in .glb, .gltf, .vrm or .vrma",
        plain(path.display())
    )]
    UnknownFormat {
        /// The file.
        path: PathBuf,
    },
    /// An AMC file whose skeleton was not found.
    #[error(
        "{}: expected its skeleton {} in the same folder, found {found}; set `skeleton`",
        plain(path.display()),
        plain(wanted)
    )]
    NoSkeleton {
        /// The motion file.
        path: PathBuf,
        /// The expected name.
        wanted: String,
        /// What was found instead.
        found: String,
    },
    /// A line has unexpected content.
    #[error("{}:{line}: expected {}, found {}", plain(file), plain(expected), plain(found))]
    Line {
        /// The file.
        file: String,
        /// Line, counted from 1.
        line: usize,
        /// The expected content.
        expected: String,
        /// The actual content.
        found: String,
    },
    /// A frame has unexpected content, in a format without meaningful lines.
    #[error("{}: frame {frame} (from 1): expected {}, found {}", plain(file), plain(expected), plain(found))]
    Frame {
        /// The file.
        file: String,
        /// Frame, counted from 1.
        frame: usize,
        /// The expected content.
        expected: String,
        /// The actual content.
        found: String,
    },
    /// A marker file that cannot be read, or whose points do not define a body.
    #[error("{}: {}", plain(file), plain(detail))]
    Points {
        /// The file.
        file: String,
        /// What was expected, and what was found.
        detail: String,
    },
    /// A recording without frames, or with one among empty ones.
    #[error("{}: expected frames with a pose, found {frames}", plain(file))]
    TooFewFrames {
        /// The file.
        file: String,
        /// The number of frames.
        frames: usize,
    },
    /// No common unit gives a plausible body height.
    #[error("{}", unknown_unit(file, *length))]
    UnknownUnit {
        /// The file.
        file: String,
        /// Height of the body, file units.
        length: f64,
    },
    /// A setting is invalid.
    #[error("{setting}: expected {}, found {found}", plain(expected))]
    Setting {
        /// The setting's name.
        setting: &'static str,
        /// The allowed values.
        expected: String,
        /// The actual value.
        found: String,
    },
    /// A clip that cannot be repeated.
    #[error(
        "clip `{}`: expected one cycle of a repeating motion (DeepMimic's `Loop: wrap`), found a motion that does not repeat",
        plain(clip)
    )]
    NotCyclic {
        /// The clip's name.
        clip: String,
    },
    /// A clip whose joints do not pair left and right.
    #[error("clip `{}` cannot be mirrored: {}", plain(clip), plain(detail))]
    NotSymmetric {
        /// The clip's name.
        clip: String,
        /// The joint, and what is wrong with it.
        detail: String,
    },
}

fn unknown_unit(file: &str, length: f64) -> String {
    if length == 0.0 {
        return format!(
            "{file}: expected a body, found no joint from which limbs branch: an animation without a skeleton?"
        );
    }
    format!(
        "{file}: expected a body 1.2 to 2.3 m tall in a common unit (mm, cm, dm, m, inch, foot or CMU's inch/0.45), \
         found a height of {length:.4} units; set the length of the file's unit (`metres_per_unit` in a scenario, \
         --metres-per-unit on the command line, --units of evaluate)"
    )
}
