//! Cameras and keypoints for anipose and aniposelib.

use super::camera_toml;
use super::folder::{Folder, camera_files};
use super::keypoints::ExportedKeypoints;
use crate::{BlindSet, SetError};
use skiagraph_core::npz::{Array, Npz};

const README: &str = "\
calibration.toml   the cameras that trackers are given, metres, for CameraGroup.load; x_camera = R x_world + t, the
                   world's Z up
points.npz         points (C cameras, T frames, K keypoints, 2), NaN if missing; scores (C, T, K); names (K); fps. Pixels
                   as in OpenCV: (0, 0) is the centre of the top-left pixel

    import numpy as np
    from aniposelib.cameras import CameraGroup
    rig, data = CameraGroup.load(\"calibration.toml\"), np.load(\"points.npz\")
    C, T, K, _ = data[\"points\"].shape
    found = rig.triangulate(data[\"points\"].reshape(C, -1, 2)).reshape(T, K, 3)
    np.savez(\"found.npz\", fps=data[\"fps\"], estimate_markers=found, marker_names=data[\"names\"])

Instead of triangulate, rig.triangulate_optim(data[\"points\"]) also smooths. Then measure found.npz, or anipose's CSV:
skiagraph evaluate SET FILE --from anipose.";

pub(super) fn write(set: &BlindSet, folder: &Folder<'_>) -> Result<(), SetError> {
    folder.readme(set, README)?;
    let keypoints = ExportedKeypoints::of(set, "anipose")?;
    folder.write("calibration.toml", camera_toml::text(&set.rig.cameras, &camera_files(set)).as_bytes())?;
    let (frames, cameras, count) = (set.frame_count, set.rig.cameras.len(), keypoints.names().len());
    let images: Vec<_> = (0..frames).map(|frame| keypoints.in_images(frame)).collect();
    let points = (0..cameras).flat_map(|camera| images.iter().flat_map(move |views| &views[camera]));
    let points: Vec<[f32; 3]> = points.map(|point| point.unwrap_or([f32::NAN, f32::NAN, 0.0])).collect();
    let places: Vec<f32> = points.iter().flat_map(|[x, y, _]| [*x, *y]).collect();
    let scores: Vec<f32> = points.iter().map(|[.., score]| *score).collect();
    let npz = Npz::from_iter([
        ("fps", Array::new(&[], vec![set.frames_per_second])),
        ("points", Array::new(&[cameras, frames, count, 2], places)),
        ("scores", Array::new(&[cameras, frames, count], scores)),
        ("names", Array::names(keypoints.names())),
    ]);
    folder.write("points.npz", &npz.to_bytes("points.npz")?)
}
