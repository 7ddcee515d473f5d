//! OpenPose's JSON: one folder a camera, one file a frame.

use serde::Serialize;

use super::folder::{Folder, camera_files};
use super::keypoints::ExportedKeypoints;
use crate::{BlindSet, SetError};

const README: &str = "\
CAMERA_json/CAMERA_NNNNNNNNNNNN_keypoints.json   the keypoints of a camera's frame NNNNNNNNNNNN (from 0)
keypoints.txt                                    the names of the keypoints, in their order

people[0].pose_keypoints_2d has x, y and confidence of every keypoint. A missing one is 0, 0, 0; an image without
any has no people. x, y are pixels, (0, 0) is the centre of the top-left pixel, as in OpenCV.";

pub(super) fn write(set: &BlindSet, folder: &Folder<'_>) -> Result<(), SetError> {
    folder.readme(set, README)?;
    let keypoints = ExportedKeypoints::of(set, "openpose")?;
    folder.write("keypoints.txt", (keypoints.names().join("\n") + "\n").as_bytes())?;
    write_people(set, folder, &keypoints, "", &camera_files(set))
}

/// Writes the JSON files below the folder `place`, with these names of the cameras.
pub(super) fn write_people(
    set: &BlindSet,
    folder: &Folder<'_>,
    keypoints: &ExportedKeypoints,
    place: &str,
    cameras: &[String],
) -> Result<(), SetError> {
    folder.for_each_frame(set, |frame| {
        cameras.iter().zip(keypoints.in_images(frame)).try_for_each(|(name, found)| {
            let path = format!("{place}{name}_json/{name}_{frame:012}_keypoints.json");
            folder.create(&path, |file| Ok(serde_json::to_writer(file, &image(found))?))
        })
    })
}

#[derive(Serialize)]
struct OpenPoseImage {
    version: f32,
    people: Vec<OpenPosePerson>,
}

#[derive(Serialize)]
struct OpenPosePerson {
    person_id: [i32; 1],
    pose_keypoints_2d: Vec<f32>,
}

fn image(found: Vec<Option<[f32; 3]>>) -> OpenPoseImage {
    let is_seen = found.iter().any(Option::is_some);
    let pose_keypoints_2d = found.into_iter().flat_map(Option::unwrap_or_default).collect();
    let person = OpenPosePerson { person_id: [-1], pose_keypoints_2d };
    OpenPoseImage { version: 1.3, people: is_seen.then_some(person).into_iter().collect() }
}
