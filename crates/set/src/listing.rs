//! The list of a set's files, as `sha256sum` writes it, and what else all who read or write files of a set share.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use super::SetError;

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

/// A line of a listing.
pub(super) fn listing_line((path, digest): (&String, &String)) -> String {
    format!("{digest}  {path}\n")
}

/// SHA-256 by path, as the listing `name` of the set in `directory` has them.
pub(super) fn digests_in(directory: &Path, name: &str, text: &str) -> Result<BTreeMap<String, String>, SetError> {
    let parts = |(index, line)| {
        let detail = || format!("{name}:{}: expected a SHA-256, two spaces and a path", index + 1);
        let not_a_set = || SetError::NotASet { path: directory.to_path_buf(), detail: detail() };
        let (digest, path) = listing_parts(line).ok_or_else(not_a_set)?;
        Ok((path.to_owned(), digest.to_owned()))
    };
    text.lines().enumerate().map(parts).collect()
}

/// SHA-256 and path of a line of a listing; `None` if it is none.
pub(super) fn listing_parts(line: &str) -> Option<(&str, &str)> {
    line.split_once("  ").filter(|(digest, path)| is_digest(digest) && stays_inside(path))
}

fn is_digest(text: &str) -> bool {
    text.len() == 64 && text.bytes().all(|b| b.is_ascii_digit() || (b'a'..=b'f').contains(&b))
}

/// Whether a path from a file leads nowhere but below the set.
fn stays_inside(path: &str) -> bool {
    !path.is_empty() && !path.contains('\\') && path.split('/').all(|part| !["", ".", ".."].contains(&part))
}

/// All files below a directory, in order of their names.
pub(super) fn files_below(directory: &Path, prefix: &str) -> Result<Vec<String>, SetError> {
    let mut found = Vec::new();
    let entries = fs::read_dir(directory).and_then(|entries| entries.collect::<Result<Vec<_>, _>>());
    let mut entries = entries.map_err(SetError::io(directory, "list"))?;
    entries.sort_by_key(fs::DirEntry::file_name);
    for entry in entries {
        let name = format!("{prefix}{}", entry.file_name().to_string_lossy());
        // a link to a directory is not followed: it could lead anywhere or form a cycle
        if entry.file_type().is_ok_and(|kind| kind.is_dir()) {
            found.extend(files_below(&entry.path(), &format!("{name}/"))?);
        } else {
            found.push(name);
        }
    }
    Ok(found)
}
