//! Writes the files of a set to a directory, in any order and from any thread, with a journal of complete files: one
//! line per file in the format of `sha256sum`, added when the file is complete.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use rayon::prelude::*;

use super::SetError;
use super::format::listing::{LISTING, Stop, files_of, stop_if_requested};
use skiagraph_core::input;
use skiagraph_core::input::{HashingWriter, hex_sha256, hex_sha256_of, limits, listed_in, listing_of};
use skiagraph_core::npz::Npz;
use skiagraph_core::parallel;

/// From this number of files on, the whole file system is synchronised at once; single files take milliseconds each.
const MANY: usize = 200;

/// Writes new files, and their listing last.
pub(super) struct SetWriter<'a> {
    folder: &'a Path,
    stop: Stop<'a>,
    journal: Option<Journal>,
    /// SHA-256 of complete files by path.
    whole: Mutex<BTreeMap<String, String>>,
    folders: Mutex<BTreeSet<String>>,
}

impl<'a> SetWriter<'a> {
    /// Writes into `folder`, which must contain none of the files.
    pub(super) fn new(folder: &'a Path, stop: Stop<'a>) -> Self {
        Self { folder, stop, journal: None, whole: Mutex::default(), folders: Mutex::default() }
    }

    /// Continues with the files that are complete according to the journal.
    pub(super) fn resuming(folder: &'a Path, stop: Stop<'a>, journal: &Path) -> Result<Self, SetError> {
        let (journal, whole) = Journal::resume(journal, folder, stop)?;
        Ok(Self { journal: Some(journal), whole: Mutex::new(whole), ..Self::new(folder, stop) })
    }

    pub(super) fn stop_if_requested(&self) -> Result<(), SetError> {
        stop_if_requested(self.stop)
    }

    /// Whether this file is complete.
    pub(super) fn has(&self, path: &str) -> bool {
        self.whole().contains_key(path)
    }

    pub(super) fn put(&self, path: &str, bytes: &[u8]) -> Result<(), SetError> {
        self.create(path, |file| file.write_all(bytes).map(|()| hex_sha256(bytes)))
    }

    /// Writes a new file in pieces; `write` returns its SHA-256.
    pub(super) fn create(
        &self,
        path: &str,
        write: impl FnOnce(&mut File) -> std::io::Result<String>,
    ) -> Result<(), SetError> {
        self.stop_if_requested()?;
        self.make_folder_of(path)?;
        let full = self.folder.join(path);
        let digest = File::create_new(&full).and_then(|mut file| write(&mut file));
        let digest = digest.map_err(SetError::io(&full, "write"))?;
        let path = path.to_owned();
        if let Some(journal) = &self.journal {
            journal.add(&path, &digest)?;
        }
        self.whole().insert(path, digest);
        Ok(())
    }

    /// Writes a file, or checks that the existing one has the same content.
    pub(super) fn put_same(&self, path: &str, content: &FileContent) -> Result<(), SetError> {
        let there = self.whole().get(path).cloned();
        if let Some(there) = there {
            let mut hashed = HashingWriter::new(std::io::sink());
            hash_into(&mut hashed, Path::new(path), content)?;
            let (_, digest) = hashed.finish();
            return if there == digest { Ok(()) } else { Err(SetError::Differs { file: path.to_owned() }) };
        }
        let mut refused = Ok(());
        let written = self.create(path, |file| {
            let mut to = HashingWriter::new(BufWriter::new(file));
            refused = hash_into(&mut to, &self.folder.join(path), content);
            if refused.is_err() {
                // the error is returned below; the file is incomplete
                return Err(std::io::ErrorKind::Other.into());
            }
            let (mut file, digest) = to.finish();
            file.flush().map(|()| digest)
        });
        refused.and(written)
    }

    /// Synchronises all files to disk, then writes the listing.
    pub(super) fn finish(self) -> Result<(), SetError> {
        let digests = self.whole.into_inner().unwrap_or_else(PoisonError::into_inner);
        // syncing after all writes lets one journal commit serve many files
        stop_if_requested(self.stop)?;
        if digests.len() < MANY || !sync_file_system(self.folder)? {
            let paths: Vec<&String> = digests.keys().collect();
            paths.par_iter().try_for_each(|path| {
                stop_if_requested(self.stop)?;
                sync(&self.folder.join(path))
            })?;
        }
        let listing = listing_of(&digests);
        let path = self.folder.join(LISTING);
        let written = File::create_new(&path).and_then(|mut file| file.write_all(listing.as_bytes()));
        written.map_err(SetError::io(&path, "write"))?;
        sync(&path)
    }

    fn make_folder_of(&self, path: &str) -> Result<(), SetError> {
        let name = path.rsplit_once('/').map_or("", |(folder, _)| folder);
        if self.folders().contains(name) {
            return Ok(());
        }
        // joining an empty name would add a trailing slash
        let folder = if name.is_empty() { self.folder.to_owned() } else { self.folder.join(name) };
        fs::create_dir_all(&folder).map_err(SetError::io(&folder, "create the directory"))?;
        self.folders().insert(name.to_owned());
        Ok(())
    }

