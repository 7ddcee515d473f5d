//! `[actor] skin` and `[tracker_body] skin`: a robot gets its surface.

use std::path::{Path, PathBuf};

use crate::body::{Blending, Humanoid, SHIPPED_SKINS, Skin, SkinError, SkinMesh, read_skin_allowing, shipped_skin};
use crate::common::{ExperimentError, scenario_error};
use crate::input::{AllowedFolders, excerpt};
use crate::retarget::with_skin;
use crate::scenario::{ScenarioError, ScenarioFile};
use std::sync::Arc;

/// `robot` with the skin of that name, if one is given, and notes of the skin, which are also the body's last ones;
/// `table` is `actor` or `tracker_body`.
///
/// # Errors
/// [`ExperimentError`] that names the key, and what is wrong with the skin or its fit.
pub(crate) fn dressed(
    file: &ScenarioFile,
    table: &str,
    robot: Humanoid,
    skin: Option<&String>,
    blending: Blending,
) -> Result<(Humanoid, Vec<String>), ExperimentError> {
    let Some(name) = skin else { return Ok((robot, Vec::new())) };
    let unusable = |error: SkinError| scenario_error(file, &format!("{table}.skin"), error.to_string());
    if !SHIPPED_SKINS.contains(&name.as_str()) {
        file.path_of(&format!("{table}.skin"), Path::new(name)).map_err(ScenarioError::from)?;
    }
    let mesh = skin_named(&file.folder, Path::new(name), &file.allowed).map_err(unusable)?;
    let mut body = with_skin(&robot, &mesh).map_err(unusable)?;
    if blending == Blending::DualQuaternion {
        body.skin = body.skin.map(|skin| Arc::new(Skin::clone(&skin).with_blending(blending)));
    }
    let of_fit = body.notes.split_off(robot.notes.len());
    let notes: Vec<String> =
        of_fit.iter().chain(&mesh.notes).map(|note| format!("{}: {note}", excerpt(name))).collect();
    body.notes.extend(notes.iter().map(|note| format!("skin {note}")));
    Ok((body, notes))
}

/// A skin that ships, or one of a file below `folder`, whose parts may lie where `allowed` says.
fn skin_named(folder: &Path, name: &Path, allowed: &AllowedFolders) -> Result<SkinMesh, SkinError> {
    if let Some(known) = SHIPPED_SKINS.iter().find(|known| name == Path::new(known)) {
        return shipped_skin(known);
    }
    let path = folder.join(name);
    if !path.exists() {
        return Err(SkinError::NotShipped { name: name.display().to_string(), known: SHIPPED_SKINS.join(", ") });
    }
    read_skin_allowing(&path, allowed)
}

/// The files of a scenario's skins that do not ship.
pub(crate) fn paths_of(file: &ScenarioFile) -> Vec<PathBuf> {
    let scenario = &file.scenario;
    let others = scenario.distractor.iter().map(|other| &other.skin);
    let skins = [&scenario.actor.skin, &scenario.tracker_body.skin].into_iter().chain(others);
    skins.flatten().map(|name| file.folder.join(name)).collect()
}
