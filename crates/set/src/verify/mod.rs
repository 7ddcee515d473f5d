//! Verifies a set: its hashes, its formats, and everything that follows from its truth.
//!
//! Hashes show that nothing was changed since the set was written. They cannot show that the content is right, and a
//! set that was edited and listed again has valid hashes. But drawing is bit-exact, and a set holds whatever it needs:
//! the bodies, their poses, the cameras, the settings of the observation and the key. So every file that follows from
//! these is made again and compared byte by byte ([`remade`]). Two checks do not trust the code that made the set:
//! projections by OpenCV's formula, and silhouettes against joints ([`witness`]).
//!
//! A file that cannot be read is a fault. A check that needs files which the set does not have, as in a set without its
//! truth, is marked as not made.

mod difference;
mod permitted;
mod remade;
#[cfg(test)]
pub(crate) mod tests;
mod witness;

use std::path::Path;
use std::sync::Arc;

use serde::Serialize;

use self::remade::{Remade, Remaking};
use super::files::SetFiles;
use super::format::listing::{KEY_FILE, stop_if_requested};
use super::format::manifest::{self, BlindManifest};
use super::{BlindSet, SetError, SetPlace, TruthSet};

/// The checks in their order, each with what it proves.
pub const CHECKS: [(&str, &str); 9] = [
    ("hashes", "every listed file is present, unchanged and inside the set, and there is no other file"),
    ("formats", "all files from which the others follow can be read, and agree in counts, names and rates"),
    (
        "blindfold",
        "outside truth/ are only the files that trackers may read, with nothing in them but what skiagraph writes there",
    ),
    ("given", "set.toml, cameras and start follow from the truth and the stated errors, byte by byte"),
    ("truth", "all arrays and records below truth/ follow from bodies, poses and cameras, byte by byte"),
    ("observations", "silhouettes, keypoints and images are those of the truth as set.toml states, byte by byte"),
    ("layers", "truth images are those of the truth, byte by byte"),
    ("projection", "pixels of joints and markers are those of OpenCV's formula with the numbers of the camera file"),
    ("masks", "joints that a camera sees inside the body are in its silhouettes"),
];

/// The result of a verification.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Verification {
    /// The set's name; empty if `set.toml` cannot be read.
    pub name: String,
    /// SHA-256 of what is tested, without truth images.
    pub set_hash: String,
    /// SHA-256 of `files.sha256`, which covers every file, truth images included.
    pub full_hash: String,
    /// All checks, in the order of [`CHECKS`].
    pub checks: Vec<Checked>,
}

/// One check.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Checked {
    /// Its name in [`CHECKS`].
    pub name: &'static str,
    /// What it proves.
    pub proves: &'static str,
    /// Description of what was checked, or why nothing was.
    pub looked_at: String,
    /// Whether it was made.
    pub made: bool,
    /// All faults found.
    pub faults: Vec<Fault>,
}

/// A fault of a file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Fault {
    /// Path inside the set.
    pub file: String,
    /// What was expected and what was found.
    pub detail: String,
}

/// Thoroughness and callbacks of a verification.
#[derive(Clone, Copy)]
pub struct VerifyOptions<'a> {
    /// Images of every n-th frame are drawn again; at least 1.
    pub every: usize,
    /// Called for every frame drawn again.
    pub tick: &'a (dyn Fn() + Sync),
    /// Returns whether to stop.
    pub stop: &'a (dyn Fn() -> bool + Sync),
}

impl Default for VerifyOptions<'_> {
    fn default() -> Self {
        Self { every: 1, tick: &|| (), stop: &|| false }
    }
}

impl Verification {
    /// Whether no check found a fault.
    pub fn is_sound(&self) -> bool {
        self.faults().next().is_none()
    }

    /// Whether every check was made.
    pub fn is_complete(&self) -> bool {
        self.checks.iter().all(|check| check.made)
    }

    /// All faults with the names of their checks.
    pub fn faults(&self) -> impl Iterator<Item = (&'static str, &Fault)> {
        self.checks.iter().flat_map(|check| check.faults.iter().map(|fault| (check.name, fault)))
    }
}

/// The result of a check: what was checked, and the faults; or why the check was not made.
type CheckOutcome = Result<(String, Vec<Fault>), String>;

