//! Recovers planted bodies, and leaves correct ones unchanged.

use nalgebra::{Isometry3, Point3, Vector3};

use super::*;
use crate::tracker::fixture::{self, March, apart_mm};
use skiagraph_core::body::{BodyShape, LinkShape};
use skiagraph_core::raster::{Mask, grown_by_disc};

fn rig(cameras: u32) -> CameraRig {
    fixture::ring(cameras, 3.5, [320, 240])
}

/// A march with swinging arms, `frame` of twelve.
fn marching(body: &Humanoid, frame: usize) -> Pose {
    March { cycle: 12, advance: 0.03, hip: 0.3, knee: 0.7, abduction: 0.5, elbow: 0.8 }.pose(body, frame)
}

/// Observations of an actor in some poses, and those poses.
type Seen = Vec<(Observation, Pose)>;

fn seen(actor: &Humanoid, rig: &CameraRig, frames: usize) -> Seen {
    let observe = |frame: usize| {
        let pose = marching(actor, frame);
        (fixture::seen(actor, &pose, rig, frame), pose)
    };
    (0..frames).map(observe).collect()
}

/// The tracker's body, a ring of cameras, and what they see of an actor of another shape.
fn mismatched(cameras: u32, [length, girth]: [f64; 2], frames: usize) -> (Humanoid, CameraRig, Seen) {
    let (body, rig) = (Humanoid::tracker25().unwrap(), rig(cameras));
    let actor = body.reshaped(&BodyShape::random_mismatch(&body, 1, length, girth));
    let seen = seen(&actor, &rig, frames);
    (body, rig, seen)
}

fn calibrated(body: &Humanoid, rig: &CameraRig, seen: &[(Observation, Pose)]) -> BodyCalibration {
    calibrated_as((Calibrated::Both, false), body, rig, seen)
}

fn calibrated_as(
    what: (Calibrated, bool),
    body: &Humanoid,
    rig: &CameraRig,
    seen: &[(Observation, Pose)],
) -> BodyCalibration {
    calibrate(body, rig, SilhouetteSettings::default(), task(what, false), &seen[0].1, seen).unwrap()
}

fn task((what, has_known_stature): (Calibrated, bool), has_known_start: bool) -> CalibrationTask {
    CalibrationTask { what, has_known_stature, has_known_start }
}

/// The rig with cameras 45 mm too high or low and turned by 0.7 degrees about the scene, one way or the other: four
/// cameras of a ring together keep place, orientation and scale.
fn misplaced(rig: &CameraRig) -> CameraRig {
    let mut given = rig.clone();
    for (camera, [up, turn]) in given.cameras.iter_mut().zip([[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]]) {
        camera.camera_from_world *= Isometry3::new(Vector3::z() * 0.045 * up, Vector3::z() * 0.012 * turn);
    }
    given
}

fn corrected(given: &CameraRig, report: &CalibrationReport) -> Vec<Camera> {
    let pairs = given.cameras.iter().zip(&report.cameras);
    pairs.map(|(camera, by)| camera.placed(camera.camera_from_world * by.motion())).collect()
}

#[test]
fn a_planted_body_is_recovered_from_its_silhouettes() {
    let body = Humanoid::tracker25().unwrap();
    let model = ShapeModel::new(&body);
    let planted = |name: &str| match name {
        "thigh length" => 0.05,
        "forearm length" => -0.04,
        "upper arm girth" => 0.15,
        "shank girth 1" => -0.12,
        _ => 0.0,
    };
    let values: Vec<f64> = model.numbers.iter().map(|number| planted(&number.name)).collect();
    let actor = model.shaped(&values);
    let rig = fixture::ring(4, 3.5, [640, 480]);
    let seen = seen(&actor, &rig, 12);
    let found = calibrated(&body, &rig, &seen);
    assert_eq!(found.report.verdict, CalibrationVerdict::Kept, "{}", found.report.describe());
    for (name, value) in &found.report.shares {
        // A pixel is 5 mm: a tenth of a limb's radius, 2 % of its length.
        let within = if name.contains("girth") { 0.1 } else { 0.03 };
        let determined =
            name.contains("length") || ["upper arm girth", "thigh girth", "shank girth 1"].contains(&name.as_str());
        assert!(!determined || (value - planted(name)).abs() < within, "{name}: {value} is not {}", planted(name));
    }
    let truth = (&actor, &seen[0].1);
    let (before, after) = (apart_mm(truth, (&body, &seen[0].1)), apart_mm(truth, (&found.body, &found.start)));
    assert!(after < 6.0 && after < before, "{before:.1} to {after:.1} mm");
    let energy = found.report.energy.unwrap();
    assert!(energy[1] < energy[0], "{energy:?}");
    assert_eq!(found.report.cameras, [], "correct cameras stay where they are");
}

