//! Cameras and keypoints for Caliscope's scripts.

use std::io::Write as _;

use super::camera_toml;
use super::folder::{Folder, camera_files};
use super::keypoints::ExportedKeypoints;
use crate::{BlindSet, SetError};

const README: &str = "\
camera_array.toml   the cameras that trackers are given, metres, for CameraArray.from_toml; x_camera = R x_world + t,
                    the world's Z up
image_points.csv    the keypoints that are found, for ImagePoints.from_csv: sync_index is the frame from 0, keypoint_id
                    the line of keypoints.txt from 0. Pixels as in OpenCV: (0, 0) is the centre of the top-left pixel
keypoints.txt       the names of the keypoints

    import numpy as np
    from caliscope.api import CameraArray, ImagePoints
    cameras, points = CameraArray.from_toml(\"camera_array.toml\"), ImagePoints.from_csv(\"image_points.csv\")
    found, names = points.triangulate(cameras).df, open(\"keypoints.txt\").read().split()
    markers = np.full((FRAMES, len(names), 3), np.nan)
    markers[found.sync_index, found.keypoint_id] = found[[\"x_coord\", \"y_coord\", \"z_coord\"]]
    np.savez(\"found.npz\", fps=RATE, estimate_markers=markers, marker_names=names)

Then measure it: skiagraph evaluate SET found.npz --from anipose, which has the same axes and names.";

pub(super) fn write(set: &BlindSet, folder: &Folder<'_>) -> Result<(), SetError> {
    let (frames, rate) = (set.frame_count, set.frames_per_second);
    let words = README.replace("FRAMES", &frames.to_string()).replace("RATE", &format!("{rate:?}"));
    folder.readme(set, &words)?;
    let keypoints = ExportedKeypoints::of(set, "caliscope")?;
    folder.write("keypoints.txt", (keypoints.names().join("\n") + "\n").as_bytes())?;
    folder.write("camera_array.toml", camera_toml::numbered(&set.rig.cameras, &camera_files(set)).as_bytes())?;
    folder.create("image_points.csv", |file| {
        writeln!(file, "sync_index,cam_id,object_id,keypoint_id,img_loc_x,img_loc_y,frame_time,confidence")?;
        for frame in 0..frames {
            let time_s = frame as f64 / rate;
            for (camera, points) in keypoints.in_images(frame).into_iter().enumerate() {
                for (point, [x, y, confidence]) in points.into_iter().enumerate().filter_map(|(k, p)| Some((k, p?))) {
                    writeln!(file, "{frame},{camera},0,{point},{x:?},{y:?},{time_s:?},{confidence:?}")?;
                }
            }
        }
        Ok(())
    })
}