/// Makes all checks of the set in `directory`.
///
/// # Errors
/// [`SetError::NotASet`] and [`SetError::Io`] for a directory that is not a set or cannot be read,
/// [`SetError::Malformed`] for a set of another version of the format, [`SetError::Stopped`]. Faults of a set are not
/// errors.
pub fn verify(directory: &Path, how: VerifyOptions<'_>) -> Result<Verification, SetError> {
    verify_place(directory.into(), how)
}

/// As [`verify`], for a set whose truth may be in another directory. Without any truth, the checks that need it are not
/// made.
///
/// # Errors
/// As [`verify`]; [`SetError::NoTruth`] if the directory of the truth has none, [`SetError::OthersTruth`] if it belongs
/// to another set.
pub fn verify_place(set: SetPlace<'_>, how: VerifyOptions<'_>) -> Result<Verification, SetError> {
    let own = SetFiles::open(set.folder)?;
    manifest::refuse_other_formats(set.folder)?;
    let complete = if set.truth.is_some() { set.complete(&own)? } else { None };
    let own = Arc::new(own);
    let mut checks = Checks { made: Vec::with_capacity(CHECKS.len()), how };
    let listed = format!("{} files", own.paths().count());
    let place_of_truth = set.truth.zip(complete.as_ref());
    let spoilt = hash_faults(&own, set.folder, place_of_truth)?;
    let spoilt_files = spoilt.iter().map(|fault| fault.file.clone()).collect();
    checks.add(Ok((listed, spoilt)))?;
    // files of both directories are equal, or reported as different
    let files = complete.map_or_else(|| own.clone(), Arc::new);
    let has_key = !is_key_elsewhere(&files);
    let mut faults = Vec::new();
    let blind = read_blind_side(&own, &mut faults);
    let truth = read_truth_side(&files, has_key, &mut faults);
    faults.extend(disagreement(&blind, &truth));
    let counts = blind.as_ref().map(|(manifest, _)| &manifest.sequence);
    let counts = counts.map(|own| format!("{} frames, {} cameras", own.frames, own.cameras));
    checks.add(Ok((counts.unwrap_or("no readable set".to_owned()), faults)))?;
    match &blind {
        Ok((manifest, side)) => checks.add(permitted::check(&own, manifest, side))?,
        Err(why) => checks.add(Err(why.clone()))?,
    }
    let remade = match (&blind, &truth) {
        (Ok((manifest, side)), Ok(truth)) => Remade::new(manifest, side, truth),
        (Err(why), _) | (_, Err(why)) => Err(why.clone()),
    };
    match (&blind, &truth, &remade) {
        (Ok((manifest, side)), Ok(truth), Ok(remade)) => {
            let again = Remaking { files: &files, spoilt: &spoilt_files, manifest, side, truth, remade, has_key, how };
            for outcome in again.outcomes()? {
                checks.add(outcome)?;
            }
            checks.add(witness::check_projection(&files, remade))?;
            checks.add(witness::check_masks(&files, side, remade))?;
        }
        _ => {
            let why = remade.as_ref().err().cloned().unwrap_or_default();
            for _ in checks.made.len()..CHECKS.len() {
                checks.add(Err(why.clone()))?;
            }
        }
    }
    let name = blind.map(|(manifest, _)| manifest.name).unwrap_or_default();
    Ok(Verification { name, set_hash: own.set_hash(), full_hash: own.full_hash().to_owned(), checks: checks.made })
}

struct Checks<'a> {
    made: Vec<Checked>,
    how: VerifyOptions<'a>,
}

impl Checks<'_> {
    fn add(&mut self, outcome: CheckOutcome) -> Result<(), SetError> {
        let (name, proves) = CHECKS[self.made.len()];
        let (made, looked_at, faults) = match outcome {
            Ok((looked_at, faults)) => (true, looked_at, faults),
            Err(why) => (false, why, Vec::new()),
        };
        self.made.push(Checked { name, proves, looked_at, made, faults });
        stop_if_requested(self.how.stop)
    }
}

/// The side for trackers, or why it is unavailable.
type BlindSide = Result<(BlindManifest, BlindSet), String>;