#[test]
fn cameras_at_wrong_places_are_corrected() {
    let body = Humanoid::tracker25().unwrap();
    let rig = rig(4);
    let seen = seen(&body, &rig, 9);
    let given = misplaced(&rig);
    let found = calibrated(&body, &given, &seen);
    assert_eq!(found.report.verdict, CalibrationVerdict::Kept, "{}", found.report.describe());
    assert_eq!(found.report.cameras.len(), 4);
    let mut most: f64 = 0.0;
    for ((given, corrected), exact) in given.cameras.iter().zip(corrected(&given, &found.report)).zip(&rig.cameras) {
        let points = [Point3::new(0.0, 0.0, 1.0), Point3::new(0.3, 0.2, 0.2), Point3::new(-0.2, 0.3, 1.6)];
        let off = |camera: &Camera| {
            let of_point = |point| (camera.project(point).unwrap() - exact.project(point).unwrap()).norm();
            points.iter().map(of_point).fold(0.0, f64::max)
        };
        assert!(off(&corrected) < 0.5 * off(given), "{}: {} to {} px", given.name, off(given), off(&corrected));
        most = off(given).max(most);
    }
    assert!(most > 4.0, "the given cameras are off by up to {most} px");
    let truth = (&body, &seen[0].1);
    let apart = apart_mm(truth, (&found.body, &found.start));
    assert!(apart < 15.0, "the start is only taken to be accurate to 15 mm: {apart}");
    assert!(found.report.describe().contains("cameras moved by up to"), "{}", found.report.describe());
}

/// Corrected cameras moved by up to 85 mm in common, by the body's assumed size.
#[test]
fn corrected_cameras_together_keep_place_orientation_and_scale() {
    let body = Humanoid::tracker25().unwrap();
    for count in [2, 3, 4] {
        let mut rig = rig(4);
        rig.cameras.truncate(count as usize);
        let seen = seen(&body.reshaped(&BodyShape::random_mismatch(&body, 1, 0.05, 0.1)), &rig, 9);
        let mut given = rig.clone();
        for (number, camera) in (0..).zip(&mut given.cameras) {
            let [x, y] = [f64::cos(f64::from(number)), f64::sin(f64::from(number))];
            let error = Isometry3::new(Vector3::new(x, y, 0.0) * 0.05, Vector3::new(y, x, 0.0) * 0.02);
            camera.camera_from_world = error * camera.camera_from_world;
        }
        let found = calibrated(&body, &given, &seen);
        assert_eq!(found.report.cameras.len(), count as usize, "{}", found.report.describe());
        let own = corrected(&given, &found.report);
        let mean = |cameras: &[Camera]| {
            cameras.iter().map(|camera| camera.centre().coords).sum::<Vector3<f64>>() / f64::from(count)
        };
        let spread = |cameras: &[Camera]| {
            cameras.iter().map(|camera| (camera.centre().coords - mean(cameras)).norm_squared()).sum::<f64>().sqrt()
        };
        // the rotation nearest to the mean of the cameras' rotations, by its singular value decomposition
        let turn = |(own, given): (&Camera, &Camera)| {
            let [own, given] = [own, given].map(|camera| camera.camera_from_world.rotation.to_rotation_matrix());
            given.matrix().transpose() * own.matrix()
        };
        let turns = own.iter().zip(&given.cameras).map(turn).sum::<nalgebra::Matrix3<f64>>().svd(true, true);
        let common = turns.u.unwrap() * turns.v_t.unwrap();
        let moved = (mean(&own) - mean(&given.cameras)).norm();
        let grown = spread(&own) / spread(&given.cameras) - 1.0;
        let turned = (common - nalgebra::Matrix3::identity()).norm();
        assert!(moved < 1e-9 && turned < 1e-9 && grown.abs() < 1e-9, "{count}: {moved:e} m, {turned:e}, {grown:e}");
    }
}

/// With three cameras whose masks are not equally wide, correct ones were moved by 41 mm.
#[test]
fn correct_cameras_stay_if_masks_are_too_wide_in_some_of_three() {
    let body = Humanoid::tracker25().unwrap();
    let mut three = rig(4);
    three.cameras.truncate(3);
    let mut seen = seen(&body.reshaped(&BodyShape::random_mismatch(&body, 1, 0.03, 0.1)), &three, 15);
    for mask in seen.iter_mut().flat_map(|(observation, _)| observation.silhouettes.iter_mut().step_by(2)) {
        *mask = grown_by_disc(mask, 1);
    }
    let found = calibrated(&body, &three, &seen);
    assert_eq!(found.report.cameras, [], "{}", found.report.describe());
    for (cameras, most) in [(2, 0.5), (3, 5.0 / 6.0), (4, 0.9), (8, 0.9)] {
        assert!((max_camera_ratio(cameras) - most).abs() < 1e-12, "{cameras}");
    }
}

