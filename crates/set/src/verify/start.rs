//! Checks the start for trackers: start pose and cameras, which are the true ones with the errors stated in `set.toml`,
//! the body, and the spread of changes from frame to frame.

use super::arrays::wrong_names;
use super::parts::ReadParts;
use super::{CheckOutcome, Fault, tracker_body};
use crate::body::{Motion, Pose};
use crate::camera::{Camera, CameraRig};
use crate::files::SetFiles;
use crate::npz::Npz;
use crate::observing::{Corruption, tracker_rig, tracker_start};
use crate::rng::KeyedSeed;
use crate::start_file::{self, Start};
use crate::{KEY_FILE, StepSpread, Training, cameras_file, spread_file, truth_file};

/// Tolerance of the start pose, metres and radians.
const TOLERANCE: f64 = 1e-9;

/// Tolerance of pinhole parameters, pixels: `cameras.json` has another pixel origin, so they are rounded.
const TOLERANCE_PX: f64 = 1e-6;

/// Relative tolerance of a root mean square.
const TOLERANCE_OF_SPREAD: f64 = 1e-6;

/// Greatest factor between the spread of another robot's motion and that of the motion nearest to the truth. The former
/// was retargeted from the recording, which sets do not contain.
const OTHER_ROBOTS_FACTOR: f64 = 1.25;

/// Root mean squares below this are not used for the factor, metres and radians.
const LEAST_SPREAD: f64 = 1e-4;

pub(super) fn check(files: &SetFiles, parts: &ReadParts) -> CheckOutcome {
    let start = parts.start.as_ref().ok_or("not checked: start/ cannot be read")?;
    let (facts, seed) = parts.observed();
    let seed = seed.ok_or_else(|| format!("not checked: {KEY_FILE} cannot be read"))?;
    let mut faults = Vec::new();
    faults.extend(start_fault(parts, start, &facts.corruption, seed));
    faults.extend(camera_faults(parts, &facts.corruption, seed));
    faults.extend(tracker_body::fault(parts, start));
    let training = match &start.training {
        Training::Motions(_) => "training motions".to_owned(),
        Training::Spread(spread) => {
            faults.extend(spread_faults(files, parts, start, spread));
            "a spread of changes".to_owned()
        }
    };
    let errors = if facts.corruption.is_none() {
        String::new()
    } else {
        format!(" with the errors of {}", facts.corruption.describe())
    };
    let pose = match first_pose(parts) {
        Some(_) => "the start pose",
        None => "no start pose (the set does not have the pose of the tracker's body in frame 0)",
    };
    Ok((format!("{pose} and the cameras{errors}, the body, {training}"), faults))
}

/// The pose of the tracker's body in frame 0, if the set has it.
fn first_pose(parts: &ReadParts) -> Option<&Pose> {
    let own = parts.facts.as_ref().filter(|facts| facts.matched).and(parts.truth.as_ref());
    let refitted = parts.refitted.as_ref().and_then(|motion| motion.poses.first());
    refitted.or_else(|| own.and_then(|truth| truth.frames.first()).map(|frame| &frame.pose))
}

fn start_fault(parts: &ReadParts, start: &Start, corruption: &Corruption, seed: KeyedSeed) -> Option<Fault> {
    let first = first_pose(parts).filter(|pose| pose.joint_angles.len() == start.pose.joint_angles.len())?;
    let expected = tracker_start(&start.body, first, corruption, seed);
    let detail = pose_difference(&start.pose, &expected, start, TOLERANCE)?;
    let errors = if corruption.is_none() { "" } else { ", with the errors stated in set.toml" };
    Some(Fault::new(
        start_file::PATH,
        format!("{detail} from the pose of the tracker's body in frame 0 (refitted_root, refitted_angles){errors}"),
    ))
}

/// Describes the greatest difference of two poses of the tracker's body beyond a tolerance (metres, radians).
pub(super) fn pose_difference(found: &Pose, expected: &Pose, start: &Start, tolerance: f64) -> Option<String> {
    let (a, b) = (&found.world_from_root, &expected.world_from_root);
    let (place, turn) = ((a.translation.vector - b.translation.vector).norm(), a.rotation.angle_to(&b.rotation));
    // an angle between rotations is accurate only to the square root of the rounding error
    if place > tolerance || turn > tolerance.max(1e-7) || !(place + turn).is_finite() {
        return Some(format!("root is {:.2} mm and {:.4} degrees off", 1e3 * place, turn.to_degrees()));
    }
    let angles = found.joint_angles.iter().zip(&expected.joint_angles).map(|(a, b)| (a - b).abs()).enumerate();
    let (index, off) = angles.max_by(|a, b| a.1.total_cmp(&b.1))?;
    let name = &start.body.degrees_of_freedom.get(index)?.name;
    (off > tolerance || off.is_nan()).then(|| format!("angle {name} is {:.4} degrees off", off.to_degrees()))
}

/// Compares `cameras.json` with the true cameras and the errors for trackers.
fn camera_faults(parts: &ReadParts, corruption: &Corruption, seed: KeyedSeed) -> Vec<Fault> {
    let Some(given) = &parts.rig else { return Vec::new() };
    let fault = |detail: String| Fault::new(cameras_file::PATH, detail);
    let Some(true_rig) = &parts.true_rig else {
        let detail = "according to set.toml trackers are given other cameras, but truth/cameras.json is missing";
        return corruption.changes_cameras().then(|| fault(detail.to_owned())).into_iter().collect();
    };
    let expected: CameraRig = tracker_rig(true_rig, corruption, seed);
    let pairs = given.cameras.iter().zip(&expected.cameras);
    pairs.filter_map(|(given, expected)| camera_difference(given, expected)).map(fault).collect()
}

