//! What can be wrong with a recording.

use std::path::PathBuf;

/// Why a recording could not be read or edited. Each message says where, what was expected and what was found.
#[derive(Debug, thiserror::Error)]
pub enum MocapError {
    /// The file is not there, or may not be read.
    #[error("{}: cannot be read: {source}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// No reader for this extension.
    #[error("{}: expected a recording ending in .bvh, .amc (with its .asf), or DeepMimic's .txt or .json", path.display())]
    UnknownFormat {
        /// The file.
        path: PathBuf,
    },
    /// An AMC file whose skeleton was not found.
    #[error("{}: expected its skeleton beside it ({wanted}), found {found}; name one with `skeleton`", path.display())]
    NoSkeleton {
        /// The motion file.
        path: PathBuf,
        /// The name that was looked for.
        wanted: String,
        /// What was there instead.
        found: String,
    },
    /// A line that does not say what it should.
    #[error("{file}:{line}: expected {expected}, found {found}")]
    Line {
        /// The file.
        file: String,
        /// Line, counted from 1.
        line: usize,
        /// What should stand there.
        expected: String,
        /// What stands there.
        found: String,
    },
    /// A frame that does not say what it should, in a format whose lines mean nothing.
    #[error("{file}: frame {frame} (from 1): expected {expected}, found {found}")]
    Frame {
        /// The file.
        file: String,
        /// Frame, counted from 1.
        frame: usize,
        /// What should stand there.
        expected: String,
        /// What stands there.
        found: String,
    },
    /// Nothing moves in fewer than two frames.
    #[error("{file}: expected at least 2 frames, found {frames}")]
    TooFewFrames {
        /// The file.
        file: String,
        /// How many there are.
        frames: usize,
    },
    /// A setting that makes no sense.
    #[error("{setting}: expected {expected}, found {found}")]
    Setting {
        /// The setting's name.
        setting: &'static str,
        /// What it may be.
        expected: String,
        /// What it is.
        found: String,
    },
    /// A clip that cannot be repeated.
    #[error(
        "clip `{clip}`: expected one cycle of a repeating motion (DeepMimic's `Loop: wrap`), found a clip that is none"
    )]
    NotCyclic {
        /// The clip's name.
        clip: String,
    },
}
