//! Shared by all readers of external files: size limits, and quoting of input in messages.
//!
//! Only regular files within the size limit of their kind ([`limits`]) are read; devices, pipes and directories are
//! refused before they are opened. Messages quote at most 200 characters of a file, without control characters, and
//! nothing of a file of another kind: a scenario may reference a user's credentials as a recording.

mod digest;
mod file;
pub mod limits;
mod listing;
mod quote;

pub use digest::{HashingWriter, hex_sha256, hex_sha256_of};
pub use file::{open, read, read_to_string};
pub use listing::{files_below, listed_in, listing_of};
pub use quote::{
    excerpt, excerpts, foreign, foreign_about, harmless, is_own_output, plain, shell_word, table_cell, unquoted,
};
