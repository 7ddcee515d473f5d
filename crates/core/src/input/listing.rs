//! Lists of files with their SHA-256 in `sha256sum`'s format, and a recursive listing of a folder's files.

use std::fs::{self, DirEntry};
use std::io;
use std::path::Path;

/// Formats pairs of path and SHA-256 as lines.
pub fn listing_of<'a>(files: impl IntoIterator<Item = (&'a String, &'a String)>) -> String {
    files.into_iter().map(|(path, digest)| format!("{digest}  {path}\n")).collect()
}

/// Path and SHA-256 of a line; `None` if the line is malformed or the path leads out of the folder.
pub fn listed_in(line: &str) -> Option<(String, String)> {
    let (digest, path) = line.split_once("  ").filter(|(digest, path)| is_digest(digest) && stays_inside(path))?;
    Some((path.to_owned(), digest.to_owned()))
}

fn is_digest(text: &str) -> bool {
    text.len() == 64 && text.bytes().all(|b| b.is_ascii_digit() || (b'a'..=b'f').contains(&b))
}

fn stays_inside(path: &str) -> bool {
    !path.is_empty() && !path.contains('\\') && path.split('/').all(|part| !["", ".", ".."].contains(&part))
}

/// Paths of all files below a folder, relative to it with `/` as separator, sorted by name within each folder. Links
/// are listed but not followed: one could lead anywhere, or form a cycle.
pub fn files_below(folder: &Path) -> io::Result<Vec<String>> {
    let mut found = Vec::new();
    add_files_below(folder, "", &mut found)?;
    Ok(found)
}

fn add_files_below(folder: &Path, prefix: &str, found: &mut Vec<String>) -> io::Result<()> {
    let mut entries = fs::read_dir(folder)?.collect::<io::Result<Vec<_>>>()?;
    entries.sort_by_key(DirEntry::file_name);
    for entry in entries {
        let name = format!("{prefix}{}", entry.file_name().to_string_lossy());
        if entry.file_type()?.is_dir() {
            add_files_below(&entry.path(), &format!("{name}/"), found)?;
        } else {
            found.push(name);
        }
    }
    Ok(())
}
