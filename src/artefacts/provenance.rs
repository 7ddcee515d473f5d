//! Provenance: recognises output of this program. Folders have a listing, `skiagraph.sha256`, in the format of
//! `sha256sum`: a folder is own output if everything in it is listed and unchanged. A subfolder with its own listing
//! (the run of a method) is checked by that listing. Files are recognised by a mark in their content. Only own output
//! is replaced without --force.

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use super::error::{ArtefactError, output};
use super::place::{LockedPlace, parent_of, write_synced};
use skiagraph_core::input::{self, files_below, hex_sha256, hex_sha256_of, limits, listed_in, listing_of};
use skiagraph_core::npz::{Npz, Values};
use skiagraph_set::{holds_only_a_set, verify_hashes};

pub(crate) const LISTING: &str = "skiagraph.sha256";

/// Number of bytes at the beginning of a file in which the mark is searched.
const HEAD_BYTES: u64 = 1024;

/// The beginning of a manual page of this program, up to its version.
pub const MANUAL_MARK: &str = ".\\\" skiagraph ";

/// The kind of an output. What made a folder is in its `made_by.json`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ArtefactKind {
    /// The folder of a run, of one tracker or of several methods. Other processes may write into it meanwhile.
    Run,
    Set,
    /// Any other folder.
    Folder,
    File,
}

impl ArtefactKind {
    /// Whether `path` is unmodified output of this program, or an empty folder.
    pub(crate) fn is_own(self, path: &Path) -> bool {
        if self == Self::File {
            return is_own_file(path);
        }
        if path.is_symlink() || !path.is_dir() {
            return false;
        }
        let is_empty = fs::read_dir(path).is_ok_and(|mut entries| entries.next().is_none());
        is_empty
            || match self {
                Self::Set => holds_only_a_set(path) && verify_hashes(path).is_ok(),
                Self::Run | Self::Folder | Self::File => is_signed(path),
            }
    }
}

/// Whether this program wrote the file, by the mark of a page, picture, manual page, JSON object or model.
pub(super) fn is_own_file(path: &Path) -> bool {
    let Some(head) = head(path) else { return false };
    let text = String::from_utf8_lossy(&head);
    let marked = match text.trim_start().as_bytes() {
        [b'{', ..] => schema_of(&text).is_some_and(|schema| schema.starts_with("skiagraph.")),
        [b'<', ..] => {
            text.contains("<meta name=\"generator\" content=\"skiagraph ")
                || text.contains("<metadata>skiagraph ")
                || text.starts_with("<!-- skiagraph ")
        }
        [b'.', b'\\', b'"', ..] => text.starts_with(MANUAL_MARK),
        _ if head.starts_with(b"\x89PNG") => text.contains("Software\0skiagraph "),
        _ => false,
    };
    marked || (head.starts_with(b"PK") && is_model(path))
}

/// Whether `path` is the file of a learned model, of any version.
fn is_model(path: &Path) -> bool {
    let npz = input::read(path, limits::ARRAYS).ok().and_then(|bytes| Npz::from_bytes("model", &bytes).ok());
    let Some(Values::U8(facts)) = npz.as_ref().and_then(|npz| npz.get("facts")).map(|array| &array.values) else {
        return false;
    };
    schema_of(&String::from_utf8_lossy(facts)).is_some_and(|schema| schema.starts_with("skiagraph.model/"))
}

/// The value of `schema`, the first key of every JSON file of this program.
fn schema_of(text: &str) -> Option<&str> {
    let rest = text.trim_start().strip_prefix('{')?.trim_start().strip_prefix("\"schema\"")?;
    rest.trim_start().strip_prefix(':')?.trim_start().strip_prefix('"')?.split('"').next()
}

fn head(path: &Path) -> Option<Vec<u8>> {
    if !path.symlink_metadata().ok()?.is_file() {
        return None;
    }
    let mut head = Vec::new();
    fs::File::open(path).ok()?.take(HEAD_BYTES).read_to_end(&mut head).ok()?;
    Some(head)
}

