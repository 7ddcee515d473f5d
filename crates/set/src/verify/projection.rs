//! The truth through the exported camera files, as anybody with OpenCV's formula sees it.

use nalgebra::Point3;

use super::cameras::{ListedCamera, plain};
use super::parts::ReadParts;
use super::{Fault, Outcome};
use crate::blind::silhouette_path;
use crate::body::LANDMARKS;
use crate::camera::Camera;
use crate::files::SetFiles;
use crate::npz::Npz;
use crate::raster::Mask;
use crate::scene::{GroundTruth, TruthFrame};
use crate::{cameras_file, silhouette_png, truth_file};

/// How far the formula may be from this program's own projection, pixels.
pub(super) const TOLERANCE_PX: f64 = 1e-6;

/// Markers lie inside the body or on it: this share of those that a camera sees must lie in its silhouettes, give or
/// take [`REACH_PX`].
pub(super) const LEAST_SHARE: f64 = 0.85;
const REACH_PX: i64 = 2;

/// Pixels of joints and markers.
pub(super) const VIEWS: &str = "truth/views.npz";

/// Fewer markers than this prove nothing.
pub(super) const LEAST_MARKERS: usize = 10;

/// How many frames' silhouettes are looked into.
pub(super) const SAMPLED_FRAMES: usize = 200;

pub(super) fn check(files: &SetFiles, parts: &ReadParts) -> Outcome {
    let (truth, rig) = parts.scene()?;
    if let Some(why) = parts.spoiled() {
        return Ok((why, Vec::new()));
    }
    let cameras = plain(files)?;
    let mut faults = Vec::new();
    let mut markers = 0;
    for (index, (plain, camera)) in cameras.iter().zip(&rig.cameras).enumerate() {
        faults.extend(disagreement(plain, camera, truth));
        let (seen, inside) = in_silhouettes(files, truth, plain, camera, index);
        markers += seen;
        if seen >= LEAST_MARKERS && (inside as f64) < LEAST_SHARE * seen as f64 {
            let name = &plain.name;
            faults.push(Fault::new(cameras_file::PATH, format!(
                "camera {name:?}: only {inside} of {seen} visible markers lie in its silhouettes when they are projected \
                by K, R, t and distortion: these numbers, the markers or the silhouettes belong to another camera, axis \
                or unit"
            )));
        }
        faults.extend(wrong_views(plain, truth, index));
    }
    faults.extend(wrong_pixels(files, &cameras, truth));
    Ok((format!("{} cameras, {markers} visible markers", cameras.len()), faults))
}

fn disagreement(plain: &ListedCamera, camera: &Camera, truth: &GroundTruth) -> Option<Fault> {
    let mut worst: f64 = 0.0;
    for marker in truth.frames.iter().flat_map(|frame| frame.markers.iter().flatten()) {
        let Some(own) = camera.project(marker) else { continue };
        let ([u, v], _) = plain.project(&marker.coords);
        worst = worst.max((own.x - 0.5 - u).abs().max((own.y - 0.5 - v).abs()));
    }
    let name = &plain.name;
    (worst > TOLERANCE_PX || worst.is_nan()).then(|| {
        let detail = format!("camera {name:?}: OpenCV's formula and camera_from_world differ by {worst:.2e} pixels");
        Fault::new(cameras_file::PATH, detail)
    })
}

/// Visible markers in sampled frames, and how many of them lie in the silhouette.
fn in_silhouettes(
    files: &SetFiles,
    truth: &GroundTruth,
    plain: &ListedCamera,
    camera: &Camera,
    index: usize,
) -> (usize, usize) {
    let (mut seen, mut inside) = (0, 0);
    let step = truth.frames.len().div_ceil(SAMPLED_FRAMES).max(1);
    for (number, frame) in truth.frames.iter().enumerate().step_by(step) {
        let path = silhouette_path(index, number);
        let bytes = files.read(&path).ok();
        let (width, height) = (camera.pinhole.width, camera.pinhole.height);
        let mask = bytes.and_then(|bytes| silhouette_png::decode(&path, &bytes, width, height).ok());
        let Some(mask) = mask else { continue };
        let markers = frame.markers.iter().zip(&frame.visible[index]).filter(|(_, visible)| **visible);
        for marker in markers.filter_map(|(marker, _)| *marker) {
            seen += 1;
            inside += usize::from(is_near(&mask, plain.project(&marker.coords).0));
        }
    }
    (seen, inside)
}

