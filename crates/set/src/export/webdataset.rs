//! WebDataset: tar shards with one sample per camera and frame.

use super::folder::{Folder, SetSilhouette};
use crate::samples::{SampleFacts, ShardWriter, key};
use crate::{BenchmarkSet, SetError};

/// Samples per shard.
const SAMPLES_PER_SHARD: usize = 1_000;

const README: &str = "\
NNNNNN.tar   shards of 1000 samples, in order of frames, then cameras; webdataset.WebDataset(\"{000000..NNNNNN}.tar\")

A sample FFFFFF_camCC has: mask.png (8-bit grey, 255 body), json (camera, K, R, t, distortion, frame, time_s, joints, markers:
world, metres; markers_2d: pixels, null where out of view; visible). Axes and pixels as OpenCV's, the world's Z up.";

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

/// The current shard.
#[derive(Default)]
struct TarShard {
    number: usize,
    /// Key of every sample, and its files.
    samples: Vec<(String, Vec<SampleFile>)>,
}

/// The name of a file of a sample, after the sample's key, and its bytes.
type SampleFile = (String, Vec<u8>);

impl TarShard {
    fn add(&mut self, set: &BenchmarkSet, picture: &SetSilhouette) -> Result<(), SetError> {
        let (camera, frame) = (picture.camera, picture.frame);
        let rig = set.blind.rig_at(frame);
        let facts = SampleFacts::new(&rig.cameras[camera], &set.truth.ground_truth.frames[frame], camera, frame);
        let json = serde_json::to_vec(&facts).map_err(|e| SetError::malformed("a sample", e.to_string()))?;
        let mut files = vec![("json".to_owned(), json)];
        files.push(("mask.png".to_owned(), picture.png.clone()));
        files.extend(picture.image(&set.blind)?.map(|image| (format!("colour.{}", image.extension), image.bytes)));
        self.samples.push((key(camera, frame), files));
        Ok(())
    }

    fn store(&mut self, folder: &Folder<'_>) -> Result<(), SetError> {
        let name = format!("{:06}.tar", self.number);
        folder.create(&name, |file| {
            let mut shard = ShardWriter::new(file);
            for (key, files) in &self.samples {
                for (name, bytes) in files {
                    shard.add(&format!("{key}.{name}"), bytes.as_slice(), bytes.len() as u64)?;
                }
            }
            shard.finish().map(|_| ())
        })?;
        self.samples.clear();
        self.number += 1;
        Ok(())
    }
}
