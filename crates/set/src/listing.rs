//! The names of a set's own files, and what else all who read or write files of a set share.

use std::collections::BTreeMap;
use std::path::Path;

use super::SetError;
use crate::input::{files_below, listed_in};

/// The list of all files; a directory without it is no set.
pub(super) const LISTING: &str = "files.sha256";

/// The list of the complete set's files, in a set without its truth.
pub(super) const COMPLETE: &str = "complete.sha256";

/// What describes the files.
pub(super) const README: &str = "README.txt";

/// What stands in the files, in full; not part of the set's identity, so that it may be said better.
pub(super) const FORMATS: &str = "FORMATS.txt";

/// The reader of the truth with NumPy alone.
pub(super) const READER: &str = "read_truth.py";

/// The secret that everything drawn for the observations depends on, where it is not public; below the set.
pub const KEY_FILE: &str = "truth/key.txt";

/// Optional images computed from the truth; not part of the set's identity.
pub(super) const LAYERS: &str = "truth/layers/";

/// Whether the caller wants to stop; checked before every file.
pub(super) type Stop<'a> = &'a (dyn Fn() -> bool + Sync);

/// An error if the caller wants to stop.
pub(super) fn unless(stop: Stop<'_>) -> Result<(), SetError> {
    if stop() { Err(SetError::Stopped) } else { Ok(()) }
}

/// SHA-256 by path, as the listing `name` of the set in `directory` has them.
pub(super) fn digests_in(directory: &Path, name: &str, text: &str) -> Result<BTreeMap<String, String>, SetError> {
    let parts = |(index, line)| {
        let detail = || format!("{name}:{}: expected a SHA-256, two spaces and a path", index + 1);
        listed_in(line).ok_or_else(|| SetError::NotASet { path: directory.to_path_buf(), detail: detail() })
    };
    text.lines().enumerate().map(parts).collect()
}

/// All files below a directory, in order of their names.
pub(super) fn files_of(directory: &Path) -> Result<Vec<String>, SetError> {
    files_below(directory).map_err(SetError::io(directory, "list"))
}
