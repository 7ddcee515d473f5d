//! WebDataset: tar shards of samples, one sample a camera and frame.

use std::io::{Read, Write};

use serde_json::{Value, json};

use super::folder::{Folder, SetSilhouette};
use crate::benchmark_set::{BenchmarkSet, SetError};

/// Samples in a shard.
const SAMPLES_A_SHARD: usize = 1_000;

const README: &str = "\
NNNNNN.tar   shards of 1000 samples, in order of frames, then cameras; webdataset.WebDataset(\"{000000..NNNNNN}.tar\")

A sample FFFFFF_camCC has: mask.png (8-bit grey, 255 body), json (camera, K, R, t, distortion, frame, time_s, joints, markers:
world, metres; markers_2d: pixels, null where out of view; visible). Axes and pixels as OpenCV's, the world's Z up.";

pub(super) fn write(set: &BenchmarkSet, folder: &Folder<'_>) -> Result<(), SetError> {
    folder.readme(set, "WebDataset shards", README)?;
    let mut shard = TarShard::default();
    folder.for_each_picture(set, |picture| {
        shard.add(set, picture);
        if shard.samples == SAMPLES_A_SHARD { shard.store(folder) } else { Ok(()) }
    })?;
    if shard.samples > 0 { shard.store(folder) } else { Ok(()) }
}

/// The shard that is being filled.
#[derive(Default)]
struct TarShard {
    number: usize,
    samples: usize,
    files: Vec<(String, Vec<u8>)>,
}

impl TarShard {
    fn add(&mut self, set: &BenchmarkSet, picture: &SetSilhouette) {
        let key = format!("{:06}_cam{:02}", picture.frame, picture.camera);
        self.files.push((format!("{key}.json"), sample(set, picture).to_string().into_bytes()));
        self.files.push((format!("{key}.mask.png"), picture.png.clone()));
        self.samples += 1;
    }

    fn store(&mut self, folder: &Folder<'_>) -> Result<(), SetError> {
        let name = format!("{:06}.tar", self.number);
        folder.create(&name, |file| {
            let mut archive = tar::Builder::new(file);
            self.files.iter().try_for_each(|(name, bytes)| push(&mut archive, name, bytes.as_slice(), bytes.len()))?;
            archive.into_inner().map(|_| ())
        })?;
        self.files.clear();
        (self.number, self.samples) = (self.number + 1, 0);
        Ok(())
    }
}

/// Adds a file whose header depends on its name and size alone.
fn push<W: Write>(archive: &mut tar::Builder<W>, name: &str, bytes: impl Read, size: usize) -> std::io::Result<()> {
    let mut header = tar::Header::new_ustar();
    header.set_size(size as u64);
    header.set_mode(0o644);
    header.set_mtime(0);
    archive.append_data(&mut header, name, bytes)
}

fn sample(set: &BenchmarkSet, picture: &SetSilhouette) -> Value {
    let camera = &set.blind.rig.cameras[picture.camera];
    let frame = &set.truth.ground_truth.frames[picture.frame];
    let place = |point: &nalgebra::Point3<f64>| json!([point.x, point.y, point.z]);
    let in_view = &frame.in_view[picture.camera];
    let pixels: Vec<Value> = frame
        .markers
        .iter()
        .zip(in_view)
        .map(|(marker, in_view)| {
            let pixel = marker.filter(|_| *in_view).and_then(|marker| camera.project(&marker));
            pixel.map_or(Value::Null, |pixel| json!([pixel.x - 0.5, pixel.y - 0.5]))
        })
        .collect();
    json!({
        "camera": camera.name, "frame": picture.frame, "time_s": frame.time_s,
        "width": camera.pinhole.width, "height": camera.pinhole.height,
        "K": camera.opencv_matrix(), "R": camera.opencv_rotation(), "t": camera.opencv_translation(),
        "distortion": camera.distortion.coefficients(),
        "joints": frame.joint_positions.iter().map(place).collect::<Vec<_>>(),
        "markers": frame.markers.iter().map(|m| m.as_ref().map_or(Value::Null, place)).collect::<Vec<_>>(),
        "markers_2d": pixels,
        "visible": frame.visible[picture.camera],
    })
}
