//! Names of a set's own files, and helpers for all readers and writers of sets.

use std::collections::BTreeMap;
use std::path::Path;

use crate::SetError;
use skiagraph_core::input::{files_below, listed_in};

/// The list of all files; a directory without it is not a set.
pub(crate) const LISTING: &str = "files.sha256";

/// The identity of the complete set, in a set without its truth.
pub(crate) const COMPLETE: &str = "complete.sha256";

pub(crate) const README: &str = "README.txt";

/// Full description of the formats; not part of the set's identity, so that it can be edited.
pub(crate) const FORMATS: &str = "FORMATS.txt";

/// A reader of the truth that needs only NumPy.
pub(crate) const READER: &str = "read_truth.py";

/// The secret key of all random numbers of the observations, unless it is public; path inside the set.
pub const KEY_FILE: &str = "truth/key.txt";

/// The command that made the set; not part of its identity.
pub(crate) const MADE_BY: &str = "truth/made_by.json";

/// The same in the set of a recording, which has no folder for the truth.
pub(crate) const FOOTAGE_MADE_BY: &str = "made_by.json";

/// Optional images computed from the truth; not part of the set's identity.
pub(crate) const LAYERS: &str = "truth/layers/";

/// Returns whether the caller wants to stop; checked before every file.
pub(crate) type Stop<'a> = &'a (dyn Fn() -> bool + Sync);

/// [`SetError::Stopped`] if the caller wants to stop.
pub(crate) fn stop_if_requested(stop: Stop<'_>) -> Result<(), SetError> {
    if stop() { Err(SetError::Stopped) } else { Ok(()) }
}

/// SHA-256 by path from `text`, the listing `name` of the set in `directory`.
pub(crate) fn digests_in(directory: &Path, name: &str, text: &str) -> Result<BTreeMap<String, String>, SetError> {
    let parts = |(index, line)| {
        let detail = || format!("{name}:{}: expected a SHA-256, two spaces and a path", index + 1);
        listed_in(line).ok_or_else(|| SetError::NotASet { path: directory.to_path_buf(), detail: detail() })
    };
    text.lines().enumerate().map(parts).collect()
}

/// All files below a directory, in order of their names.
pub(crate) fn files_of(directory: &Path) -> Result<Vec<String>, SetError> {
    files_below(directory).map_err(SetError::io(directory, "list"))
}
