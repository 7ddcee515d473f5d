//! The truth images of a set, drawn while they are written.

use std::ops::Range;

use super::set_writer::SetWriter;
use super::{Layer, SetError, depth_png, exr_layers};
use crate::camera::{Camera, TimedRig};
use crate::observing::{ImageSettings, LayerImages, LayerObserver, WantedLayers};
use crate::parallel;
use crate::rng::KeyedSeed;
use crate::scene::GroundTruth;

/// Memory limit of images while layers are written, unless a single image takes more: it bounds the number of drawing
/// threads.
pub const LAYERS_MEMORY_BYTES: usize = 1 << 30;

/// What one thread that writes layers holds for every pixel: its ray, depth and part, the parts cut out, and the file's
/// bytes.
const LAYER_BYTES_A_PIXEL: usize = 16 + 8 + 8 + 8;

/// What a thread holds for every pixel besides depth and parts: images, their crops and surface points.
fn bytes_a_pixel(layer: &Layer) -> usize {
    match layer {
        Layer::Depth | Layer::Parts => 4,
        Layer::Normals | Layer::Flow => 120,
        // sixteen rays, and depths where there are props
        Layer::Coverage => 16 * (16 + 8),
        Layer::Colour => 160,
    }
}

/// Images of every true camera and frame.
pub(super) struct LayerDrawing<'a> {
    pub(super) truth: &'a GroundTruth,
    pub(super) rig: &'a TimedRig,
    /// How colour images look, and the seed of what is random in them.
    pub(super) scene: (ImageSettings, KeyedSeed),
    pub(super) layers: &'a [Layer],
}

impl LayerDrawing<'_> {
    /// Size of the images of one frame.
    ///
    /// # Errors
    /// [`SetError`] where an image cannot be encoded.
    pub(super) fn bytes(&self, frame: usize) -> Result<usize, SetError> {
        let size = |camera: usize| {
            let Some(images) = self.observer(camera).look(frame) else { return Ok(0) };
            Ok(layer_files(camera, frame, &images, self.layers)?.iter().map(|(_, bytes)| bytes.len()).sum::<usize>())
        };
        (0..self.rig.cameras()).map(size).sum()
    }

    /// Sees the images of one camera.
    fn observer(&self, camera: usize) -> LayerObserver<'_> {
        let wanted = WantedLayers {
            // coverage has their data window
            depth: self.layers.iter().any(|layer| *layer != Layer::Colour),
            normals: self.layers.contains(&Layer::Normals),
            flow: self.layers.contains(&Layer::Flow),
            coverage: self.layers.contains(&Layer::Coverage),
            colour: self.layers.contains(&Layer::Colour).then_some(self.scene),
        };
        LayerObserver::new(self.truth, self.rig, camera, wanted)
    }

    /// Images of some frames, one camera after another. Each image is drawn, written and dropped, so memory does not
    /// grow with their number. Images that are there stay. `tick` is told of every camera and frame that is done.
    pub(super) fn write(
        &self,
        writer: &SetWriter<'_>,
        frames: Range<usize>,
        tick: &(dyn Fn() + Sync),
    ) -> Result<(), SetError> {
        for (index, camera) in self.rig.rig().cameras.iter().enumerate() {
            let observer = self.observer(index);
            let workers = workers(camera, self.layers);
            let work = |worker| {
                frames.clone().skip(worker).step_by(workers).try_for_each(|frame| {
                    writer.unless_stopped()?;
                    self.write_one(writer, &observer, index, frame)?;
                    tick();
                    Ok::<(), SetError>(())
                })
            };
            parallel::map(workers, work).into_iter().collect::<Result<(), _>>()?;
        }
        Ok(())
    }

    fn write_one(
        &self,
        writer: &SetWriter<'_>,
        observer: &LayerObserver<'_>,
        camera: usize,
        frame: usize,
    ) -> Result<(), SetError> {
        if layer_paths(camera, frame, self.layers).iter().all(|path| writer.has(path)) {
            return Ok(());
        }
        let Some(images) = observer.look(frame) else { return Ok(()) };
        for (path, bytes) in layer_files(camera, frame, &images, self.layers)? {
            if !writer.has(&path) {
                writer.put(&path, &bytes)?;
            }
        }
        Ok(())
    }
}

/// Where the files of one camera and frame lie.
pub(super) fn layer_paths(camera: usize, frame: usize, layers: &[Layer]) -> Vec<String> {
    let png = layers.contains(&Layer::Depth).then(|| depth_png::path(camera, frame));
    let exr = (!layers.is_empty()).then(|| exr_layers::path(camera, frame));
    exr.into_iter().chain(png).collect()
}

/// The files of one camera and frame.
fn layer_files(
    camera: usize,
    frame: usize,
    images: &LayerImages,
    layers: &[Layer],
) -> Result<Vec<(String, Vec<u8>)>, SetError> {
    let exr = exr_layers::path(camera, frame);
    let mut files = vec![(exr.clone(), exr_layers::encode(&exr, images, layers)?)];
    if layers.contains(&Layer::Depth) {
        let png = depth_png::path(camera, frame);
        files.push((png.clone(), depth_png::encode(&png, &images.depth)?));
    }
    Ok(files)
}

/// How many threads may draw images of that camera at a time, at least one.
fn workers(camera: &Camera, layers: &[Layer]) -> usize {
    let pixels = (camera.pinhole.width as usize * camera.pinhole.height as usize).max(1);
    let more: usize = layers.iter().map(bytes_a_pixel).sum();
    let bytes = pixels * (LAYER_BYTES_A_PIXEL + more);
    (LAYERS_MEMORY_BYTES / bytes).clamp(1, rayon::current_num_threads().max(1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::small_set;

    fn sized(width: u32, height: u32) -> Camera {
        let mut camera = small_set(1).unwrap().blind.rig.cameras.remove(0);
        (camera.pinhole.width, camera.pinhole.height) = (width, height);
        camera
    }

    #[test]
    fn so_few_large_images_are_drawn_at_a_time_that_memory_is_bounded() {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(64).build().unwrap();
        let [small, large, largest] =
            pool.install(|| [(640, 480), (3840, 2160), (8192, 8192)].map(|(w, h)| workers(&sized(w, h), &[])));
        assert_eq!((small, largest), (64, 1));
        assert!(large > 1 && large * 3840 * 2160 * LAYER_BYTES_A_PIXEL <= LAYERS_MEMORY_BYTES, "{large}");
    }
}
