//! Cameras of files that cannot stand as they do: below the ground, upside down, far away, or with K of other images.
//!
//! What explains them is tried: keys of `[[rig.file]]` that the user has left at their defaults are changed, and the
//! files read again. A change that lets all cameras stand upright above the ground and see the body is the remedy.

use std::ops::Range;
use std::path::Path;

use nalgebra::{Point3, Vector3};
use serde_json::Value;

use super::camera_files::cameras_of;
use crate::scenario::{KeyError, RigSettings};
use skiagraph_core::body::Motion;
use skiagraph_core::camera::{Camera, CameraFile};

/// A person is a few pixels high from farther away: metres.
const FAR_M: f64 = 200.0;
/// The floor of a calibration is off by a few centimetres: metres.
const FLOOR_M: f64 = 0.1;
/// Heights at which cameras usually are, metres: a remedy must put them there.
const USUAL_HEIGHT_M: Range<f64> = 0.2..50.0;
/// Cameras whose horizon is tilted more are on their side, degrees.
const ROLL_DEG: f64 = 45.0;
/// Sine of the angle from the vertical within which a view has no horizon.
const NO_HORIZON: f64 = 0.3;
/// Lenses are centred on their sensors within a few percent: a principal point farther from the middle, as a share of
/// the image's sides, and by one factor along both, is that of images of another size.
const OFF_CENTRE: f64 = 0.12;
/// Greatest relative difference of the two factors by which a principal point is off, along x and y.
const SAME_FACTOR: f64 = 0.15;
/// The camera whose world a file has is nearer to the origin than this share of the distance of the farthest,
const OF_REFERENCE: f64 = 0.5;
/// and turned less, degrees.
const TURN_OF_REFERENCE_DEG: f64 = 3.0;
const MOST_FRAMES: usize = 60;

/// A camera of `rig.file[file]`, and what is impossible about it.
struct Standing {
    file: usize,
    camera: Camera,
    /// What no camera does.
    faults: Vec<String>,
    /// What few cameras do: hang upside down or on their side.
    roll: Option<String>,
}

/// A value of a key that a user may have to set.
struct Change {
    key: &'static str,
    value: &'static str,
    /// The key and value that say that the file is right.
    otherwise: &'static str,
    reason: &'static str,
}

const fn unit(value: &'static str, reason: &'static str) -> Change {
    Change { key: "metres_per_unit", value, otherwise: "metres_per_unit to its default", reason }
}

const fn up(value: &'static str) -> Change {
    Change { key: "up", value, otherwise: "up = \"z\"", reason: "another axis of the file's world seems to point up" }
}

const CHANGES: [Change; 9] = [
    unit("0.001", "lengths seem to be in millimetres"),
    unit("0.01", "lengths seem to be in centimetres"),
    unit("1.0", "lengths seem to be in metres"),
    Change {
        key: "pose",
        value: "\"camera_to_world\"",
        otherwise: "pose = \"world_to_camera\"",
        reason: "R and T seem to be camera to world, not world to camera",
    },
    up("\"y\""),
    up("\"-z\""),
    up("\"-y\""),
    up("\"x\""),
    up("\"-x\""),
];

