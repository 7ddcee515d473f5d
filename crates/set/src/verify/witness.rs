//! Two witnesses that do not trust the code which made the set: OpenCV's formula with the numbers of the camera file,
//! and the silhouettes, in which joints inside the body must lie.

use nalgebra::{Isometry3, Matrix3, Point3, Vector3};
use serde::Deserialize;

use super::remade::Remade;
use super::{CheckOutcome, Fault};
use crate::files::SetFiles;
use crate::format::{cameras_file, silhouette_png, views_file};
use crate::{BlindSet, SetError};
use skiagraph_core::body::{Humanoid, LANDMARKS, Ray, Solid};
use skiagraph_core::npz::{Npz, Values};
use skiagraph_core::parallel;
use skiagraph_truth::observing::SilhouetteSource;
use skiagraph_truth::scene::{SceneClock, Shot, ShotPoint};

/// Tolerance between the formula and the pixels of the set, relative to the pixel or 1 px.
const TOLERANCE_PX: f64 = 1e-6;

/// This share of the visible joints inside the body must be in a camera's silhouettes, within [`REACH_PX`].
const LEAST_SHARE: f64 = 0.85;
const REACH_PX: i64 = 2;

/// Fewest joints for this share.
const LEAST_JOINTS: usize = 10;

/// Greatest number of frames whose silhouettes are read.
const SAMPLED_FRAMES: usize = 200;

/// A camera of a file, read without this program's own reader.
#[derive(Clone, Deserialize)]
struct ListedCamera {
    name: String,
    #[serde(rename = "K")]
    matrix: [[f64; 3]; 3],
    #[serde(rename = "R")]
    rotation: [[f64; 3]; 3],
    #[serde(rename = "t")]
    translation: [f64; 3],
    /// k1 k2 p1 p2 k3.
    distortion: [f64; 5],
}

#[derive(Deserialize)]
struct ListedRig {
    cameras: Vec<ListedCamera>,
}

impl ListedCamera {
    /// OpenCV's `projectPoints`, from its documentation: pixels with centres at integers. `camera_from_world` replaces
    /// `R` and `t` if the camera moves.
    fn project(&self, point: &Point3<f64>, camera_from_world: Option<&Isometry3<f64>>) -> [f64; 2] {
        let p = match camera_from_world {
            Some(moved) => (moved * point).coords,
            None => {
                let r = Matrix3::from_row_slice(self.rotation.as_flattened());
                r * point.coords + Vector3::from(self.translation)
            }
        };
        let (x, y) = (p.x / p.z, p.y / p.z);
        let [k1, k2, p1, p2, k3] = self.distortion;
        let r2 = x * x + y * y;
        let radial = 1.0 + k1 * r2 + k2 * r2.powi(2) + k3 * r2.powi(3);
        let bent_x = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x);
        let bent_y = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y;
        let k = &self.matrix;
        [k[0][0] * bent_x + k[0][2], k[1][1] * bent_y + k[1][2]]
    }
}

/// The arrays of `views.npz` that the witnesses need; every array has the shape (T, C, points, ...).
struct Views {
    joints: Vec<f64>,
    markers: Vec<f64>,
    joint_sights: Vec<i64>,
}

impl Views {
    fn read(files: &SetFiles, remade: &Remade) -> Result<Self, SetError> {
        let path = views_file::PATH;
        let npz = Npz::from_bytes(path, &files.read(path)?)?;
        let joints = remade.truth.actor.joints.len();
        let shape = |points: usize| [remade.truth.frames.len(), remade.rig.cameras(), points].map(Some);
        let pixels = |array: &str, points: usize| {
            let shape = [&shape(points)[..], &[Some(2)]].concat();
            npz.f64s(path, array, &shape).map(<[f64]>::to_vec)
        };
        let sights = npz.get("joint_sight").filter(|array| array.shape.iter().copied().map(Some).eq(shape(joints)));
        let Some(Values::I64(joint_sights)) = sights.map(|array| array.values.clone()) else {
            let detail = format!(
                "joint_sight: expected integers of the shape {:?}",
                shape(joints).map(Option::unwrap_or_default)
            );
            return Err(SetError::malformed(path, detail));
        };
        let (joints, markers) = (pixels("joints_2d", joints)?, pixels("markers_2d", LANDMARKS.len())?);
        Ok(Self { joints, markers, joint_sights })
    }
}

fn refused(files: &SetFiles, error: SetError) -> CheckOutcome {
    Ok((String::new(), vec![Fault::from_file(files.folder().unwrap_or("".as_ref()), error)]))
}

