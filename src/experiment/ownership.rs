//! Which files of a folder this program wrote: `skiagraph.sha256` lists them as `sha256sum` does, and `sha256sum -c`
//! checks them.
//!
//! A directory is ours if everything in it is listed and unchanged. Only such a directory may be replaced. A folder
//! inside that has a listing of its own (the run of a method) answers for itself.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io;
use std::path::Path;

use super::ExperimentError;
use super::place::{parent_of, write_synced};
use crate::input::{hex_sha256, hex_sha256_of};

/// The listing's name.
pub(super) const LISTING: &str = "skiagraph.sha256";
/// A listing is read up to this size: ours take a few hundred bytes.
const LONGEST_LISTING: u64 = 16 << 20;

/// Paths (parts divided by `/`) and their SHA-256. While files are being replaced a path has two: what was there, and
/// what comes.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Listing(BTreeSet<(String, String)>);

impl Listing {
    /// The listing that lies in `folder`; empty where there is none that can be read.
    pub(super) fn read(folder: &Path) -> Self {
        let path = folder.join(LISTING);
        let fits = fs::symlink_metadata(&path).is_ok_and(|meta| meta.is_file() && meta.len() <= LONGEST_LISTING);
        let text = if fits { fs::read_to_string(path).unwrap_or_default() } else { String::new() };
        let lines = text.lines().filter_map(|line| line.split_once("  "));
        Self(lines.map(|(digest, path)| (path.to_owned(), digest.to_owned())).collect())
    }

    /// Of every file below `folder`, but for those that a folder inside lists itself.
    fn new(folder: &Path) -> io::Result<Self> {
        let of_file = |path: String| Ok((path.clone(), sha256_of(&folder.join(&path))?));
        files_below(folder, "")?.into_iter().map(of_file).collect::<io::Result<_>>().map(Self)
    }

    /// Whether the file at `path` in `folder` is the one that is listed.
    pub(super) fn holds(&self, folder: &Path, path: &str) -> bool {
        sha256_of(&folder.join(path)).is_ok_and(|digest| self.0.contains(&(path.to_owned(), digest)))
    }

    /// Adds a file; what else is listed under its path stays.
    pub(super) fn add(&mut self, path: &str, bytes: &[u8]) {
        self.0.insert((path.to_owned(), hex_sha256(bytes)));
    }

    /// The same with these files for those that are listed under their paths.
    pub(super) fn with(&self, files: &super::NamedFiles) -> Self {
        let kept = self.0.iter().filter(|(path, _)| files.iter().all(|(name, _)| name != path)).cloned();
        let mut listing = Self(kept.collect());
        files.iter().for_each(|(name, bytes)| listing.add(name, bytes));
        listing
    }

    /// Puts the listing into `folder`; what was there stays until it is whole.
    pub(super) fn store(&self, folder: &Path) -> io::Result<()> {
        let meanwhile = folder.join(format!(".{LISTING}.partial"));
        write_synced(&meanwhile, self.to_text().as_bytes())?;
        fs::rename(&meanwhile, folder.join(LISTING))
    }

    /// As `sha256sum` writes it.
    fn to_text(&self) -> String {
        self.0.iter().map(|(path, digest)| format!("{digest}  {path}\n")).collect()
    }
}

/// Lists all files of a folder that is finished, in the folder.
pub(super) fn sign(folder: &Path) -> io::Result<()> {
    Listing::new(folder)?.store(folder)
}

/// Lists what was written into a folder that is finished, in the folder, as it was written. What else is there is
/// removed: another process put it there. Folders that were written into may have a listing of their own and answer for
/// themselves.
pub(super) fn sign_written(folder: &Path, written: &Listing) -> io::Result<()> {
    for path in all_files_below(folder, "")? {
        let around = path.strip_suffix(LISTING).filter(|around| around.is_empty() || around.ends_with('/'));
        let is_own_output = written.0.iter().any(|(name, _)| match around {
            // the listing of a folder that we wrote into
            Some(around) => name.starts_with(around),
            None => *name == path,
        });
        if !is_own_output {
            fs::remove_file(folder.join(path))?;
        }
    }
    let listed = files_below(folder, "")?;
    Listing(written.0.iter().filter(|(name, _)| listed.contains(name)).cloned().collect()).store(folder)
}

/// Refuses a file that this program did not write, or that was changed since: the folder that it lies in has a listing,
/// and the file is not in it as it is. Where there is no listing, as in a folder that somebody copied files into, the
/// file is taken for what it is.
///
/// # Errors
/// [`ExperimentError::Malformed`].
pub(super) fn check_listed(path: &Path) -> Result<(), ExperimentError> {
    let folder = parent_of(path);
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    if !folder.join(LISTING).is_file() || Listing::read(folder).holds(folder, &name) {
        return Ok(());
    }
    let detail = format!(
        "skiagraph did not write this file, or it was changed since ({LISTING} beside it lists what was written); \
         measure the run again with skiagraph evaluate SET {}",
        folder.display()
    );
    Err(ExperimentError::Malformed { path: path.to_owned(), detail })
}

