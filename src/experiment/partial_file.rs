//! One file that is whole or absent.

use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};

use super::ExperimentError;
use super::error::output;

/// The path with `suffix` behind its name.
pub(super) fn beside(path: &Path, suffix: &str) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(suffix);
    path.with_file_name(name)
}

/// Whether nothing is there.
pub(super) fn is_free(path: &Path) -> bool {
    path.symlink_metadata().is_err()
}

/// Writes a file beside its place and renames it; what was there stays until then. Directories above are made.
///
/// # Errors
/// [`ExperimentError::Output`] that names the file.
pub(super) fn put(path: &Path, bytes: &[u8]) -> Result<(), ExperimentError> {
    if path.file_name().is_none() || path.is_dir() {
        return Err(ExperimentError::Occupied { path: path.to_owned() });
    }
    if let Some(parent) = path.parent().filter(|p| !p.as_os_str().is_empty()) {
        fs::create_dir_all(parent).map_err(output(parent, "create the directory"))?;
    }
    let meanwhile = beside(path, &format!(".writing-{}", std::process::id()));
    let written = File::create(&meanwhile).and_then(|mut file| {
        file.write_all(bytes)?;
        file.sync_all()?;
        fs::rename(&meanwhile, path)
    });
    written.map_err(|source| {
        fs::remove_file(&meanwhile).ok();
        output(path, "write")(source)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_replaced_whole_and_nothing_else_is_left() {
        let root = tempfile::tempdir().unwrap();
        let path = root.path().join("deep/walk.model");
        put(&path, b"one").unwrap();
        put(&path, b"two").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"two");
        assert_eq!(fs::read_dir(path.parent().unwrap()).unwrap().count(), 1);
    }

    #[test]
    fn a_place_that_cannot_be_written_is_named() {
        let root = tempfile::tempdir().unwrap();
        fs::write(root.path().join("a"), "").unwrap();
        let error = put(&root.path().join("a/walk.model"), b"one").unwrap_err();
        assert!(error.to_string().contains("cannot"), "{error}");
        assert!(matches!(put(root.path(), b"one").unwrap_err(), ExperimentError::Occupied { .. }));
    }
}
