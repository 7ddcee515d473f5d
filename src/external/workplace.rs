//! The folder of a program: the blind side of a set in a fresh temporary folder.
//!
//! Nothing in it enters a run. Files that the program leaves there are listed by name and size, and removed. A locked
//! file beside the folder says that this process lives; folders of processes that were killed are removed by the next.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Once;
use std::sync::atomic::{AtomicU32, Ordering};

use serde::{Deserialize, Serialize};

use crate::artefacts::{ArtefactError, LockedPlace, Unfinished, output, remove};
use crate::common::ExperimentError;
use skiagraph_core::input::excerpt;
use skiagraph_set::BlindSet;

/// Files that are listed by name.
const LISTED: usize = 100;
/// Files that are counted at most.
const COUNTED: usize = 100_000;
/// Depth to which they are searched.
const DEPTH: usize = 16;

/// Files that programs left in their folders, which are removed.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct LeftBehind {
    pub files: usize,
    /// Their total size, bytes.
    pub bytes: u64,
    /// The first hundred.
    pub listed: Vec<LeftFile>,
}

/// A file that a program left in its folder.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LeftFile {
    /// The seed of the program's run.
    pub seed: u64,
    /// Its path below the folder, without control characters.
    pub name: String,
    /// Its size, bytes.
    pub bytes: u64,
}

impl LeftBehind {
    pub fn is_empty(&self) -> bool {
        self.files == 0
    }

    pub(super) fn extend(&mut self, other: Self) {
        self.files += other.files;
        self.bytes = self.bytes.saturating_add(other.bytes);
        self.listed.extend(other.listed);
        self.listed.truncate(LISTED);
    }
}

/// The blind side of a set in a temporary folder, which is removed when dropped.
pub(super) struct Workplace {
    root: Unfinished,
    /// The blind side.
    pub(super) folder: PathBuf,
    /// The files that were in the folder at the start.
    provided: BTreeSet<PathBuf>,
    /// Dropped last, when the folder is gone.
    _place: LockedPlace,
}

impl Workplace {
    pub(super) fn new(set: &BlindSet) -> Result<Self, ExperimentError> {
        let temporary = std::env::temp_dir();
        SWEPT.call_once(|| sweep(&temporary));
        let (place, root) = fresh_folder(&temporary)?;
        let root = Unfinished::begin(root);
        let folder = root.path().join("blind");
        let mut this = Self { root, folder, provided: BTreeSet::new(), _place: place };
        set.copy_to(&this.folder)?;
        this.provided = files_below(this.root.path()).into_iter().map(|(path, _)| path).collect();
        Ok(this)
    }

    pub(super) fn left_behind(&self, seed: u64) -> LeftBehind {
        let mut left = LeftBehind::default();
        for (path, bytes) in files_below(self.root.path()) {
            if self.provided.contains(&path) {
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

static SWEPT: Once = Once::new();

/// Removes the folders of processes of this program that were killed: those beside which they left a file that nobody
/// has locked.
fn sweep(temporary: &Path) {
    for entry in fs::read_dir(temporary).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let folder = name.to_str().and_then(|name| name.strip_prefix('.')?.strip_suffix(".lock"));
        let Some((process, number)) = folder.and_then(|name| name.strip_prefix("skiagraph-")?.split_once('-')) else {
            continue;
        };
        let is_number = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
        if is_number(process) && is_number(number) {
            let folder = temporary.join(format!("skiagraph-{process}-{number}"));
            // taking the place fails while its process lives; dropping it removes the file
            drop(LockedPlace::take(&folder).map(|_place| remove(&folder)));
        }
    }
}

/// A new folder that other users cannot enter, and its lock.
fn fresh_folder(temporary: &Path) -> Result<(LockedPlace, PathBuf), ExperimentError> {
    static MADE: AtomicU32 = AtomicU32::new(0);
    loop {
        let number = MADE.fetch_add(1, Ordering::Relaxed);
        let path = temporary.join(format!("skiagraph-{}-{number}", std::process::id()));
        let place = match LockedPlace::take(&path) {
            Err(ArtefactError::Busy { .. }) if number < u32::MAX => continue,
            taken => taken?,
        };
        match private_folder().create(&path) {
            Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists && number < u32::MAX => {}
            made => {
                made.map_err(output(&path, "create the directory"))?;
                return Ok((place, fs::canonicalize(&path).unwrap_or(path)));
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

/// The files below a folder, sorted by path, with their sizes; links are not followed.
fn files_below(root: &Path) -> Vec<(PathBuf, u64)> {
    let (mut found, mut folders) = (Vec::new(), vec![(root.to_owned(), 0)]);
    while let Some((folder, depth)) = folders.pop() {
        for entry in fs::read_dir(&folder).into_iter().flatten().flatten() {
            let Ok(about) = entry.metadata() else { continue };
            if !about.is_dir() {
                found.push((entry.path(), about.len()));
            } else if depth < DEPTH {
                folders.push((entry.path(), depth + 1));
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
    fn left_files_are_listed_by_name_and_size_without_their_content() {
        let root = tempfile::tempdir().unwrap();
        let folder = root.path().join("blind");
        fs::create_dir_all(folder.join("deep")).unwrap();
        fs::write(folder.join("cameras.json"), "{}").unwrap();
        let provided = files_below(root.path()).into_iter().map(|(path, _)| path).collect();
        let lock = LockedPlace::take(root.path()).unwrap();
        let place = Workplace { root: Unfinished::begin(root.path()), folder: folder.clone(), provided, _place: lock };
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
    // the copy of the set stayed in the temporary folder for good if this process was killed
    #[test]
    fn folders_of_killed_processes_are_swept() {
        let temporary = tempfile::tempdir().unwrap();
        let (living, _folder) = fresh_folder(temporary.path()).unwrap();
        for name in ["skiagraph-17-0", "skiagraph-18-0", "skiagraph-notes-1"] {
            fs::create_dir_all(temporary.path().join(name).join("blind")).unwrap();
        }
        for name in [".skiagraph-17-0.lock", ".skiagraph-19-4.lock", ".skiagraph-notes-1.lock"] {
            fs::write(temporary.path().join(name), "").unwrap();
        }
        sweep(temporary.path());
        let left = fs::read_dir(temporary.path()).unwrap().map(|entry| entry.unwrap().file_name());
        let left: BTreeSet<String> = left.map(|name| name.into_string().unwrap()).collect();
        let own = living.path.file_name().unwrap().to_str().unwrap().to_owned();
        let kept = [".skiagraph-notes-1.lock", "skiagraph-18-0", "skiagraph-notes-1"].map(str::to_owned);
        assert_eq!(left, kept.into_iter().chain([format!(".{own}.lock"), own]).collect());
    }
}
