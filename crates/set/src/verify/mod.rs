//! Verifies a set: every file is unchanged, and all files agree with each other.
//!
//! Hashes show that nothing was changed since the set was written. They cannot show that the content is right, and a
//! set that was edited and listed again has valid hashes. Therefore everything that can be computed in two ways is
//! computed again: body and joints from the poses, contact from the body, projections from the numbers of
//! `cameras.json` by OpenCV's formula without this program's reader, silhouettes and truth images from the body.
//! Differences are faults, with an explanation if they come from a common mistake (another unit, a flipped axis,
//! mirrored images, the previous frame).
//!
//! [`CHECKS`] lists the checks. A check that lacks a file which another check reports is marked as not made.

mod arrays;
mod blindfold;
mod body;
mod cameras;
mod colour;
mod contacts;
mod explanation;
mod filming;
mod keypoints;
mod layers;
mod masks;
mod parts;
mod poses;
mod projection;
mod recording;
mod refit;
mod rounding;
mod shards;
mod start;
mod surface;
mod tracker_body;

use std::path::Path;

use serde::Serialize;

use self::parts::ReadParts;
use super::files::SetFiles;
use super::{SetError, SetPlace, manifest};

/// The checks in their order, each with what it proves.
pub const CHECKS: [(&str, &str); 16] = [
    ("hashes", "every listed file is present, unchanged and inside the set, and there is no other file"),
    ("formats", "every file can be read, and counts, names and frame rates agree"),
    (
        "cameras",
        "cameras.json describes real cameras: right-handed rotations, positive focal lengths, the stated axes; cameras.npz \
        has the poses and times of moving or timed cameras",
    ),
    (
        "body",
        "the actor stands upright in metres, its left and right are not exchanged, and markers are on their links",
    ),
    (
        "poses",
        "link frames, joints and markers follow from root and angles, frame by frame, and nothing jumps; refitted poses \
        are the nearest of the tracker's body",
    ),
    (
        "start",
        "trackers are given the true start and cameras with the errors stated in set.toml, the body stated in facts.toml, \
        and the spread of the set's own changes",
    ),
    ("recording", "the fingerprints, which detect training on the test, are of this motion"),
    ("projection", "markers projected by OpenCV's formula agree with in_view and lie in the silhouettes"),
    ("visibility", "in_view, visible and the visibility codes of views.npz follow from body, props and cameras"),
    (
        "silhouettes",
        "every silhouette is that of the body in its camera and frame, segmented or corrupted if set.toml states it",
    ),
    (
        "keypoints",
        "keypoints are those of the body in its cameras, with the errors that set.toml states, if it states any",
    ),
    ("colour", "the images for trackers are those of the scene, with and without people, if set.toml states any"),
    ("layers", "truth images hold depth (along z, metres), part, normal, flow, coverage and brightness of every pixel"),
    ("contact", "contact.npz follows from the poses"),
    ("shards", "tar shards hold the listed images and the truth of their samples, in order, and nothing else"),
    ("blindfold", "no file outside truth/ contains a pose of the test"),
];

/// The result of a verification.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Verification {
    /// The set's name; empty if `set.toml` cannot be read.
    pub name: String,
    /// SHA-256 of what is tested, without layers and shards.
    pub set_hash: String,
    /// SHA-256 of `files.sha256`, which covers every file, truth images and shards included.
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
    /// Silhouettes and truth images of every n-th frame are rendered again; at least 1.
    pub every: usize,
    /// Called for every frame rendered again.
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
    /// Whether every check was made and found no fault.
    pub fn is_sound(&self) -> bool {
        self.checks.iter().all(|check| check.made && check.faults.is_empty())
    }

    /// All faults with the names of their checks.
    pub fn faults(&self) -> impl Iterator<Item = (&'static str, &Fault)> {
        self.checks.iter().flat_map(|check| check.faults.iter().map(|fault| (check.name, fault)))
    }
}

/// The result of a check: what was checked, and the faults; or why the check was not made.
type CheckOutcome = Result<(String, Vec<Fault>), String>;

/// The result of a check of images that `skipped` some, because they are missing or changed, which another check
/// reports. Without faults in the others, the check counts as not made.
fn with_skipped(skipped: usize, images: &str, looked_at: String, faults: Vec<Fault>) -> CheckOutcome {
    match skipped {
        0 => Ok((looked_at, faults)),
        _ if !faults.is_empty() => Ok((format!("{looked_at}, except {skipped} missing or changed"), faults)),
        1 => Err(format!("not checked: 1 of the {images} is missing or was changed; {looked_at}, except this one")),
        _ => Err(format!(
            "not checked: {skipped} of the {images} are missing or were changed; {looked_at}, except these"
        )),
    }
}

