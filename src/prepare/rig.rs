//! The cameras of a scenario: a ring or an arc, files of other tools and single cameras, without those that are left
//! out; how they move and when they take images.

use std::path::Path;

use nalgebra::Point3;

use crate::benchmark_set::RigMoments;
use crate::body::Motion;
use crate::camera::{
    Camera, CameraError, CameraFileFormat, CameraKeyframe, CameraPath, CameraRig, CameraTiming, DEFAULT_NEAR,
    RingParameters, TimedRig, read_cameras,
};
use crate::common::{ExperimentError, scenario_error};
use crate::input::{self, excerpt, limits};
use crate::scenario::{
    CameraFileSettings, CameraSettings, CameraTimingSettings, KeyframeSettings, RingSettings, ScenarioError,
    ScenarioFile, did_you_mean,
};

/// Default height that a ring of cameras looks at, metres: the pelvis of an adult.
const DEFAULT_LOOK_AT_HEIGHT: f64 = 0.95;

/// The cameras that see `motion`, how they move and when they take images.
pub(crate) fn rig(file: &ScenarioFile, motion: &Motion) -> Result<TimedRig, ExperimentError> {
    let settings = &file.scenario.rig;
    let in_rig = |key: &str, e: CameraError| scenario_error(file, key, e.to_string());
    let mut cameras = match &settings.ring {
        None => Vec::new(),
        Some(ring) => ring_of(ring, motion).map_err(|e| in_rig("rig.ring", e))?.cameras,
    };
    let mut add = |key: &str, camera: Camera| {
        if cameras.iter().any(|known| known.name == camera.name) {
            let message = format!("two cameras are named `{}`; camera names must be unique", excerpt(&camera.name));
            return Err(scenario_error(file, &format!("{key}.name"), message));
        }
        cameras.push(camera);
        Ok(cameras.len())
    };
    let mut count = settings.ring.as_ref().map_or(0, |ring| ring.count as usize);
    for (index, settings) in settings.file.iter().enumerate() {
        let key = format!("rig.file[{index}]");
        for camera in cameras_of_file(file, &key, settings)? {
            count = add(&key, camera)?;
        }
    }
    for (index, single) in settings.camera.iter().enumerate() {
        let key = format!("rig.camera[{index}]");
        let name = single.name.clone().unwrap_or_else(|| format!("cam{count:02}"));
        count = add(&key, single_camera(&name, single).map_err(|e| in_rig(&key, e))?)?;
    }
    leave_out(file, &mut cameras)?;
    let rig = CameraRig { cameras };
    rig.check_size().map_err(|e| in_rig("rig", e))?;
    timed(file, rig, motion)
}

/// Removes the cameras of `rig.leave_out`.
fn leave_out(file: &ScenarioFile, cameras: &mut Vec<Camera>) -> Result<(), ExperimentError> {
    for (index, name) in file.scenario.rig.leave_out.iter().enumerate() {
        let key = format!("rig.leave_out[{index}]");
        let Some(at) = cameras.iter().position(|camera| camera.name == *name) else {
            let names = || cameras.iter().map(|camera| camera.name.as_str());
            let guess =
                did_you_mean(name, names()).map(|guess| format!(" (did you mean `{guess}`?)")).unwrap_or_default();
            let left = names().collect::<Vec<_>>().join(", ");
            let message = format!("expected the name of a camera of the rig, {left}; found `{}`{guess}", excerpt(name));
            return Err(scenario_error(file, &key, message));
        };
        cameras.remove(at);
    }
    if cameras.is_empty() {
        let message = "expected at least one remaining camera, found none: leave fewer out".to_owned();
        return Err(scenario_error(file, "rig.leave_out", message));
    }
    Ok(())
}

/// The cameras of another tool's file.
fn cameras_of_file(
    file: &ScenarioFile,
    key: &str,
    settings: &CameraFileSettings,
) -> Result<Vec<Camera>, ExperimentError> {
    let path = file.path_of(&format!("{key}.path"), Path::new(&settings.path)).map_err(ScenarioError::from)?;
    let text = input::read_to_string(&path, limits::SETTINGS).map_err(|e| {
        scenario_error(file, &format!("{key}.path"), format!("{}: cannot be read: {e}", path.display()))
    })?;
    let mut options = settings.options();
    let format = settings.format().unwrap_or(CameraFileFormat::OpenCv);
    let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned());
    let mut cameras = read_cameras(&text, format, &options);
    // a single camera without a name gets the name of the file
    if options.name.is_none() && matches!(&cameras, Ok(found) if found.len() == 1 && found[0].name == "camera") {
        options.name = stem;
        cameras = read_cameras(&text, format, &options);
    }
    cameras.map_err(|e| scenario_error(file, key, format!("{}: {e}", path.display())))
}

fn ring_of(ring: &RingSettings, motion: &Motion) -> Result<CameraRig, CameraError> {
    let parameters = ring_parameters(ring, motion);
    match ring.arc_deg {
        Some(arc) => CameraRig::arc(&parameters, arc.to_radians()),
        None => CameraRig::ring(&parameters),
    }
}

fn ring_parameters(ring: &RingSettings, motion: &Motion) -> RingParameters {
    let middle = middle_of_path(motion);
    RingParameters {
        count: ring.count,
        radius: ring.radius_m,
        height: ring.height_m,
        look_at: ring.look_at_m.map_or(Point3::new(middle.x, middle.y, DEFAULT_LOOK_AT_HEIGHT), Point3::from),
        first_azimuth: ring.first_azimuth_deg.to_radians(),
        field_of_view: ring.field_of_view_deg.to_radians(),
        image_size: ring.size_px,
        near: DEFAULT_NEAR,
    }
}

