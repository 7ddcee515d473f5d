//! Checks the files in tar shards, their order, and the data of samples.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;

use serde_json::Value;

use super::parts::ReadParts;
use super::{CheckOutcome, Fault, VerifyOptions, with_skipped};
use crate::blind::silhouette_path;
use crate::camera::CameraRig;
use crate::files::SetFiles;
use crate::input::{hex_sha256, limits};
use crate::parallel;
use crate::samples::{self, SampleFacts, TarPlaces, tar_end, tar_header, tar_places};
use crate::scene::GroundTruth;
use crate::shard_plan::{OBSERVED, ShardPlan, WITH_TRUTH, tar_path};
use crate::{depth_png, exr_layers};

/// Tolerance of the numbers of a sample, relative to the number or 1: the numbers of cameras are rounded once.
const TOLERANCE: f64 = 1e-9;

/// Greatest number of faults reported for one shard.
const MOST_FAULTS: usize = 20;

/// Block size of tar files, bytes.
const BLOCK: u64 = 512;

/// Expected content of a file in a shard.
enum Content {
    /// The bytes of the file with this path in a set without shards.
    FileOf(String),
    /// The true data of a camera and a frame.
    Facts { camera: usize, frame: usize },
}

pub(super) fn check(
    own: &SetFiles,
    complete: Option<&SetFiles>,
    parts: &ReadParts,
    how: VerifyOptions<'_>,
) -> CheckOutcome {
    let sides =
        [Some((own, &[OBSERVED, WITH_TRUTH][..])), complete.map(|complete| (complete, &[OBSERVED, WITH_TRUTH][..]))];
    let shards: Vec<(&SetFiles, &str, usize, usize)> = sides
        .into_iter()
        .flatten()
        .flat_map(|(files, kinds)| kinds.iter().map(move |kind| (files, *kind)))
        .flat_map(|(files, kind)| {
            let count = files.shards(kind).count();
            (0..count).map(move |shard| (files, kind, shard, count))
        })
        .collect();
    if shards.is_empty() {
        return Ok(("the set has no shards".to_owned(), Vec::new()));
    }
    let (truth, rig) = parts.scene()?;
    let of_shard = |index: usize| {
        if (how.stop)() {
            return (Some(0), Vec::new());
        }
        let (files, kind, shard, count) = shards[index];
        let plan = ShardPlan { shards: count, frames: truth.frames.len() };
        let path = tar_path(kind, shard);
        let Some(folder) = files.folder() else { return (Some(0), Vec::new()) };
        let shard_check = ShardCheck { files, truth, rig, path: &path, full: &folder.join(&path) };
        shard_check.run(&expected_files(files, kind, rig.cameras.len(), plan.frames_of(shard)))
    };
    let found = parallel::map(shards.len(), of_shard);
    let files: usize = found.iter().filter_map(|(files, _)| *files).sum();
    let skipped = found.iter().filter(|(files, _)| files.is_none()).count();
    let faults = found.into_iter().flat_map(|(_, faults)| faults).collect();
    with_skipped(skipped, "shards", format!("{files} files in {} shards", shards.len()), faults)
}

/// Expected names and contents of the files of a shard, in order.
fn expected_files(
    files: &SetFiles,
    kind: &str,
    cameras: usize,
    frames: std::ops::Range<usize>,
) -> Vec<(String, Content)> {
    let of_image = |(camera, frame): (usize, usize)| {
        let mask = silhouette_path(camera, frame);
        if kind == OBSERVED {
            return vec![(mask.clone(), Content::FileOf(mask))];
        }
        let key = samples::key(camera, frame);
        let layers = [
            ("layers.exr", exr_layers::path(camera, frame)),
            ("colour.exr", exr_layers::colour_path(camera, frame)),
            ("depth.png", depth_png::path(camera, frame)),
        ];
        let layers = layers.into_iter().filter(|(_, path)| files.has(path));
        let layers = layers.map(|(extension, path)| (format!("{key}.{extension}"), Content::FileOf(path)));
        let facts = (format!("{key}.json"), Content::Facts { camera, frame });
        [facts, (format!("{key}.mask.png"), Content::FileOf(mask))].into_iter().chain(layers).collect()
    };
    frames.flat_map(|frame| (0..cameras).map(move |camera| (camera, frame))).flat_map(of_image).collect()
}

/// The check of one shard.
struct ShardCheck<'a> {
    files: &'a SetFiles,
    truth: &'a GroundTruth,
    rig: &'a CameraRig,
    /// Path inside the set.
    path: &'a str,
    /// Path on disk.
    full: &'a Path,
}

