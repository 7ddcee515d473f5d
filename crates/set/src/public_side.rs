//! A public set without its truth, and the complete set with the truth.
//!
//! The public set's `files.sha256` lists its own files. Its `complete.sha256` has the identity of the complete set; its
//! SHA-256 is the set hash of both, so runs on one are measured with the other. The lines of the truth are combined to
//! one that also depends on the set's key, because a hash of the truth alone could confirm a guess.

use std::fs;
use std::path::{Path, PathBuf};

use super::blind::BlindSet;
use super::files::SetFiles;
use super::format::colour_files::OF_COLOUR;
use super::format::listing::{COMPLETE, KEY_FILE, LISTING, READER, README};
use super::set::OF_KEYPOINTS;
use super::{BenchmarkSet, SetError};
use skiagraph_core::input::{hex_sha256, listing_of, plain};

const OF_FILMING: &str = "
Cameras that move or keep times of their own (set.toml: schema skiagraph.set/2). cameras.npz has, for T frames and C cameras,
camera_from_world (T, C, 7: x y z qw qx qy qz; x_camera = R x_world + t) and time_s (T, C), when the first row of the image was
exposed; NaN means that the camera took no image for the frame, and then there is none in observations/. Row r was exposed
line_delay_s[camera] * r seconds after the first. cameras.json has the same cameras as they are in frame 0.
";

/// A set on disk, and the location of its truth.
#[derive(Clone, Copy, Debug)]
pub struct SetPlace<'a> {
    /// Folder of the set.
    pub folder: &'a Path,
    /// Folder of the complete set, for a set that may lack its truth.
    pub truth: Option<&'a Path>,
}

/// Whether the set in `directory` lacks its truth.
pub fn is_public(directory: &Path) -> bool {
    SetFiles::open(directory).is_ok_and(|files| matches!(files.refuse_without_truth(), Err(SetError::NoTruth { .. })))
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
    /// As [`BenchmarkSet::read`]; [`SetError::NoTruth`] if the truth is needed and not given, [`SetError::OthersTruth`]
    /// if it belongs to another set.
    pub fn read(self) -> Result<BenchmarkSet, SetError> {
        let own = SetFiles::open(self.folder)?;
        match self.complete(&own)? {
            None => BenchmarkSet::read(self.folder),
            Some(complete) => BenchmarkSet::from_sides(own, &complete),
        }
    }

    /// All folders of the set.
    pub fn folders(self) -> impl Iterator<Item = PathBuf> {
        [Some(self.folder), self.truth].into_iter().flatten().map(Path::to_owned)
    }

    /// The files of the complete set given for `own`; `None` if `own` has its truth.
    pub(super) fn complete(self, own: &SetFiles) -> Result<Option<SetFiles>, SetError> {
        let Some(folder) = self.truth else { return own.refuse_without_truth().map(|()| None) };
        let files = SetFiles::open(folder)?;
        files.refuse_without_truth()?;
        let (expected, found) = (own.set_hash(), files.set_hash());
        if found != expected {
            return Err(SetError::OthersTruth(format!(
                "{} is not the truth of {}: it has hash {found}, expected {expected}; give the folder that `render \
                 --truth` wrote",
                plain(folder.display()),
                plain(self.folder.display())
            )));
        }
        Ok(Some(files))
    }
}

impl BlindSet {
    /// Writes the set without its truth into a folder. [`Self::read`] returns the same set, with the same set hash.
    ///
    /// # Errors
    /// [`SetError`] if a file cannot be written; [`SetError::Inconsistent`] for a set without a key, whose hash would
    /// confirm a guess of its truth.
    pub fn write_without_truth(&self, folder: &Path) -> Result<(), SetError> {
        let files = self.files();
        if !files.is_sealed() {
            let detail = format!("a set without its truth needs its own key, {KEY_FILE}; render it with a key");
            return Err(SetError::inconsistent(detail));
        }
        let own = |path: &str| [README, READER, COMPLETE].contains(&path);
        let is_public = |path: &str| !path.starts_with("truth/") && !own(path);
        files.copy_to(folder, is_public)?;
        let mut listed = files.digests_where(is_public);
        let mut put = |path: &str, text: &str| {
            listed.insert(path.to_owned(), hex_sha256(text.as_bytes()));
            fs::write(folder.join(path), text).map_err(SetError::io(&folder.join(path), "write"))
        };
        put(README, &readme(self))?;
        put(COMPLETE, &files.identity())?;
        fs::write(folder.join(LISTING), listing_of(&listed)).map_err(SetError::io(&folder.join(LISTING), "write"))
    }
}

fn readme(set: &BlindSet) -> String {
    let (text, is_filmed) = (include_str!("format/readme_public.txt"), set.moments.is_some());
    let text = if is_filmed { text.replacen("skiagraph.set/1", "skiagraph.set/2", 1) } else { text.to_owned() };
    let filmed = if is_filmed { OF_FILMING } else { "" };
    let found = if set.keypoints.is_some() { OF_KEYPOINTS } else { "" };
    let images = if set.background_paths(0).is_empty() { "" } else { OF_COLOUR };
    [&text, filmed, found, images].concat()
}
