//! Renders the truth images of a set while writing them.

use std::ops::Range;

use super::set_writer::SetWriter;
use super::{Layer, SetError, depth_png, exr_layers};
use crate::camera::{Camera, TimedRig};
use crate::observing::{ImageSettings, LayerImages, LayerObserver, WantedLayers};
use crate::parallel;
use crate::rng::KeyedSeed;
use crate::scene::GroundTruth;

/// Memory limit for images while layers are written, bytes. It bounds the number of rendering threads; a single image
/// may take more.
pub const LAYERS_MEMORY_BYTES: usize = 1 << 30;

/// Bytes per pixel of a thread that writes layers: ray, depth and part, their crops, and the file's bytes.
const LAYER_BYTES_PER_PIXEL: usize = 16 + 8 + 8 + 8;

/// Additional bytes per pixel for a layer: images, their crops and surface points.
fn bytes_per_pixel(layer: &Layer) -> usize {
    match layer {
        Layer::Depth | Layer::Parts => 4,
        Layer::Normals | Layer::Flow => 120,
        // sixteen rays, and depths if there are props
        Layer::Coverage => 16 * (16 + 8),
        Layer::Colour => 160,
    }
}

/// Renders the images of every true camera and frame.
pub(super) struct LayerDrawing<'a> {
    pub(super) truth: &'a GroundTruth,
    pub(super) rig: &'a TimedRig,
    /// Appearance of colour images, and the seed of their random numbers.
    pub(super) scene: (ImageSettings, KeyedSeed),
    pub(super) layers: &'a [Layer],
}

impl LayerDrawing<'_> {
    /// Size of the images of one frame, bytes.
    ///
    /// # Errors
    /// [`SetError`] if an image cannot be encoded.
    pub(super) fn bytes(&self, frame: usize) -> Result<usize, SetError> {
        let size = |camera: usize| {
            let Some(images) = self.observer(camera).look(frame) else { return Ok(0) };
            Ok(layer_files(camera, frame, &images, self.layers)?.iter().map(|(_, bytes)| bytes.len()).sum::<usize>())
        };
        (0..self.rig.cameras()).map(size).sum()
    }

    /// Renders the images of one camera.
    fn observer(&self, camera: usize) -> LayerObserver<'_> {
        let wanted = WantedLayers {
            // the data window of coverage depends on it
            depth: self.layers.iter().any(|layer| *layer != Layer::Colour),
            normals: self.layers.contains(&Layer::Normals),
            flow: self.layers.contains(&Layer::Flow),
            coverage: self.layers.contains(&Layer::Coverage),
            colour: self.layers.contains(&Layer::Colour).then_some(self.scene),
        };
        LayerObserver::new(self.truth, self.rig, camera, wanted)
    }

    /// Writes the images of these frames, one camera after another. Each image is rendered, written and dropped, so
    /// memory does not grow with their number. Existing images are kept. `tick` is called after every camera and frame.
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
                    writer.stop_if_requested()?;
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

/// Paths of the files of one camera and frame.
pub(super) fn layer_paths(camera: usize, frame: usize, layers: &[Layer]) -> Vec<String> {
    let geometry = layers.iter().any(|layer| *layer != Layer::Colour).then(|| exr_layers::path(camera, frame));
    let colour = layers.contains(&Layer::Colour).then(|| exr_layers::colour_path(camera, frame));
    let png = layers.contains(&Layer::Depth).then(|| depth_png::path(camera, frame));
    geometry.into_iter().chain(colour).chain(png).collect()
}

/// The files of one camera and frame.
fn layer_files(
    camera: usize,
    frame: usize,
    images: &LayerImages,
    layers: &[Layer],
) -> Result<Vec<(String, Vec<u8>)>, SetError> {
    let mut files = exr_layers::files(camera, frame, images, layers)?;
    if layers.contains(&Layer::Depth) {
        let png = depth_png::path(camera, frame);
        files.push((png.clone(), depth_png::encode(&png, &images.depth)?));
    }
    Ok(files)
}

/// Number of threads that may render images of this camera at the same time, at least one.
fn workers(camera: &Camera, layers: &[Layer]) -> usize {
    let pixels = (camera.pinhole.width as usize * camera.pinhole.height as usize).max(1);
    let more: usize = layers.iter().map(bytes_per_pixel).sum();
    let bytes = pixels * (LAYER_BYTES_PER_PIXEL + more);
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
    fn the_number_of_threads_for_large_images_is_limited_by_memory() {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(64).build().unwrap();
        let [small, large, largest] =
            pool.install(|| [(640, 480), (3840, 2160), (8192, 8192)].map(|(w, h)| workers(&sized(w, h), &[])));
        assert_eq!((small, largest), (64, 1));
        assert!(large > 1 && large * 3840 * 2160 * LAYER_BYTES_PER_PIXEL <= LAYERS_MEMORY_BYTES, "{large}");
    }
}
