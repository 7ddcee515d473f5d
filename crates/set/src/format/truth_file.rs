//! `truth/truth.npz`: the exact truth, for T frames, n angles, L links, J = L - 1 joints, C cameras.
//!
//! | array | shape | meaning |
//! |---|---|---|
//! | `fps` | () | frames per second |
//! | `root` | (T, 7) | `world_from_root`: x y z, qw qx qy qz |
//! | `angles` | (T, n) | degrees of freedom, rad (m where prismatic) |
//! | `link_frames` | (T, L, 7) | `world_from_link` |
//! | `joints` | (T, J, 3) | position of every joint, m |
//! | `parents` | (L) | parent of every link, -1 for the root |
//! | `markers` | (T, 15, 3) | HumanEva's virtual markers, m; NaN if the body lacks one |
//! | `in_view`, `visible` | (T, C, 15) | marker inside the image; and not occluded by the body |
//! | `refitted_root`, `refitted_angles` | (T, 7), (T, m) | if known: the pose of the tracker's body nearest to the truth |
//!
//! `angle_names`, `link_names`, `joint_names`, `marker_names`, `camera_names`, `refitted_angle_names` name the columns.

use nalgebra::{DVector, Point3};

use super::manifest::check_rate;
use super::rigid;
use crate::SetError;
use skiagraph_core::body::{Humanoid, LANDMARKS, LinkFrames, Markers, Motion, Pose, Prop};
use skiagraph_core::camera::CameraRig;
use skiagraph_core::npz::{Array, Npz, Values};
use skiagraph_truth::scene::{GroundTruth, TruthFrame};

pub(crate) const PATH: &str = "truth/truth.npz";
/// A program in every set that reads the file using only NumPy.
pub(crate) const READER: &str = include_str!("read_truth.py");
pub(crate) const ACTOR_PATH: &str = "truth/actor.json";
const MARKERS: usize = LANDMARKS.len();

/// The arrays of the truth, with the refitted motion of the tracker's body if known.
pub(crate) fn to_npz(truth: &GroundTruth, refitted: Option<(&Humanoid, &Motion)>, rig: &CameraRig) -> Npz {
    let (actor, frames) = (&truth.actor, truth.frames.as_slice());
    let (count, links) = (frames.len(), actor.links.len());
    let link_frames = frames.iter().flat_map(|f| f.link_frames.0.iter().flat_map(rigid::to_row)).collect::<Vec<_>>();
    let joints = frames.iter().flat_map(|f| f.joint_positions.iter().flat_map(|p| [p.x, p.y, p.z])).collect::<Vec<_>>();
    let markers = frames.iter().flat_map(|f| marker_numbers(&f.markers)).collect::<Vec<_>>();
    let views = |pick: fn(&TruthFrame) -> &Vec<[bool; MARKERS]>| {
        let values: Vec<bool> = frames.iter().flat_map(|f| pick(f).as_flattened().iter().copied()).collect();
        Array::new(&[count, rig.cameras.len(), MARKERS], values)
    };
    let mut npz = Npz::from_iter([("fps", Array::new(&[], vec![truth.frames_per_second]))]);
    push_poses(&mut npz, "", &[count], actor, frames.iter().map(|f| &f.pose));
    npz.push("link_frames", Array::new(&[count, links, 7], link_frames));
    npz.push("link_names", Array::names(actor.links.iter().map(|l| l.name.as_str())));
    npz.push("joints", Array::new(&[count, links - 1, 3], joints));
    npz.push("joint_names", Array::names(actor.joints.iter().map(|j| j.name.as_str())));
    let parents = (0..links).map(|link| actor.parent(link).map_or(-1, |parent| parent as i64));
    npz.push("parents", Array::new(&[links], parents.collect::<Vec<_>>()));
    npz.push("markers", Array::new(&[count, MARKERS, 3], markers));
    npz.push("marker_names", Array::names(LANDMARKS.map(|l| l.name())));
    npz.push("in_view", views(|f| &f.in_view));
    npz.push("visible", views(|f| &f.visible));
    npz.push("camera_names", Array::names(rig.cameras.iter().map(|c| c.name.as_str())));
    if let Some((body, motion)) = refitted {
        push_poses(&mut npz, "refitted_", &[motion.poses.len()], body, motion.poses.iter());
    }
    npz
}

/// The texts of the array `name`; `None` if it is missing or has another type.
pub(crate) fn names<'a>(npz: &'a Npz, name: &str) -> Option<&'a [String]> {
    match npz.get(name).map(|array| &array.values) {
        Some(Values::Text(texts)) => Some(texts),
        _ => None,
    }
}

