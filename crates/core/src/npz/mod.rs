//! NumPy arrays: `.npy` files, and `.npz` archives of them.
//!
//! ```
//! use skiagraph_core::npz::{Array, Npz};
//! let mut archive = Npz::default();
//! archive.push("angles", Array::new(&[2, 3], vec![0.0, 0.1, 0.2, 0.3, 0.4, 0.5]));
//! let bytes = archive.to_bytes("poses.npz")?;
//! let read = Npz::from_bytes("poses.npz", &bytes)?;
//! assert_eq!(read.f64s("poses.npz", "angles", &[None, Some(3)])?[5], 0.5);
//! # Ok::<(), skiagraph_core::npz::NpzError>(())
//! ```

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
