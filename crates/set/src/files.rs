//! The files of a set, in memory or in a directory, each identified by its SHA-256.
//!
//! `files.sha256` lists them in the format of `sha256sum`, so `sha256sum -c files.sha256` checks a set without this
//! program. It is written last: a directory without it is not a set. Every read is checked against it.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use super::SetError;
use super::format::listing::{COMPLETE, KEY_FILE, LISTING, Stop, digests_in, files_of, stop_if_requested};
use super::identity::{complete_lines, identity_lines};
use super::set_writer::SetWriter;
use skiagraph_core::input;
use skiagraph_core::input::{hex_sha256, limits, listing_of};
use skiagraph_core::parallel;

/// Python's cache, written when `read_truth.py` is imported; it is not a fault.
const PYTHON_CACHE: &str = "__pycache__/";

/// The list of images in tar shards, in sets of earlier versions.
const PACKED: &str = "packed.sha256";

#[derive(Clone, Debug)]
pub(super) struct SetFiles {
    /// SHA-256 in hexadecimal by relative path with `/`.
    digests: BTreeMap<String, String>,
    /// The identity of the complete set, for a set without its truth.
    complete: Option<String>,
    listing_hash: String,
    place: FileStore,
}

#[derive(Clone, Debug)]
enum FileStore {
    Memory(BTreeMap<String, Vec<u8>>),
    Directory(PathBuf),
}

impl SetFiles {
    pub(super) fn in_memory(files: BTreeMap<String, Vec<u8>>, stop: Stop<'_>) -> Result<Self, SetError> {
        let digest = |(path, bytes): (&String, &Vec<u8>)| {
            stop_if_requested(stop)?;
            Ok((path.clone(), hex_sha256(bytes)))
        };
        let digests = files.par_iter().map(digest).collect::<Result<BTreeMap<_, _>, SetError>>()?;
        let listing_hash = hex_sha256(listing_of(&digests).as_bytes());
        Ok(Self { digests, complete: None, listing_hash, place: FileStore::Memory(files) })
    }

    /// The same files with words at the end of one of them; files on disk stay as they are.
    pub(super) fn with_words(self, path: &str, words: &str) -> Result<Self, SetError> {
        match self.place {
            FileStore::Memory(mut files) => {
                files.entry(path.to_owned()).or_default().extend_from_slice(words.as_bytes());
                Self::in_memory(files, &|| false)
            }
            FileStore::Directory(_) => Ok(self),
        }
    }

    /// The files of a set on disk. Contents are read and checked on demand.
    pub(super) fn open(directory: &Path) -> Result<Self, SetError> {
        let not_a_set = |detail: String| SetError::NotASet { path: directory.to_path_buf(), detail };
        let listing = match input::read_to_string(&directory.join(LISTING), limits::LISTING) {
            Ok(listing) => listing,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound && directory.is_dir() => {
                return Err(not_a_set(format!("it has no {LISTING}")));
            }
            Err(e) => return Err(SetError::io(&directory.join(LISTING), "read")(e)),
        };
        let digests = digests_in(directory, LISTING, &listing)?;
        if digests.contains_key(PACKED) {
            return Err(not_a_set(format!(
                "its images are in tar shards ({PACKED}), which only earlier versions read; render it again without \
                 --shards; skiagraph export SET --to webdataset writes shards for training"
            )));
        }
        let place = FileStore::Directory(directory.to_path_buf());
        let listing_hash = hex_sha256(listing.as_bytes());
        let mut files = Self { digests, complete: None, listing_hash, place };
        files.complete = complete_lines(directory, files.digests.get(COMPLETE), &files.digests.iter().collect())?;
        Ok(files)
    }

    pub(super) fn has(&self, path: &str) -> bool {
        self.digests.contains_key(path)
    }

    pub(super) fn digest(&self, path: &str) -> Option<&str> {
        self.digests.get(path).map(String::as_str)
    }

    pub(super) fn folder(&self) -> Option<&Path> {
        match &self.place {
            FileStore::Memory(_) => None,
            FileStore::Directory(directory) => Some(directory),
        }
    }

