//! Recorded walks: their stances at several frame rates, and how their feet stand on the ground once planted.
//! `results/contact.md` has tables of these results.

use std::path::Path;

use skiagraph_core::body::shipped;
use skiagraph_core::contact::{ContactRule, GroundContacts};
use skiagraph_physics::{PlantingReport, plant_feet};
use skiagraph_truth::mocap::{ReadOptions, read};
use skiagraph_truth::retarget::{RetargetOptions, Retargeted, retarget};

const RATES: [f64; 3] = [120.0, 60.0, 30.0];

/// A whole clip at a frame rate on the actor, prepared as in a scenario: first resampled, then retargeted.
pub(crate) fn walk(folder: &Path, name: &str, frames_per_second: f64) -> Retargeted {
    let path = folder.join(format!("{name}.amc"));
    let clip = read(&path, &ReadOptions::default()).unwrap().without_inserted_rest_pose();
    let clip = clip.resampled(frames_per_second).unwrap();
    retarget(&clip, &shipped("actor").unwrap(), &RetargetOptions::default()).unwrap()
}

/// First and last times of the stances of a foot, seconds; `None` if the clip begins or ends there, because then they
/// are not the foot's.
type Stances = Vec<[Option<f64>; 2]>;

fn stances(walk: &Retargeted) -> [Stances; 2] {
    let motion = &walk.motion;
    let found = GroundContacts::from_motion(&walk.humanoid, motion, &ContactRule::default()).unwrap();
    let at = |frame: usize| {
        let is_inside = frame > 0 && frame + 1 < motion.poses.len();
        is_inside.then_some(frame as f64 / motion.frames_per_second)
    };
    found.feet.map(|foot| foot.stances().into_iter().map(|s| [at(s.start), at(s.end - 1)]).collect())
}

/// The greatest time between stances at two rates, frames at 30 Hz; `None` if there are none or their numbers differ.
fn time_between(of_fast: &[Stances; 2], of_slow: &[Stances; 2]) -> Option<f64> {
    let mut greatest = 0.0_f64;
    for (a, b) in of_fast.iter().zip(of_slow) {
        if a.is_empty() || a.len() != b.len() {
            return None;
        }
        let both = a.iter().flatten().zip(b.iter().flatten()).filter_map(|(a, b)| a.zip(*b));
        greatest = both.map(|(a, b)| 30.0 * (a - b).abs()).fold(greatest, f64::max);
    }
    Some(greatest)
}

/// The greatest time between the stances of a walk at any two rates, frames at 30 Hz; `None` if their numbers differ.
pub(crate) fn stances_apart(walk_at: impl Fn(f64) -> Retargeted) -> Option<f64> {
    let found = RATES.map(|fps| stances(&walk_at(fps)));
    let pairs = [(0, 1), (0, 2), (1, 2)].map(|(a, b)| time_between(&found[a], &found[b]));
    pairs.into_iter().try_fold(0.0, |greatest, time| Some(f64::max(greatest, time?)))
}

/// The limits that a planted walk exceeds; empty if it meets all.
fn shortcomings(name: &str, fps: f64, report: &PlantingReport) -> Vec<String> {
    let mut found = Vec::new();
    for after in [report.after, report.after_in_old_stances] {
        if !(after.skate_mm_per_s <= 20.0 && after.penetration_mm <= 2.0 && after.float_mm <= 10.0) {
            found.push(format!("{name} at {fps} Hz: {after}"));
        }
    }
    if report.moved_mm > 15.0 {
        found.push(format!("{name} at {fps} Hz: {report}"));
    }
    found
}

/// The limits that a clip of `folder` with planted feet exceeds; empty if it meets all.
pub(crate) fn planted(folder: &Path, name: &str, fps: f64) -> Vec<String> {
    let walk = walk(folder, name, fps);
    let report = plant_feet(&walk.humanoid, &walk.motion, &ContactRule::default()).unwrap().report;
    shortcomings(name, fps, &report)
}
