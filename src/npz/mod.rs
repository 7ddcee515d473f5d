//! NumPy's arrays: `.npy` files, and `.npz` archives of them.

mod archive;
mod element;
mod error;
mod npy;

pub use archive::Npz;
pub use error::NpzError;
pub use npy::{Array, Values};
