//! What may be wrong with a URDF.

use crate::input::{excerpt, limits, plain};

/// Why a URDF cannot be used. Every message names the file, and the line and the link or joint where there is one.
#[derive(Debug, thiserror::Error)]
pub enum UrdfError {
    /// The file cannot be read.
    #[error("{}: cannot be read: {source}", plain(file))]
    Unreadable {
        /// The URDF.
        file: String,
        /// What the system says.
        source: std::io::Error,
    },
    /// The text is longer than any URDF should be.
    #[error(
        "{}: longer than {}; a URDF is a short text with its meshes in files of their own",
        plain(file),
        limits::in_words(*limit as u64)
    )]
    TooLong {
        /// The URDF.
        file: String,
        /// Greatest length, bytes.
        limit: usize,
    },
    /// The text is not well-formed XML.
    #[error("{}:{line}: not well-formed XML: {}", plain(file), excerpt(reason))]
    NotXml {
        /// The URDF.
        file: String,
        /// Line, from 1.
        line: u32,
        /// What the reader stumbled over.
        reason: String,
    },
    /// The text is XML but not a humanoid that we can use.
    #[error("{}:{line}: {}: {}", plain(file), excerpt(element), plain(problem))]
    Refused {
        /// The URDF.
        file: String,
        /// Line, from 1.
        line: u32,
        /// The link or joint at fault.
        element: String,
        /// What is wrong, what was expected, what to do.
        problem: String,
    },
    /// No shipped robot has that name.
    #[error("no robot `{}` ships; there are: {known}", excerpt(name))]
    NotShipped {
        /// The name asked for.
        name: String,
        /// The names there are.
        known: String,
    },
}