/// Whether all that is in `folder` was written by this program and is as it was.
pub(super) fn is_signed(folder: &Path) -> bool {
    let listing = Listing::read(folder);
    let inside = |name: &String| is_signed(&folder.join(name));
    files_below(folder, "").is_ok_and(|files| files.iter().all(|path| listing.holds(folder, path)))
        && signed_folders(folder).is_ok_and(|folders| folders.iter().all(inside))
        && listing != Listing::default()
}

/// An error for all that is no plain file: a link could lead anywhere.
fn sha256_of(path: &Path) -> io::Result<String> {
    if !fs::symlink_metadata(path)?.is_file() {
        return Err(io::ErrorKind::InvalidInput.into());
    }
    hex_sha256_of(File::open(path)?)
}

/// Folders directly in `folder` that have a listing.
fn signed_folders(folder: &Path) -> io::Result<Vec<String>> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        if entry.file_type()?.is_dir() && entry.path().join(LISTING).is_file() {
            found.push(entry.file_name().to_string_lossy().into_owned());
        }
    }
    Ok(found)
}

/// Everything below `folder` but folders, its listing, and what folders with a listing hold.
fn files_below(folder: &Path, prefix: &str) -> io::Result<Vec<String>> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let name = format!("{prefix}{}", entry.file_name().to_string_lossy());
        match entry.file_type()?.is_dir() {
            true if entry.path().join(LISTING).is_file() => {}
            true => found.extend(files_below(&entry.path(), &format!("{name}/"))?),
            false if name == LISTING => {}
            false => found.push(name),
        }
    }
    found.sort();
    Ok(found)
}

/// Everything below `folder` but folders.
fn all_files_below(folder: &Path, prefix: &str) -> io::Result<Vec<String>> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let name = format!("{prefix}{}", entry.file_name().to_string_lossy());
        match entry.file_type()?.is_dir() {
            true => found.extend(all_files_below(&entry.path(), &format!("{name}/"))?),
            false => found.push(name),
        }
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run() -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir_all(folder.path().join("graph/deep")).unwrap();
        fs::create_dir_all(folder.path().join("plain")).unwrap();
        for path in ["run.json", "graph/run.json", "graph/deep/file", "plain/file"] {
            fs::write(folder.path().join(path), path).unwrap();
        }
        sign(&folder.path().join("graph")).unwrap();
        sign(folder.path()).unwrap();
        folder
    }

    #[test]
    fn what_was_written_is_ours_until_anything_in_it_changes() {
        let folder = run();
        assert!(is_signed(folder.path()) && is_signed(&folder.path().join("graph")));
        let text = fs::read_to_string(folder.path().join(LISTING)).unwrap();
        let paths: Vec<&str> = text.lines().map(|line| &line[66..]).collect();
        assert_eq!(paths, ["plain/file", "run.json"]);
        // printf run.json | sha256sum
        assert!(
            text.contains("2dfe744f64b97238df644a0ef96b7f245bb6ffc7519b726824c0753e6e3797c4  run.json\n"),
            "{text}"
        );
        for path in ["run.json", "graph/run.json", "graph/deep/file", "plain/file"] {
            let whole = fs::read(folder.path().join(path)).unwrap();
            fs::write(folder.path().join(path), "mine").unwrap();
            assert!(!is_signed(folder.path()), "{path} changed");
            fs::write(folder.path().join(path), whole).unwrap();
        }
        for path in ["notes.txt", "graph/notes.txt", "plain/notes.txt"] {
            fs::write(folder.path().join(path), "mine").unwrap();
            assert!(!is_signed(folder.path()), "{path} added");
            fs::remove_file(folder.path().join(path)).unwrap();
        }
        assert!(is_signed(folder.path()));
    }

    #[test]
    fn a_folder_without_a_listing_is_not_ours() {
        let folder = tempfile::tempdir().unwrap();
        assert!(!is_signed(folder.path()));
        fs::write(folder.path().join("poses.npz"), "somebody's").unwrap();
        assert!(!is_signed(folder.path()));
        fs::write(folder.path().join(LISTING), "no listing at all").unwrap();
        assert!(!is_signed(folder.path()));
    }

    #[cfg(unix)]
    #[test]
    fn a_link_in_place_of_a_file_is_not_ours() {
        let folder = run();
        let elsewhere = tempfile::tempdir().unwrap();
        fs::rename(folder.path().join("run.json"), elsewhere.path().join("run.json")).unwrap();
        std::os::unix::fs::symlink(elsewhere.path().join("run.json"), folder.path().join("run.json")).unwrap();
        assert!(!is_signed(folder.path()));
    }

    #[test]
    fn while_files_are_replaced_both_the_old_and_the_new_are_ours() {
        let folder = run();
        let files: super::super::NamedFiles = vec![("run.json", b"new".to_vec())];
        let old = Listing::read(folder.path());
        let mut both = old.clone();
        both.add("run.json", b"new");
        assert!(both.holds(folder.path(), "run.json") && !old.with(&files).holds(folder.path(), "run.json"));
        fs::write(folder.path().join("run.json"), "new").unwrap();
        assert!(both.holds(folder.path(), "run.json") && old.with(&files).holds(folder.path(), "run.json"));
        assert!(!old.holds(folder.path(), "run.json"));
    }
}
