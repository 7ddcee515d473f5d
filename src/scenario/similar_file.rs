//! Suggestions for misspelt files.

use std::fs;
use std::path::Path;

use super::diagnostic::did_you_mean;
use skiagraph_core::input::plain;

/// Greatest number of names of a folder that are compared with a misspelt one.
const MOST_NAMES: usize = 10_000;

/// For a missing path, the sibling with the most similar name.
pub(crate) fn similar_file(path: &Path) -> Option<String> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let entries = fs::read_dir(folder).ok()?.flatten().take(MOST_NAMES);
    let mut names: Vec<String> = entries.filter_map(|entry| entry.file_name().into_string().ok()).collect();
    names.sort();
    let meant = did_you_mean(path.file_name()?.to_str()?, names.iter().map(String::as_str))?;
    Some(path.with_file_name(meant).display().to_string())
}

/// The suggestion at the end of a message about a missing file: `walk` may be `walk.toml` or `scenarios/walk.toml`.
pub(super) fn suggestion_for(path: &Path) -> String {
    if path.exists() {
        return String::new();
    }
    let named = path.with_extension("toml");
    let mut places = [named.clone(), Path::new("scenarios").join(&named)].into_iter();
    let known = places.find(|file| file.is_file());
    let known = known.map(|file| file.display().to_string());
    match known.or_else(|| similar_file(path).filter(|guess| !Path::new(guess).is_dir())) {
        Some(guess) => format!("; did you mean {}?", plain(guess)),
        None if path == Path::new("walk") => "; to use the built-in walk, give no file".to_owned(),
        None => String::new(),
    }
}
