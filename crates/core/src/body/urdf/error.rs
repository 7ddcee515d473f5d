//! Errors of URDF files.

use crate::input::{excerpt, plain};

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
    /// The text is too long, not well-formed XML, or no usable humanoid.
    #[error("{0}")]
    Refused(String),
    /// There is no built-in robot with this name.
    #[error("{0}")]
    NotShipped(String),
}

impl UrdfError {
    pub(super) fn not_xml(file: &str, line: u32, reason: &str) -> Self {
        Self::Refused(format!("{}:{line}: not well-formed XML: {}", plain(file), excerpt(reason)))
    }
}
