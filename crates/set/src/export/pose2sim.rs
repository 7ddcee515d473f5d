//! A project of Pose2Sim that triangulates and filters as it is.

use super::camera_toml;
use super::folder::Folder;
use super::keypoints::ExportedKeypoints;
use super::openpose::write_people;
use crate::{BlindSet, SetError};
use skiagraph_core::camera::{Camera, Distortion};

const README: &str = "\
calibration/Calib.toml    the cameras that trackers are given, metres; x_camera = R x_world + t, the world's Z up. Without their
                          lenses, which are already taken out of the keypoints
pose/camNN_json/          the keypoints as OpenPose's JSON; camera NN of Calib.toml, frames from 0; pixels as in OpenCV, of
                          an image without the lens, so they may be outside of it
Config.toml               Pose2Sim's defaults, with the set's rate and keypoint layout, and without windows

In this folder: python -c \"from Pose2Sim import Pose2Sim; Pose2Sim.triangulation(); Pose2Sim.filtering()\"
Then measure pose-3d/*.trc: skiagraph evaluate SET FILE.trc --from pose2sim. Pose2Sim exchanges the axes: its x, y, z are
the set's y, z, x. Its filter leaves out the last frame, which then counts as lost; its C3D files have whole millimetres,
cut off.";

pub(super) fn write(set: &BlindSet, folder: &Folder<'_>) -> Result<(), SetError> {
    folder.readme(set, README)?;
    let cameras = &set.rig.cameras;
    // Pose2Sim's own undistortion leaves a pixel or more, and then rejects points that are right
    let keypoints = ExportedKeypoints::of(set, "pose2sim")?.undistorted(cameras);
    let ideal = cameras.iter().map(|camera| Camera { distortion: Distortion::default(), ..camera.clone() });
    let names: Vec<String> = (0..cameras.len()).map(|camera| format!("cam{camera:02}")).collect();
    folder.write("calibration/Calib.toml", camera_toml::text(&ideal.collect::<Vec<_>>(), &names).as_bytes())?;
    folder.write("Config.toml", config(set, keypoints.model()).as_bytes())?;
    write_people(set, folder, &keypoints, "pose/", &names)
}

fn config(set: &BlindSet, model: &str) -> String {
    let rate = set.frames_per_second;
    format!(
        "[project]\n\
         multi_person = false\n\
         frame_rate = {rate}\n\
         frame_range = 'all'\n\
         \n\
         [pose]\n\
         pose_model = '{model}'\n\
         \n\
         [triangulation]\n\
         # triangulation reads it here, although Pose2Sim's own Config.toml has it under [pose]\n\
         undistort_points = false\n\
         reproj_error_threshold_triangulation = 15\n\
         likelihood_threshold_triangulation = 0.3\n\
         min_cameras_for_triangulation = 2\n\
         interpolation = 'linear'\n\
         interp_if_gap_smaller_than = 20\n\
         sections_to_keep = 'all'\n\
         fill_large_gaps_with = 'last_value'\n\
         \n\
         [filtering]\n\
         reject_outliers = true\n\
         filter = true\n\
         type = 'butterworth'\n\
         display_figures = false\n\
         save_filt_plots = false\n\
         \n\
         [filtering.butterworth]\n\
         cut_off_frequency = 6\n\
         order = 4\n"
    )
}