/// Makes all checks of the set in `directory`.
///
/// # Errors
/// [`SetError::NotASet`] and [`SetError::Io`] for a directory that is not a set or cannot be read,
/// [`SetError::Malformed`] for a set of another version of the format, [`SetError::Stopped`]. Faults of a set are not
/// errors.
pub fn verify(directory: &Path, how: VerifyOptions<'_>) -> Result<Verification, SetError> {
    verify_place(directory.into(), how)
}

/// As [`verify`], for a set whose truth may be in another directory.
///
/// # Errors
/// As [`verify`]; [`SetError::NoTruth`] if the truth is needed and not given, [`SetError::OthersTruth`] if it belongs
/// to another set.
pub fn verify_place(set: SetPlace<'_>, how: VerifyOptions<'_>) -> Result<Verification, SetError> {
    let directory = set.folder;
    let own = SetFiles::open(directory)?;
    manifest::refuse_other_formats(directory)?;
    let complete = set.complete(&own)?;
    let mut checks = Vec::with_capacity(CHECKS.len());
    let mut add = |outcome: CheckOutcome| -> Result<(), SetError> {
        let (name, proves) = CHECKS[checks.len()];
        let (made, looked_at, faults) = match outcome {
            Ok((looked_at, faults)) => (true, looked_at, faults),
            Err(why) => (false, why, Vec::new()),
        };
        checks.push(Checked { name, proves, looked_at, made, faults });
        if (how.stop)() { Err(SetError::Stopped) } else { Ok(()) }
    };
    add(Ok((format!("{} files", own.count()), hash_faults(&own, directory, set.truth.zip(complete.as_ref()))?)))?;
    // files of both directories are equal, or reported as different
    let files = complete.as_ref().unwrap_or(&own);
    let (parts, faults) = ReadParts::read(files);
    add(match parts.unread() {
        // a changed file is reported by its hash; its format is unknown
        unread if faults.is_empty() && !unread.is_empty() => {
            Err(format!("not checked: cannot read {}", unread.join(", ")))
        }
        _ => Ok((parts.describe(), faults)),
    })?;
    add(cameras::check(files, &parts))?;
    add(body::check(&parts))?;
    add(poses::check(&parts))?;
    add(start::check(files, &parts))?;
    add(recording::check(files, &parts))?;
    add(projection::check(files, &parts))?;
    add(poses::check_visibility(files, &parts))?;
    add(masks::check(files, &parts, how))?;
    add(keypoints::check(files, &parts))?;
    add(colour::check(files, &parts, how))?;
    add(layers::check(files, &parts, how))?;
    add(contacts::check(files, &parts))?;
    add(shards::check(&own, complete.as_ref(), &parts, how))?;
    add(blindfold::check(directory, set.truth.unwrap_or(directory), &own))?;
    let name = parts.manifest.map(|manifest| manifest.name).unwrap_or_default();
    Ok(Verification { name, set_hash: own.set_hash(), full_hash: own.full_hash().to_owned(), checks })
}

/// Faults of the files of a set, and of the truth in another directory. Unlisted files are faults in any folder: one
/// below truth/ may be the truth itself.
fn hash_faults(own: &SetFiles, folder: &Path, truth: Option<(&Path, &SetFiles)>) -> Result<Vec<Fault>, SetError> {
    let errors = own.faults()?.into_iter();
    let found = errors.map(|error| (matches!(error, SetError::Unlisted { .. }), Fault::from_file(folder, error)));
    let is_of_truth = |fault: &Fault| fault.file.starts_with("truth/");
    let counts = |(is_unlisted, fault): &(bool, Fault)| *is_unlisted || truth.is_none() || !is_of_truth(fault);
    let mut faults: Vec<Fault> = found.filter(counts).map(|(_, fault)| fault).collect();
    if let Some((folder, complete)) = truth {
        let elsewhere = complete.faults()?.into_iter().map(|error| Fault::from_file(folder, error));
        faults.extend(elsewhere.filter(is_of_truth));
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
            other => other.into(),
        }
    }
}

impl From<SetError> for Fault {
    fn from(error: SetError) -> Self {
        match error {
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
            SetError::MissingShard { file, shards } => Self {
                file,
                detail: format!("is missing; the set lists {shards} shards; get it again, or render the set again"),
            },
            SetError::BrokenShard { file, detail } => Self { file, detail: format!("this shard is damaged: {detail}") },
            other => Self { file: String::new(), detail: other.to_string() },
        }
    }
}
