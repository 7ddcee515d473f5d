//! Inputs of a command, which are never overwritten.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use super::error::ArtefactError;
use super::place::are_same;
use skiagraph_core::input::{self, hex_sha256_of};
use skiagraph_set::is_set;

/// Maximum size of a file that is hashed, bytes: larger than any valid recording.
const LARGEST: u64 = 4 << 30;

#[derive(Clone, Debug, Default)]
pub(crate) struct Inputs {
    paths: Vec<PathBuf>,
}

impl Inputs {
    /// The existing ones of these paths.
    pub(crate) fn new(paths: impl IntoIterator<Item = PathBuf>) -> Self {
        Self { paths: paths.into_iter().filter(|path| path.exists()).collect() }
    }

    pub(crate) fn into_paths(self) -> Vec<PathBuf> {
        self.paths
    }

    /// The SHA-256 of every file but `own`, by what [`super::MadeBy`] calls it.
    pub(crate) fn hashes(&self, own: Option<&Path>) -> BTreeMap<String, String> {
        let mut hashes = BTreeMap::new();
        for path in self.paths.iter().filter(|path| Some(path.as_path()) != own) {
            let digest = input::open(path, LARGEST).and_then(hex_sha256_of);
            if let (Ok(digest), Some(name)) = (digest, path.file_name()) {
                hashes.insert(format!("SHA-256 of {}", name.to_string_lossy()), digest);
            }
        }
        hashes
    }

    /// Refuses a `target` that is an input, contains one, or lies in a set that is one.
    pub(crate) fn keep_from(&self, target: &Path) -> Result<(), ArtefactError> {
        if target.file_name().is_none() {
            // a root or `..`: refused elsewhere, since nothing can be written there
            return Ok(());
        }
        let place = resolved(target);
        let changes = |input: &&PathBuf| {
            let read = resolved(input);
            read.starts_with(&place)
                || (is_set(&read) && place.starts_with(&read))
                || are_same(fs::metadata(target), fs::metadata(input)) == Some(true)
        };
        match self.paths.iter().find(changes) {
            Some(input) => Err(ArtefactError::IsInput { path: target.to_owned(), input: input.clone() }),
            None => Ok(()),
        }
    }
}

/// The path without links; for a path that does not exist, relative to its nearest existing directory.
fn resolved(path: &Path) -> PathBuf {
    if let Ok(real) = fs::canonicalize(path) {
        return real;
    }
    match (path.parent(), path.file_name()) {
        (Some(parent), Some(name)) if !parent.as_os_str().is_empty() => resolved(parent).join(name),
        (_, Some(name)) => resolved(Path::new(".")).join(name),
        _ => path.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_input_is_protected_under_every_name() {
        let root = tempfile::tempdir().unwrap();
        let at = |name: &str| root.path().join(name);
        fs::create_dir_all(at("data/set")).unwrap();
        fs::write(at("data/walk.bvh"), "walk").unwrap();
        fs::write(at("data/set/files.sha256"), "set").unwrap();
        let inputs = Inputs::new([at("data/walk.bvh"), at("data/set"), at("nowhere")]);
        let mut targets = vec!["data/walk.bvh", "data/../data/walk.bvh", "data", "data/set", "data/set/runs/new"];
        if cfg!(unix) {
            #[cfg(unix)]
            std::os::unix::fs::symlink(at("data"), at("link")).unwrap();
            fs::hard_link(at("data/walk.bvh"), at("hard.bvh")).unwrap();
            targets.extend(["link", "link/walk.bvh", "hard.bvh", "link/set/a"]);
        }
        for target in targets {
            assert!(inputs.keep_from(&at(target)).is_err(), "{target}");
        }
        for target in ["data/walk.html", "data/set2", "runs/a/b", "nowhere", "data/walk.bvh~"] {
            inputs.keep_from(&at(target)).unwrap();
        }
    }
}