fn camera_difference(given: &Camera, expected: &Camera) -> Option<String> {
    let (a, b) = (&given.pinhole, &expected.pinhole);
    let off = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let (focal, centre) = (off(&a.focal, &b.focal), off(&a.principal_point, &b.principal_point));
    let lens = off(&given.distortion.coefficients(), &expected.distortion.coefficients());
    let (p, q) = (&given.camera_from_world, &expected.camera_from_world);
    let (place, turn) = ((p.translation.vector - q.translation.vector).norm(), p.rotation.angle_to(&q.rotation));
    let differs = focal > TOLERANCE_PX || centre > TOLERANCE_PX || lens > TOLERANCE || place > TOLERANCE || turn > 1e-7;
    differs.then(|| {
        format!(
            "camera {:?} is not that of truth/cameras.json with the errors stated in set.toml: {:.2e} m, {:.2e} \
             degrees, focal lengths {focal:.2e} px, principal point {centre:.2e} px, distortion {lens:.2e} off",
            given.name,
            place,
            turn.to_degrees()
        )
    })
}

fn spread_faults(files: &SetFiles, parts: &ReadParts, start: &Start, spread: &StepSpread) -> Vec<Fault> {
    let path = spread_file::PATH;
    let found = files.read(path).ok().and_then(|bytes| Npz::from_bytes(path, &bytes).ok());
    let expected = spread.to_npz(&start.body).ok().and_then(|bytes| Npz::from_bytes(path, &bytes).ok());
    let names = found.zip(expected).into_iter().flat_map(|(found, expected)| wrong_names(&found, &expected));
    let numbers = spread_fault(parts, start, spread);
    names.chain(numbers).map(|detail| Fault::new(path, detail)).collect()
}

fn spread_fault(parts: &ReadParts, start: &Start, spread: &StepSpread) -> Option<String> {
    let (facts, truth) = (parts.facts.as_ref()?, parts.truth.as_ref()?);
    let all = |spread: &StepSpread| [&spread.change[..], &spread.change_of_change].concat();
    let found = all(spread);
    // a set made without a recording need not have a spread
    if facts.retargeting.is_none() && found.iter().all(|value| *value == 0.0) {
        return None;
    }
    let of = |motion: &Motion| StepSpread::of_motion(&start.body, motion).ok().map(|spread| all(&spread));
    let fits = |poses: &Motion| poses.poses.iter().all(|pose| pose.joint_angles.len() == start.pose.joint_angles.len());
    let own = Some(truth.motion()).filter(fits).and_then(|motion| of(&motion));
    let is_near =
        |expected: &Vec<f64>| found.iter().zip(expected).all(|(a, b)| (a - b).abs() <= TOLERANCE_OF_SPREAD * b + 1e-12);
    if own.as_ref().is_some_and(is_near) {
        return None;
    }
    if facts.is_of_one_robot() {
        let ratio = own.as_ref().and_then(|own| median_ratio(&found, own));
        let by = ratio.map(|ratio| format!("; the median factor is {ratio:.3}")).unwrap_or_default();
        return Some(format!("the root mean squares are not those of the actor's motion{by}"));
    }
    // the actor was simulated, but the other robot's motion was not
    let was_simulated = facts.contact.as_ref().is_some_and(|contact| contact.simulation.is_some());
    let refitted = parts.refitted.as_ref().filter(|motion| !was_simulated && fits(motion)).and_then(of)?;
    let ratio = median_ratio(&found, &refitted)?;
    let usual = OTHER_ROBOTS_FACTOR.recip()..=OTHER_ROBOTS_FACTOR;
    (!usual.contains(&ratio)).then(|| {
        format!(
            "the root mean squares are {ratio:.3} times those of the tracker's body in the set's motion (median); \
             expected {:.2} to {OTHER_ROBOTS_FACTOR}",
            usual.start()
        )
    })
}

/// The median ratio of the numbers above the least spread.
fn median_ratio(found: &[f64], expected: &[f64]) -> Option<f64> {
    let pairs = found.iter().zip(expected).filter(|(_, expected)| **expected > LEAST_SPREAD);
    let mut ratios: Vec<f64> = pairs.map(|(found, expected)| found / expected).collect();
    ratios.sort_by(f64::total_cmp);
    ratios.get(ratios.len() / 2).copied()
}

/// Compares the poses of the tracker's body with those nearest to the truth.
pub(super) fn refitted_faults(parts: &ReadParts) -> Vec<Fault> {
    let Some(((start, truth), refitted)) = parts.start.as_ref().zip(parts.truth.as_ref()).zip(parts.refitted.as_ref())
    else {
        return Vec::new();
    };
    let expected = if start.body.is_same_body(&truth.actor) {
        truth.motion()
    } else {
        super::refit::nearest_motion(&start.body, truth)
    };
    let angles = start.body.degrees_of_freedom.len();
    let mut wrong = refitted.poses.iter().zip(&expected.poses).enumerate().filter_map(|(frame, (found, expected))| {
        if found.joint_angles.len() != angles {
            return Some((frame, format!("expected the {angles} angles of start/body.json")));
        }
        Some((frame, pose_difference(found, expected, start, super::refit::TOLERANCE)?))
    });
    let Some((frame, detail)) = wrong.next() else { return Vec::new() };
    let count = 1 + wrong.count();
    let array = if detail.starts_with("root") { "refitted_root" } else { "refitted_angles" };
    let frames = refitted.poses.len();
    let detail = format!(
        "{array}: {count} of {frames} poses are not the nearest to the truth, first in frame {frame}: {detail}"
    );
    vec![Fault::new(truth_file::PATH, detail)]
}