/// Notes about cameras of files that cannot stand as they do.
///
/// # Errors
/// [`KeyError`] if K is of images of another size, or if the value of a key explains most of the cameras.
pub(crate) fn doubts(settings: &RigSettings, folder: &Path, motion: &Motion) -> Result<Vec<String>, KeyError> {
    let standing = stand(settings, &settings.file, folder, motion)?;
    for of_file in &standing {
        check_centre(of_file, &settings.file[of_file.file])?;
    }
    check_world(&standing, &settings.file)?;
    let doubtful: Vec<&Standing> = standing.iter().filter(|camera| !camera.is_sound()).collect();
    let Some(first) = doubtful.first() else { return Ok(Vec::new()) };
    let mut words: Vec<String> = doubtful.iter().take(4).map(|camera| camera.words()).collect();
    if doubtful.len() > words.len() {
        words.push(format!("and {} more", doubtful.len() - words.len()));
    }
    let words = words.join("; ");
    let impossible = doubtful.iter().any(|camera| !camera.faults.is_empty());
    let remedies = if impossible { remedies(settings, folder, motion, &doubtful) } else { Vec::new() };
    let joined = |remedy: &[&Change], of: fn(&Change) -> String| {
        remedy.iter().map(|change| of(change)).collect::<Vec<_>>().join(" and ")
    };
    let value = |change: &Change| format!("{} = {}", change.key, change.value);
    let hint = match remedies.first() {
        Some(remedy) if 2 * doubtful.len() > standing.len() => {
            let values: Vec<String> = remedies.iter().map(|remedy| joined(remedy, value)).collect();
            let message = format!(
                "the cameras cannot stand as the file says: {words}; {}: with {} all of them stand upright above the \
                 ground and see the body: set this in the [[rig.file]] of each, or {} if the file is right",
                joined(remedy, |change| change.reason.to_owned()),
                values.join(" or "),
                joined(remedy, |change| change.otherwise.to_owned()),
            );
            return Err(KeyError::new(format!("rig.file[{}]", first.file), message));
        }
        Some(remedy) => format!("with {} in its [[rig.file]] it would stand like the others", joined(remedy, value)),
        None if !impossible => "right if they are mounted so".to_owned(),
        None => {
            "check R and T, `up` and `pose` of its [[rig.file]], or the place of the motion; if the translation in \
                 its file is in millimetres, set metres_per_unit = 0.001 in its [[rig.file]]"
                .to_owned()
        }
    };
    Ok(vec![format!("{} of {} cameras of files: {words}: {hint}", doubtful.len(), standing.len())])
}

impl Standing {
    fn new(file: usize, camera: Camera, body: &[Point3<f64>]) -> Self {
        let centre = camera.centre();
        let mut faults = Vec::new();
        if centre.z < -FLOOR_M {
            faults.push(format!("{:.2} m below the ground", -centre.z));
        }
        let metres = body.iter().map(|point| nalgebra::distance(point, &centre)).fold(f64::INFINITY, f64::min);
        if metres > FAR_M {
            faults.push(format!("{metres:.0} m from the body"));
        } else if !body.iter().any(|point| camera.sees(point)) {
            faults.push("never sees the middle of the body".to_owned());
        }
        let height = |axis: Vector3<f64>| camera.camera_from_world.inverse_transform_vector(&axis).z;
        let (right, up) = (height(Vector3::x()), height(-Vector3::y()));
        let roll = right.atan2(up).to_degrees();
        let has_horizon = right.hypot(up) > NO_HORIZON;
        let roll = (has_horizon && roll.abs() > ROLL_DEG).then(|| match roll.abs() > 180.0 - ROLL_DEG {
            true => "upside down".to_owned(),
            false => format!("on its side (rolled by {roll:.0} degrees)"),
        });
        Self { file, camera, faults, roll }
    }

    fn is_sound(&self) -> bool {
        self.faults.is_empty() && self.roll.is_none()
    }

    fn words(&self) -> String {
        let words: Vec<&str> = self.faults.iter().chain(&self.roll).map(String::as_str).collect();
        format!("`{}` {}", self.camera.name, words.join(", "))
    }
}

/// The cameras of the files that stand still and are not left out.
fn stand(
    settings: &RigSettings,
    files: &[CameraFile],
    folder: &Path,
    motion: &Motion,
) -> Result<Vec<Standing>, KeyError> {
    let step = motion.poses.len().div_ceil(MOST_FRAMES).max(1);
    let roots = motion.poses.iter().step_by(step).map(|pose| Point3::from(pose.world_from_root.translation.vector));
    // chest, pelvis and knees of somebody who stands
    let body: Vec<Point3<f64>> =
        roots.flat_map(|root| [-0.4, 0.0, 0.4].map(|above| root + above * Vector3::z())).collect();
    let mut standing = Vec::new();
    for (index, file) in files.iter().enumerate() {
        for camera in cameras_of(file, folder, index)? {
            let moves = settings.motion.iter().any(|entry| entry.camera == camera.name);
            if !moves && !settings.leave_out.contains(&camera.name) {
                standing.push(Standing::new(index, camera, &body));
            }
        }
    }
    Ok(standing)
}

