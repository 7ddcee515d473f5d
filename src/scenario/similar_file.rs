//! Suggestions for misspelt files.

use std::fs;
use std::path::Path;

use super::diagnostic::did_you_mean;

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_misspelt_file_is_suggested_beside_its_place() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("walk.toml"), "").unwrap();
        let meant = |name: &str| similar_file(&folder.path().join(name));
        assert_eq!(meant("wlak.toml"), Some(folder.path().join("walk.toml").display().to_string()));
        assert_eq!(meant("sets"), None);
        assert_eq!(meant("nowhere/walk.toml"), None);
    }
}
