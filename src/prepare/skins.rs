//! `[actor] skin` and `[tracker_body] skin`: the surface of a robot.

use std::path::{Path, PathBuf};

use crate::body::{Blending, Humanoid, SHIPPED_SKINS, Skin, SkinMesh, read_skin_allowing, shipped_skin};
use crate::common::{ExperimentError, scenario_error};
use crate::input::{AllowedFolders, excerpt};
use crate::retarget::with_skin;
use crate::scenario::{ScenarioError, ScenarioFile, did_you_mean, similar_file};
use std::sync::Arc;

/// `robot` with the skin of this name, if one is given, and the notes about the skin, which are also the body's last
/// notes. `table` is `actor`, `tracker_body` or a distractor's.
///
/// # Errors
/// [`ExperimentError`] that names the key and the problem with the skin or its fit.
pub(crate) fn attach_skin(
    file: &ScenarioFile,
    table: &str,
    robot: Humanoid,
    skin: Option<&String>,
    blending: Blending,
) -> Result<(Humanoid, Vec<String>), ExperimentError> {
    let Some(name) = skin else { return Ok((robot, Vec::new())) };
    let unusable = |error: String| scenario_error(file, &format!("{table}.skin"), error);
    if !SHIPPED_SKINS.contains(&name.as_str()) {
        file.path_of(&format!("{table}.skin"), Path::new(name)).map_err(ScenarioError::from)?;
    }
    let mesh = skin_named(&file.folder, Path::new(name), &file.allowed).map_err(unusable)?;
    let mut body = with_skin(&robot, &mesh).map_err(|error| unusable(error.to_string()))?;
    if blending == Blending::DualQuaternion {
        body.skin = body.skin.map(|skin| Arc::new(Skin::clone(&skin).with_blending(blending)));
    }
    let of_fit = body.notes.split_off(robot.notes.len());
    let notes: Vec<String> =
        of_fit.iter().chain(&mesh.notes).map(|note| format!("{}: {note}", excerpt(name))).collect();
    body.notes.extend(notes.iter().map(|note| format!("skin {note}")));
    Ok((body, notes))
}

/// A built-in skin, or one from a file below `folder`, whose parts must be in `allowed` folders; otherwise the reason.
fn skin_named(folder: &Path, name: &Path, allowed: &AllowedFolders) -> Result<SkinMesh, String> {
    if let Some(known) = SHIPPED_SKINS.iter().find(|known| name == Path::new(known)) {
        return shipped_skin(known).map_err(|error| error.to_string());
    }
    let path = folder.join(name);
    if !path.exists() {
        let guess = did_you_mean(&name.to_string_lossy(), SHIPPED_SKINS).map(str::to_owned);
        let guess = guess.or_else(|| similar_file(&path)).map(|guess| format!("; did you mean `{}`?", excerpt(&guess)));
        return Err(format!(
            "`{}` is neither a built-in skin ({}) nor the file {}{}",
            excerpt(&name.display().to_string()),
            SHIPPED_SKINS.join(", "),
            excerpt(&path.display().to_string()),
            guess.unwrap_or_default()
        ));
    }
    read_skin_allowing(&path, allowed).map_err(|error| error.to_string())
}

/// The files of a scenario's skins; names of built-in skins give files that do not exist.
pub(crate) fn paths_of(file: &ScenarioFile) -> Vec<PathBuf> {
    let scenario = &file.scenario;
    let others = scenario.distractor.iter().map(|other| &other.skin);
    let skins = [&scenario.actor.skin, &scenario.tracker_body.skin].into_iter().chain(others);
    skins.flatten().map(|name| file.folder.join(name)).collect()
}
