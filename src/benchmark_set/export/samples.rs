//! Samples of a tar shard as WebDataset reads them: files of one key follow each other.

use std::io::{Read, Write};

use serde_json::{Value, json};

use crate::camera::Camera;
use crate::scene::TruthFrame;

/// A shard on its way to `to`.
pub(in crate::benchmark_set) struct ShardWriter<W: Write>(tar::Builder<W>);

impl<W: Write> ShardWriter<W> {
    pub(in crate::benchmark_set) fn new(to: W) -> Self {
        Self(tar::Builder::new(to))
    }

    /// Adds a file of the sample `key`; its header depends on its name and size alone.
    pub(in crate::benchmark_set) fn add(
        &mut self,
        key: &str,
        extension: &str,
        bytes: impl Read,
        size: u64,
    ) -> std::io::Result<()> {
        let mut header = tar::Header::new_ustar();
        header.set_size(size);
        header.set_mode(0o644);
        header.set_mtime(0);
        self.0.append_data(&mut header, format!("{key}.{extension}"), bytes)
    }

    /// The end of the shard.
    pub(in crate::benchmark_set) fn finish(self) -> std::io::Result<W> {
        self.0.into_inner()
    }
}

/// By which the files of a sample are known.
pub(in crate::benchmark_set) fn key(camera: usize, frame: usize) -> String {
    format!("{frame:06}_cam{camera:02}")
}

/// What a sample says of a camera and frame: OpenCV's camera, joints and markers in the world and in the image.
pub(in crate::benchmark_set) fn facts(
    camera: &Camera,
    truth: &TruthFrame,
    camera_index: usize,
    frame_index: usize,
) -> Value {
    let place = |point: &nalgebra::Point3<f64>| json!([point.x, point.y, point.z]);
    let in_view = &truth.in_view[camera_index];
    let pixels: Vec<Value> = truth
        .markers
        .iter()
        .zip(in_view)
        .map(|(marker, in_view)| {
            let pixel = marker.filter(|_| *in_view).and_then(|marker| camera.project(&marker));
            pixel.map_or(Value::Null, |pixel| json!([pixel.x - 0.5, pixel.y - 0.5]))
        })
        .collect();
    json!({
        "camera": camera.name, "frame": frame_index, "time_s": truth.time_s,
        "width": camera.pinhole.width, "height": camera.pinhole.height,
        "K": camera.opencv_matrix(), "R": camera.opencv_rotation(), "t": camera.opencv_translation(),
        "distortion": camera.distortion.coefficients(),
        "joints": truth.joint_positions.iter().map(place).collect::<Vec<_>>(),
        "markers": truth.markers.iter().map(|m| m.as_ref().map_or(Value::Null, place)).collect::<Vec<_>>(),
        "markers_2d": pixels,
        "visible": truth.visible[camera_index],
    })
}