/// The sets of fewest changes to the files of doubtful cameras that let all cameras stand.
fn remedies(
    settings: &RigSettings,
    folder: &Path,
    motion: &Motion,
    doubtful: &[&Standing],
) -> Vec<Vec<&'static Change>> {
    let mut found = Vec::new();
    let mut candidates: Vec<Vec<&Change>> = CHANGES.iter().map(|change| vec![change]).collect();
    while found.is_empty() && !candidates.is_empty() {
        for changes in &candidates {
            let files = settings.file.iter().enumerate().map(|(index, file)| {
                let doubted = doubtful.iter().any(|camera| camera.file == index);
                if doubted { changed(file, changes) } else { Some(file.clone()) }
            });
            let Some(files) = files.collect::<Option<Vec<_>>>() else { continue };
            let is_usual =
                |of_file: &Standing| of_file.is_sound() && USUAL_HEIGHT_M.contains(&of_file.camera.centre().z);
            if stand(settings, &files, folder, motion).is_ok_and(|cameras| cameras.iter().all(is_usual)) {
                found.push(changes.clone());
            }
        }
        // one change more, of a key that comes later in the list
        let mut longer = Vec::new();
        for changes in candidates {
            let last = changes.last().map(|change| change.key);
            for change in CHANGES.iter().rev().take_while(|change| Some(change.key) != last) {
                longer.push([&changes[..], &[change]].concat());
            }
        }
        candidates = longer;
    }
    found
}

/// The file with these changes; `None` if the user has set one of the keys, which is not doubted.
fn changed(file: &CameraFile, changes: &[&Change]) -> Option<CameraFile> {
    let mut keys = serde_json::to_value(file).ok()?;
    for change in changes {
        let value: Value = serde_json::from_str(change.value).ok()?;
        if keys.as_object_mut()?.insert(change.key.to_owned(), value).is_some() {
            return None;
        }
    }
    serde_json::from_value(keys).ok()
}

/// Refuses files whose world is that of one of their cameras, as programs have it before they know another: that camera
/// is at the origin and looks straight up. A bundle adjustment moves it, by a third of the rig in one file of anipose.
fn check_world(standing: &[Standing], files: &[CameraFile]) -> Result<(), KeyError> {
    let size = standing.iter().map(|one| one.camera.centre().coords.norm()).fold(0.0, f64::max);
    for reference in standing {
        let file = &files[reference.file];
        let pose = &reference.camera.camera_from_world;
        let is_reference = pose.translation.vector.norm() <= 1e-6 + OF_REFERENCE * size
            && pose.rotation.angle().to_degrees() < TURN_OF_REFERENCE_DEG;
        if !is_reference || file.up.is_some() || file.first_camera.is_some() {
            continue;
        }
        let of_file: Vec<&Standing> = standing.iter().filter(|one| one.file == reference.file).collect();
        let is_alone = of_file.len() == 1 && standing.len() > 1;
        let folder =
            if is_alone { "give the folder of all its files as the `path` of one [[rig.file]], and " } else { "" };
        let first =
            of_file.first().filter(|_| !is_alone).map_or(String::new(), |one| format!(", `{}`", one.camera.name));
        let message = format!(
            "its world is that of its camera `{}`, which would stand at the origin and look straight up: {folder}say where the \
             first camera{first} is, for example first_camera = {{ position_m = [0.0, -4.0, 1.5], look_at_m = [0.0, 0.0, 1.0] }}, \
             or up = \"z\" if the file is right",
            reference.camera.name
        );
        return Err(KeyError::new(format!("rig.file[{}]", reference.file), message));
    }
    Ok(())
}

