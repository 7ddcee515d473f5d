//! Where results go.

use std::path::Path;

/// Where a result goes.
#[derive(Clone, Copy, Debug)]
pub struct Destination<'a> {
    /// The directory.
    pub path: &'a Path,
    /// Replace a set that the same command made and move aside anything else, instead of refusing.
    pub force: bool,
}
