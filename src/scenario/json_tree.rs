//! Reads settings from a JSON tree for every file format, so that each type is compiled for one input only, and every
//! error has its key.

use serde::de::DeserializeOwned;
use serde_json::Value;

use crate::input::foreign_about;

/// An error of a tree with its key.
pub(crate) type TreeError = serde_path_to_error::Error<serde_json::Error>;

/// The value of a tree.
pub(crate) fn value<T: DeserializeOwned>(tree: Value) -> Result<T, TreeError> {
    serde_path_to_error::deserialize(tree)
}

/// The value of a JSON file, or an error, which quotes the file only if it is in a format of this program.
pub(crate) fn value_of_file<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, String> {
    let tree = serde_json::from_slice(bytes).map_err(|e| foreign_about(bytes, e))?;
    value(tree).map_err(|e| foreign_about(bytes, e))
}
