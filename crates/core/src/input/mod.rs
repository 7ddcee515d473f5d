//! Shared by all readers of external files: size limits, where files that a file names may lie, and quoting of their
//! text in messages.
//!
//! A file is read only if it is a regular file within the limit of its kind ([`limits`]); devices, pipes and
//! directories are refused before they are opened. Files that a file names lie in [`AllowedFolders`]. Messages quote at
//! most 200 characters of a file and no control characters, and nothing of a file that is not of its kind: a scenario
//! may name somebody's credentials as a recording.

mod allowed_folders;
mod digest;
mod file;
pub mod limits;
mod listing;
mod quote;

pub use allowed_folders::AllowedFolders;
pub use digest::{HashingWriter, hex_sha256, hex_sha256_of};
pub use file::{open, read, read_to_string};
pub use listing::{files_below, listed_in, listing_of};
pub use quote::{excerpt, foreign, foreign_about, harmless, is_own_output, plain, shell_word, table_cell, unquoted};
