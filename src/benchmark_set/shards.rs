//! The samples of a set as WebDataset's tar shards below `truth/shards/`, for those who train on it.
//!
//! A shard holds frames that follow each other, all cameras of each. It is written as soon as its files are there, from
//! these files, by one thread: so its bytes depend on nothing else.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::ops::Range;
use std::path::Path;

use super::blind::silhouette_path;
use super::export::{ShardWriter, sample_facts, sample_key};
use super::file_content::FileContent;
use super::files::SHARDS;
use super::layer_drawing::layer_paths;
use super::set_writer::SetWriter;
use super::{Layer, SetError, SetParts};
use crate::input::HashingWriter;

const README: &str = "\
WebDataset shards. They repeat silhouettes and truth images of the set, and hold the truth: nothing for trackers.

NNNNNN.tar   samples in order of frames, then cameras; webdataset.WebDataset(\"truth/shards/{000000..NNNNNN}.tar\")

A sample FFFFFF_camCC is frame FFFFFF of camera CC, both from 0, and has
json         camera, K, R, t, distortion, width, height, frame, time_s, joints and markers (world, metres), markers_2d (pixels, null
             where out of view), visible; names and order as in truth/truth.npz, markers and axes as the set's README.txt has it
mask.png     what the camera saw: 8-bit grey, 255 body
layers.exr   truth images, where the set has them; their channels are named in the file
depth.png    depth in millimetres, 16-bit grey, 0 without geometry, where the set has depth
";

/// What [`README`] is called.
const README_PATH: &str = "truth/shards/README.txt";

/// Where a shard lies.
fn path(shard: usize) -> String {
    format!("{SHARDS}{shard:06}.tar")
}

/// The frames of one of `shards` shards: as many in each as can be.
fn frames_of(shard: usize, shards: usize, frames: usize) -> Range<usize> {
    shard * frames / shards..(shard + 1) * frames / shards
}

/// Frames that are drawn before others, so that what a shard repeats was just written.
pub(super) fn frame_ranges(shards: Option<usize>, frames: usize) -> Vec<Range<usize>> {
    let shards = shards.unwrap_or(1);
    (0..shards).map(|shard| frames_of(shard, shards, frames)).collect()
}

/// An error where there are more shards than frames.
pub(super) fn check(shards: Option<usize>, frames: usize) -> Result<(), SetError> {
    match shards {
        Some(count) if !(1..=frames).contains(&count) => {
            let detail = format!("expected 1 to {frames} shards, for a shard has at least one frame; found {count}");
            Err(SetError::malformed("--shards", detail))
        }
        _ => Ok(()),
    }
}

/// Says what shards are.
pub(super) fn write_readme(writer: &SetWriter<'_>) -> Result<(), SetError> {
    writer.put_same(README_PATH, &FileContent::Bytes(README.as_bytes().to_vec()))
}

/// Writes a shard of the files of `frames` in `folder`, unless it is there.
pub(super) fn write(
    writer: &SetWriter<'_>,
    folder: &Path,
    parts: &SetParts<'_>,
    layers: &[Layer],
    (shard, frames): (usize, Range<usize>),
) -> Result<(), SetError> {
    if writer.has(&path(shard)) {
        return Ok(());
    }
    let stopped = std::cell::Cell::new(false);
    let written = writer.create(&path(shard), |file| {
        let mut shard = ShardWriter::new(HashingWriter::new(BufWriter::new(file)));
        for frame in frames {
            for camera in 0..parts.rig.cameras.len() {
                if writer.unless_stopped().is_err() {
                    stopped.set(true);
                    return Err(io::Error::other("stopped"));
                }
                add_sample(&mut shard, folder, parts, layers, camera, frame)?;
            }
        }
        let (mut file, digest) = shard.finish()?.finish();
        file.flush()?;
        Ok(digest)
    });
    if stopped.get() { Err(SetError::Stopped) } else { written }
}

fn add_sample<W: Write>(
    shard: &mut ShardWriter<W>,
    folder: &Path,
    parts: &SetParts<'_>,
    layers: &[Layer],
    camera: usize,
    frame: usize,
) -> io::Result<()> {
    if !parts.has_image(camera, frame) {
        return Ok(());
    }
    let key = sample_key(camera, frame);
    let truth = &parts.ground_truth.frames[frame];
    let moved = parts.observed.filming.map(|filming| filming.camera_at(camera, truth.time_s));
    let seen_by = moved.as_ref().unwrap_or(&parts.rig.cameras[camera]);
    let said = sample_facts(seen_by, truth, camera, frame).to_string();
    shard.add(&key, "json", said.as_bytes(), said.len() as u64)?;
    let mut repeat = |extension: &str, path: &str| {
        let file = File::open(folder.join(path))?;
        let size = file.metadata()?.len();
        shard.add(&key, extension, file, size)
    };
    repeat("mask.png", &silhouette_path(camera, frame))?;
    for path in layer_paths(camera, frame, layers) {
        repeat(if path.ends_with(".png") { "depth.png" } else { "layers.exr" }, &path)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_frame_is_in_one_shard_and_no_shard_is_empty() {
        for (frames, shards) in [(1, 1), (7, 3), (529, 8), (9, 9), (10_000, 7)] {
            let ranges = frame_ranges(Some(shards), frames);
            assert_eq!(ranges.iter().cloned().flatten().collect::<Vec<_>>(), (0..frames).collect::<Vec<_>>());
            let sizes = || ranges.iter().map(ExactSizeIterator::len);
            assert!(sizes().max() <= sizes().min().map(|least| least + 1) && sizes().min() > Some(0));
        }
        assert!(check(Some(8), 8).is_ok() && check(None, 1).is_ok());
        for refused in [0, 9] {
            let error = check(Some(refused), 8).unwrap_err().to_string();
            assert!(error.starts_with("--shards: expected 1 to 8 shards"), "{error}");
        }
    }
}