    /// The bytes of a file, checked against its SHA-256.
    pub(super) fn read(&self, path: &str) -> Result<Cow<'_, [u8]>, SetError> {
        let missing = || match &self.place {
            FileStore::Memory(_) => SetError::malformed(path, "the set has no such file"),
            FileStore::Directory(directory) => {
                SetError::NotASet { path: directory.clone(), detail: format!("{LISTING} lists no {path}") }
            }
        };
        let listed = self.digests.get(path).ok_or_else(missing)?;
        let bytes = match &self.place {
            FileStore::Memory(files) => return files.get(path).map(|b| b.as_slice().into()).ok_or_else(missing),
            FileStore::Directory(directory) => {
                let full = directory.join(path);
                input::read(&full, limit_of(path)).map_err(SetError::io(&full, "read"))?
            }
        };
        let found = hex_sha256(&bytes);
        if found == *listed {
            Ok(bytes.into())
        } else {
            Err(SetError::Tampered { file: path.to_string(), listed: listed.clone(), found })
        }
    }

    /// An error for the first of the `wanted` files that is not on disk. Contents are not read.
    pub(super) fn expect_there(&self, wanted: impl Fn(&str) -> bool) -> Result<(), SetError> {
        let FileStore::Directory(directory) = &self.place else { return Ok(()) };
        let mut full = self.digests.keys().filter(|path| wanted(path)).map(|path| directory.join(path));
        full.try_for_each(|full| fs::metadata(&full).map(drop).map_err(SetError::io(&full, "read")))
    }

    /// Copies the `wanted` files into a folder. They are not linked, so that writing to the copy cannot change the set.
    pub(super) fn copy_to(&self, folder: &Path, wanted: impl Fn(&str) -> bool) -> Result<(), SetError> {
        for path in self.paths().filter(|path| wanted(path)) {
            let target = folder.join(path);
            if let Some(parent) = target.parent() {
                fs::create_dir_all(parent).map_err(SetError::io(parent, "create"))?;
            }
            fs::write(&target, &*self.read(path)?).map_err(SetError::io(&target, "write"))?;
        }
        Ok(())
    }

    /// SHA-256 by path of the `wanted` files.
    pub(super) fn digests_where(&self, wanted: impl Fn(&str) -> bool) -> BTreeMap<String, String> {
        let digests = self.digests.iter().filter(|(path, _)| wanted(path));
        digests.map(|(path, digest)| (path.clone(), digest.clone())).collect()
    }

    /// An error if the set is on disk without its truth.
    pub(super) fn refuse_without_truth(&self) -> Result<(), SetError> {
        let FileStore::Directory(directory) = &self.place else { return Ok(()) };
        if self.is_footage() {
            return Err(SetError::OthersTruth(format!(
                "{} is a recording of a person, which has no ground truth; track, evaluate, inspect, verify, compare \
                 and export --to opencv, humaneva, openpose, pose2sim, anipose, caliscope or video work without one",
                input::plain(directory.display())
            )));
        }
        // sets of older versions list a truth that they do not contain
        let is_gone = self.paths().any(|path| path.starts_with("truth/")) && !directory.join("truth").exists();
        if is_gone || self.complete.is_some() { Err(SetError::NoTruth { set: directory.clone() }) } else { Ok(()) }
    }

    /// The same error with the file's path on disk.
    pub(super) fn locate(&self, error: SetError) -> SetError {
        match &self.place {
            FileStore::Memory(_) => error,
            FileStore::Directory(directory) => error.below(directory),
        }
    }

    /// Size of the files in memory whose paths have this prefix, bytes; 0 for a set on disk.
    pub(super) fn bytes_below(&self, prefix: &str) -> usize {
        match &self.place {
            FileStore::Memory(files) => {
                files.iter().filter(|(path, _)| path.starts_with(prefix)).map(|(_, bytes)| bytes.len()).sum()
            }
            FileStore::Directory(_) => 0,
        }
    }

    /// SHA-256 of [`Self::identity`].
    pub(super) fn set_hash(&self) -> String {
        hex_sha256(self.identity().as_bytes())
    }

    /// SHA-256 of `files.sha256`, which covers every file, layers included.
    pub(super) fn full_hash(&self) -> &str {
        &self.listing_hash
    }

    /// The lines that identify the complete set.
    pub(super) fn identity(&self) -> String {
        let own = || identity_lines(&self.digests.iter().collect());
        self.complete.clone().unwrap_or_else(own)
    }

    /// Whether [`Self::identity`] cannot be used to confirm a guess of the truth.
    pub(super) fn is_sealed(&self) -> bool {
        self.complete.is_some() || self.digests.contains_key(KEY_FILE)
    }

    /// Writes every file below `folder`, then the files that `more` adds, and the listing.
    pub(super) fn write(
        &self,
        folder: &Path,
        more: impl FnOnce(&SetWriter<'_>) -> Result<(), SetError>,
    ) -> Result<(), SetError> {
        let writer = SetWriter::new(folder, &|| false);
        let paths: Vec<&str> = self.paths().collect();
        paths.par_iter().try_for_each(|path| writer.put(path, &self.read(path)?))?;
        more(&writer)?;
        writer.finish()
    }

    pub(super) fn paths(&self) -> impl Iterator<Item = &str> {
        self.digests.keys().map(String::as_str)
    }

    /// The first of [`Self::faults`] as an error.
    pub(super) fn verify(&self) -> Result<(), SetError> {
        self.faults()?.into_iter().next().map_or(Ok(()), Err)
    }

    /// Every listed file that is missing or changed, in alphabetical order, then those that links lead to outside the
    /// directory, then every file that is not listed.
    pub(super) fn faults(&self) -> Result<Vec<SetError>, SetError> {
        let paths: Vec<&String> = self.digests.keys().collect();
        let faults = parallel::map(paths.len(), |path| self.read(paths[path]).err());
        let mut faults: Vec<SetError> = faults.into_iter().flatten().collect();
        if let FileStore::Directory(directory) = &self.place {
            faults.extend(self.linked_outside(directory)?);
            let unlisted =
                |path: &String| !self.digests.contains_key(path) && path != LISTING && !path.starts_with(PYTHON_CACHE);
            let files = files_of(directory)?.into_iter().filter(unlisted);
            faults.extend(files.map(|file| SetError::Unlisted { file }));
        }
        Ok(faults)
    }

    /// Listed files, and the listing, that symbolic links lead to outside `directory`. Hashes do not show them, but a
    /// copy of the directory would lack their content.
    fn linked_outside(&self, directory: &Path) -> Result<Vec<SetError>, SetError> {
        let root = fs::canonicalize(directory).map_err(SetError::io(directory, "read"))?;
        let paths: Vec<&str> = self.digests.keys().map(String::as_str).chain([LISTING]).collect();
        let is_outside = |index: usize| {
            // a missing file is reported as such
            fs::canonicalize(root.join(paths[index])).is_ok_and(|found| !found.starts_with(&root))
        };
        let outside = parallel::map(paths.len(), is_outside);
        let found = paths.into_iter().zip(outside).filter(|(_, is_outside)| *is_outside);
        Ok(found.map(|(path, _)| SetError::LinkedOutside { file: path.to_owned() }).collect())
    }
}