/// Paths (separated by `/`) and their SHA-256. While a file is being replaced, its path has two hashes: the old and the
/// new one.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Listing(BTreeSet<(String, String)>);

impl Listing {
    /// The listing in `folder`; empty if there is no readable one.
    pub(crate) fn read(folder: &Path) -> Self {
        let path = folder.join(LISTING);
        let text = if path.is_symlink() { None } else { input::read_to_string(&path, limits::RECORD).ok() };
        Self(text.unwrap_or_default().lines().filter_map(listed_in).collect())
    }

    /// Whether the file at `path` in `folder` is listed with its current content.
    pub(crate) fn holds(&self, folder: &Path, path: &str) -> bool {
        sha256_of(&folder.join(path)).is_ok_and(|digest| self.0.contains(&(path.to_owned(), digest)))
    }

    /// Adds a file; other entries of its path are kept.
    pub(super) fn add(&mut self, path: &str, bytes: &[u8]) {
        self.0.insert((path.to_owned(), hex_sha256(bytes)));
    }

    /// The same listing with the entries of these files replaced.
    fn with(&self, files: &[(Cow<'static, str>, Vec<u8>)]) -> Self {
        let kept = self.0.iter().filter(|(path, _)| files.iter().all(|(name, _)| **name != *path)).cloned();
        let mut listing = Self(kept.collect());
        files.iter().for_each(|(name, bytes)| listing.add(name, bytes));
        listing
    }

    fn store(&self, folder: &Path) -> Result<(), ArtefactError> {
        let (path, temporary) = (folder.join(LISTING), folder.join(format!(".{LISTING}.partial")));
        let text = listing_of(self.0.iter().map(|(path, digest)| (path, digest)));
        let stored = write_synced(&temporary, text.as_bytes()).and_then(|()| fs::rename(&temporary, &path));
        stored.map_err(output(&path, "write"))
    }

    /// Writes files into a folder with a listing. Each is written under a temporary name first; only when all are on
    /// the disk are they renamed, in order. An existing file must be listed. While files are being renamed, the listing
    /// has both the old and the new ones, so that the folder remains own output if the process is killed. Another
    /// process that does the same to this folder is waited for.
    ///
    /// # Errors
    /// [`ArtefactError::InTheWay`] if a file is not listed, [`ArtefactError::Busy`] if the folder is in use for half a
    /// minute, [`ArtefactError::Output`] if nothing can be written.
    pub(crate) fn replace(folder: &Path, files: &[(Cow<'static, str>, Vec<u8>)]) -> Result<(), ArtefactError> {
        let _place = match LockedPlace::take_when_free(folder) {
            // the folder above cannot be written to, so there is no lock
            Err(ArtefactError::Output { .. }) => None,
            place => Some(place?),
        };
        let listing = Self::read(folder);
        let path = |name: &str| folder.join(name);
        let is_there = |name: &str| path(name).symlink_metadata().is_ok();
        if let Some((name, _)) = files.iter().find(|(name, _)| is_there(name) && !listing.holds(folder, name)) {
            return Err(ArtefactError::in_the_way(&path(name)));
        }
        let partial = |name: &str| folder.join(format!(".{name}.partial"));
        let replaced = listing.replace_by(folder, files, &partial);
        if replaced.is_err() {
            files.iter().for_each(|(name, _)| drop(fs::remove_file(partial(name))));
        }
        replaced
    }

    fn replace_by(
        &self,
        folder: &Path,
        files: &[(Cow<'static, str>, Vec<u8>)],
        partial: &dyn Fn(&str) -> PathBuf,
    ) -> Result<(), ArtefactError> {
        let mut both = self.clone();
        for (name, bytes) in files {
            write_synced(&partial(name), bytes).map_err(output(&partial(name), "write"))?;
            both.add(name, bytes);
        }
        both.store(folder)?;
        for (name, _) in files {
            let path = folder.join(&**name);
            fs::rename(partial(name), &path).map_err(output(&path, "write"))?;
        }
        self.with(files).store(folder)
    }
}

/// Writes the listing of a finished folder: all files except those in subfolders with their own listing.
pub(crate) fn sign(folder: &Path) -> Result<(), ArtefactError> {
    let of_file = |path: String| Ok((path.clone(), sha256_of(&folder.join(&path))?));
    let listed = own_and_signed(folder).and_then(|(own, _)| own.into_iter().map(of_file).collect());
    Listing(listed.map_err(output(folder, "list the files of the directory"))?).store(folder)
}

/// Writes the listing of a finished folder from the files as they were written. Other files are removed, since they
/// come from another process. Subfolders with written files may have their own listing.
pub(super) fn sign_written(folder: &Path, written: &Listing) -> Result<(), ArtefactError> {
    let failed = |error| output(folder, "list the files of the directory")(error);
    for path in files_below(folder).map_err(failed)? {
        let around = path.strip_suffix(LISTING).filter(|around| around.is_empty() || around.ends_with('/'));
        let is_own_output = written.0.iter().any(|(name, _)| match around {
            // the listing of a subfolder with written files
            Some(around) => name.starts_with(around),
            None => *name == path,
        });
        if !is_own_output {
            fs::remove_file(folder.join(path)).map_err(failed)?;
        }
    }
    let (own, _) = own_and_signed(folder).map_err(failed)?;
    Listing(written.0.iter().filter(|(name, _)| own.contains(name)).cloned().collect()).store(folder)
}

/// Whether a file was not written by this program, or was changed since: its folder has a listing, which does not have
/// the file with its current content. A file in a folder without a listing, for example a copy, is accepted.
pub(crate) fn is_unlisted(path: &Path) -> bool {
    let folder = parent_of(path);
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    folder.join(LISTING).is_file() && !Listing::read(folder).holds(folder, &name)
}

/// Whether everything in `folder` was written by this program and is unchanged.
pub(crate) fn is_signed(folder: &Path) -> bool {
    let listing = Listing::read(folder);
    listing != Listing::default()
        && own_and_signed(folder).is_ok_and(|(own, signed)| {
            own.iter().all(|path| listing.holds(folder, path))
                && signed.iter().all(|inside| is_signed(&folder.join(inside)))
        })
}

/// Whether the same holds and nothing that `folder` lists is missing, as after a removal that was killed.
pub(crate) fn is_whole(folder: &Path) -> bool {
    is_signed(folder) && Listing::read(folder).0.iter().all(|(path, _)| folder.join(path).is_file())
}

/// The hash of a regular file; an error for anything else, since a link could point anywhere.
fn sha256_of(path: &Path) -> io::Result<String> {
    if !fs::symlink_metadata(path)?.is_file() {
        return Err(io::ErrorKind::InvalidInput.into());
    }
    hex_sha256_of(File::open(path)?)
}

/// The files covered by a folder's listing, and the subfolders with their own listings.
fn own_and_signed(folder: &Path) -> io::Result<(Vec<String>, Vec<String>)> {
    let files = files_below(folder)?;
    let around = |path: &String| path.strip_suffix(LISTING).filter(|path| path.ends_with('/')).map(str::to_owned);
    let signed: Vec<String> = files.iter().filter_map(around).collect();
    let is_own = |path: &String| path != LISTING && !signed.iter().any(|inside| path.starts_with(inside));
    Ok((files.iter().filter(|path| is_own(path)).cloned().collect(), signed))
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
    fn a_written_folder_is_own_output_until_anything_in_it_changes() {
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
        fs::create_dir_all(folder.path().join("plain/copy")).unwrap();
        fs::write(folder.path().join("plain/copy/run.json"), "copied").unwrap();
        sign(&folder.path().join("plain/copy")).unwrap();
        assert!(is_signed(folder.path()));
        fs::write(folder.path().join("plain/copy/thesis.tex"), "mine").unwrap();
        assert!(!is_signed(folder.path()), "at any depth");
    }

    #[test]
    fn a_folder_without_a_listing_is_foreign() {
        let folder = tempfile::tempdir().unwrap();
        assert!(!is_signed(folder.path()));
        fs::write(folder.path().join("poses.npz"), "somebody's").unwrap();
        assert!(!is_signed(folder.path()));
        fs::write(folder.path().join(LISTING), "no listing at all").unwrap();
        assert!(!is_signed(folder.path()));
    }

    #[cfg(unix)]
    #[test]
    fn a_link_in_place_of_a_file_is_foreign() {
        let folder = run();
        let elsewhere = tempfile::tempdir().unwrap();
        fs::rename(folder.path().join("run.json"), elsewhere.path().join("run.json")).unwrap();
        std::os::unix::fs::symlink(elsewhere.path().join("run.json"), folder.path().join("run.json")).unwrap();
        assert!(!is_signed(folder.path()));
    }

    #[test]
    fn while_files_are_replaced_both_the_old_and_the_new_are_listed() {
        let folder = run();
        let files = [("run.json".into(), b"new".to_vec())];
        let old = Listing::read(folder.path());
        let mut both = old.clone();
        both.add("run.json", b"new");
        assert!(both.holds(folder.path(), "run.json") && !old.with(&files).holds(folder.path(), "run.json"));
        fs::write(folder.path().join("run.json"), "new").unwrap();
        assert!(both.holds(folder.path(), "run.json") && old.with(&files).holds(folder.path(), "run.json"));
        assert!(!old.holds(folder.path(), "run.json"));
    }

    /// One process lost the other's temporary files.
    #[test]
    fn results_may_be_replaced_by_several_at_once() {
        let folder = run();
        let written = std::thread::scope(|scope| {
            let one = |text: &'static str| {
                let files: Vec<_> = ["run.json", "report.html"].map(|name| (name.into(), text.into())).into();
                let path = folder.path();
                scope.spawn(move || (0..20).try_for_each(|_| Listing::replace(path, &files)))
            };
            ["a", "b", "c"].map(one).map(|thread| thread.join().unwrap())
        });
        written.into_iter().for_each(|result| result.unwrap());
        assert!(is_signed(folder.path()));
        let text = |name: &str| fs::read_to_string(folder.path().join(name)).unwrap();
        assert_eq!(text("run.json"), text("report.html"));
    }

    fn folder(files: &[(&str, &str)]) -> tempfile::TempDir {
        let root = tempfile::tempdir().unwrap();
        for (name, text) in files {
            let path = root.path().join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        }
        root
    }

    #[test]
    fn a_run_is_own_output_by_its_listing_and_not_by_its_file_names() {
        let run = folder(&[("track.json", "{}"), ("poses.npz", "years of work")]);
        assert!(!ArtefactKind::Run.is_own(run.path()));
        sign(run.path()).unwrap();
        assert!(ArtefactKind::Run.is_own(run.path()) && !ArtefactKind::Set.is_own(run.path()));
        assert!(ArtefactKind::Run.is_own(folder(&[]).path()), "an empty directory may be replaced");
    }

    #[test]
    fn files_are_own_output_by_their_mark_and_not_by_their_name() {
        let root = folder(&[
            ("page.html", "<!doctype html>\n<meta name=\"generator\" content=\"skiagraph 0.0.1\">"),
            ("chart.svg", "<svg width=\"9\"><metadata>skiagraph 9.0.0</metadata></svg>"),
            ("study.md", "<!-- skiagraph 0.1.0 -->\n# study"),
            ("skiagraph.1", ".\\\" skiagraph 0.1.0\n.TH skiagraph 1"),
            ("run.json", "{\"schema\": \"skiagraph.run/1\"}"),
            ("thesis.html", "<!doctype html><p>skiagraph is a tool"),
            ("other.json", "{\"schema\": \"http://json-schema.org\"}"),
            ("scenario.toml", "schema = \"skiagraph.scenario/1\""),
            ("walk.model", "PK not really"),
            ("empty", ""),
        ]);
        let is_own = |name: &str| is_own_file(&root.path().join(name));
        for name in ["page.html", "study.md", "chart.svg", "skiagraph.1", "run.json"] {
            assert!(is_own(name), "{name}");
        }
        for name in ["thesis.html", "other.json", "scenario.toml", "walk.model", "empty", "nowhere", "."] {
            assert!(!is_own(name), "{name}");
        }
    }
}