    fn whole(&self) -> MutexGuard<'_, BTreeMap<String, String>> {
        self.whole.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn folders(&self) -> MutexGuard<'_, BTreeSet<String>> {
        self.folders.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn hash_into<W: Write>(to: &mut HashingWriter<W>, path: &Path, content: &FileContent) -> Result<(), SetError> {
    let name = path.to_string_lossy();
    content.write_to(&name, &mut |part| to.write_all(part).map_err(SetError::io(path, "write")))
}

/// Synchronises the file system of `folder` to disk; `false` if the platform does not support it.
#[cfg(any(target_os = "linux", target_os = "android"))]
fn sync_file_system(folder: &Path) -> Result<bool, SetError> {
    let synced = File::open(folder).and_then(|folder| Ok(rustix::fs::syncfs(folder)?));
    synced.map(|()| true).map_err(SetError::io(folder, "write"))
}

/// Synchronises the file system of `folder` to disk; `false` if the platform does not support it.
#[cfg(not(any(target_os = "linux", target_os = "android")))]
fn sync_file_system(_: &Path) -> Result<bool, SetError> {
    Ok(false)
}

fn sync(path: &Path) -> Result<(), SetError> {
    File::open(path).and_then(|file| file.sync_all()).map_err(SetError::io(path, "write"))
}

/// A journal that any thread can append to.
#[derive(Debug)]
struct Journal {
    path: PathBuf,
    file: Mutex<File>,
}

impl Journal {
    /// Continues or creates the journal at `path` of the files in `folder`, and returns the complete files: those with
    /// the SHA-256 of the journal. All other files in `folder` are removed, because they may be incomplete.
    fn resume(path: &Path, folder: &Path, stop: Stop<'_>) -> Result<(Self, BTreeMap<String, String>), SetError> {
        let listed: Vec<(String, String)> = lines_of(path)?.into_iter().collect();
        let is_whole = |index: usize| {
            let (path, digest): &(String, String) = &listed[index];
            let found = File::open(folder.join(path)).and_then(hex_sha256_of);
            !stop() && found.is_ok_and(|found| found == *digest)
        };
        let are_whole = parallel::map(listed.len(), is_whole);
        stop_if_requested(stop)?;
        let listed = listed.into_iter().zip(are_whole).filter(|(_, whole)| *whole);
        let whole: BTreeMap<String, String> = listed.map(|(line, _)| line).collect();
        for file in files_of(folder)?.iter().filter(|file| !whole.contains_key(*file)) {
            let file = folder.join(file);
            fs::remove_file(&file).map_err(SetError::io(&file, "remove"))?;
        }
        // rewritten, because the last line may be truncated
        let lines = listing_of(&whole);
        let meanwhile = path.with_extension("writing");
        let written = fs::write(&meanwhile, lines).and_then(|()| fs::rename(&meanwhile, path));
        let opened = written.and_then(|()| File::options().append(true).open(path));
        let file = Mutex::new(opened.map_err(SetError::io(path, "write"))?);
        Ok((Self { path: path.to_owned(), file }, whole))
    }

    fn add(&self, path: &String, digest: &String) -> Result<(), SetError> {
        let line = listing_of([(path, digest)]);
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        file.write_all(line.as_bytes()).map_err(SetError::io(&self.path, "write"))
    }
}

/// Digests by path from the complete lines of a journal; empty if there is no journal.
fn lines_of(path: &Path) -> Result<BTreeMap<String, String>, SetError> {
    let bytes = match input::read(path, limits::LISTING) {
        Ok(bytes) => bytes,
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(BTreeMap::new()),
        Err(e) => return Err(SetError::io(path, "read")(e)),
    };
    let text = String::from_utf8_lossy(&bytes);
    Ok(text.split_inclusive('\n').filter_map(|line| listed_in(line.strip_suffix('\n')?)).collect())
}

/// Content of a file before serialisation.
pub(super) enum FileContent {
    Bytes(Vec<u8>),
    Arrays(Npz),
}

impl FileContent {
    /// Writes all bytes in order, in parts.
    pub(super) fn write_to(
        &self,
        path: &str,
        put: &mut dyn FnMut(&[u8]) -> Result<(), SetError>,
    ) -> Result<(), SetError> {
        match self {
            Self::Bytes(bytes) => put(bytes),
            Self::Arrays(arrays) => arrays.write_to(path, put),
        }
    }

    /// All bytes at once.
    pub(super) fn into_bytes(self, path: &str) -> Result<Vec<u8>, SetError> {
        match self {
            Self::Bytes(bytes) => Ok(bytes),
            Self::Arrays(arrays) => Ok(arrays.to_bytes(path)?),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn truncated_changed_and_unlisted_files_are_removed_and_a_truncated_line_is_ignored() {
        let root = tempfile::tempdir().unwrap();
        let (folder, path) = (root.path().join("set"), root.path().join("finished.sha256"));
        fs::create_dir_all(folder.join("deep")).unwrap();
        for (name, text) in [("a", "one"), ("deep/b", "two"), ("c", "three"), ("d", "four"), ("deep/e", "five")] {
            fs::write(folder.join(name), text).unwrap();
        }
        let line = |name: &str, text: &str| format!("{}  {name}\n", hex_sha256(text.as_bytes()));
        let lines = line("a", "one") + &line("deep/b", "two") + "nonsense\n" + &line("c", "other") + &line("gone", "x");
        fs::write(&path, lines.clone() + line("d", "four").trim_end()).unwrap();
        let (journal, whole) = Journal::resume(&path, &folder, &|| false).unwrap();
        assert_eq!(whole.keys().collect::<Vec<_>>(), ["a", "deep/b"]);
        assert_eq!(files_of(&folder).unwrap(), ["a", "deep/b"]);
        journal.add(&"f".to_owned(), &hex_sha256(b"six")).unwrap();
        let now = fs::read_to_string(&path).unwrap();
        assert_eq!(now, line("a", "one") + &line("deep/b", "two") + &line("f", "six"));
        assert!(matches!(Journal::resume(&path, &folder, &|| true), Err(SetError::Stopped)));
    }
}
