//! The files of a set on their way to a directory, in any order and from any thread.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};

use rayon::prelude::*;

use super::SetError;
use super::file_content::FileContent;
use super::journal::{Journal, WholeFiles};
use super::listing::{LISTING, Stop, listing_line, unless};
use super::shard_plan::{PACKED, ShardPlan};
use crate::input::{HashingWriter, hex_sha256};

/// From so many files on, the whole file system is synchronised at once: one by one takes milliseconds a file.
const MANY: usize = 200;

/// Writes files that are not there yet, and last their listing.
pub(super) struct SetWriter<'a> {
    folder: &'a Path,
    stop: Stop<'a>,
    journal: Option<Journal>,
    whole: Mutex<WholeFiles>,
    /// Folders that are there.
    folders: Mutex<BTreeSet<String>>,
}

impl<'a> SetWriter<'a> {
    /// Writes into `folder`, where none of the files may be yet.
    pub(super) fn new(folder: &'a Path, stop: Stop<'a>) -> Self {
        Self { folder, stop, journal: None, whole: Mutex::default(), folders: Mutex::default() }
    }

    /// Goes on with what the journal says to be whole, some of it in the shards of `plan`.
    pub(super) fn resuming(
        folder: &'a Path,
        stop: Stop<'a>,
        journal: &Path,
        plan: Option<ShardPlan>,
    ) -> Result<Self, SetError> {
        let (journal, whole) = Journal::resume(journal, folder, plan, stop)?;
        Ok(Self { journal: Some(journal), whole: Mutex::new(whole), ..Self::new(folder, stop) })
    }

    /// Whether the caller wants to stop.
    pub(super) fn unless_stopped(&self) -> Result<(), SetError> {
        unless(self.stop)
    }

    /// Whether this file is whole, be it in a shard.
    pub(super) fn has(&self, path: &str) -> bool {
        let whole = self.whole();
        whole.loose.contains_key(path) || whole.packed.contains_key(path)
    }

    /// Removes a file that is whole in a shard now; it is listed apart.
    pub(super) fn pack(&self, path: &str) -> Result<(), SetError> {
        let Some(digest) = self.whole().loose.remove(path) else { return Ok(()) };
        self.whole().packed.insert(path.to_owned(), digest);
        let full = self.folder.join(path);
        fs::remove_file(&full).map_err(SetError::io(&full, "remove"))
    }

    /// Writes a file that is not there yet.
    pub(super) fn put(&self, path: &str, bytes: &[u8]) -> Result<(), SetError> {
        self.create(path, |file| file.write_all(bytes).map(|()| hex_sha256(bytes)))
    }

    /// Writes a file piece by piece; `write` gives its SHA-256.
    pub(super) fn create(
        &self,
        path: &str,
        write: impl FnOnce(&mut File) -> std::io::Result<String>,
    ) -> Result<(), SetError> {
        self.unless_stopped()?;
        self.make_folder_of(path)?;
        let full = self.folder.join(path);
        let digest = File::create_new(&full).and_then(|mut file| write(&mut file));
        let digest = digest.map_err(SetError::io(&full, "write"))?;
        let path = path.to_owned();
        if let Some(journal) = &self.journal {
            journal.add(&path, &digest)?;
        }
        self.whole().loose.insert(path, digest);
        Ok(())
    }

    /// Writes a file, or makes sure that the one that is there is the same.
    pub(super) fn put_same(&self, path: &str, content: &FileContent) -> Result<(), SetError> {
        let there = self.whole().loose.get(path).cloned();
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
                // told below; what was written is not whole
                return Err(std::io::ErrorKind::Other.into());
            }
            let (mut file, digest) = to.finish();
            file.flush().map(|()| digest)
        });
        refused.and(written)
    }

    /// Makes sure that every file is on the disk, then writes the listing.
    pub(super) fn finish(self) -> Result<(), SetError> {
        let packed: String = self.whole().packed.iter().map(listing_line).collect();
        if !packed.is_empty() {
            self.put_same(PACKED, &FileContent::Bytes(packed.into_bytes()))?;
        }
        let digests = self.whole.into_inner().unwrap_or_else(PoisonError::into_inner).loose;
        // syncing after all writes lets one journal commit serve many files
        unless(self.stop)?;
        if digests.len() < MANY || !sync_file_system(self.folder)? {
            let paths: Vec<&String> = digests.keys().collect();
            paths.par_iter().try_for_each(|path| {
                unless(self.stop)?;
                sync(&self.folder.join(path))
            })?;
        }
        let listing: String = digests.iter().map(listing_line).collect();
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
        // joined with nothing, a path would end in a slash
        let folder = if name.is_empty() { self.folder.to_owned() } else { self.folder.join(name) };
        fs::create_dir_all(&folder).map_err(SetError::io(&folder, "create the directory"))?;
        self.folders().insert(name.to_owned());
        Ok(())
    }

    fn whole(&self) -> MutexGuard<'_, WholeFiles> {
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

/// Makes sure that everything on the file system of `folder` is on the disk; `false` where the system cannot.
#[cfg(any(target_os = "linux", target_os = "android"))]
fn sync_file_system(folder: &Path) -> Result<bool, SetError> {
    let synced = File::open(folder).and_then(|folder| Ok(rustix::fs::syncfs(folder)?));
    synced.map(|()| true).map_err(SetError::io(folder, "write"))
}

/// Makes sure that everything on the file system of `folder` is on the disk; `false` where the system cannot.
#[cfg(not(any(target_os = "linux", target_os = "android")))]
fn sync_file_system(_: &Path) -> Result<bool, SetError> {
    Ok(false)
}

fn sync(path: &Path) -> Result<(), SetError> {
    File::open(path).and_then(|file| file.sync_all()).map_err(SetError::io(path, "write"))
}
