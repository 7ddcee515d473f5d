//! Listings of files with their SHA-256, as `sha256sum` writes and checks them, and the walk over a folder's files.

use std::fs::{self, DirEntry};
use std::io;
use std::path::Path;

/// Pairs of path and SHA-256 as lines.
pub fn listing_of<'a>(files: impl IntoIterator<Item = (&'a String, &'a String)>) -> String {
    files.into_iter().map(|(path, digest)| format!("{digest}  {path}\n")).collect()
}

/// Path and SHA-256 of a line; `None` where it is none, or the path leads elsewhere than below the folder.
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

/// Everything below a folder but folders, in order of the names in each: paths, their parts divided by `/`. Links are
/// listed and not followed: one could lead anywhere, or form a cycle.
///
/// # Errors
/// Where a folder cannot be read.
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