fn single_camera(name: &str, c: &CameraSettings) -> Result<Camera, CameraError> {
    let [width, height] = c.size_px;
    Camera::from_opencv(name, c.matrix, c.rotation, c.translation_m, c.distortion, width, height)
}

/// The middle between the root's least and greatest coordinates.
fn middle_of_path(motion: &Motion) -> Point3<f64> {
    let places = || motion.poses.iter().map(|pose| Point3::from(pose.world_from_root.translation.vector));
    let first = places().next().unwrap_or(Point3::origin());
    let (low, high) = places().fold((first, first), |(low, high), p| (low.inf(&p), high.sup(&p)));
    nalgebra::center(&low, &high)
}

/// Adds to `rig` how its cameras move and when they take images of `motion`. Settings of cameras that are left out are
/// ignored.
fn timed(file: &ScenarioFile, rig: CameraRig, motion: &Motion) -> Result<TimedRig, ExperimentError> {
    let settings = &file.scenario.rig;
    let mut paths = vec![None; rig.cameras.len()];
    let mut timings = vec![CameraTiming::default(); rig.cameras.len()];
    let refused = |key: &str, e: CameraError| scenario_error(file, key, e.to_string());
    let is_there = |camera: &String| !settings.leave_out.contains(camera);
    for (index, entry) in settings.motion.iter().enumerate().filter(|(_, entry)| is_there(&entry.camera)) {
        let key = format!("rig.motion[{index}]");
        let camera = camera_named(file, &format!("{key}.camera"), &entry.camera, &rig)?;
        let keyframes = entry.keyframes.iter().map(keyframe).collect();
        let path = CameraPath::new(&entry.camera, keyframes);
        paths[camera] = Some(path.map_err(|e| refused(&format!("{key}.keyframes"), e))?);
    }
    for (index, entry) in settings.timing.iter().enumerate().filter(|(_, entry)| is_there(&entry.camera)) {
        let key = format!("rig.timing[{index}]");
        let camera = camera_named(file, &format!("{key}.camera"), &entry.camera, &rig)?;
        let CameraTimingSettings { offset_ms, line_delay_us, .. } = *entry;
        let every = entry.every(file.scenario.motion.frames_per_second).ok_or_else(|| {
            let message = "expected the scenario's rate divided by a whole number".to_owned();
            scenario_error(file, &format!("{key}.frames_per_second"), message)
        })?;
        timings[camera] = CameraTiming { every, offset_s: 1e-3 * offset_ms, line_delay_s: 1e-6 * line_delay_us };
    }
    let rig = TimedRig::new(rig, paths, timings).map_err(|e| refused("rig.motion", e))?;
    let checked = rig.check(motion.poses.len(), motion.frames_per_second);
    checked.map_err(|e| refused("rig.motion", e))?;
    Ok(rig)
}

/// Notes about how the cameras move and take images.
pub(crate) fn rig_notes(moments: &RigMoments, rig: &CameraRig, frames_per_second: f64) -> Vec<String> {
    let cameras = rig.cameras.iter().enumerate();
    let words = cameras.filter_map(|(index, camera)| Some((camera, moments.describe(index, frames_per_second)?)));
    words.map(|(camera, words)| format!("camera `{}`: {words}", camera.name)).collect()
}

fn keyframe(settings: &KeyframeSettings) -> CameraKeyframe {
    let KeyframeSettings { time_s, position_m, look_at_m, roll_deg } = *settings;
    CameraKeyframe { time_s, position: position_m, look_at: look_at_m, roll: roll_deg.to_radians() }
}

/// The index of the camera with this name.
fn camera_named(file: &ScenarioFile, key: &str, name: &str, rig: &CameraRig) -> Result<usize, ExperimentError> {
    rig.cameras.iter().position(|camera| camera.name == name).ok_or_else(|| {
        let names = || rig.cameras.iter().map(|camera| camera.name.as_str());
        let guess = did_you_mean(name, names()).map(|guess| format!(" (did you mean `{guess}`?)")).unwrap_or_default();
        let known = names().collect::<Vec<_>>().join(", ");
        let message = format!("expected the name of a camera of the rig, {known}; found `{}`{guess}", excerpt(name));
        scenario_error(file, key, message)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prepare::PreparedScene;

    fn names(overrides: &[&str]) -> Result<Vec<String>, String> {
        let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
        let file = ScenarioFile::built_in(&overrides).map_err(|e| e.to_string())?;
        let scene = PreparedScene::new(&file, None).map_err(|e| e.to_string())?;
        Ok(scene.rig.rig().cameras.iter().map(|camera| camera.name.clone()).collect())
    }

    #[test]
    fn cameras_that_are_left_out_are_missing_and_the_others_keep_their_names() {
        let short = "motion.loop_to_s=0.1";
        assert_eq!(names(&[short, "rig.leave_out=[\"cam01\"]"]).unwrap(), ["cam00", "cam02", "cam03"]);
        let error = names(&[short, "rig.leave_out=[\"cam1\"]"]).unwrap_err();
        assert!(error.contains("rig.leave_out[0]") && error.contains("did you mean `cam01`?"), "{error}");
        let error = names(&[short, "rig.ring.count=1", "rig.leave_out=[\"cam00\"]"]).unwrap_err();
        assert!(error.contains("leave fewer out"), "{error}");
    }
}
