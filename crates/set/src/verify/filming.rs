//! Compares `cameras.npz` with `truth/filming.json`: the cameras of every frame, with the errors for trackers, and
//! their exposure times.

use nalgebra::Isometry3;

use super::Fault;
use super::parts::ReadParts;
use crate::camera::{RigMoment, TimedRig};
use crate::input::excerpt;
use crate::{RigMoments, moments_file};

/// Tolerance of times, seconds.
const TOLERANCE_S: f64 = 1e-9;
/// Tolerance of camera poses, metres and radians.
const TOLERANCE_M: f64 = 1e-9;

/// Faults of the moving or timed cameras for trackers.
pub(super) fn faults(parts: &ReadParts) -> Vec<Fault> {
    let Some(moments) = &parts.moments else { return Vec::new() };
    let mut faults = unsteady_times(moments);
    // if the key cannot be read, the check of the start reports it
    if let (Ok(filming), Some(truth), (facts, Some(seed))) = (parts.filming(), &parts.truth, parts.observed()) {
        let given = RigMoments::for_tracker(&filming, truth, Some(&facts), seed);
        if let Some(expected) = given.map(|given| given.frames).filter(|frames| frames.len() == moments.frames.len()) {
            for camera in 0..filming.cameras() {
                faults.extend(wrong_times(&filming, moments, &expected, camera));
                faults.extend(wrong_delay(&filming, moments, camera));
                faults.extend(wrong_places(&filming, moments, &expected, camera));
            }
        }
    }
    faults.into_iter().map(|detail| Fault::new(moments_file::PATH, detail)).collect()
}

/// Times of a camera's images that do not increase.
fn unsteady_times(moments: &RigMoments) -> Vec<String> {
    let of_camera = |camera: usize| {
        let times = moments.frames.iter().enumerate().filter_map(|(f, m)| Some((f, m.exposed_s[camera]?)));
        let times: Vec<(usize, f64)> = times.collect();
        let pair = times.windows(2).find(|pair| pair[1].1 <= pair[0].1)?;
        let [(_, before), (frame, after)] = [pair[0], pair[1]];
        Some(format!(
            "time_s: the times of camera {camera} do not increase: {after} s in frame {frame}, after {before} s"
        ))
    };
    (0..moments.line_delay_s.len()).filter_map(of_camera).collect()
}

fn wrong_times(filming: &TimedRig, found: &RigMoments, expected: &[RigMoment], camera: usize) -> Option<String> {
    let differs =
        |(found, expected): &(&RigMoment, &RigMoment)| match (found.exposed_s[camera], expected.exposed_s[camera]) {
            (None, None) => false,
            (Some(found), Some(expected)) => (found - expected).abs() > TOLERANCE_S,
            _ => true,
        };
    let wrong: Vec<usize> = (0..expected.len()).filter(|f| differs(&(&found.frames[*f], &expected[*f]))).collect();
    let first = *wrong.first()?;
    let describe =
        |moment: &RigMoment| moment.exposed_s[camera].map_or("no image".to_owned(), |time| format!("{time} s"));
    let name = excerpt(&filming.rig().cameras[camera].name);
    Some(format!(
        "time_s: {} of {} times of camera {name:?} are not those of truth/filming.json, first in frame {first}: \
        {}, expected {}",
        wrong.len(),
        expected.len(),
        describe(&found.frames[first]),
        describe(&expected[first])
    ))
}

fn wrong_delay(filming: &TimedRig, found: &RigMoments, camera: usize) -> Option<String> {
    let (found, expected) = (found.line_delay_s[camera], filming.timing(camera).line_delay_s);
    let name = excerpt(&filming.rig().cameras[camera].name);
    (found != expected).then(|| format!("line_delay_s: camera {name:?} has {found}, truth/filming.json has {expected}"))
}

fn wrong_places(filming: &TimedRig, found: &RigMoments, expected: &[RigMoment], camera: usize) -> Option<String> {
    let place = |frame: usize| &found.frames[frame].camera_from_world[camera];
    let known = |frame: usize| &expected[frame].camera_from_world[camera];
    let wrong: Vec<usize> = (0..expected.len()).filter(|frame| !is_same(place(*frame), known(*frame))).collect();
    let first = *wrong.first()?;
    let frames = 0..expected.len();
    let all = |shift: i64| {
        frames.clone().all(|frame| {
            let other = usize::try_from(frame as i64 + shift).ok().filter(|other| *other < expected.len());
            other.is_none_or(|other| is_same(place(frame), known(other)))
        })
    };
    let inverted = || frames.clone().all(|frame| is_same(&place(frame).inverse(), known(frame)));
    let why = if all(-1) {
        "; each is that of the frame before"
    } else if all(1) {
        "; each is that of the frame after"
    } else if inverted() {
        "; they are world_from_camera"
    } else {
        ""
    };
    let off = (place(first).translation.vector - known(first).translation.vector).norm();
    let degrees = place(first).rotation.angle_to(&known(first).rotation).to_degrees();
    let name = excerpt(&filming.rig().cameras[camera].name);
    Some(format!(
        "camera_from_world: {} of {} poses of camera {name:?} are not those of truth/filming.json, first in frame {first}: \
        off by {off:.2e} m and {degrees:.2e} degrees{why}",
        wrong.len(),
        expected.len()
    ))
}

fn is_same(a: &Isometry3<f64>, b: &Isometry3<f64>) -> bool {
    let off = (a.translation.vector - b.translation.vector).amax().max(a.rotation.angle_to(&b.rotation) - 1e-7);
    off <= TOLERANCE_M
}
