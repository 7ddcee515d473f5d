//! Shared by all readers of external files: size limits, and quoting of their text in messages.
//!
//! A file is read only if it is a regular file within the limit of its kind ([`limits`]); devices, pipes and
//! directories are refused before they are opened. Messages quote at most 200 characters of a file and no control
//! characters.

mod digest;
mod file;
pub(crate) mod limits;
mod quote;

pub(crate) use digest::{HashingWriter, hex_sha256, hex_sha256_of};
pub(crate) use file::{open, read, read_to_string};
pub(crate) use quote::{excerpt, foreign, harmless, plain};
