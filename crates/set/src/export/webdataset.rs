//! WebDataset: tar shards with one sample per camera and frame. The files of a sample are consecutive, and their
//! headers depend only on their names and sizes.

use std::collections::BTreeMap;

use nalgebra::Point3;
use serde::Serialize;

use super::folder::{Folder, SetSilhouette};
use crate::format::{depth_png, exr_layers};
use crate::{BenchmarkSet, SetError};
use skiagraph_core::camera::Camera;
use skiagraph_core::observation::FoundKeypoint;
use skiagraph_truth::scene::TruthFrame;

const SAMPLES_PER_SHARD: usize = 1_000;

const README: &str = "\
NNNNNN.tar   shards of 1000 samples, in order of frames, then cameras; webdataset.WebDataset(\"{000000..NNNNNN}.tar\")

A sample FFFFFF_camCC has: mask.png (8-bit grey, 255 body), json (camera, K, R, t, distortion, frame, time_s, joints, markers:
world, metres; markers_2d: pixels, null where out of view; visible). Axes and pixels as OpenCV's, the world's Z up. Of a set with
keypoints, json has those of a 2D detector by name: column, row and confidence, or null. Where the set has truth images:
layers.exr (channels are named in the file), colour.exr (brightness of the scene), depth.png (millimetres, 16-bit grey, 0 without
geometry).";

/// Addition to the README for a set with images.
const IMAGES: &str = "
colour.png or colour.jpg is what the camera saw: 8 bits, RGB or grey.";

pub(super) fn write(set: &BenchmarkSet, folder: &Folder<'_>) -> Result<(), SetError> {
    let images = if set.blind.has_colour() { IMAGES } else { "" };
    folder.readme(&set.blind, &format!("{README}{images}"))?;
    let mut shard = TarShard::default();
    folder.for_each_picture(&set.blind, |picture| {
        shard.add(set, picture)?;
        if shard.samples.len() == SAMPLES_PER_SHARD { shard.store(folder) } else { Ok(()) }
    })?;
    if shard.samples.is_empty() { Ok(()) } else { shard.store(folder) }
}

#[derive(Default)]
struct TarShard {
    number: usize,
    samples: Vec<Vec<SampleFile>>,
}

type SampleFile = (String, Vec<u8>);

impl TarShard {
    fn add(&mut self, set: &BenchmarkSet, picture: &SetSilhouette) -> Result<(), SetError> {
        let (camera, frame) = (picture.camera, picture.frame);
        let rig = set.blind.rig_at(frame);
        let mut facts = SampleFacts::new(&rig.cameras[camera], &set.truth.ground_truth.frames[frame], camera, frame);
        facts.keypoints = set.blind.keypoints.as_ref().map(|found| {
            let points =
                found.frame(frame).views.swap_remove(camera).into_iter().map(|point| point.map(column_row_confidence));
            found.layout.keypoints().iter().map(|keypoint| keypoint.name()).zip(points).collect()
        });
        let json = serde_json::to_vec(&facts).map_err(|e| SetError::malformed("a sample", e.to_string()))?;
        let key = format!("{frame:06}_cam{camera:02}");
        let mut files = vec![(format!("{key}.json"), json), (format!("{key}.mask.png"), picture.png.clone())];
        if let Some(image) = picture.image(&set.blind)? {
            files.push((format!("{key}.colour.{}", image.extension), image.bytes));
        }
        let truth_images = [
            ("layers.exr", exr_layers::path(camera, frame)),
            ("colour.exr", exr_layers::colour_path(camera, frame)),
            ("depth.png", depth_png::path(camera, frame)),
        ];
        for (name, path) in truth_images {
            if set.blind.files().has(&path) {
                files.push((format!("{key}.{name}"), set.blind.file(&path)?));
            }
        }
        self.samples.push(files);
        Ok(())
    }

    fn store(&mut self, folder: &Folder<'_>) -> Result<(), SetError> {
        let name = format!("{:06}.tar", self.number);
        folder.create(&name, |file| {
            let mut shard = tar::Builder::new(file);
            for (name, bytes) in self.samples.iter().flatten() {
                let mut header = tar::Header::new_ustar();
                header.set_size(bytes.len() as u64);
                header.set_mode(0o644);
                header.set_mtime(0);
                shard.append_data(&mut header, name, bytes.as_slice())?;
            }
            shard.into_inner().map(|_| ())
        })?;
        self.samples.clear();
        self.number += 1;
        Ok(())
    }
}

fn column_row_confidence(point: FoundKeypoint) -> [f64; 3] {
    [point.pixel[0] - 0.5, point.pixel[1] - 0.5, point.confidence]
}

/// The JSON of a sample: OpenCV's camera, joints and markers in the world and in the image. A marker that the body
/// lacks is null; so are its pixels, also out of view.
#[derive(Serialize)]
pub(super) struct SampleFacts<'a> {
    camera: &'a str,
    frame: usize,
    time_s: f64,
    width: u32,
    height: u32,
    #[serde(rename = "K")]
    matrix: [[f64; 3]; 3],
    #[serde(rename = "R")]
    rotation: [[f64; 3]; 3],
    #[serde(rename = "t")]
    translation: [f64; 3],
    distortion: [f64; 5],
    joints: Vec<[f64; 3]>,
    markers: Vec<Option<[f64; 3]>>,
    markers_2d: Vec<Option<[f64; 2]>>,
    visible: &'a [bool],
    #[serde(skip_serializing_if = "Option::is_none")]
    keypoints: Option<BTreeMap<&'static str, Option<[f64; 3]>>>,
}

impl<'a> SampleFacts<'a> {
    /// Of the image of a camera and frame.
    pub(super) fn new(camera: &'a Camera, truth: &'a TruthFrame, camera_index: usize, frame: usize) -> Self {
        let pixel = |(marker, in_view): (&Option<Point3<f64>>, &bool)| {
            let pixel = marker.filter(|_| *in_view).and_then(|marker| camera.project(&marker));
            pixel.map(|pixel| [pixel.x - 0.5, pixel.y - 0.5])
        };
        let place = |point: &Point3<f64>| [point.x, point.y, point.z];
        Self {
            camera: &camera.name,
            frame,
            time_s: truth.time_s,
            width: camera.pinhole.width,
            height: camera.pinhole.height,
            matrix: camera.opencv_matrix(),
            rotation: camera.opencv_rotation(),
            translation: camera.opencv_translation(),
            distortion: camera.distortion.coefficients(),
            joints: truth.joint_positions.iter().map(place).collect(),
            markers: truth.markers.iter().map(|marker| marker.as_ref().map(place)).collect(),
            markers_2d: truth.markers.iter().zip(&truth.in_view[camera_index]).map(pixel).collect(),
            visible: &truth.visible[camera_index],
            keypoints: None,
        }
    }
}
