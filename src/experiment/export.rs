//! Exports a set to other tools' formats, each in its own folder, which appears when it is complete.

use std::fs::File;
use std::io::{BufWriter, Write as _};
use std::path::Path;

use super::made_by::MadeBy;
use super::video::{VIDEO_TITLE, camera_file, check_ffmpeg, videos};
use crate::artefacts::{Artefact, ArtefactKind, Destination, Inputs, is_signed, output};
use crate::benchmark_set::{
    BenchmarkSet, BlindSet, EXPORT_FORMATS, EXPORT_README, ExportFormat, ExportWatch, SetPlace, export, export_blind,
    export_readme,
};
use crate::common::{ExperimentError, Progress, Stage, advance};
use crate::report::overlay::link_bones;
use crate::report::write_animation;

/// The name of the format for animated PNGs.
const ANIMATION: &str = "apng";
/// The name of the format for H.264.
const VIDEO: &str = "video";

/// The title of its export.
const ANIMATION_TITLE: &str = "Animations";

const ANIMATION_README: &str = "\
NN-NAME.apng of every camera, NN its number: its silhouettes, and the true skeleton in green; any browser plays it. For MP4: ffmpeg -i NN-NAME.apng
NAME.mp4";

/// The target of an export.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExportTo {
    /// Another tool's format.
    Format(ExportFormat),
    /// Animated PNGs for viewing.
    Animation,
    /// H.264 by the user's ffmpeg.
    Video,
}

impl ExportTo {
    /// Names of all targets, each with a description of its files.
    pub fn names() -> impl Iterator<Item = (&'static str, &'static str)> {
        let animation = (ANIMATION, "NN-NAME.apng of every camera, silhouettes and skeleton: browsers");
        let video = (VIDEO, "NN-NAME.mp4 of every camera, its images or silhouettes, by your ffmpeg: H.264");
        EXPORT_FORMATS.into_iter().map(|(_, name, what)| (name, what)).chain([animation, video])
    }

    /// The target with this name.
    pub fn named(name: &str) -> Option<Self> {
        match name {
            ANIMATION => Some(Self::Animation),
            VIDEO => Some(Self::Video),
            _ => ExportFormat::named(name).map(Self::Format),
        }
    }

    /// The title of its `README.txt`.
    fn title(self) -> &'static str {
        match self {
            Self::Format(format) => format.title(),
            Self::Animation => ANIMATION_TITLE,
            Self::Video => VIDEO_TITLE,
        }
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Format(format) => format.name(),
            Self::Animation => ANIMATION,
            Self::Video => VIDEO,
        }
    }
}

/// `skiagraph export`: writes a set into a folder.
///
/// # Errors
/// [`ExperimentError`]; nothing is written then.
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
    let made_by = MadeBy::export(to.title(), &export_readme("", &blind, ""));
    let folder = Artefact::begin_unless(place, ArtefactKind::Export, made_by.difference_at(place.path))?;
    progress.begin(Stage::Export, blind.frame_count);
    let watch = ExportWatch { tick: &|| progress.advance(), stop: &|| progress.interrupted() };
    match to {
        ExportTo::Format(format) if format.has_truth() => export(&set.read()?, format, folder.folder(), watch)?,
        ExportTo::Format(format) => export_blind(&blind, format, folder.folder(), watch)?,
        ExportTo::Animation => animations(&set.read()?, &folder, progress)?,
        ExportTo::Video => videos(&blind, &folder, progress)?,
    }
    Ok(folder.finish()?)
}

/// The formats with an export inside this folder; none if the folder is an export itself.
fn exports_in(folder: &Path) -> Vec<&'static str> {
    if ArtefactKind::Export.is_own(folder) {
        return Vec::new();
    }
    let is_there = |name: &&str| is_signed(&folder.join(name));
    ExportTo::names().map(|(name, _)| name).filter(is_there).collect()
}

fn animations(set: &BenchmarkSet, folder: &Artefact, progress: &dyn Progress) -> Result<(), ExperimentError> {
    if set.blind.moments.is_some() {
        let detail = "apng: only valid for static cameras with an image at every frame's time, and this set has others";
        return Err(ExperimentError::Argument { argument: "--to", detail: detail.to_owned() });
    }
    folder.write(EXPORT_README, export_readme(ANIMATION_TITLE, &set.blind, ANIMATION_README).as_bytes())?;
    let (truth, frames) = (&set.truth.ground_truth, set.blind.frame_count);
    for (index, camera) in set.blind.rig.cameras.iter().enumerate() {
        let path = folder.folder().join(format!("{}.apng", camera_file(index, &camera.name)));
        let mut file = BufWriter::new(File::create_new(&path).map_err(output(&path, "write"))?);
        write_animation(&mut file, camera, frames, set.blind.frames_per_second, |frame| {
            // progress counts the frames of the first camera
            if index == 0 {
                advance(progress)?;
            } else if progress.interrupted() {
                return Err(ExperimentError::Interrupted);
            }
            let mask = set.blind.observation(frame)?.silhouettes.swap_remove(index);
            Ok((mask, link_bones(&truth.actor, &truth.frames[frame].link_frames)))
        })?;
        file.flush().map_err(output(&path, "write"))?;
    }
    Ok(())
}
