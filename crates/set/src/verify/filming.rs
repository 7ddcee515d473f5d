//! `cameras.npz` against `truth/filming.json`: where the cameras are in every frame, with the errors that trackers are
//! told, and when they took their images.

use nalgebra::Isometry3;

use super::Fault;
use super::parts::ReadParts;
use crate::camera::{RigMoment, TimedRig};
use crate::input::excerpt;
use crate::{RigMoments, moments_file};

/// How far a time may be off, seconds.
const TOLERANCE_S: f64 = 1e-9;
/// How far a camera may be off, metres and radians.
const TOLERANCE_M: f64 = 1e-9;

/// What is wrong with what a tracker is told of cameras that film.
pub(super) fn faults(parts: &ReadParts) -> Vec<Fault> {
    let Some(moments) = &parts.moments else { return Vec::new() };
    let mut faults = unsteady_times(moments);
    // where the key cannot be read, the check of the start says so
    if let (Ok(filming), Some(truth), (facts, Some(seed))) = (parts.filming(), &parts.truth, parts.observed()) {
        let told = RigMoments::told(&filming, truth, Some(&facts), seed);
        if let Some(expected) = told.map(|told| told.frames).filter(|told| told.len() == moments.frames.len()) {
            for camera in 0..filming.cameras() {
                faults.extend(wrong_times(&filming, moments, &expected, camera));
                faults.extend(wrong_delay(&filming, moments, camera));
                faults.extend(wrong_places(&filming, moments, &expected, camera));
            }
        }
    }
    faults.into_iter().map(|detail| Fault::new(moments_file::PATH, detail)).collect()
}

/// Times of a camera's images that do not rise.
fn unsteady_times(moments: &RigMoments) -> Vec<String> {
    let of_camera = |camera: usize| {
        let times = moments.frames.iter().enumerate().filter_map(|(f, m)| Some((f, m.exposed_s[camera]?)));
        let times: Vec<(usize, f64)> = times.collect();
        let pair = times.windows(2).find(|pair| pair[1].1 <= pair[0].1)?;
        let [(_, before), (frame, after)] = [pair[0], pair[1]];
        Some(format!("time_s: the times of camera {camera} do not rise: {after} s in frame {frame}, after {before} s"))
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
    let words = |moment: &RigMoment| moment.exposed_s[camera].map_or("no image".to_owned(), |time| format!("{time} s"));
    let name = excerpt(&filming.rig().cameras[camera].name);
    Some(format!(
        "time_s: {} of {} times of camera {name:?} are not those of truth/filming.json, first in frame {first}: it says \
        {}, expected {}",
        wrong.len(),
        expected.len(),
        words(&found.frames[first]),
        words(&expected[first])
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
        "camera_from_world: {} of {} places of camera {name:?} are not those of truth/filming.json, first in frame {first}: \
        off by {off:.2e} m and {degrees:.2e} degrees{why}",
        wrong.len(),
        expected.len()
    ))
}

fn is_same(a: &Isometry3<f64>, b: &Isometry3<f64>) -> bool {
    let off = (a.translation.vector - b.translation.vector).amax().max(a.rotation.angle_to(&b.rotation) - 1e-7);
    off <= TOLERANCE_M
}
