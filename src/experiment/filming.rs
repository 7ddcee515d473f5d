//! How a scenario's cameras move and when they take their images.

use super::ExperimentError;
use super::error::scenario_error;
use crate::benchmark_set::RigMoments;
use crate::body::Motion;
use crate::camera::{CameraError, CameraKeyframe, CameraPath, CameraRig, CameraTiming, RigMoment, TimedRig};
use crate::input::excerpt;
use crate::observation::{Corruption, tracker_rig};
use crate::rng::KeyedSeed;
use crate::scenario::{CameraTimingSettings, KeyframeSettings, ScenarioFile, did_you_mean};
use crate::scene::GroundTruth;

/// How the cameras of `rig` film `motion`. What is said of cameras that are left out is passed over.
pub(super) fn filming(file: &ScenarioFile, rig: CameraRig, motion: &Motion) -> Result<TimedRig, ExperimentError> {
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
    let filming = TimedRig::new(rig, paths, timings).map_err(|e| refused("rig.motion", e))?;
    let on_its_way = filming.check(motion.poses.len(), motion.frames_per_second);
    on_its_way.map_err(|e| refused("rig.motion", e))?;
    Ok(filming)
}

/// What a tracker is told of the cameras in every frame, with the errors that it is told; nothing of cameras that stand
/// still.
pub(super) fn moments(
    truth: &GroundTruth,
    filming: &TimedRig,
    corruption: &Corruption,
    seed: KeyedSeed,
) -> Option<RigMoments> {
    if filming.is_still() {
        return None;
    }
    let line_delay_s = (0..filming.cameras()).map(|camera| filming.timing(camera).line_delay_s).collect();
    let frames = truth.frames.iter().enumerate();
    let moments = frames.filter_map(|(frame, known)| filming.moment(frame, known.time_s));
    if !corruption.changes_cameras() {
        return Some(RigMoments { frames: moments.collect(), line_delay_s });
    }
    let told = |moment: RigMoment| {
        let told = tracker_rig(&filming.rig().at(&moment), corruption, seed);
        RigMoment { camera_from_world: told.cameras.iter().map(|camera| camera.camera_from_world).collect(), ..moment }
    };
    Some(RigMoments { frames: moments.map(told).collect(), line_delay_s })
}

/// How the cameras film, for users.
pub(super) fn notes(moments: &RigMoments, rig: &CameraRig, frames_per_second: f64) -> Vec<String> {
    let cameras = rig.cameras.iter().enumerate();
    let words = cameras.filter_map(|(index, camera)| Some((camera, moments.in_words(index, frames_per_second)?)));
    words.map(|(camera, words)| format!("camera `{}`: {words}", camera.name)).collect()
}

fn keyframe(settings: &KeyframeSettings) -> CameraKeyframe {
    let KeyframeSettings { time_s, position_m, look_at_m, roll_deg } = *settings;
    CameraKeyframe { time_s, position: position_m.into(), look_at: look_at_m.into(), roll: roll_deg.to_radians() }
}

/// The number of the camera of a name.
fn camera_named(file: &ScenarioFile, key: &str, name: &str, rig: &CameraRig) -> Result<usize, ExperimentError> {
    rig.cameras.iter().position(|camera| camera.name == name).ok_or_else(|| {
        let names = || rig.cameras.iter().map(|camera| camera.name.as_str());
        let guess = did_you_mean(name, names()).map(|guess| format!(" (did you mean `{guess}`?)")).unwrap_or_default();
        let known = names().collect::<Vec<_>>().join(", ");
        let message = format!("expected the name of a camera of the rig, {known}; found `{}`{guess}", excerpt(name));
        scenario_error(file, key, message)
    })
}
