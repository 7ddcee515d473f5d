//! NumPy's arrays: `.npy` files, and `.npz` archives of them.
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
mod error;
mod npy;

pub use archive::Npz;
pub use array::{Array, Values};
pub use error::NpzError;
