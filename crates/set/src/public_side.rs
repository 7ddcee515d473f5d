//! A set without its truth, and the truth that is kept apart.
//!
//! Its `files.sha256` lists the files that are there. `complete.sha256` has the lines that the complete set is known
//! by, whose SHA-256 is the hash of both: runs of the one are measured with the other. All lines of the truth are one,
//! which depends on the set's key, too: with a hash of the truth alone a guess could be confirmed.

use std::fs;
use std::path::{Path, PathBuf};

use super::blind::BlindSet;
use super::files::SetFiles;
use super::listing::{COMPLETE, KEY_FILE, LISTING, READER, README};
use super::shard_plan::PACKED;
use super::{BenchmarkSet, SetError};
use crate::input::{hex_sha256, listing_of};

const OF_FILMING: &str = "
Cameras that move or keep times of their own (set.toml: schema skiagraph.set/2). cameras.npz has, for T frames and C cameras,
camera_from_world (T, C, 7: x y z qw qx qy qz; x_camera = R x_world + t) and time_s (T, C), when the first row of the image was
exposed; NaN means that the camera took no image for the frame, and then there is none in observations/. Row r was exposed
line_delay_s[camera] * r seconds after the first. cameras.json has the same cameras as they are in frame 0.
";

/// A set on disk, and where its truth is kept.
#[derive(Clone, Copy, Debug)]
pub struct SetPlace<'a> {
    /// Folder of the set.
    pub folder: &'a Path,
    /// Folder of the complete set, where the set itself may lack its truth.
    pub truth: Option<&'a Path>,
}

/// Whether the truth of the set in `directory` is kept apart.
pub fn is_public(directory: &Path) -> bool {
    SetFiles::open(directory).is_ok_and(|files| files.refuse_without_truth().is_err())
}

impl<'a> From<&'a Path> for SetPlace<'a> {
    fn from(folder: &'a Path) -> Self {
        Self { folder, truth: None }
    }
}

impl SetPlace<'_> {
    /// Opens both sides.
    ///
    /// # Errors
    /// As [`BenchmarkSet::read`]; [`SetError::NoTruth`] where it is needed and not given, [`SetError::OthersTruth`]
    /// where it is that of another set.
    pub fn read(self) -> Result<BenchmarkSet, SetError> {
        let own = SetFiles::open(self.folder)?;
        match self.complete(&own)? {
            None => BenchmarkSet::read(self.folder),
            Some(complete) => BenchmarkSet::from_sides(own, &complete),
        }
    }

    /// The folders that are read.
    pub fn folders(self) -> impl Iterator<Item = PathBuf> {
        [Some(self.folder), self.truth].into_iter().flatten().map(Path::to_owned)
    }

    /// The files of the complete set that was given for `own`.
    pub(super) fn complete(self, own: &SetFiles) -> Result<Option<SetFiles>, SetError> {
        let Some(folder) = self.truth else { return own.refuse_without_truth().map(|()| None) };
        let files = SetFiles::open(folder)?;
        files.refuse_without_truth()?;
        let (expected, found) = (own.set_hash(), files.set_hash());
        if found != expected {
            let (set, truth) = (self.folder.to_owned(), folder.to_owned());
            return Err(SetError::OthersTruth { set, truth, expected, found });
        }
        Ok(Some(files))
    }
}

impl BlindSet {
    /// Writes a set without its truth into a folder: the same set for [`Self::read`], by its hash too.
    ///
    /// # Errors
    /// [`SetError`] if a file cannot be written; [`SetError::Inconsistent`] of a set without a key, whose hash would
    /// confirm a guess of its truth.
    pub fn write_without_truth(&self, folder: &Path) -> Result<(), SetError> {
        let files = self.files();
        if !files.is_sealed() {
            let detail =
                format!("a set whose truth is kept apart needs a key of its own, {KEY_FILE}; render it with one");
            return Err(SetError::inconsistent(detail));
        }
        let own = |path: &str| [README, READER, PACKED, COMPLETE].contains(&path);
        let goes_along = |path: &str| !path.starts_with("truth/") && files.is_loose(path) && !own(path);
        files.copy_to(folder, goes_along)?;
        let mut listed = files.digests_where(goes_along);
        let mut put = |path: &str, text: &str| {
            listed.insert(path.to_owned(), hex_sha256(text.as_bytes()));
            fs::write(folder.join(path), text).map_err(SetError::io(&folder.join(path), "write"))
        };
        put(README, &readme(self.moments.is_some()))?;
        put(COMPLETE, &files.identity())?;
        if files.is_loose(PACKED) {
            let lines = files.packed_digests().filter(|(path, _)| !path.starts_with("truth/"));
            put(PACKED, &listing_of(lines))?;
        }
        fs::write(folder.join(LISTING), listing_of(&listed)).map_err(SetError::io(&folder.join(LISTING), "write"))
    }
}

fn readme(is_filmed: bool) -> String {
    let text = include_str!("readme_public.txt");
    if is_filmed {
        [&text.replacen("skiagraph.set/1", "skiagraph.set/2", 1), OF_FILMING].concat()
    } else {
        text.to_owned()
    }
}
