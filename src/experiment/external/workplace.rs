//! The folder that a program is handed: the blind side of a set, in a fresh folder of the system for temporary files.
//!
//! Nothing of it enters a run. What the program leaves there is listed by name and size, and removed with the folder.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

use serde::{Deserialize, Serialize};

use crate::artefacts::{Unfinished, output};
use crate::benchmark_set::BlindSet;
use crate::experiment::ExperimentError;
use crate::input::excerpt;

/// Files that are listed by name.
const LISTED: usize = 100;
/// How many files are looked at.
const COUNTED: usize = 100_000;
/// How deep they are looked for.
const DEPTH: usize = 16;

/// What programs left in the folders that they were handed; removed with these.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct LeftBehind {
    /// How many files.
    pub files: usize,
    /// Their size, bytes.
    pub bytes: u64,
    /// The first hundred.
    pub listed: Vec<LeftFile>,
}

/// A file that a program left in the folder that it was handed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LeftFile {
    /// For which seed the program ran.
    pub seed: u64,
    /// Its path below the folder, without control characters.
    pub name: String,
    /// Its size, bytes.
    pub bytes: u64,
}

impl LeftBehind {
    /// Whether nothing was left.
    pub fn is_empty(&self) -> bool {
        self.files == 0
    }

    /// Adds what was left for other seeds.
    pub(super) fn extend(&mut self, other: Self) {
        self.files += other.files;
        self.bytes = self.bytes.saturating_add(other.bytes);
        self.listed.extend(other.listed);
        self.listed.truncate(LISTED);
    }
}

/// The blind side of a set in a folder of its own; gone when dropped.
pub(super) struct Workplace {
    root: Unfinished,
    /// The blind side.
    pub(super) folder: PathBuf,
    /// What lies in the folder, as it was handed out.
    handed: BTreeSet<PathBuf>,
}

impl Workplace {
    /// Hands out the blind side of a set.
    pub(super) fn new(set: &BlindSet) -> Result<Self, ExperimentError> {
        let root = Unfinished::begin(fresh_folder()?);
        let folder = root.path().join("blind");
        let mut this = Self { root, folder, handed: BTreeSet::new() };
        set.copy_to(&this.folder)?;
        this.handed = files_below(this.root.path()).into_iter().map(|(path, _)| path).collect();
        Ok(this)
    }

    /// The folder around the blind side, which is removed as a whole.
    pub(super) fn root(&self) -> &Path {
        self.root.path()
    }

    /// What is there that was not handed out.
    pub(super) fn left_behind(&self, seed: u64) -> LeftBehind {
        let mut left = LeftBehind::default();
        for (path, bytes) in files_below(self.root.path()) {
            if self.handed.contains(&path) {
                continue;
            }
            left.files += 1;
            left.bytes = left.bytes.saturating_add(bytes);
            if left.listed.len() < LISTED {
                let name = path.strip_prefix(self.root.path()).unwrap_or(&path).display().to_string();
                left.listed.push(LeftFile { seed, name: excerpt(&name), bytes });
            }
        }
        left
    }
}

/// A folder that was not there before and that other users cannot enter.
fn fresh_folder() -> Result<PathBuf, ExperimentError> {
    static MADE: AtomicU32 = AtomicU32::new(0);
    let temporary = std::env::temp_dir();
    loop {
        let number = MADE.fetch_add(1, Ordering::Relaxed);
        let path = temporary.join(format!("skiagraph-{}-{number}", std::process::id()));
        match private_folder().create(&path) {
            Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists && number < u32::MAX => {}
            made => {
                made.map_err(output(&path, "create the directory"))?;
                return Ok(fs::canonicalize(&path).unwrap_or(path));
            }
        }
    }
}

#[cfg(unix)]
fn private_folder() -> fs::DirBuilder {
    use std::os::unix::fs::DirBuilderExt;
    let mut folder = fs::DirBuilder::new();
    folder.mode(0o700);
    folder
}

#[cfg(not(unix))]
fn private_folder() -> fs::DirBuilder {
    fs::DirBuilder::new()
}

/// All that is below a folder but folders, in the order of the paths, with sizes; links are not followed.
fn files_below(root: &Path) -> Vec<(PathBuf, u64)> {
    let (mut found, mut folders) = (Vec::new(), vec![(root.to_owned(), 0)]);
    while let Some((folder, depth)) = folders.pop() {
        for entry in fs::read_dir(&folder).into_iter().flatten().flatten() {
            let Ok(about) = entry.metadata() else { continue };
            match about.is_dir() {
                true if depth < DEPTH => folders.push((entry.path(), depth + 1)),
                true => {}
                false => found.push((entry.path(), about.len())),
            }
            if found.len() >= COUNTED {
                return found;
            }
        }
    }
    found.sort();
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_is_told_by_name_and_size_and_never_by_what_it_says() {
        let root = tempfile::tempdir().unwrap();
        let folder = root.path().join("blind");
        fs::create_dir_all(folder.join("deep")).unwrap();
        fs::write(folder.join("cameras.json"), "{}").unwrap();
        let handed = files_below(root.path()).into_iter().map(|(path, _)| path).collect();
        let place = Workplace { root: Unfinished::begin(root.path()), folder: folder.clone(), handed };
        assert!(place.left_behind(0).is_empty());
        fs::write(root.path().join("run.json"), "forged").unwrap();
        fs::write(folder.join("deep/notes\n.txt"), "12345").unwrap();
        let left = place.left_behind(7);
        assert_eq!((left.files, left.bytes, left.listed.len()), (2, 11, 2));
        let named = |index: usize| (left.listed[index].name.as_str(), left.listed[index].bytes);
        assert_eq!(named(0).1, 5);
        assert!(named(0).0.starts_with("blind/deep/notes") && !named(0).0.contains('\n'));
        assert_eq!(named(1), ("run.json", 6));
        let mut all = LeftBehind { listed: vec![left.listed[0].clone(); LISTED], files: LISTED, bytes: 0 };
        all.extend(left);
        assert_eq!((all.files, all.bytes, all.listed.len()), (LISTED + 2, 11, LISTED));
        drop(place);
        assert!(!root.path().exists());
    }
}
