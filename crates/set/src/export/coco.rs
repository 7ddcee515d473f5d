//! COCO: instances (run lengths) and keypoints (HumanEva's markers) in one file.

use std::io::Write;

use serde_json::{Value, json};

use super::folder::Folder;
use super::rle;
use crate::{BenchmarkSet, SetError};
use skiagraph_core::body::LANDMARKS;

const README: &str = "\
annotations.json   images, annotations (segmentation as compressed run lengths, bbox, area, keypoints), one category
images/            the silhouettes, camNN_NNNNNN.png: camera and frame from 0

Keypoints are HumanEva's 15 markers, which lie inside the body; x, y are pixels, (0, 0) is the centre of the top-left pixel, as
in OpenCV. v: 0 not in the image (then x = y = 0), 1 hidden by the body or by something else, 2 visible. The 15 sigmas for OKS
are not COCO's 17: set COCOeval.params.kpt_oks_sigmas to an array of 15. An image without the body has no annotation.";

/// The line of the README about the images, and the one for a set with images of its own.
const SILHOUETTES: &str = "images/            the silhouettes, camNN_NNNNNN.png: camera and frame from 0";
const IMAGES: &str = "images/            what the cameras saw, camNN_NNNNNN.png or .jpg: camera and frame from 0";

/// Pairs of connected keypoints, from 1.
const SKELETON: [[usize; 2]; 14] = [
    [15, 1],
    [1, 2],
    [1, 3],
    [3, 4],
    [4, 5],
    [1, 6],
    [6, 7],
    [7, 8],
    [2, 9],
    [9, 10],
    [10, 11],
    [2, 12],
    [12, 13],
    [13, 14],
];

pub(super) fn write(set: &BenchmarkSet, folder: &Folder<'_>) -> Result<(), SetError> {
    let readme = if set.blind.has_colour() { README.replace(SILHOUETTES, IMAGES) } else { README.to_owned() };
    folder.readme(&set.blind, &readme)?;
    let (mut images, mut annotations) = (Vec::new(), Vec::new());
    let cameras = set.blind.rig.cameras.len();
    folder.for_each_picture(&set.blind, |picture| {
        let (camera, frame) = (picture.camera, picture.frame);
        let id = frame * cameras + camera + 1;
        let image = picture.image(&set.blind)?;
        let (extension, bytes) =
            image.as_ref().map_or(("png", &picture.png), |image| (image.extension.as_str(), &image.bytes));
        let file = format!("cam{camera:02}_{frame:06}.{extension}");
        folder.write(&format!("images/{file}"), bytes)?;
        let known = &set.blind.rig.cameras[camera];
        images.push(json!({
            "id": id, "file_name": file, "width": known.pinhole.width, "height": known.pinhole.height,
            "camera": known.name, "frame": frame, "time_s": set.truth.ground_truth.frames[frame].time_s,
        }));
        if picture.mask.is_empty() {
            return Ok(());
        }
        let bounds = picture.mask.bounds();
        let (keypoints, known_points) = keypoints(set, camera, frame);
        annotations.push(json!({
            "id": id, "image_id": id, "category_id": 1, "iscrowd": 0, "area": picture.mask.count(),
            "bbox": [bounds.left, bounds.top, bounds.right - bounds.left, bounds.bottom - bounds.top],
            "segmentation": { "size": [known.pinhole.height, known.pinhole.width], "counts": rle::encode(&picture.mask) },
            "keypoints": keypoints, "num_keypoints": known_points,
        }));
        Ok(())
    })?;
    let names: Vec<&str> = LANDMARKS.iter().map(|landmark| landmark.name()).collect();
    let whole = json!({
        "info": { "description": set.blind.name, "version": set.blind.set_hash, "contributor": "Skiagraph" },
        "licenses": [],
        "images": images,
        "annotations": annotations,
        "categories": [{
            "id": 1, "name": "person", "supercategory": "person", "keypoints": names, "skeleton": SKELETON,
        }],
    });
    folder.create("annotations.json", |file| {
        serde_json::to_writer(&mut *file, &whole)?;
        file.write_all(b"\n")
    })
}

/// x, y, v of every marker, and how many have v > 0.
fn keypoints(set: &BenchmarkSet, camera: usize, frame: usize) -> (Vec<Value>, usize) {
    let truth = &set.truth.ground_truth.frames[frame];
    let rig = set.blind.rig_at(frame);
    let of = |marker: usize| {
        let in_view = truth.in_view[camera][marker];
        let pixel = truth.markers[marker].filter(|_| in_view).and_then(|m| rig.cameras[camera].project(&m));
        pixel.map(|pixel| (pixel.x - 0.5, pixel.y - 0.5, if truth.visible[camera][marker] { 2 } else { 1 }))
    };
    let all: Vec<Option<(f64, f64, i32)>> = (0..LANDMARKS.len()).map(of).collect();
    let known = all.iter().flatten().count();
    let numbers = all.into_iter().flat_map(|point| match point {
        Some((x, y, v)) => [json!(x), json!(y), json!(v)],
        None => [json!(0), json!(0), json!(0)],
    });
    (numbers.collect(), known)
}
