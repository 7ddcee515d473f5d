//! Exports a set to other tools' formats, each in its own folder, which appears when it is complete.

use std::path::Path;

use serde_json::json;

use super::video::{check_ffmpeg, videos};
use crate::artefacts::{Artefact, ArtefactKind, Destination, Inputs, MadeBy, is_signed};
use crate::common::{ExperimentError, Progress, Stage};
use skiagraph_set::{BlindSet, EXPORT_FORMATS, ExportFormat, ExportWatch, SetPlace, export, export_blind};

/// The name of the format for H.264.
const VIDEO: &str = "video";

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExportTo {
    /// Another tool's format.
    Format(ExportFormat),
    /// H.264 by the user's ffmpeg.
    Video,
}

impl ExportTo {
    /// Names of all targets, each with a description of its files.
    pub fn names() -> impl Iterator<Item = (&'static str, &'static str)> {
        let video = (VIDEO, "NN-NAME.mp4 of every camera, its images or silhouettes, by your ffmpeg: H.264");
        EXPORT_FORMATS.into_iter().map(|(_, name, what)| (name, what)).chain([video])
    }

    pub fn named(name: &str) -> Option<Self> {
        match name {
            VIDEO => Some(Self::Video),
            _ => ExportFormat::named(name).map(Self::Format),
        }
    }

    pub fn name(self) -> &'static str {
        match self {
            Self::Format(format) => format.name(),
            Self::Video => VIDEO,
        }
    }
}

/// `skiagraph export`: writes a set into a folder.
pub fn export_set(
    set: SetPlace<'_>,
    to: ExportTo,
    place: Destination<'_>,
    progress: &dyn Progress,
) -> Result<(), ExperimentError> {
    Inputs::new(set.folders()).keep_from(place.path)?;
    let there = exports_in(place.path);
    if !there.is_empty() && !place.force {
        let beside = place.path.join(to.name());
        return Err(ExperimentError::ExportsThere { path: place.path.to_owned(), there: there.join(", "), beside });
    }
    if to == ExportTo::Video {
        check_ffmpeg()?;
    }
    let blind = match set.truth {
        Some(_) => set.read()?.blind,
        None => BlindSet::read(set.folder)?,
    };
    let made_by = MadeBy::new("skiagraph export", json!({"--to": to.name()})).of("set", &blind.set_hash);
    let folder = Artefact::begin_folder(place, ArtefactKind::Folder, made_by)?;
    progress.begin(Stage::Export, blind.frame_count);
    let watch = ExportWatch { tick: &|| progress.advance(), stop: &|| progress.interrupted() };
    match to {
        ExportTo::Format(format) if format.has_truth() => export(&set.read()?, format, folder.folder(), watch)?,
        ExportTo::Format(format) => export_blind(&blind, format, folder.folder(), watch)?,
        ExportTo::Video => videos(&blind, &folder, progress)?,
    }
    Ok(folder.finish()?)
}

/// The formats with an export inside this folder; none if the folder is an export itself.
fn exports_in(folder: &Path) -> Vec<&'static str> {
    if ArtefactKind::Folder.is_own(folder) {
        return Vec::new();
    }
    let is_there = |name: &&str| is_signed(&folder.join(name));
    ExportTo::names().map(|(name, _)| name).filter(is_there).collect()
}