/// Refuses a K of images of another size than the camera's.
fn check_centre(standing: &Standing, file: &CameraFile) -> Result<(), KeyError> {
    let pinhole = &standing.camera.pinhole;
    let ([cx, cy], sides) = (pinhole.principal_point, [pinhole.width, pinhole.height].map(f64::from));
    // 1 at the middle
    let [along_x, along_y] = [2.0 * cx / sides[0], 2.0 * cy / sides[1]];
    let off = (along_x - 1.0).abs().max((along_y - 1.0).abs()) / 2.0;
    let agree = along_x > 0.0 && along_y > 0.0 && (along_x / along_y).ln().abs() < SAME_FACTOR;
    let exchanged = (2.0 * cx / sides[1] - 1.0).abs().max((2.0 * cy / sides[0] - 1.0).abs()) < OFF_CENTRE;
    if file.calibrated_at_px.is_some() || off <= OFF_CENTRE || !(agree || exchanged || off > 0.5) {
        return Ok(());
    }
    let remedy = if agree {
        let factor = nearest_factor((along_x * along_y).sqrt());
        let [width, height] = sides.map(|side| (factor * side).round());
        format!(
            "K seems to be of images {factor:.2} times as large, of another resolution: set calibrated_at_px = [{width}, \
             {height}], or [{}, {}] if K is right",
            sides[0], sides[1]
        )
    } else if exchanged {
        "width and height of the image seem to be exchanged, in size_px or in the file".to_owned()
    } else {
        "K seems to be of another camera; cameras with cropped images are given as [[rig.camera]]".to_owned()
    };
    let message = format!(
        "camera `{}` has its principal point at cx = {:.1}, cy = {:.1}, {} its image of {} x {} pixels: {remedy}",
        standing.camera.name,
        cx - 0.5,
        cy - 0.5,
        if off > 0.5 { "outside" } else { "far from the middle of" },
        sides[0],
        sides[1],
    );
    Err(KeyError::new(format!("rig.file[{}]", standing.file), message))
}

