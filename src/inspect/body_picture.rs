//! `inspect ROBOT|CLIP|SKIN --out`: a picture, or a page with it and the facts.

use std::path::Path;

use super::facts::grouped;
use super::{ClipSummary, RobotSummary, SkinSummary, picture_kind, place_for};
use crate::artefacts::{Artefact, Destination};
use crate::body::{Humanoid, Motion, Pose};
use crate::common::ExperimentError;
use crate::report::BodySheet;
use crate::retarget::Retargeted;

/// Where a picture goes, and whether as a page.
pub(super) struct Place {
    file: Artefact,
    is_page: bool,
}

/// The place of a `.png` or `.html` file that is asked for, before anything long is done.
///
/// # Errors
/// [`ExperimentError`] for another kind of file, and where it would replace what is not ours.
pub(super) fn place_of(to: Option<Destination<'_>>, read: &Path) -> Result<Option<Place>, ExperimentError> {
    let Some(to) = to else { return Ok(None) };
    let is_page = picture_kind(to.path, &["png", "html"], "a .png or .html file")? == "html";
    Ok(Some(Place { file: place_for(to, [Some(read)])?, is_page }))
}

/// Writes a sheet, if it is asked for.
pub(super) fn put<'a>(place: Option<Place>, sheet: impl FnOnce() -> BodySheet<'a>) -> Result<(), ExperimentError> {
    let Some(Place { file, is_page }) = place else { return Ok(()) };
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

pub(super) fn of_clip<'a>(summary: &ClipSummary, performed: &'a Retargeted) -> BodySheet<'a> {
    BodySheet {
        title: summary.name.clone(),
        body: &performed.humanoid,
        poses: spread(&performed.motion),
        motion: Some(&performed.motion),
        facts: grouped(summary.heading(), summary.facts(), &summary.notes),
    }
}

/// Eight poses of a motion, evenly over its time.
fn spread(motion: &Motion) -> Vec<(String, Pose)> {
    let last = motion.poses.len().saturating_sub(1);
    let shown = motion.poses.len().clamp(1, 8);
    let frame = |index: usize| index * last / (shown - 1).max(1);
    (0..shown).filter_map(|i| Some((format!("frame {}", frame(i)), motion.poses.get(frame(i))?.clone()))).collect()
}
