//! Errors of URDF files.

use crate::input::{excerpt, limits, plain};

/// Why a URDF cannot be used. Every message names the file, and the line and the link or joint if known.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum UrdfError {
    /// The file cannot be read.
    #[error("{}: cannot be read: {source}", plain(file))]
    Unreadable {
        /// The URDF.
        file: String,
        /// The operating system's error.
        source: std::io::Error,
    },
    /// The text is longer than a URDF should be.
    #[error(
        "{}: larger than {}; a URDF is a short text, with meshes in separate files",
        plain(file),
        limits::describe_size(*limit as u64)
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
        /// The XML parser's message.
        reason: String,
    },
    /// The text is XML but not a usable humanoid.
    #[error("{}:{line}: {}: {}", plain(file), excerpt(element), plain(problem))]
    Refused {
        /// The URDF.
        file: String,
        /// Line, from 1.
        line: u32,
        /// The link or joint with the error.
        element: String,
        /// The problem, what was expected, and what to do.
        problem: String,
    },
    /// There is no built-in robot with this name.
    #[error("no built-in robot `{}`; known: {known}", excerpt(name))]
    NotShipped {
        /// The requested name.
        name: String,
        /// The known names.
        known: String,
    },
}
