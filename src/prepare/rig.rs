//! The cameras of a scenario: a ring or an arc, files of other tools and single cameras, without those that are left
//! out; how they move and when they take images.

use std::path::Path;

use nalgebra::Point3;

use super::camera_files::cameras_of;
use crate::scenario::{
    CameraSettings, CameraTimingSettings, KeyError, KeyframeSettings, RigSettings, RingSettings, did_you_mean,
};
use skiagraph_core::body::Motion;
use skiagraph_core::camera::{
    Camera, CameraError, CameraFile, CameraKeyframe, CameraPath, CameraRig, CameraTiming, DEFAULT_NEAR, RingParameters,
    TimedRig,
};
use skiagraph_core::input::excerpt;
use skiagraph_set::RigMoments;

/// Default height that a ring of cameras looks at, metres: the pelvis of an adult.
const DEFAULT_LOOK_AT_HEIGHT: f64 = 0.95;

/// The cameras that see `motion`, how they move and when they take images. Files are relative to `folder`.
pub(crate) fn rig(settings: &RigSettings, folder: &Path, motion: &Motion) -> Result<TimedRig, KeyError> {
    let mut cameras = match &settings.ring {
        None => Vec::new(),
        Some(ring) => ring_of(ring, motion).map_err(refused("rig.ring"))?.cameras,
    };
    add_files(&mut cameras, &settings.file, folder)?;
    for (index, single) in settings.camera.iter().enumerate() {
        let key = format!("rig.camera[{index}]");
        let name = single.name.clone().unwrap_or_else(|| format!("cam{:02}", cameras.len()));
        add(&mut cameras, single_camera(&name, single).map_err(refused(&key))?, &key)?;
    }
    leave_out(&settings.leave_out, &mut cameras)?;
    let rig = CameraRig { cameras };
    rig.check_size().map_err(refused("rig"))?;
    timed(settings, rig, motion)
}

fn refused(key: &str) -> impl Fn(CameraError) -> KeyError + '_ {
    move |error| KeyError::new(key, error.to_string())
}

/// The cameras of the files of a recording, without those of `rig.leave_out`.
pub(crate) fn cameras_of_recording(
    files: &[CameraFile],
    left_out: &[String],
    folder: &Path,
) -> Result<CameraRig, KeyError> {
    let mut cameras = Vec::new();
    add_files(&mut cameras, files, folder)?;
    leave_out(left_out, &mut cameras)?;
    let rig = CameraRig { cameras };
    rig.check_size().map_err(refused("rig"))?;
    Ok(rig)
}

fn add_files(cameras: &mut Vec<Camera>, files: &[CameraFile], folder: &Path) -> Result<(), KeyError> {
    for (index, file) in files.iter().enumerate() {
        for camera in cameras_of(file, folder, index)? {
            add(cameras, camera, &format!("rig.file[{index}]"))?;
        }
    }
    Ok(())
}

/// Adds a camera of the table `key`, if its name is new.
fn add(cameras: &mut Vec<Camera>, camera: Camera, key: &str) -> Result<(), KeyError> {
    if cameras.iter().any(|known| known.name == camera.name) {
        let message = format!(
            "two cameras are named `{}`; camera names must be unique, and a [[rig.camera]] without a name has that of \
             its place in the rig: give it another",
            excerpt(&camera.name)
        );
        return Err(KeyError::new("name", message).within(key));
    }
    cameras.push(camera);
    Ok(())
}

fn leave_out(names: &[String], cameras: &mut Vec<Camera>) -> Result<(), KeyError> {
    for (index, name) in names.iter().enumerate() {
        let at = camera_named(&format!("rig.leave_out[{index}]"), name, cameras)?;
        cameras.remove(at);
    }
    if cameras.is_empty() {
        let message = "expected at least one remaining camera, found none: leave fewer out";
        return Err(KeyError::new("rig.leave_out", message));
    }
    Ok(())
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
pub(crate) fn middle_of_path(motion: &Motion) -> Point3<f64> {
    let places = || motion.poses.iter().map(|pose| Point3::from(pose.world_from_root.translation.vector));
    let first = places().next().unwrap_or(Point3::origin());
    let (low, high) = places().fold((first, first), |(low, high), p| (low.inf(&p), high.sup(&p)));
    nalgebra::center(&low, &high)
}

/// Adds to `rig` how its cameras move and when they take images of `motion`. Settings of cameras that are left out are
/// ignored.
fn timed(settings: &RigSettings, rig: CameraRig, motion: &Motion) -> Result<TimedRig, KeyError> {
    let mut paths = vec![None; rig.cameras.len()];
    let mut timings = vec![CameraTiming::default(); rig.cameras.len()];
    let is_there = |camera: &String| !settings.leave_out.contains(camera);
    for (index, entry) in settings.motion.iter().enumerate().filter(|(_, entry)| is_there(&entry.camera)) {
        let key = format!("rig.motion[{index}]");
        let camera = camera_named(&format!("{key}.camera"), &entry.camera, &rig.cameras)?;
        let keyframes = entry.keyframes.iter().map(keyframe).collect();
        let path = CameraPath::new(&entry.camera, keyframes);
        paths[camera] = Some(path.map_err(refused(&format!("{key}.keyframes")))?);
    }
    for (index, entry) in settings.timing.iter().enumerate().filter(|(_, entry)| is_there(&entry.camera)) {
        let key = format!("rig.timing[{index}]");
        let camera = camera_named(&format!("{key}.camera"), &entry.camera, &rig.cameras)?;
        let CameraTimingSettings { offset_ms, line_delay_us, .. } = *entry;
        let every = entry.every(motion.frames_per_second).ok_or_else(|| {
            let message = "expected the scenario's rate divided by a whole number";
            KeyError::new("frames_per_second", message).within(&key)
        })?;
        timings[camera] = CameraTiming { every, offset_s: 1e-3 * offset_ms, line_delay_s: 1e-6 * line_delay_us };
    }
    let rig = TimedRig::new(rig, paths, timings).map_err(refused("rig.motion"))?;
    let checked = rig.check(motion.poses.len(), motion.frames_per_second);
    checked.map_err(refused("rig.motion"))?;
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

pub(crate) fn camera_named(key: &str, name: &str, cameras: &[Camera]) -> Result<usize, KeyError> {
    cameras.iter().position(|camera| camera.name == name).ok_or_else(|| {
        let names: Vec<&str> = cameras.iter().map(|camera| camera.name.as_str()).collect();
        let guess = did_you_mean(name, names.iter().copied()).map(|guess| format!(" (did you mean `{guess}`?)"));
        let (known, guess) = (names.join(", "), guess.unwrap_or_default());
        let message = format!("expected the name of a camera of the rig, {known}; found `{}`{guess}", excerpt(name));
        KeyError::new(key, message)
    })
}

#[cfg(test)]
mod tests {
    use crate::prepare::PreparedScene;
    use crate::scenario::ScenarioFile;

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
