//! A set on disk: manifest, writer, reader.

mod error;
mod npy;
mod npz;

pub use error::SetError;
pub use npy::{Array, Values};
pub use npz::Npz;