// synthetic sets have an exact start; without it, what all cameras share cannot be seen
#[test]
fn a_known_start_says_where_the_world_is() {
    let body = Humanoid::tracker25().unwrap();
    let rig = rig(4);
    let seen = seen(&body, &rig, 9);
    let mut given = misplaced(&rig);
    for camera in &mut given.cameras {
        camera.camera_from_world *= Isometry3::translation(0.04, 0.0, 0.0);
    }
    let off = |has_known_start| {
        let task = task((Calibrated::Cameras, false), has_known_start);
        let found = calibrate(&body, &given, SilhouetteSettings::default(), task, &seen[0].1, &seen).unwrap();
        let pairs = corrected(&given, &found.report).into_iter().zip(&rig.cameras);
        let shifts: Vec<Vector3<f64>> = pairs.map(|(own, exact)| own.centre() - exact.centre()).collect();
        assert_eq!(shifts.len(), 4, "{}", found.report.describe());
        (shifts.iter().sum::<Vector3<f64>>() / 4.0).norm()
    };
    let [unknown, known] = [false, true].map(off);
    assert!((unknown - 0.04).abs() < 0.002 && known < 0.02, "{unknown} {known}");
}

#[test]
fn a_known_stature_is_kept() {
    let body = Humanoid::tracker25().unwrap();
    let rig = rig(4);
    let link = LinkShape { length: Vector3::repeat(1.06), girth: 1.06 };
    let actor = body.reshaped(&BodyShape { links: vec![link; body.links.len()] });
    let seen = seen(&actor, &rig, 9);
    for (what, given) in [(Calibrated::Both, &misplaced(&rig)), (Calibrated::Body, &rig)] {
        let grown = |is_known: bool| {
            let found = calibrated_as((what, is_known), &body, given, &seen);
            assert_eq!(found.report.verdict, CalibrationVerdict::Kept, "{}", found.report.describe());
            found.body.stature().unwrap() - body.stature().unwrap()
        };
        let [free, held] = [false, true].map(grown);
        assert!(free.abs() > 0.02 && held.abs() < 1e-9, "{what}: {free} {held:e}");
    }
}

#[test]
fn only_what_is_asked_for_is_calibrated() {
    let (body, rig, seen) = mismatched(4, [0.05, 0.15], 9);
    let given = misplaced(&rig);
    let cameras = calibrated_as((Calibrated::Cameras, true), &body, &given, &seen);
    assert!(cameras.body.is_same_body(&body) && cameras.report.cameras.len() == 4, "{}", cameras.report.describe());
    for rig in [&given, &rig] {
        let own = calibrated_as((Calibrated::Body, false), &body, rig, &seen);
        assert_eq!(own.report.cameras, [], "{}", own.report.describe());
    }
    assert!(!calibrated_as((Calibrated::Body, false), &body, &rig, &seen).body.is_same_body(&body));
}

#[test]
fn a_correct_body_stays_unchanged() {
    let body = Humanoid::tracker25().unwrap();
    let rig = rig(4);
    let found = calibrated(&body, &rig, &seen(&body, &rig, 6));
    assert_eq!(found.report.verdict, CalibrationVerdict::NoBetter, "{}", found.report.describe());
    assert!(found.body.is_same_body(&body));
}

#[test]
fn a_body_that_fits_only_the_frames_it_was_solved_on_is_not_used() {
    let (body, rig, mut seen) = mismatched(4, [0.05, 0.15], 9);
    let others = self::seen(&body, &rig, 9);
    let verdict = |seen: &[_]| calibrated(&body, &rig, seen).report.verdict;
    assert_eq!(verdict(&seen), CalibrationVerdict::Kept);
    seen.splice(6.., others.into_iter().skip(6));
    assert_eq!(verdict(&seen), CalibrationVerdict::NoBetter);
}

#[test]
fn too_few_frames_leave_the_body_unchanged() {
    let (body, rig, seen) = mismatched(3, [0.03, 0.1], 5);
    let found = calibrated(&body, &rig, &seen);
    assert_eq!(found.report.verdict, CalibrationVerdict::TooFewFrames);
    assert!(found.body.is_same_body(&body) && found.report.describe().contains("at least 6 frames"));
}

#[test]
fn one_camera_or_empty_masks_leave_the_body_unchanged() {
    let body = Humanoid::tracker25().unwrap();
    let actor = body.reshaped(&BodyShape::random_mismatch(&body, 1, 0.03, 0.1));
    let one = rig(1);
    let found = calibrated(&body, &one, &seen(&actor, &one, 3));
    assert_eq!(found.report.verdict, CalibrationVerdict::TooFewViews);
    let four = rig(4);
    let mut blank = seen(&actor, &four, 3);
    for mask in blank.iter_mut().flat_map(|(observation, _)| &mut observation.silhouettes) {
        *mask = Mask::new(320, 240);
    }
    let found = calibrated(&body, &four, &blank);
    assert_eq!((found.report.verdict, found.report.cost), (CalibrationVerdict::TooFewViews, None));
    assert!(found.body.is_same_body(&body) && found.start == blank[0].1);
    assert!(found.report.describe().contains("fewer than two cameras"));
}

