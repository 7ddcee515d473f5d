//! Cameras in the TOML of anipose, Pose2Sim and Caliscope: a table a camera with `matrix`, `distortions`, `rotation`
//! (axis times angle, or a matrix) and `translation`. Caliscope has them below `[cameras]`, the others at the root.

use std::collections::BTreeMap;

use serde::Deserialize;
use serde_json::Value;
use toml::Spanned;

use super::storage::{Names, Storage};
use super::{PlainCamera, pixels};
use crate::input::{excerpt, unquoted};

const NAMES: Names<'_> = Names {
    matrix: &["matrix"],
    lens: &["distortions"],
    rotation: &["rotation"],
    translation: &["translation"],
    size: [&[], &[]],
};

type Tables = BTreeMap<String, Spanned<Value>>;

#[derive(Deserialize)]
struct Caliscope {
    cameras: Tables,
}

pub(super) fn read(text: &str) -> Result<Vec<PlainCamera>, String> {
    let text = text.trim_start_matches('\u{feff}');
    let tables = match toml::from_str(text) {
        Ok(Caliscope { cameras }) => cameras,
        Err(_) => toml::from_str::<Tables>(text).map_err(|e| format!("not TOML: {}", unquoted(e.message())))?,
    };
    // anipose is calibrated in the unit of its board's squares, which are not a metre wide
    let square = tables.get("metadata").and_then(|table| table.get_ref().get("charuco_square_size")?.as_f64());
    let metres_per_unit = if square.is_some_and(|square| square >= 1.0) { 0.001 } else { 1.0 };
    let mut tables: Vec<(String, Spanned<Value>)> = tables.into_iter().collect();
    tables.sort_by_key(|(_, table)| table.span().start);
    let mut cameras = Vec::new();
    for (key, table) in tables {
        let start = table.span().start;
        let Value::Object(keys) = table.into_inner() else { continue };
        let storage = Storage(keys);
        // Caliscope before version 0.7 also has a table for every pair of cameras
        let is_camera = [NAMES.matrix, NAMES.lens, NAMES.rotation].iter().any(|keys| storage.entry(keys).is_some())
            && !key.starts_with("stereo_");
        let is = |key: &str| storage.entry(&[key]).and_then(Value::as_bool) == Some(true);
        if is_camera && !is("ignore") {
            let camera = if is("fisheye") { Err(super::other_lens("fisheye = true")) } else { camera(&key, &storage) };
            let of = |error: String| {
                let line = 1 + text.get(..start).map_or(0, |before| before.matches('\n').count());
                let name = excerpt(&key);
                format!("line {line}: camera {name:?}: {error}; ignore = true in its table leaves the camera out")
            };
            cameras.push(PlainCamera { metres_per_unit, ..camera.map_err(of)? });
        }
    }
    Ok(cameras)
}

fn camera(key: &str, storage: &Storage) -> Result<PlainCamera, String> {
    // Caliscope numbers its cameras: `port` before its version 0.7
    let names = [("name", ""), ("cam_id", "cam_"), ("port", "port_")];
    let name = names.iter().find_map(|(key, start)| match storage.entry(&[key])? {
        Value::String(name) => Some(name.clone()),
        number => Some(format!("{start}{number}")),
    });
    let size = storage.numbers(&["size"])?.map(pixels).transpose()?;
    Ok(PlainCamera { name: name.or(Some(key.to_owned())), size, ..storage.camera(NAMES, 1.0)? })
}
