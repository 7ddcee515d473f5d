//! Files of a set on disk that are in its tar shards.
//!
//! `packed.sha256` lists them by their paths in a set without shards. A shard is indexed once, when one of its files is
//! first read. Every read is checked against the list.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use super::SetError;
use super::listing::digests_in;
use super::samples::{TarPlaces, tar_places};
use super::shard_plan::{OBSERVED, PACKED, ShardPlan, frame_of, is_shard};
use crate::input::{self, hex_sha256, limits};

/// The files in the shards of a set on disk.
#[derive(Debug)]
pub(super) struct PackedFiles {
    directory: PathBuf,
    /// SHA-256 by path.
    digests: BTreeMap<String, String>,
    plan: ShardPlan,
    /// The index of every shard by path, or why it could not be made.
    tars: BTreeMap<String, OnceLock<Result<TarPlaces, ShardFault>>>,
    /// SHA-256 of the list according to `files.sha256`.
    listed: String,
    /// SHA-256 of the list as found.
    found: String,
}

/// Why a shard cannot be indexed.
#[derive(Clone, Debug)]
enum ShardFault {
    Missing,
    Broken(String),
}

impl PackedFiles {
    /// The files in the shards of the set in `directory`, whose other files are `listed`; `None` without shards.
    pub(super) fn open(directory: &Path, listed: &BTreeMap<String, String>) -> Result<Option<Self>, SetError> {
        let Some(own) = listed.get(PACKED) else { return Ok(None) };
        let path = directory.join(PACKED);
        let text = input::read_to_string(&path, limits::LISTING).map_err(SetError::io(&path, "read"))?;
        let digests = digests_in(directory, PACKED, &text)?;
        let tars: BTreeMap<_, _> =
            listed.keys().filter(|path| is_shard(path)).map(|path| (path.clone(), OnceLock::new())).collect();
        let shards = tars.keys().filter(|path| path.starts_with(OBSERVED)).count();
        let frames = digests.keys().filter_map(|path| frame_of(path)).max().map_or(0, |last| last.saturating_add(1));
        let (listed, found) = (own.clone(), hex_sha256(text.as_bytes()));
        Ok(Some(Self {
            directory: directory.to_owned(),
            digests,
            plan: ShardPlan { shards, frames },
            tars,
            listed,
            found,
        }))
    }

    /// SHA-256 of every file by its path.
    pub(super) fn digests(&self) -> &BTreeMap<String, String> {
        &self.digests
    }

    /// The bytes of a file of at most `limit` bytes, checked against its SHA-256.
    pub(super) fn read(&self, path: &str, limit: u64) -> Result<Vec<u8>, SetError> {
        if self.listed != self.found {
            let (listed, found) = (self.listed.clone(), self.found.clone());
            return Err(SetError::Tampered { file: PACKED.to_owned(), listed, found });
        }
        let no_shard = || SetError::malformed(PACKED, format!("{path}: no shard of the set contains it"));
        let place = self.plan.place_of(path).ok_or_else(no_shard)?;
        let fault = |fault: &ShardFault| match fault {
            ShardFault::Missing => SetError::MissingShard { file: place.tar.clone(), shards: self.plan.shards },
            ShardFault::Broken(detail) => SetError::BrokenShard { file: place.tar.clone(), detail: detail.clone() },
        };
        let broken = |detail: String| fault(&ShardFault::Broken(detail));
        let tar = self.tars.get(&place.tar).ok_or_else(no_shard)?;
        let full = self.directory.join(&place.tar);
        let places = tar.get_or_init(|| index_of(&full)).as_ref().map_err(fault)?;
        let (at, size) = *places.get(&place.name).ok_or_else(|| broken(format!("it has no {}", place.name)))?;
        if size > limit {
            return Err(broken(format!("{}: {size} bytes, expected at most {limit}", place.name)));
        }
        let bytes = read_range(&full, at, size).map_err(SetError::io(&full, "read"))?;
        if self.digests.get(path).is_some_and(|listed| *listed == hex_sha256(&bytes)) {
            Ok(bytes)
        } else {
            Err(broken(format!("{} in it was changed", place.name)))
        }
    }
}

fn index_of(path: &Path) -> Result<TarPlaces, ShardFault> {
    File::open(path).and_then(|mut file| tar_places(&mut file)).map_err(|error| match error.kind() {
        io::ErrorKind::NotFound => ShardFault::Missing,
        io::ErrorKind::UnexpectedEof => ShardFault::Broken("it is truncated".to_owned()),
        _ => ShardFault::Broken(error.to_string()),
    })
}

fn read_range(path: &Path, at: u64, size: u64) -> io::Result<Vec<u8>> {
    let mut file = File::open(path)?;
    file.seek(SeekFrom::Start(at))?;
    let mut bytes = Vec::new();
    file.take(size).read_to_end(&mut bytes)?;
    Ok(bytes)
}