/// Projects joints and markers by OpenCV's formula with the true cameras, each at the time when its row was exposed.
pub(super) fn check_projection(files: &SetFiles, remade: &Remade) -> CheckOutcome {
    let path = if files.has(cameras_file::TRUTH_PATH) { cameras_file::TRUTH_PATH } else { cameras_file::PATH };
    let listed = files.read(path).and_then(|bytes| {
        serde_json::from_slice::<ListedRig>(&bytes).map_err(|error| SetError::malformed(path, error.to_string()))
    });
    let (views, listed) = match Views::read(files, remade).and_then(|views| Ok((views, listed?))) {
        Ok(read) => read,
        Err(error) => return refused(files, error),
    };
    let (truth, rig) = (&remade.truth, &remade.rig);
    let (cameras, joints) = (rig.cameras(), truth.actor.joints.len());
    if listed.cameras.len() != cameras {
        let detail = format!("{} cameras, expected {cameras}", listed.cameras.len());
        return refused(files, SetError::malformed(path, detail));
    }
    let clock = SceneClock::new(truth, rig);
    let of_frame = |frame: usize| {
        let mut shot = Shot::new(&clock, rig, frame);
        let mut wrong = vec![[0; 2]; cameras];
        for (camera, (own, wrong)) in listed.cameras.iter().zip(&mut wrong).enumerate() {
            let is_wrong = |seen: Option<ShotPoint>, pixels: &[f64], index: usize| {
                let Some(seen) = seen.filter(|seen| seen.pixel.is_some()) else { return false };
                let moved = (!rig.is_still()).then_some(&seen.camera.camera_from_world);
                let expected = own.project(&seen.place, moved);
                let scale = expected[0].abs().max(expected[1].abs()).max(1.0);
                (0..2).any(|axis| {
                    let off = (pixels[2 * index + axis] - expected[axis]).abs();
                    off.is_nan() || off > TOLERANCE_PX * scale
                })
            };
            let view = frame * cameras + camera;
            for joint in 0..joints {
                let seen = shot.joint(camera, joint);
                wrong[0] += usize::from(is_wrong(seen, &views.joints, view * joints + joint));
            }
            for marker in 0..LANDMARKS.len() {
                let seen = shot.marker(camera, marker);
                wrong[1] += usize::from(is_wrong(seen, &views.markers, view * LANDMARKS.len() + marker));
            }
        }
        wrong
    };
    let found = parallel::map(truth.frames.len(), of_frame);
    let mut faults = Vec::new();
    for camera in 0..cameras {
        for (kind, array) in ["joints_2d", "markers_2d"].into_iter().enumerate() {
            let wrong: usize = found.iter().map(|frame| frame[camera][kind]).sum();
            if wrong > 0 {
                let name = &listed.cameras[camera].name;
                let detail =
                    format!("{array}: {wrong} pixels of camera {name:?} are not those of OpenCV's formula and {path}");
                faults.push(Fault::new(views_file::PATH, detail));
            }
        }
    }
    Ok((format!("{joints} joints and the markers in {} frames of {cameras} cameras", truth.frames.len()), faults))
}

/// Compares the silhouettes with the joints that are inside a solid of the body.
pub(super) fn check_masks(files: &SetFiles, side: &BlindSet, remade: &Remade) -> CheckOutcome {
    let stated = side.observation.as_ref().filter(|facts| facts.silhouette != SilhouetteSource::Exact);
    if let Some(facts) = stated {
        return Ok((format!("nothing, because the silhouettes are {}", facts.describe()), Vec::new()));
    }
    let views = match Views::read(files, remade) {
        Ok(views) => views,
        Err(error) => return refused(files, error),
    };
    let (truth, cameras) = (&remade.truth, remade.rig.cameras());
    let (frames, joints) = (truth.frames.len(), truth.actor.joints.len());
    let inside: Vec<usize> = (0..joints).filter(|joint| is_inside(&truth.actor, *joint)).collect();
    let step = frames.div_ceil(SAMPLED_FRAMES).max(1);
    // joints seen, and those of them in the silhouette, by camera
    let of_frame = |index: usize| {
        let frame = index * step;
        let mut seen = vec![[0; 2]; cameras];
        for camera in (0..cameras).filter(|camera| remade.rig.has_image(*camera, frame)) {
            let pinhole = &remade.rig.rig().cameras[camera].pinhole;
            let path = BlindSet::silhouette_path(camera, frame);
            let read = files.read(&path).and_then(|b| silhouette_png::decode(&path, &b, pinhole.width, pinhole.height));
            // other checks report an image that cannot be read
            let Ok(mask) = read else { continue };
            for joint in &inside {
                let at = (frame * cameras + camera) * joints + joint;
                if views.joint_sights[at] != 0 {
                    continue;
                }
                let [x, y] = [views.joints[2 * at], views.joints[2 * at + 1]].map(|x| x.round() as i64);
                let around =
                    (-REACH_PX..=REACH_PX).flat_map(|dy| (-REACH_PX..=REACH_PX).map(move |dx| (x + dx, y + dy)));
                let mut pixels = around.filter_map(|(x, y)| Some((u32::try_from(x).ok()?, u32::try_from(y).ok()?)));
                seen[camera][0] += 1;
                seen[camera][1] += usize::from(pixels.any(|(x, y)| mask.get(x, y)));
            }
        }
        seen
    };
    let found = parallel::map(frames.div_ceil(step), of_frame);
    let (mut faults, mut compared) = (Vec::new(), 0);
    for camera in 0..cameras {
        let [seen, hit] = [0, 1].map(|kind| found.iter().map(|frame| frame[camera][kind]).sum::<usize>());
        compared += seen;
        if seen >= LEAST_JOINTS && (hit as f64) < LEAST_SHARE * seen as f64 {
            let detail = format!(
                "only {hit} of {seen} visible joints are in the silhouettes of this camera: they belong to another camera, \
                 frame or axis"
            );
            faults.push(Fault::new(&cameras_file::observations_directory(camera), detail));
        }
    }
    Ok((format!("{compared} visible joints inside the body"), faults))
}

/// Whether a joint is inside a solid of one of its links, whatever the pose. A mesh is a surface and has no inside.
fn is_inside(actor: &Humanoid, joint: usize) -> bool {
    let place = &actor.joints[joint];
    let in_parent = Point3::from(place.parent_from_joint.translation.vector);
    [(place.parent, in_parent), (joint + 1, Point3::origin())].into_iter().any(|(link, origin)| {
        let ray = Ray { origin, direction: Vector3::x() };
        let contains = |solid: &Solid| !matches!(solid, Solid::Mesh { .. }) && solid.ray_entry(&ray) == Some(0.0);
        actor.links[link].solids.iter().any(contains)
    })
}
