//! `inspect ROBOT|CLIP|SKIN --out`: a picture, or a page with it and the facts.

use std::path::Path;

use super::facts::grouped;
use super::{ClipSummary, RobotSummary, SkinSummary, picture_kind, place_for};
use crate::artefacts::{Artefact, Destination};
use crate::body::{Humanoid, Motion, Pose};
use crate::common::ExperimentError;
use crate::report::BodySheet;
use crate::retarget::Retargeted;

/// The file of a picture or a page.
pub(super) struct PicturePlace {
    file: Artefact,
    is_page: bool,
}

/// Prepares the `.png` or `.html` file, before the work.
///
/// # Errors
/// [`ExperimentError`] for another kind of file, and if it would replace a file that is not output of this program.
pub(super) fn place_of(to: Option<Destination<'_>>, read: &Path) -> Result<Option<PicturePlace>, ExperimentError> {
    let Some(to) = to else { return Ok(None) };
    let is_page = picture_kind(to.path, &["png", "html"], "a .png or .html file")? == "html";
    Ok(Some(PicturePlace { file: place_for(to, [Some(read)])?, is_page }))
}

/// Writes a sheet, if a file is given.
pub(super) fn put<'a>(
    place: Option<PicturePlace>,
    sheet: impl FnOnce() -> BodySheet<'a>,
) -> Result<(), ExperimentError> {
    let Some(PicturePlace { file, is_page }) = place else { return Ok(()) };
    let sheet = sheet();
    let bytes = if is_page { sheet.page()?.into_bytes() } else { sheet.png()? };
    Ok(file.put(&bytes)?)
}

pub(super) fn of_robot<'a>(summary: &RobotSummary, body: &'a Humanoid) -> BodySheet<'a> {
    BodySheet {
        title: summary.name.clone(),
        body,
        poses: BodySheet::four_poses(body),
        motion: None,
        facts: grouped(summary.heading(), summary.facts(), &summary.notes),
    }
}

pub(super) fn of_skin<'a>(summary: &SkinSummary, body: &'a Humanoid) -> BodySheet<'a> {
    BodySheet {
        title: summary.name.clone(),
        body,
        poses: BodySheet::four_poses(body),
        motion: None,
        facts: grouped(summary.heading(), summary.facts(), &summary.notes),
    }
}

pub(super) fn of_clip<'a>(summary: &ClipSummary, retargeted: &'a Retargeted) -> BodySheet<'a> {
    BodySheet {
        title: summary.name.clone(),
        body: &retargeted.humanoid,
        poses: sampled_poses(&retargeted.motion),
        motion: Some(&retargeted.motion),
        facts: grouped(summary.heading(), summary.facts(), &summary.notes),
    }
}

/// Up to eight poses of a motion, evenly spaced.
fn sampled_poses(motion: &Motion) -> Vec<(String, Pose)> {
    let last = motion.poses.len().saturating_sub(1);
    let shown = motion.poses.len().clamp(1, 8);
    let frame = |index: usize| index * last / (shown - 1).max(1);
    (0..shown).filter_map(|i| Some((format!("frame {}", frame(i)), motion.poses.get(frame(i))?.clone()))).collect()
}