fn read_blind_side(own: &Arc<SetFiles>, faults: &mut Vec<Fault>) -> BlindSide {
    let manifest = own.read(manifest::PATH).and_then(|bytes| BlindManifest::from_toml(&bytes));
    let read = manifest.and_then(|manifest| Ok((manifest, BlindSet::parse(own)?)));
    read.map_err(|error| unreadable(own, error, faults))
}

fn read_truth_side(files: &SetFiles, has_key: bool, faults: &mut Vec<Fault>) -> Result<TruthSet, String> {
    if files.is_footage() {
        return Err("not checked: a recording has no truth".to_owned());
    }
    if files.refuse_without_truth().is_err() {
        return Err("not checked: the set has no truth; --truth DIR gives the complete set".to_owned());
    }
    TruthSet::parse(files, has_key).map_err(|error| unreadable(files, error, faults))
}

/// Reports a file that cannot be read, and returns why the checks that need it are not made.
fn unreadable(files: &SetFiles, error: SetError, faults: &mut Vec<Fault>) -> String {
    let fault = Fault::from_file(files.folder().unwrap_or(Path::new("")), error);
    let why = match fault.file.as_str() {
        "" => format!("not checked: {}", fault.detail),
        file => format!("not checked: cannot read {file}"),
    };
    if !faults.contains(&fault) {
        faults.push(fault);
    }
    why
}

/// Whether the key is listed, but kept elsewhere: then nothing that was drawn with it can be drawn again.
fn is_key_elsewhere(files: &SetFiles) -> bool {
    let folder = files.folder();
    files.has(KEY_FILE) && folder.is_some_and(|folder| !folder.join(KEY_FILE).exists())
}

/// Numbers of both sides that differ.
fn disagreement(blind: &BlindSide, truth: &Result<TruthSet, String>) -> Option<Fault> {
    let (Ok((_, side)), Ok(truth)) = (blind, truth) else { return None };
    let (given, known) = (side.rig.cameras.len(), truth.rig.cameras());
    let detail = format!("trackers are given {given} cameras, the truth has {known}");
    (given != known).then(|| Fault::new(manifest::PATH, detail))
}

/// Faults of the files of a set, and of the truth in another directory. Unlisted files are faults in any folder: one
/// below truth/ may be the truth itself.
fn hash_faults(own: &SetFiles, folder: &Path, truth: Option<(&Path, &SetFiles)>) -> Result<Vec<Fault>, SetError> {
    let mut faults = Vec::new();
    for error in own.faults()? {
        let is_unlisted = matches!(error, SetError::Unlisted { .. });
        let fault = Fault::from_file(folder, error);
        if is_unlisted || truth.is_none() || !fault.file.starts_with("truth/") {
            faults.push(fault);
        }
    }
    if let Some((folder, complete)) = truth {
        let elsewhere = complete.faults()?.into_iter().map(|error| Fault::from_file(folder, error));
        faults.extend(elsewhere.filter(|fault| fault.file.starts_with("truth/")));
    }
    if is_key_elsewhere(truth.map_or(own, |(_, complete)| complete)) {
        faults.retain(|fault| fault.file != KEY_FILE);
    }
    Ok(faults)
}

impl Fault {
    fn new(file: &str, detail: impl Into<String>) -> Self {
        Self { file: file.to_owned(), detail: detail.into() }
    }

    /// A fault with the path inside the set, also for files that cannot be read.
    fn from_file(directory: &Path, error: SetError) -> Self {
        match error {
            SetError::Io { path, action, source } => {
                let file = path.strip_prefix(directory).unwrap_or(&path).to_string_lossy().replace('\\', "/");
                Self { file, detail: format!("cannot {action}: {source}") }
            }
            SetError::Malformed { file, detail } => Self { file, detail },
            SetError::Tampered { file, listed, found } => Self {
                file,
                detail: format!("was changed or truncated: its SHA-256 is {found}, the set lists {listed}"),
            },
            SetError::Unlisted { file } => {
                Self { file, detail: "is not one of the set's files: files.sha256 does not list it".to_owned() }
            }
            SetError::LinkedOutside { file } => Self {
                file,
                detail: "is a symbolic link that leads out of the set; expected the file itself".to_owned(),
            },
            other => Self { file: String::new(), detail: other.to_string() },
        }
    }
}