/// Reads the truth from its arrays, and the refitted motion if the file has one.
pub(crate) fn from_npz(
    npz: &Npz,
    actor: Humanoid,
    props: Vec<Prop>,
    cameras: usize,
) -> Result<(GroundTruth, Option<Motion>), SetError> {
    let links = actor.links.len();
    let fps = npz.f64s(PATH, "fps", &[])?[0];
    check_rate(fps).map_err(|e| SetError::malformed(PATH, format!("fps: {e}")))?;
    let poses = read_poses(npz, PATH, "", Some(actor.degrees_of_freedom.len()))?;
    let count = Some(poses.len());
    let link_frames = npz.f64s(PATH, "link_frames", &[count, Some(links), Some(7)])?;
    let joints = npz.f64s(PATH, "joints", &[count, Some(links - 1), Some(3)])?;
    let markers = npz.f64s(PATH, "markers", &[count, Some(MARKERS), Some(3)])?;
    let views = [count, Some(cameras), Some(MARKERS)];
    let (in_view, visible) = (npz.bools(PATH, "in_view", &views)?, npz.bools(PATH, "visible", &views)?);
    let frame_of = |frame: usize, pose: Pose| {
        let link_frames = block(link_frames, frame, links * 7).as_chunks().0.iter().map(rigid::from_row);
        let seen = |all: &[bool]| block(all, frame, cameras * MARKERS).as_chunks().0.to_vec();
        Ok(TruthFrame {
            time_s: frame as f64 / fps,
            pose,
            link_frames: LinkFrames(link_frames.collect::<Result<_, String>>()?),
            joint_positions: block(joints, frame, (links - 1) * 3)
                .as_chunks()
                .0
                .iter()
                .map(|p| Point3::from(*p))
                .collect(),
            markers: markers_of(block(markers, frame, MARKERS * 3)),
            in_view: seen(in_view),
            visible: seen(visible),
        })
    };
    let frames: Result<_, String> = poses.into_iter().enumerate().map(|(frame, pose)| frame_of(frame, pose)).collect();
    let frames = frames.map_err(|e| SetError::malformed(PATH, format!("link_frames: {e}")))?;
    let refitted = match npz.get("refitted_root") {
        Some(_) => Some(Motion { frames_per_second: fps, poses: read_poses(npz, PATH, "refitted_", None)? }),
        None => None,
    };
    let distractors = Vec::new();
    Ok((GroundTruth { actor, props, distractors, frames_per_second: fps, frames }, refitted))
}

/// Adds `{prefix}root`, `{prefix}angles` and `{prefix}angle_names`; the poses fill the axes `shape` in C order.
pub(crate) fn push_poses<'a>(
    npz: &mut Npz,
    prefix: &str,
    shape: &[usize],
    body: &Humanoid,
    poses: impl Iterator<Item = &'a Pose> + Clone,
) {
    let roots: Vec<f64> = poses.clone().flat_map(|p| rigid::to_row(&p.world_from_root)).collect();
    let angles: Vec<f64> = poses.flat_map(|p| p.joint_angles.iter().copied()).collect();
    let with = |last: usize| [shape, &[last]].concat();
    npz.push(&format!("{prefix}root"), Array::new(&with(7), roots));
    npz.push(&format!("{prefix}angles"), Array::new(&with(body.degrees_of_freedom.len()), angles));
    let names = body.degrees_of_freedom.iter().map(|d| d.name.as_str());
    npz.push(&format!("{prefix}angle_names"), Array::names(names));
}

/// The poses of `{prefix}root` (T, 7) and `{prefix}angles` (T, `degrees`).
pub(crate) fn read_poses(npz: &Npz, file: &str, prefix: &str, degrees: Option<usize>) -> Result<Vec<Pose>, SetError> {
    let (root, angles) = (format!("{prefix}root"), format!("{prefix}angles"));
    let roots = npz.f64s(file, &root, &[None, Some(7)])?.as_chunks::<7>().0;
    let angles = npz.f64s(file, &angles, &[Some(roots.len()), degrees])?;
    let degrees = angles.len().checked_div(roots.len()).unwrap_or(0);
    let pose = |(frame, row): (usize, &[f64; 7])| {
        let joint_angles = DVector::from_column_slice(block(angles, frame, degrees));
        rigid::from_row(row).map(|world_from_root| Pose { world_from_root, joint_angles })
    };
    let poses = roots.iter().enumerate().map(pose).collect::<Result<Vec<_>, String>>();
    poses.map_err(|e| SetError::malformed(file, format!("{root}: {e}")))
}

/// Row `index` of rows with this `length`.
fn block<T>(values: &[T], index: usize, length: usize) -> &[T] {
    &values[index * length..(index + 1) * length]
}

/// Coordinates of the markers, NaN for missing ones.
pub(crate) fn marker_numbers(markers: &Markers) -> Vec<f64> {
    markers.iter().flat_map(|marker| marker.map_or([f64::NAN; 3], Into::into)).collect()
}

fn markers_of(numbers: &[f64]) -> Markers {
    let mut markers = [None; MARKERS];
    for (marker, point) in markers.iter_mut().zip(numbers.as_chunks().0) {
        *marker = Some(Point3::from(*point)).filter(|p| p.iter().all(|x| x.is_finite()));
    }
    markers
}
