//! The images of a set as WebDataset's tar shards instead of separate files.
//!
//! A shard contains consecutive frames with all cameras. Silhouettes are in shards that trackers may read. Other
//! shards, for training, contain complete samples: the silhouettes again, the truth, and truth images. The images of a
//! shard are first rendered as separate files, so that an interruption loses none of them. Then they are packed by one
//! thread, so that the bytes are reproducible, and removed.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::Path;

use super::blind::silhouette_path;
use super::cameras_file::observations_directory;
use super::layer_drawing::layer_paths;
use super::listing::LAYERS;
use super::samples::{self, SampleFacts, ShardWriter};
use super::set_writer::{FileContent, SetWriter};
use super::shard_plan::{IMAGES_OF_SAMPLES, OBSERVED, ShardPlan, WITH_TRUTH, tar_path};
use super::{Layer, SetError, SetParts};
use crate::input::HashingWriter;

const README_OBSERVED: &str = "\
The silhouettes of this set, in order of frames, then cameras.

NNNNNN.tar   observations/camCC/silhouette/FFFFFF.png: what camera CC saw in frame FFFFFF, both from 0; 8-bit grey, 255 body

skiagraph reads them here. For other programs, in the folder of the set: for shard in observations/shards/*.tar; do tar -xf $shard; done
../../packed.sha256 lists what is in the shards; once unpacked, sha256sum -c packed.sha256 checks it.
";

const README_WITH_TRUTH: &str = "\
WebDataset shards. They hold the truth: nothing for trackers.

NNNNNN.tar   samples in order of frames, then cameras; webdataset.WebDataset(\"truth/shards/{000000..NNNNNN}.tar\")

A sample FFFFFF_camCC is frame FFFFFF of camera CC, both from 0, and has
json         camera, K, R, t, distortion, width, height, frame, time_s, joints and markers (world, metres), markers_2d (pixels, null
             where out of view), visible; names and order as in truth/truth.npz, markers and axes as the set's README.txt has it
mask.png     what the camera saw: 8-bit grey, 255 body; the same file is in observations/shards
layers.exr   truth images, where the set has them; their channels are named in the file
colour.exr   brightness of the scene, where the set has colour
depth.png    depth in millimetres, 16-bit grey, 0 without geometry, where the set has depth
";

/// The plan for a number of shards; an error if there are more shards than frames.
pub(super) fn plan(shards: Option<usize>, frames: usize) -> Result<Option<ShardPlan>, SetError> {
    match shards {
        Some(count) if !(1..=frames).contains(&count) => {
            let detail = format!("expected 1 to {frames} shards (at least one frame in each), found {count}");
            Err(SetError::malformed("--shards", detail))
        }
        shards => Ok(shards.map(|shards| ShardPlan { shards, frames })),
    }
}

/// Writes the descriptions of the shards.
pub(super) fn write_readmes(writer: &SetWriter<'_>) -> Result<(), SetError> {
    for (kind, text) in [(OBSERVED, README_OBSERVED), (WITH_TRUTH, README_WITH_TRUTH)] {
        writer.put_same(&format!("{kind}README.txt"), &FileContent::Bytes(text.as_bytes().to_vec()))?;
    }
    Ok(())
}

/// Packs images into shards.
pub(super) struct Packing<'a> {
    pub(super) writer: &'a SetWriter<'a>,
    pub(super) folder: &'a Path,
    pub(super) parts: &'a SetParts<'a>,
    pub(super) layers: &'a [Layer],
    pub(super) plan: ShardPlan,
}

/// Camera and frame of an image.
type ImagePlace = (usize, usize);

/// Writer of a shard to a file.
type ShardFile<'a> = ShardWriter<HashingWriter<BufWriter<&'a mut File>>>;

impl Packing<'_> {
    /// Writes a shard of the files of its frames, unless it exists, and removes these files.
    pub(super) fn pack(&self, shard: usize) -> Result<(), SetError> {
        self.write(&tar_path(OBSERVED, shard), shard, &|to, (camera, frame)| {
            let path = silhouette_path(camera, frame);
            self.repeat(to, &path, &path)
        })?;
        self.write(&tar_path(WITH_TRUTH, shard), shard, &|to, place| self.add_sample(to, place))?;
        for (camera, frame) in self.images(shard) {
            self.writer.pack(&silhouette_path(camera, frame))?;
            layer_paths(camera, frame, self.layers).iter().try_for_each(|path| self.writer.pack(path))?;
        }
        Ok(())
    }

    /// Removes empty folders.
    pub(super) fn remove_empty_folders(&self) {
        let of_camera = |camera: usize| {
            let own = observations_directory(camera);
            [format!("{own}/silhouette"), own, format!("{LAYERS}cam{camera:02}")]
        };
        let folders = (0..self.parts.rig.cameras()).flat_map(of_camera).chain([LAYERS.to_owned()]);
        // folders that are missing or not empty are ignored
        folders.for_each(|folder| fs::remove_dir(self.folder.join(folder)).unwrap_or_default());
    }

    fn images(&self, shard: usize) -> impl Iterator<Item = ImagePlace> + use<> {
        let cameras = self.parts.rig.cameras();
        self.plan.frames_of(shard).flat_map(move |frame| (0..cameras).map(move |camera| (camera, frame)))
    }

    fn write(
        &self,
        path: &str,
        shard: usize,
        add: &dyn Fn(&mut ShardFile<'_>, ImagePlace) -> io::Result<()>,
    ) -> Result<(), SetError> {
        if self.writer.has(path) {
            return Ok(());
        }
        let stopped = std::cell::Cell::new(false);
        let written = self.writer.create(path, |file| {
            let mut to = ShardWriter::new(HashingWriter::new(BufWriter::new(file)));
            for place in self.images(shard) {
                if self.writer.stop_if_requested().is_err() {
                    stopped.set(true);
                    return Err(io::Error::other("stopped"));
                }
                add(&mut to, place)?;
            }
            let (mut file, digest) = to.finish()?.finish();
            file.flush()?;
            Ok(digest)
        });
        if stopped.get() { Err(SetError::Stopped) } else { written }
    }

    fn add_sample<W: Write>(&self, to: &mut ShardWriter<W>, (camera, frame): ImagePlace) -> io::Result<()> {
        let key = samples::key(camera, frame);
        let truth = &self.parts.ground_truth.frames[frame];
        let camera_of_rig = &self.parts.rig.rig().cameras[camera];
        let json = serde_json::to_string(&SampleFacts::new(camera_of_rig, truth, camera, frame))?;
        to.add(&format!("{key}.json"), json.as_bytes(), json.len() as u64)?;
        self.repeat(to, &format!("{key}.mask.png"), &silhouette_path(camera, frame))?;
        for path in layer_paths(camera, frame, self.layers) {
            if let Some((_, name)) = IMAGES_OF_SAMPLES.iter().find(|(end, _)| path.ends_with(end)) {
                self.repeat(to, &format!("{key}.{name}"), &path)?;
            }
        }
        Ok(())
    }

    /// Adds a file of the set.
    fn repeat<W: Write>(&self, to: &mut ShardWriter<W>, name: &str, path: &str) -> io::Result<()> {
        let file = File::open(self.folder.join(path))?;
        let size = file.metadata()?.len();
        to.add(name, file, size)
    }
}