/// Whether `directory` contains a set and nothing else.
pub fn holds_only_a_set(directory: &Path) -> bool {
    let Ok(files) = SetFiles::open(directory) else { return false };
    let listed = |path: &String| path == LISTING || files.has(path);
    files_of(directory).is_ok_and(|found| found.iter().all(listed))
}

/// Greatest size of a file of a set, bytes.
fn limit_of(path: &str) -> u64 {
    match path.rsplit('.').next() {
        Some("toml" | "txt") => limits::SETTINGS,
        Some("json") => limits::JSON,
        Some("png" | "jpg") => limits::PICTURE,
        Some("exr") => limits::LAYER,
        Some("sha256") => limits::LISTING,
        _ => limits::ARRAYS,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> SetFiles {
        let files = [("a.txt", "one"), ("deep/er/b.bin", "two"), ("empty", "")];
        let files = files.map(|(path, text)| (path.to_string(), text.as_bytes().to_vec()));
        SetFiles::in_memory(files.into(), &|| false).unwrap()
    }

    fn write(files: &SetFiles, folder: &Path) -> Result<(), SetError> {
        files.write(folder, |_| Ok(()))
    }

    fn written() -> tempfile::TempDir {
        let directory = tempfile::tempdir().unwrap();
        write(&sample(), directory.path()).unwrap();
        directory
    }

    #[test]
    fn the_listing_is_what_sha256sum_writes() {
        let directory = written();
        let listing = fs::read_to_string(directory.path().join(LISTING)).unwrap();
        // printf one | sha256sum
        let one = "7692c3ad3540bb803c020b3aee66cd8887123234ea0c6e7143c0add73ff431ed";
        assert_eq!(listing.lines().next(), Some(format!("{one}  a.txt").as_str()));
        assert_eq!(hex_sha256(listing.as_bytes()), sample().set_hash());
        assert_eq!(SetFiles::open(directory.path()).unwrap().set_hash(), sample().set_hash());
    }

    #[test]
    fn a_missing_file_is_named_without_reading_any() {
        let directory = written();
        fs::write(directory.path().join("deep/er/b.bin"), "changed").unwrap();
        let files = SetFiles::open(directory.path()).unwrap();
        files.expect_there(|_| true).unwrap();
        fs::remove_file(directory.path().join("a.txt")).unwrap();
        files.expect_there(|path| path.ends_with(".bin")).unwrap();
        let error = files.expect_there(|_| true).unwrap_err();
        assert!(error.to_string().contains("a.txt: cannot read"), "{error}");
    }

    #[test]
    fn files_too_few_and_files_too_many_are_found() {
        let directory = written();
        fs::create_dir(directory.path().join("__pycache__")).unwrap();
        fs::write(directory.path().join("__pycache__/read_truth.cpython-312.pyc"), "x").unwrap();
        SetFiles::open(directory.path()).unwrap().verify().unwrap();
        fs::write(directory.path().join("deep/extra"), "x").unwrap();
        let error = SetFiles::open(directory.path()).unwrap().verify().unwrap_err();
        assert!(matches!(error, SetError::Unlisted { file } if file == "deep/extra"));
        fs::remove_file(directory.path().join("a.txt")).unwrap();
        let error = SetFiles::open(directory.path()).unwrap().verify().unwrap_err();
        assert!(error.to_string().contains("a.txt: cannot read"), "{error}");
    }

    #[cfg(unix)]
    #[test]
    fn links_out_of_the_set_are_found_and_links_inside_it_are_not() {
        use std::os::unix::fs::symlink;
        let (directory, elsewhere) = (written(), tempfile::tempdir().unwrap());
        let at = |path: &str| directory.path().join(path);
        let faults = || {
            let faults = SetFiles::open(directory.path()).unwrap().faults().unwrap();
            faults.iter().map(ToString::to_string).collect::<Vec<String>>()
        };
        let linked = |path: &str| {
            format!(
                "{path} is a symbolic link that leads out of the set; replace it with the file itself (cp -rL copies a \
                 set so)"
            )
        };
        fs::rename(at("a.txt"), elsewhere.path().join("moved")).unwrap();
        symlink(elsewhere.path().join("moved"), at("a.txt")).unwrap();
        assert_eq!(faults(), [linked("a.txt")]);
        fs::remove_file(at("a.txt")).unwrap();
        fs::rename(elsewhere.path().join("moved"), at("deep/a.txt")).unwrap();
        symlink("deep/a.txt", at("a.txt")).unwrap();
        assert_eq!(faults().len(), 1, "the link stays inside, but its target is not listed");
        assert!(faults()[0].starts_with("deep/a.txt is not one of the set's files"), "{:?}", faults());
    }

    #[test]
    fn a_listing_cannot_lead_out_of_the_set_or_name_tar_shards() {
        let directory = tempfile::tempdir().unwrap();
        let error = |path: &str| {
            fs::write(directory.path().join(LISTING), format!("{}  {path}\n", "0".repeat(64))).unwrap();
            SetFiles::open(directory.path()).unwrap_err().to_string()
        };
        for path in ["../secret", "/etc/passwd", "a//b", "a/./b", "a\\b"] {
            assert!(error(path).contains("files.sha256:1"), "{path}");
        }
        assert!(error("packed.sha256").contains("render it again without --shards"));
    }

    #[test]
    fn a_set_is_never_written_over_another_nor_where_nothing_can_be_written() {
        let directory = written();
        let again = write(&sample(), directory.path()).unwrap_err();
        assert!(again.to_string().contains("cannot write"), "{again}");
        let below_a_file = directory.path().join("a.txt/set");
        let error = write(&sample(), &below_a_file).unwrap_err();
        assert!(error.to_string().contains("a.txt/set: cannot create the directory"), "{error}");
    }

    #[test]
    fn after_a_request_to_stop_no_other_file_is_hashed() {
        let stopped = SetFiles::in_memory([("a".to_owned(), Vec::new())].into(), &|| true).unwrap_err();
        assert!(matches!(stopped, SetError::Stopped), "{stopped}");
    }

    #[test]
    fn a_directory_with_unlisted_files_does_not_hold_only_a_set() {
        let directory = written();
        assert!(holds_only_a_set(directory.path()));
        fs::write(directory.path().join("deep/thesis.tex"), "years of work").unwrap();
        assert!(!holds_only_a_set(directory.path()));
    }
}