/// Whether a pixel of the mask is set at most [`REACH_PX`] from a place, whose pixel centres are at integers.
pub(super) fn is_near(mask: &Mask, [u, v]: [f64; 2]) -> bool {
    if !(u.is_finite() && v.is_finite()) {
        return false;
    }
    let (x, y) = (u.round() as i64, v.round() as i64);
    let around = (-REACH_PX..=REACH_PX).flat_map(|dy| (-REACH_PX..=REACH_PX).map(move |dx| (x + dx, y + dy)));
    around.filter_map(|(x, y)| Some((u32::try_from(x).ok()?, u32::try_from(y).ok()?))).any(|(x, y)| mask.get(x, y))
}

/// Points of a frame.
type PointsOf = fn(&TruthFrame) -> Vec<Option<Point3<f64>>>;

/// `joints_2d` and `markers_2d` against the formula, where the set has them.
fn wrong_pixels(files: &SetFiles, cameras: &[ListedCamera], truth: &GroundTruth) -> Vec<Fault> {
    let npz = files.read(VIEWS).ok().and_then(|bytes| Npz::from_bytes(VIEWS, &bytes).ok());
    let Some(npz) = npz else { return Vec::new() };
    let joints: PointsOf = |f| f.joint_positions.iter().copied().map(Some).collect();
    let markers: PointsOf = |f| f.markers.to_vec();
    let wrong = |(array, points): (&str, PointsOf)| {
        npz.get(array)?;
        let count = truth.frames.first().map_or(0, |frame| points(frame).len());
        let shape = [Some(truth.frames.len()), Some(cameras.len()), Some(count), Some(2)];
        let found = match npz.f64s(VIEWS, array, &shape) {
            Ok(found) => found.as_chunks::<2>().0,
            Err(error) => return Some(Fault::new(VIEWS, error.detail)),
        };
        let expected = truth.frames.iter().flat_map(|frame| {
            let places = points(frame);
            cameras.iter().flat_map(move |camera| places.clone().into_iter().map(move |place| pixel(camera, place)))
        });
        let wrong = found.iter().zip(expected).filter(|(found, expected)| match expected {
            Some([u, v]) => {
                let off = (found[0] - u).abs().max((found[1] - v).abs());
                off.is_nan() || off > TOLERANCE_PX * u.abs().max(v.abs()).max(1.0)
            }
            None => !found.iter().all(|x| x.is_nan()),
        });
        let wrong = wrong.count();
        (wrong > 0).then(|| {
            let all = found.len();
            Fault::new(VIEWS, format!("{array}: {wrong} of {all} pixels are not what OpenCV's formula gives"))
        })
    };
    [("joints_2d", joints), ("markers_2d", markers)].into_iter().filter_map(wrong).collect()
}

/// Where a camera sees a place; `None` before its near plane.
fn pixel(camera: &ListedCamera, place: Option<Point3<f64>>) -> Option<[f64; 2]> {
    let (pixel, depth) = camera.project(&place?.coords);
    (depth >= camera.near).then_some(pixel)
}

/// `in_view` against the formula.
fn wrong_views(plain: &ListedCamera, truth: &GroundTruth, index: usize) -> Option<Fault> {
    let [width, height] = plain.size;
    let mut wrong = Vec::new();
    for (number, frame) in truth.frames.iter().enumerate() {
        for (marker, place) in frame.markers.iter().enumerate() {
            let Some(place) = place else { continue };
            let ([u, v], depth) = plain.project(&place.coords);
            // the image reaches from -0.5 to its size less 0.5
            let margin = [u + 0.5, width - 0.5 - u, v + 0.5, height - 0.5 - v, depth - plain.near];
            let margin = margin.into_iter().fold(f64::INFINITY, f64::min);
            if (margin >= 0.0) != frame.in_view[index][marker] && margin.abs() > TOLERANCE_PX {
                wrong.push((number, marker));
            }
        }
    }
    let (frame, marker) = *wrong.first()?;
    let (name, count, marker) = (&plain.name, wrong.len(), LANDMARKS[marker].name());
    let detail = format!(
        "in_view: {count} flags of camera {name:?} are not what OpenCV's formula gives, first {marker} in frame {frame}"
    );
    Some(Fault::new(truth_file::PATH, detail))
}
