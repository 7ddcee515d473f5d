//! NumPy arrays: `.npy` files, and `.npz` archives of them.

mod archive;
mod array;
mod element;
mod npy;

pub use archive::Npz;
pub use array::{Array, Values};

use crate::input::plain;

/// An error in an archive of arrays.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}: {}", plain(file), plain(detail))]
pub struct NpzError {
    /// The archive's name.
    pub file: String,
    /// What was expected and what was found.
    pub detail: String,
}

impl NpzError {
    #[doc(hidden)]
    pub fn new(file: &str, detail: impl Into<String>) -> Self {
        Self { file: file.to_owned(), detail: detail.into() }
    }
}
