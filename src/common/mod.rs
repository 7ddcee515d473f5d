//! What the rooms of the application share: their error, progress and interruption, and JSON files.

mod error;
mod progress;

pub use error::ExperimentError;
pub use progress::{NoProgress, Progress, Stage};

pub(crate) use error::{ONE_CAMERA, TRY_AGAIN, key_error, read_file, stays_unreadable};
pub(crate) use progress::{OnlyInterruption, advance};

/// Named bytes, in the order in which they are written.
pub type NamedFiles = Vec<(&'static str, Vec<u8>)>;

/// A JSON file's bytes, ending in a newline.
pub(crate) fn to_json(value: &impl serde::Serialize) -> Result<Vec<u8>, ExperimentError> {
    let mut bytes = serde_json::to_vec_pretty(value)
        .map_err(|e| ExperimentError::Malformed { path: "JSON".into(), detail: e.to_string() })?;
    bytes.push(b'\n');
    Ok(bytes)
}