impl ShardCheck<'_> {
    /// The number of compared files, `None` if the shard cannot be read, and the faults.
    fn run(&self, expected: &[(String, Content)]) -> (Option<usize>, Vec<Fault>) {
        let opened = File::open(self.full).and_then(|mut shard| Ok((tar_places(&mut shard)?, shard)));
        let (places, mut shard) = match opened {
            Ok(opened) => opened,
            // the check of the hashes reports missing shards
            Err(error) if error.kind() == io::ErrorKind::NotFound => return (None, Vec::new()),
            // and truncated ones
            Err(_) if self.files.check(self.path).is_err() => return (None, Vec::new()),
            Err(error) => return (Some(0), vec![Fault::new(self.path, format!("cannot be read: {error}"))]),
        };
        let mut details: Vec<String> = extra_files(&places, expected).collect();
        let mut at = 0;
        for (name, content) in expected {
            let Some((first, size)) = places.get(name).copied() else {
                details.push(format!("it has no {name}"));
                continue;
            };
            if first != at + BLOCK {
                details.push(format!("{name} is out of order; expected samples in the order of frames, then cameras"));
            }
            at = (first + size).next_multiple_of(BLOCK);
            match self.read(&mut shard, first - BLOCK, size) {
                Ok(blocks) => details.extend(self.wrong_file(name, content, &blocks, size)),
                Err(error) => details.push(format!("{name} cannot be read: {error}")),
            }
        }
        details.extend(wrong_end(&mut shard, at));
        let reported = details.into_iter().take(MOST_FAULTS).map(|detail| Fault::new(self.path, detail)).collect();
        (Some(expected.len()), reported)
    }

    /// Header, content and padding of a file.
    fn read(&self, shard: &mut File, at: u64, size: u64) -> io::Result<Vec<u8>> {
        if size > limits::LAYER {
            return Err(io::Error::other(format!("{size} bytes, expected at most {}", limits::LAYER)));
        }
        shard.seek(SeekFrom::Start(at))?;
        let mut blocks = Vec::new();
        shard.take(BLOCK + size.next_multiple_of(BLOCK)).read_to_end(&mut blocks)?;
        Ok(blocks)
    }

    fn wrong_file(&self, name: &str, content: &Content, blocks: &[u8], size: u64) -> Option<String> {
        let (header, rest) = blocks.split_at_checked(BLOCK as usize)?;
        let (bytes, padding) = rest.split_at_checked(size as usize)?;
        if tar_header(name, size).is_ok_and(|expected| expected != header) || padding.iter().any(|byte| *byte != 0) {
            return Some(format!("the header or padding of {name} differs from that of skiagraph"));
        }
        match content {
            Content::FileOf(path) => {
                let listed = self.files.packed_digest(path);
                let detail = || format!("{name} differs from {path} in packed.sha256");
                (listed != Some(hex_sha256(bytes).as_str())).then(detail)
            }
            Content::Facts { camera, frame } => {
                let camera_of_rig = self.rig.cameras.get(*camera)?;
                let facts = SampleFacts::new(camera_of_rig, &self.truth.frames[*frame], *camera, *frame);
                let expected = serde_json::to_value(facts).unwrap_or_default();
                let Ok(found) = serde_json::from_slice::<Value>(bytes) else {
                    return Some(format!("{name} is not valid JSON"));
                };
                difference("", &expected, &found).map(|detail| format!("{name}: {detail}"))
            }
        }
    }
}

fn extra_files<'a>(places: &'a TarPlaces, expected: &'a [(String, Content)]) -> impl Iterator<Item = String> + 'a {
    let known: std::collections::BTreeSet<&str> = expected.iter().map(|(name, _)| name.as_str()).collect();
    let extra = places.keys().filter(move |name| !known.contains(name.as_str()));
    extra.map(|name| format!("it has {name:?}, which belongs to none of its frames and cameras"))
}

/// Checks the bytes after the last file, which ends at `at`.
fn wrong_end(shard: &mut File, at: u64) -> Option<String> {
    let mut end = Vec::new();
    let expected = tar_end();
    let read =
        shard.seek(SeekFrom::Start(at)).and_then(|_| shard.take(expected.len() as u64 + 1).read_to_end(&mut end));
    (read.is_err() || end != expected)
        .then(|| "the bytes after its last file differ from those of skiagraph".to_owned())
}

/// Describes where two JSON values differ.
fn difference(place: &str, expected: &Value, found: &Value) -> Option<String> {
    let differs = || Some(format!("{place} is {}, expected {expected}", crate::input::excerpt(&found.to_string())));
    match (expected, found) {
        (Value::Number(a), Value::Number(b)) => {
            let (a, b) = (a.as_f64()?, b.as_f64()?);
            if (a - b).abs() <= TOLERANCE * a.abs().max(1.0) { None } else { differs() }
        }
        (Value::Array(a), Value::Array(b)) if a.len() == b.len() => {
            let mut pairs = a.iter().zip(b).enumerate();
            pairs.find_map(|(i, (a, b))| difference(&format!("{place}[{i}]"), a, b))
        }
        (Value::Object(a), Value::Object(b)) if a.keys().eq(b.keys()) => {
            let dot = if place.is_empty() { "" } else { "." };
            a.iter().find_map(|(key, a)| difference(&format!("{place}{dot}{key}"), a, &b[key]))
        }
        (a, b) if a == b => None,
        _ => differs(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn json_values_differ_by_more_than_rounding_by_keys_and_by_lengths() {
        let expected = json!({ "K": [[500.0, 0.0], [0.0, 1.0]], "visible": [true, null], "frame": 3 });
        assert_eq!(difference("", &expected, &expected), None);
        let with = |change: &dyn Fn(&mut Value)| {
            let mut found = expected.clone();
            change(&mut found);
            difference("", &expected, &found)
        };
        assert_eq!(with(&|v| v["K"][0][0] = json!(500.0 + 1e-8)), None);
        assert_eq!(with(&|v| v["K"][0][0] = json!(500.001)).unwrap(), "K[0][0] is 500.001, expected 500.0");
        assert!(with(&|v| v["visible"][1] = json!(0)).unwrap().starts_with("visible[1]"));
        assert!(with(&|v| v["frame"] = json!(4)).is_some() && with(&|v| v["note"] = json!(4)).is_some());
        assert!(with(&|v| v["visible"] = json!([true])).is_some());
    }
}
