//! `truth/filming.json`: motion and timing of the true cameras, in sets with moving cameras or own exposure times.
//! `cameras.npz` is sampled from it; only this file defines the cameras between the samples.

use serde::{Deserialize, Serialize};

use super::manifest::MOST_FRAMES;
use crate::SetError;
use skiagraph_core::camera::{CameraKeyframe, CameraPath, CameraRig, CameraTiming, TimedRig};
use skiagraph_core::input::excerpt;

pub(crate) const PATH: &str = "truth/filming.json";
const SCHEMA: &str = "skiagraph.filming/1";
/// Greatest time, seconds, and coordinate, metres.
const FARTHEST: f64 = 1e6;

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FilmingFile {
    schema: String,
    /// Description of the interpolation between keyframes.
    between_keyframes: String,
    cameras: Vec<FilmingRecord>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FilmingRecord {
    name: String,
    /// Frames from one image to the next.
    every: usize,
    offset_s: f64,
    line_delay_s: f64,
    /// Empty for a static camera.
    keyframes: Vec<CameraKeyframe>,
}

const BETWEEN: &str = "piecewise cubic Hermite (Fritsch and Butland 1984, SciPy's PchipInterpolator) of position, look_at \
                       and roll; constant before the first and after the last";

pub(crate) fn to_json(filming: &TimedRig) -> Result<Vec<u8>, SetError> {
    let camera = |(index, name): (usize, &String)| {
        let CameraTiming { every, offset_s, line_delay_s } = *filming.timing(index);
        let keyframes = filming.path(index).map_or(&[][..], CameraPath::keyframes).to_vec();
        FilmingRecord { name: name.clone(), every, offset_s, line_delay_s, keyframes }
    };
    let names = filming.rig().cameras.iter().map(|camera| &camera.name);
    let cameras = names.enumerate().map(camera).collect();
    super::json::to_bytes(PATH, &FilmingFile { schema: SCHEMA.into(), between_keyframes: BETWEEN.into(), cameras })
}

/// Motion and timing of the cameras of `rig`, the true cameras.
pub(crate) fn from_json(bytes: &[u8], rig: &CameraRig) -> Result<TimedRig, SetError> {
    let file: FilmingFile = super::json::from_bytes(PATH, &[SCHEMA], bytes)?;
    let malformed = |detail: String| SetError::malformed(PATH, detail);
    if !file.cameras.iter().map(|camera| &camera.name).eq(rig.cameras.iter().map(|camera| &camera.name)) {
        return Err(malformed("expected the cameras of cameras.json in the same order".to_owned()));
    }
    let (mut paths, mut timings) = (Vec::new(), Vec::new());
    for FilmingRecord { name, every, offset_s, line_delay_s, keyframes } in file.cameras {
        let named = |what: &str| malformed(format!("camera {:?}: {what}", excerpt(&name)));
        let sound = (1..=MOST_FRAMES).contains(&every)
            && offset_s.abs() <= FARTHEST
            && (0.0..=FARTHEST).contains(&line_delay_s);
        if !sound {
            return Err(named(
                "expected `every` from 1 to 1000000, and finite `offset_s` and `line_delay_s` in seconds",
            ));
        }
        let far = |k: &CameraKeyframe| k.position.iter().chain(&k.look_at).any(|x| x.abs() > FARTHEST);
        if keyframes.iter().any(far) {
            return Err(named("expected keyframes in metres, within 1000000 m"));
        }
        let path = (!keyframes.is_empty()).then(|| CameraPath::new(&name, keyframes)).transpose();
        paths.push(path.map_err(|e| malformed(e.to_string()))?);
        timings.push(CameraTiming { every, offset_s, line_delay_s });
    }
    TimedRig::new(rig.clone(), paths, timings).map_err(|e| malformed(e.to_string()))
}
