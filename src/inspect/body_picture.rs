//! `inspect ROBOT|CLIP|SKIN --out`: a picture.

use std::path::Path;

use super::{ClipSummary, expect_kind, place_for};
use crate::artefacts::{Artefact, Destination};
use crate::common::ExperimentError;
use skiagraph_core::body::{Humanoid, Motion, Pose};
use skiagraph_report::BodySheet;
use skiagraph_truth::retarget::Retargeted;

/// Prepares the `.png` file, before the work.
///
/// # Errors
/// [`ExperimentError`] for another kind of file, and if it would replace a file that is not output of this program.
pub(super) fn place_of(to: Option<Destination<'_>>, read: &Path) -> Result<Option<Artefact>, ExperimentError> {
    let Some(to) = to else { return Ok(None) };
    expect_kind(to.path, "png", "a .png file")?;
    Ok(Some(place_for(to, [Some(read)])?))
}

pub(super) fn put<'a>(file: Option<Artefact>, sheet: impl FnOnce() -> BodySheet<'a>) -> Result<(), ExperimentError> {
    let Some(file) = file else { return Ok(()) };
    Ok(file.put(&sheet().png()?)?)
}

pub(super) fn of_body<'a>(name: &str, body: &'a Humanoid) -> BodySheet<'a> {
    BodySheet { title: name.to_owned(), body, poses: BodySheet::four_poses(body), motion: None }
}

pub(super) fn of_clip<'a>(summary: &ClipSummary, retargeted: &'a Retargeted) -> BodySheet<'a> {
    BodySheet {
        title: summary.name.clone(),
        body: &retargeted.humanoid,
        poses: sampled_poses(&retargeted.motion),
        motion: Some(&retargeted.motion),
    }
}

/// Up to eight poses of a motion, evenly spaced.
fn sampled_poses(motion: &Motion) -> Vec<(String, Pose)> {
    let last = motion.poses.len().saturating_sub(1);
    let shown = motion.poses.len().clamp(1, 8);
    let frame = |index: usize| index * last / (shown - 1).max(1);
    (0..shown).filter_map(|i| Some((format!("frame {}", frame(i)), motion.poses.get(frame(i))?.clone()))).collect()
}
