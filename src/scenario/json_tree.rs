//! Values that hold settings, read from a tree of JSON, whatever file it comes from: every type of settings is then compiled for
//! one kind of input alone, and every mistake is told by its key.

use serde::de::DeserializeOwned;
use serde_json::Value;

use crate::input::foreign;

/// What is wrong with a tree, and at which key.
pub(crate) type Error = serde_path_to_error::Error<serde_json::Error>;

/// The value that a tree says.
pub(crate) fn value<T: DeserializeOwned>(tree: Value) -> Result<T, Error> {
    serde_path_to_error::deserialize(tree)
}

/// The value of a JSON file, or what is wrong with it.
pub(crate) fn value_of_file<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, String> {
    let tree = serde_json::from_slice(bytes).map_err(foreign)?;
    value(tree).map_err(foreign)
}
