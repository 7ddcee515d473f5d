//! Human3.6M's cameras as JSON, in its two public forms: `intrinsics` by camera and `extrinsics` by subject and camera
//! (`calibration_matrix`, `distortion`, `R`, `t`), or a file a subject with `R`, `t`, `f`, `c` by camera. Millimetres.

use serde_json::{Map, Value};

use super::storage::{Names, Storage};
use super::{CameraFile, PlainCamera};
use crate::input::{excerpt, unquoted};

const NAMES: Names<'_> = Names {
    matrix: &["calibration_matrix"],
    lens: &["distortion"],
    rotation: &["R"],
    translation: &["t", "T"],
    size: [&[], &[]],
};

pub(super) fn read(text: &str, options: &CameraFile) -> Result<Vec<PlainCamera>, String> {
    let whole: Map<String, Value> = serde_json::from_str(text).map_err(|e| format!("not JSON: {}", unquoted(e)))?;
    let of = |key: &str| whole.get(key).and_then(Value::as_object);
    let poses = match of("extrinsics") {
        None => &whole,
        Some(extrinsics) if extrinsics.values().all(has_rotation) => extrinsics,
        Some(extrinsics) => of_subject(extrinsics, options)?,
    };
    if !poses.values().all(has_rotation) {
        return Err("expected intrinsics and extrinsics, or R, t, f and c, of every camera".to_owned());
    }
    let mut cameras = Vec::new();
    for (name, pose) in poses {
        let keys = [of("intrinsics").and_then(|all| all.get(name)), Some(pose)];
        let keys = keys.into_iter().flatten().filter_map(Value::as_object).flatten();
        let mut storage = Storage(keys.map(|(key, value)| (key.clone(), value.clone())).collect());
        let camera = (|| {
            if let (Some([fx, fy]), Some([cx, cy])) = (storage.numbers(&["f"])?, storage.numbers(&["c"])?) {
                let k = vec![fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0];
                storage.0.insert(NAMES.matrix[0].to_owned(), k.into());
            }
            storage.camera(NAMES, 0.001)
        })();
        let camera = camera.map_err(|e: String| format!("camera {:?}: {e}", excerpt(name)))?;
        cameras.push(PlainCamera { name: Some(name.to_owned()), ..camera });
    }
    Ok(cameras)
}

fn has_rotation(camera: &Value) -> bool {
    camera.get("R").is_some()
}

/// The poses of the chosen subject.
fn of_subject<'a>(extrinsics: &'a Map<String, Value>, options: &CameraFile) -> Result<&'a Map<String, Value>, String> {
    let subjects = excerpt(&extrinsics.keys().map(String::as_str).collect::<Vec<_>>().join(", "));
    let chosen = match (&options.subject, extrinsics.len()) {
        (Some(subject), _) => extrinsics.get(subject),
        (None, 1) => extrinsics.values().next(),
        (None, _) => {
            return Err(format!("the file has poses of several subjects; select one by `subject`: {subjects}"));
        }
    };
    chosen.and_then(Value::as_object).ok_or_else(|| format!("subject: expected one of {subjects}"))
}