/// A body that is larger by 4 % in all lengths is as large in an image as one that is nearer: only the start pose
/// tells.
#[test]
fn one_camera_and_a_known_start_say_how_large_the_body_is() {
    let body = Humanoid::tracker25().unwrap();
    let mut shape = BodyShape::identity(&body);
    shape.links.iter_mut().for_each(|link| (link.length, link.girth) = (Vector3::repeat(1.04), 1.04));
    let actor = body.reshaped(&shape);
    let one = rig(1);
    let seen = seen(&actor, &one, 1);
    let by = |body: &Humanoid, start: &Pose| {
        let task = task((Calibrated::Body, false), true);
        calibrate(body, &one, SilhouetteSettings::default(), task, start, &seen).unwrap()
    };
    let found = by(&body, &seen[0].1);
    let [before, after, wanted] = [&body, &found.body, &actor].map(|body| body.stature().unwrap());
    // the prior keeps a part of it: 4 % is more than a standard deviation in every length
    assert!((after - wanted).abs() < 0.5 * (before - wanted).abs(), "{before} {after} {wanted}");
    // a start that is off would pass for another size
    let mut off = seen[0].1.clone();
    off.world_from_root.translation.vector += Vector3::new(0.1, 0.1, 0.1);
    let found = by(&body, &off);
    assert_eq!(found.report.verdict, CalibrationVerdict::NoBetter, "{}", found.report.describe());
    assert!(found.body.is_same_body(&body) && found.start == off);
    // a correct body stays
    let stature = by(&actor, &seen[0].1).body.stature().unwrap();
    assert!((stature - wanted).abs() < 0.01, "{stature} {wanted}");
}

#[test]
fn a_frame_without_silhouettes_is_tolerated() {
    let (body, rig, mut seen) = mismatched(3, [0.03, 0.1], 7);
    seen[2].0.silhouettes.iter_mut().for_each(|mask| *mask = Mask::new(320, 240));
    let found = calibrated(&body, &rig, &seen);
    assert!(!found.report.shares.is_empty() && found.report.shares.iter().all(|(_, share)| share.is_finite()));
    assert!(found.start.joint_angles.iter().all(|angle| angle.is_finite()));
}

/// Empty images add the same to all energies, so that the calibrated one was less than 10 % lower.
#[test]
fn empty_images_in_the_test_frames_do_not_change_the_decision() {
    let (body, rig, mut seen) = mismatched(4, [0.05, 0.15], 12);
    let mut energies = |blank: &[(usize, std::ops::Range<usize>)]| {
        for (frame, views) in blank {
            seen[*frame].0.silhouettes[views.clone()].iter_mut().for_each(|mask| *mask = Mask::new(320, 240));
        }
        let report = calibrated(&body, &rig, &seen).report;
        assert_eq!(report.verdict, CalibrationVerdict::Kept, "{}", report.describe());
        (report.held_back, report.energy.unwrap())
    };
    let (all, of_all) = energies(&[]);
    let (rest, of_rest) = energies(&[(9, 0..4), (10, 0..1), (11, 0..4)]);
    assert_eq!((all, rest), (4, 2));
    assert!((0..2).all(|body| (of_rest[body] / of_all[body] - 1.0).abs() < 0.5), "{of_all:?} {of_rest:?}");
}

#[test]
fn results_are_bit_identical_for_any_number_of_threads() {
    let (body, rig, seen) = mismatched(2, [0.03, 0.1], 6);
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| calibrated(&body, &rig, &seen)).report
    };
    let one = with(1);
    assert_eq!(with(2), one);
    assert_eq!(with(8), one);
}

#[test]
fn no_frames_and_a_different_rig_are_errors() {
    let body = Humanoid::tracker25().unwrap();
    let refused = |cameras, start: &Pose, seen: &[(Observation, Pose)]| {
        let task = task((Calibrated::Both, false), false);
        let refused = calibrate(&body, &rig(cameras), SilhouetteSettings::default(), task, start, seen);
        refused.unwrap_err().to_string()
    };
    let none = refused(2, &marching(&body, 0), &[]);
    assert_eq!(none, "calibration of the tracker's body: expected at least one frame, found none");
    let seen = seen(&body, &rig(2), 1);
    assert!(refused(3, &seen[0].1, &seen).contains("expected 3 silhouettes"));
}