/// The ratio of two usual sizes of images that is within 10 % of `factor`, else `factor`.
fn nearest_factor(factor: f64) -> f64 {
    let usual = [0.25, 1.0 / 3.0, 0.5, 2.0 / 3.0, 0.75, 4.0 / 3.0, 1.5, 2.0, 3.0, 4.0];
    usual.into_iter().find(|ratio| (ratio / factor).ln().abs() < 0.1).unwrap_or(factor)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI};
    use std::fs;

    use super::*;
    use crate::prepare::PreparedScene;
    use crate::scenario::ScenarioFile;
    use nalgebra::Isometry3;
    use skiagraph_core::camera::FieldOfView;

    type Pose = Isometry3<f64>;
    type Moved = fn(usize, Pose) -> Pose;

    /// What is said about four cameras around a walk, in files with changed poses, K times `k`, and `keys`.
    fn said(change: Moved, k: f64, keys: &str) -> Result<String, String> {
        let folder = tempfile::tempdir().unwrap();
        let head =
            "schema = \"skiagraph.scenario/1\"\nname = \"a\"\n[motion]\nclip = \"embedded:walk\"\nlast_frame = 12\n";
        let mut scenario = head.to_owned();
        let places = [[4.0, 3.0, 1.5], [-3.0, 4.0, 1.8], [-4.0, -3.0, 2.1], [3.0, -4.0, 0.4]].map(Point3::from);
        for (index, eye) in places.into_iter().enumerate() {
            let target = Point3::new(0.1, 0.0, 0.9);
            let camera = Camera::look_at("a", eye, target, Vector3::z(), FieldOfView::Vertical(0.9), 160, 120).unwrap();
            let (pose, f) = (change(index, camera.camera_from_world), k * camera.pinhole.focal[0]);
            let text = format!(
                "image_width: 160\nimage_height: 120\nK: [{f}, 0, {}, 0, {f}, {}, 0, 0, 1]\nrvec: {:?}\nT: {:?}\n",
                k * 80.0 - 0.5,
                k * 60.0 - 0.5,
                pose.rotation.scaled_axis().as_slice(),
                pose.translation.vector.as_slice(),
            );
            fs::write(folder.path().join(format!("cam{index}.yml")), text).unwrap();
            scenario += &format!("[[rig.file]]\npath = \"cam{index}.yml\"\n{keys}\n");
        }
        let file =
            ScenarioFile::parse(&scenario, "a.toml", folder.path().to_owned(), &[]).map_err(|e| e.to_string())?;
        let scene = PreparedScene::new(&file, None).map_err(|e| e.to_string())?;
        Ok(scene.notes.into_iter().filter(|note| note.contains("cameras of files")).collect())
    }

    fn turned(pose: Pose, angle: f64) -> Pose {
        pose * Pose::rotation(angle * Vector3::x())
    }

    fn in_millimetres(pose: Pose) -> Pose {
        Pose::from_parts((1000.0 * pose.translation.vector).into(), pose.rotation)
    }

    #[test]
    fn impossible_cameras_are_refused_with_the_key_that_mends_them() {
        let changes: [(Moved, f64, &str); 8] = [
            (|_, pose| turned(pose, PI), 1.0, "up = \"-z\""),
            (|_, pose| turned(pose, FRAC_PI_2), 1.0, "up = \"y\""),
            (|_, pose| pose.inverse(), 1.0, "pose = \"camera_to_world\""),
            (|_, pose| in_millimetres(pose), 1.0, "metres_per_unit = 0.001"),
            (|_, pose| in_millimetres(pose.inverse()), 1.0, "metres_per_unit = 0.001 and pose = \"camera_to_world\""),
            (|_, pose| pose, 2.0, "calibrated_at_px = [320, 240]"),
            (|_, pose| pose, 4.0, "calibrated_at_px = [640, 480]"),
            (|_, pose| pose, 0.75, "calibrated_at_px = [120, 90]"),
        ];
        for (change, k, remedy) in changes {
            let refused = said(change, k, "").unwrap_err();
            assert!(refused.contains("rig.file[0]") && refused.contains(remedy), "{refused}");
            assert_eq!(said(change, k, &remedy.replace(" and ", "\n")).as_deref(), Ok(""), "{remedy}");
        }
        // what the user says is not doubted
        let kept = said(|_, pose| in_millimetres(pose), 1.0, "metres_per_unit = 1.0").unwrap();
        assert!(kept.starts_with("4 of 4 cameras of files: `cam0` 5"), "{kept}");
    }

    #[test]
    fn one_camera_unlike_the_others_is_named() {
        let said = said(|index, pose| if index == 2 { pose.inverse() } else { pose }, 1.0, "").unwrap();
        assert!(said.starts_with("1 of 4 cameras of files: `cam2`") && said.contains("camera_to_world"), "{said}");
    }

    /// A bundle adjustment leaves the reference camera a little off the identity.
    #[test]
    fn world_of_a_camera_is_refused() {
        let of_second = |_: usize, pose: Pose| {
            let reference = Camera::look_at(
                "a",
                Point3::new(-3.0, 4.0, 1.8),
                Point3::new(0.1, 0.0, 0.9),
                Vector3::z(),
                FieldOfView::Vertical(0.9),
                160,
                120,
            );
            let moved = Pose::new(Vector3::new(0.01, 0.0, 0.02), Vector3::new(0.0, 0.01, 0.0));
            pose * (moved * reference.unwrap().camera_from_world).inverse()
        };
        let refused = said(of_second, 1.0, "").unwrap_err();
        assert!(refused.contains("rig.file[1]") && refused.contains("first_camera = {"), "{refused}");
        assert!(refused.contains("the folder of all its files"), "first_camera alone would move one camera: {refused}");
        assert!(said(of_second, 1.0, "up = \"z\"").unwrap().contains("cameras of files"));
    }

    #[test]
    fn usual_cameras_are_not_doubted() {
        // two of them on the ceiling, looking straight down
        let ceiling = |index, pose: Pose| match index {
            0 | 1 => Pose::new(Vector3::new(0.0, 0.0, 5.0), PI * Vector3::x()),
            _ => pose,
        };
        assert_eq!(said(ceiling, 1.0, "").as_deref(), Ok(""));
        let portrait = said(|_, pose| Pose::rotation(FRAC_PI_2 * Vector3::z()) * pose, 1.0, "").unwrap();
        assert!(portrait.contains("on its side (rolled by") && portrait.contains("mounted so"), "{portrait}");
    }
}
