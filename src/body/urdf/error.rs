//! What may be wrong with a URDF.

/// Why a URDF cannot be used. Every message names the file, and the line and the link or joint where there is one.
#[derive(Debug, thiserror::Error)]
pub enum UrdfError {
    /// The file cannot be read.
    #[error("{file}: cannot be read: {source}")]
    Unreadable {
        /// The URDF.
        file: String,
        /// What the system says.
        source: std::io::Error,
    },
    /// The text is longer than any URDF should be.
    #[error("{file}: longer than {limit} bytes; a URDF is a short text with its meshes in files of their own")]
    TooLong {
        /// The URDF.
        file: String,
        /// Greatest length, bytes.
        limit: usize,
    },
    /// The text is not well-formed XML.
    #[error("{file}:{line}: not well-formed XML: {reason}")]
    NotXml {
        /// The URDF.
        file: String,
        /// Line, from 1.
        line: u32,
        /// What the reader stumbled over.
        reason: String,
    },
    /// The text is XML but not a humanoid that we can use.
    #[error("{file}:{line}: {element}: {problem}")]
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
    #[error("no robot `{name}` ships; there are: {known}")]
    NotShipped {
        /// The name asked for.
        name: String,
        /// The names there are.
        known: String,
    },
}
