//! WebDataset: tar shards with one sample per camera and frame.

use super::folder::{Folder, SetSilhouette};
use crate::samples::{ShardWriter, facts, key};
use crate::{BenchmarkSet, SetError};

/// Samples per shard.
const SAMPLES_PER_SHARD: usize = 1_000;

const README: &str = "\
NNNNNN.tar   shards of 1000 samples, in order of frames, then cameras; webdataset.WebDataset(\"{000000..NNNNNN}.tar\")

A sample FFFFFF_camCC has: mask.png (8-bit grey, 255 body), json (camera, K, R, t, distortion, frame, time_s, joints, markers:
world, metres; markers_2d: pixels, null where out of view; visible). Axes and pixels as OpenCV's, the world's Z up.";

pub(super) fn write(set: &BenchmarkSet, folder: &Folder<'_>) -> Result<(), SetError> {
    folder.readme(set, "WebDataset shards", README)?;
    let mut shard = TarShard::default();
    folder.for_each_picture(set, |picture| {
        shard.add(set, picture);
        if shard.samples.len() == SAMPLES_PER_SHARD { shard.store(folder) } else { Ok(()) }
    })?;
    if shard.samples.is_empty() { Ok(()) } else { shard.store(folder) }
}

/// The current shard.
#[derive(Default)]
struct TarShard {
    number: usize,
    /// Key, JSON and PNG of every sample.
    samples: Vec<(String, Vec<u8>, Vec<u8>)>,
}

impl TarShard {
    fn add(&mut self, set: &BenchmarkSet, picture: &SetSilhouette) {
        let (camera, frame) = (picture.camera, picture.frame);
        let facts =
            facts(&set.blind.rig_at(frame).cameras[camera], &set.truth.ground_truth.frames[frame], camera, frame);
        self.samples.push((key(camera, frame), facts.to_string().into_bytes(), picture.png.clone()));
    }

    fn store(&mut self, folder: &Folder<'_>) -> Result<(), SetError> {
        let name = format!("{:06}.tar", self.number);
        folder.create(&name, |file| {
            let mut shard = ShardWriter::new(file);
            for (key, json, png) in &self.samples {
                shard.add(&format!("{key}.json"), json.as_slice(), json.len() as u64)?;
                shard.add(&format!("{key}.mask.png"), png.as_slice(), png.len() as u64)?;
            }
            shard.finish().map(|_| ())
        })?;
        self.samples.clear();
        self.number += 1;
        Ok(())
    }
}
