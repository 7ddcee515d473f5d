//! Verifies a set: every file is as it was written, and all files agree with each other.
//!
//! Hashes say that nothing was changed since the set was written. They cannot say that what was written is right, and a
//! set that was edited and listed again has good hashes. So everything that can be computed in two ways is computed
//! again: body and joints from the poses, contact from the body, projections from the numbers of `cameras.json` by
//! OpenCV's formula without this program's reader, silhouettes and truth images from the body. What differs is a fault,
//! and where a common mistake explains it (another unit, a flipped axis, mirrored images, the frame before), the fault
//! says so.
//!
//! [`CHECKS`] lists the checks. A check that lacks a file which another check found at fault says that it did not look.

mod arrays;
mod blindfold;
mod body;
mod cameras;
mod contacts;
mod explanation;
mod filming;
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

/// The checks in the order in which they are made, each with what it proves.
pub const CHECKS: [(&str, &str); 14] = [
    ("hashes", "every listed file is there and unchanged, and no other file is"),
    ("formats", "every file can be read, and counts, names and frame rates agree"),
    (
        "cameras",
        "cameras.json describes real cameras: right-handed rotations, positive focal lengths, the stated axes; cameras.npz \
        has the places and times of cameras that move or keep times of their own",
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
        "trackers are told the true start and cameras with the errors that set.toml says, a body as facts.toml says, \
        and the spread of the set's own changes",
    ),
    ("recording", "the fingerprints, by which training on the test is noticed, are of this motion"),
    ("projection", "markers projected by OpenCV's formula are where in_view says, and lie in the silhouettes"),
    ("visibility", "in_view, visible and the sights of views.npz are what body, props and cameras give"),
    (
        "silhouettes",
        "every silhouette is what its camera sees of the body in its frame, or what segmentation or corruption makes of it",
    ),
    ("layers", "truth images hold depth (along z, metres), part, normal, flow, coverage and brightness of every pixel"),
    ("contact", "contact.npz is what the poses give"),
    ("shards", "tar shards hold the listed images and the truth of their samples, in order, and nothing else"),
    ("blindfold", "no file outside truth/ tells a pose of the test"),
];

/// What was found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Verification {
    /// The set's name; empty where `set.toml` cannot be read.
    pub name: String,
    /// SHA-256 of what is tested, without layers and shards.
    pub set_hash: String,
    /// SHA-256 of `files.sha256`: of every file, truth images and shards included.
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
    /// What was looked at, in words and numbers; or why nothing was.
    pub looked_at: String,
    /// Whether it was made.
    pub made: bool,
    /// Everything that is wrong.
    pub faults: Vec<Fault>,
}

/// One thing that is wrong.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Fault {
    /// Path inside the set.
    pub file: String,
    /// What was expected and what was found.
    pub detail: String,
}

/// How thorough a verification is, and who follows its progress.
#[derive(Clone, Copy)]
pub struct VerifyOptions<'a> {
    /// Silhouettes and truth images of every so many frames are redrawn; at least 1.
    pub every: usize,
    /// Called for every frame that was redrawn.
    pub tick: &'a (dyn Fn() + Sync),
    /// Whether to stop.
    pub stop: &'a (dyn Fn() -> bool + Sync),
}

impl Default for VerifyOptions<'_> {
    fn default() -> Self {
        Self { every: 1, tick: &|| (), stop: &|| false }
    }
}

impl Verification {
    /// Whether every check was made and found nothing.
    pub fn is_sound(&self) -> bool {
        self.checks.iter().all(|check| check.made && check.faults.is_empty())
    }

    /// All faults with the names of their checks.
    pub fn faults(&self) -> impl Iterator<Item = (&'static str, &Fault)> {
        self.checks.iter().flat_map(|check| check.faults.iter().map(|fault| (check.name, fault)))
    }
}

/// What a check brings home: what it looked at, and the faults; or why it could not look.
type Outcome = Result<(String, Vec<Fault>), String>;

/// What a check of images brings home of which some were `skipped`, because they are missing or were changed, as
/// another check says: it has looked at the rest alone, and what it has not looked at is not proved.
fn but_for(skipped: usize, images: &str, looked_at: String, faults: Vec<Fault>) -> Outcome {
    match skipped {
        0 => Ok((looked_at, faults)),
        _ if !faults.is_empty() => Ok((format!("{looked_at}, but for {skipped} that cannot be read"), faults)),
        _ => Err(format!("not checked: {skipped} of the {images} cannot be read; {looked_at}, but for these")),
    }
}

/// Makes all checks of the set in `directory`.
///
/// # Errors
/// [`SetError::NotASet`] and [`SetError::Io`] for a directory that is no set or cannot be read, [`SetError::Malformed`]
/// for a set of another version of the format, [`SetError::Stopped`]. What is wrong with a set is no error but a fault.
pub fn verify(directory: &Path, how: VerifyOptions<'_>) -> Result<Verification, SetError> {
    verify_place(directory.into(), how)
}

/// As [`verify`], of a set whose truth may lie elsewhere.
///
/// # Errors
/// As [`verify`]; [`SetError::NoTruth`] where the truth is needed and not given, [`SetError::OthersTruth`] where it is
/// that of another set.
pub fn verify_place(set: SetPlace<'_>, how: VerifyOptions<'_>) -> Result<Verification, SetError> {
    let directory = set.folder;
    let own = SetFiles::open(directory)?;
    manifest::refuse_other_formats(directory)?;
    let complete = set.complete(&own)?;
    let mut checks = Vec::with_capacity(CHECKS.len());
    let mut add = |outcome: Outcome| -> Result<(), SetError> {
        let (name, proves) = CHECKS[checks.len()];
        let (made, looked_at, faults) = match outcome {
            Ok((looked_at, faults)) => (true, looked_at, faults),
            Err(why) => (false, why, Vec::new()),
        };
        checks.push(Checked { name, proves, looked_at, made, faults });
        if (how.stop)() { Err(SetError::Stopped) } else { Ok(()) }
    };
    add(Ok((format!("{} files", own.count()), hash_faults(&own, directory, set.truth.zip(complete.as_ref()))?)))?;
    // what both sides have is the same in both, or was found to differ
    let files = complete.as_ref().unwrap_or(&own);
    let (parts, faults) = ReadParts::read(files);
    add(match parts.unread() {
        // a file that was changed is a fault of its hash, and tells nothing of its format
        unread if faults.is_empty() && !unread.is_empty() => {
            Err(format!("not checked: cannot read {}", unread.join(", ")))
        }
        _ => Ok((parts.in_words(), faults)),
    })?;
    add(cameras::check(files, &parts))?;
    add(body::check(&parts))?;
    add(poses::check(&parts))?;
    add(start::check(files, &parts))?;
    add(recording::check(files, &parts))?;
    add(projection::check(files, &parts))?;
    add(poses::check_visibility(files, &parts))?;
    add(masks::check(files, &parts, how))?;
    add(layers::check(files, &parts, how))?;
    add(contacts::check(files, &parts))?;
    add(shards::check(&own, complete.as_ref(), &parts, how))?;
    add(blindfold::check(directory, set.truth.unwrap_or(directory), &own))?;
    let name = parts.manifest.map(|manifest| manifest.name).unwrap_or_default();
    Ok(Verification { name, set_hash: own.set_hash(), full_hash: own.full_hash().to_owned(), checks })
}

/// Faults of the files of a set, and of the truth of the complete one that is elsewhere. A file that no list names is
/// one wherever it lies: one below truth/ may well be the truth itself.
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

    /// A file that cannot be read is named by its path inside the set.
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
