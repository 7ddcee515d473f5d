//! `[actor] skin` and `[tracker_body] skin`: the surface of a robot.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::clip_file::buffers_of;
use super::robots::{RobotChoice, robot};
use crate::common::ExperimentError;
use crate::scenario::{KeyError, RecordedBody, Scenario, SolidsSource, did_you_mean, similar_file};
use skiagraph_core::body::{Blending, Humanoid, SHIPPED_SKINS, Skin, SkinMesh, read_skin, shipped_skin};
use skiagraph_core::input::excerpt;
use skiagraph_truth::retarget::with_skin;
use std::sync::Arc;

pub(crate) struct WornSkin<'a> {
    pub(crate) name: Option<&'a String>,
    pub(crate) joint_map: &'a BTreeMap<String, String>,
    pub(crate) blending: Blending,
}

/// `robot` with its skin, if one is given, and the notes about the skin, which are also the body's last notes. `table`
/// is `actor`, `tracker_body` or a distractor's.
pub(crate) fn attach_skin(
    folder: &Path,
    table: &str,
    robot: Humanoid,
    WornSkin { name, joint_map, blending }: WornSkin<'_>,
) -> Result<(Humanoid, Vec<String>), KeyError> {
    let Some(name) = name else {
        if joint_map.is_empty() {
            return Ok((robot, Vec::new()));
        }
        let detail = "names joints of a skin's file (.glb, .gltf, .vrm), and there is no `skin`";
        return Err(KeyError::new("joint_map", detail.to_owned()).within(table));
    };
    let unusable = |error: String| KeyError::new("skin", error).within(table);
    let mesh = skin_named(folder, Path::new(name), joint_map).map_err(unusable)?;
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

/// The body that trackers of a recording are given, before it is scaled.
pub(crate) fn recorded_body(worn: &RecordedBody, folder: &Path) -> Result<Humanoid, ExperimentError> {
    let choice = RobotChoice {
        table: "tracker_body",
        robot: &worn.robot,
        solids: SolidsSource::default(),
        has_skin: worn.skin.is_some(),
    };
    let joint_map = BTreeMap::new();
    let skin = WornSkin { name: worn.skin.as_ref(), joint_map: &joint_map, blending: Blending::Linear };
    Ok(attach_skin(folder, "tracker_body", robot(folder, &choice)?, skin)?.0)
}

/// A built-in skin, or one from a file relative to `folder`; otherwise the reason.
fn skin_named(folder: &Path, name: &Path, joint_map: &BTreeMap<String, String>) -> Result<SkinMesh, String> {
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
    read_skin(&path, joint_map).map_err(|error| error.to_string())
}

/// The files of a scenario's skins; names of built-in skins give files that do not exist.
pub(crate) fn paths_of(scenario: &Scenario, folder: &Path) -> Vec<PathBuf> {
    let others = scenario.distractor.iter().map(|other| &other.skin);
    let skins = [&scenario.actor.skin, &scenario.tracker_body.skin].into_iter().chain(others);
    let skins: Vec<PathBuf> = skins.flatten().map(|name| folder.join(name)).collect();
    let buffers = skins.iter().flat_map(|path| buffers_of(path));
    skins.iter().cloned().chain(buffers).collect()
}
