//! `inspect ROBOT|CLIP|SKIN --out`: a picture, or a page with it and the facts.

use std::path::Path;

use super::{ClipSummary, RobotSummary, SkinSummary, place_for};
use crate::artefacts::{Artefact, Destination};
use crate::body::{Humanoid, Motion, Pose};
use crate::experiment::ExperimentError;
use crate::report::{BodySheet, FactGroup};
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
    let extension = to.path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
    let is_page = match extension.as_deref() {
        Some("png") => false,
        Some("html") => true,
        _ => {
            let detail = format!("expected the name of a .png or .html file, found {}", to.path.display());
            return Err(ExperimentError::Argument { argument: "--out", detail });
        }
    };
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
    let facts = vec![
        ("links".to_owned(), format!("{}, {} with geometry", summary.links[1], summary.links[0])),
        ("drawn".to_owned(), summary.drawn.in_words()),
        ("joints".to_owned(), format!("{}, {} movable", summary.joints[1], summary.joints[0])),
        ("joint angles".to_owned(), summary.degrees_of_freedom.len().to_string()),
        ("mass".to_owned(), format!("{:.2} kg", summary.mass_kg)),
        ("height".to_owned(), format!("{:.2} m from the lowest to the highest joint", summary.height_m)),
    ];
    BodySheet {
        title: summary.name.clone(),
        body,
        poses: BodySheet::four_poses(body),
        motion: None,
        facts: grouped("Robot", facts, &summary.notes),
    }
}

pub(super) fn of_skin<'a>(summary: &SkinSummary, body: &'a Humanoid) -> BodySheet<'a> {
    let facts = vec![
        ("vertices".to_owned(), summary.vertices.to_string()),
        ("triangles".to_owned(), summary.triangles.to_string()),
        ("height".to_owned(), format!("{:.3} m as modelled", summary.height_m)),
        ("weights".to_owned(), summary.weights.clone()),
        ("shown on".to_owned(), summary.body.clone()),
    ];
    BodySheet {
        title: summary.name.clone(),
        body,
        poses: BodySheet::four_poses(body),
        motion: None,
        facts: grouped("Skin", facts, &summary.notes),
    }
}

pub(super) fn of_clip<'a>(summary: &ClipSummary, performed: &'a Retargeted) -> BodySheet<'a> {
    let facts = vec![
        (
            "frames".to_owned(),
            format!("{} at {} Hz, {:.2} s", summary.frames, summary.frames_per_second, summary.duration_s),
        ),
        ("path".to_owned(), format!("{:.2} m along the ground", summary.path_m)),
    ];
    let fit = summary.fit.iter().flat_map(|fit| {
        let mean = format!("{:.1} mm from the recorded landmarks on average, on `actor`", fit.mean_mm);
        [("fit".to_owned(), mean), ("limits".to_owned(), fit.limits_in_words())]
    });
    let facts = facts.into_iter().chain(fit).collect();
    BodySheet {
        title: summary.name.clone(),
        body: &performed.humanoid,
        poses: spread(&performed.motion),
        motion: Some(&performed.motion),
        facts: grouped("Recording", facts, &summary.notes),
    }
}

/// Eight poses of a motion, evenly over its time.
fn spread(motion: &Motion) -> Vec<(String, Pose)> {
    let last = motion.poses.len().saturating_sub(1);
    let shown = motion.poses.len().clamp(1, 8);
    let frame = |index: usize| index * last / (shown - 1).max(1);
    (0..shown).filter_map(|i| Some((format!("frame {}", frame(i)), motion.poses.get(frame(i))?.clone()))).collect()
}

fn grouped(title: &str, facts: Vec<(String, String)>, notes: &[String]) -> Vec<FactGroup> {
    let notes = notes.iter().enumerate().map(|(index, note)| (format!("note {}", index + 1), note.clone())).collect();
    vec![FactGroup { title: title.to_owned(), facts }, FactGroup { title: "Notes".to_owned(), facts: notes }]
}
