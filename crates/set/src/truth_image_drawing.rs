//! Renders the truth images of a set while writing them.

use super::format::{depth_png, exr_layers};
use super::set_writer::SetWriter;
use super::{SetError, TruthImage};
use skiagraph_core::camera::{Camera, TimedRig};
use skiagraph_core::parallel;
use skiagraph_core::rng::KeyedSeed;
use skiagraph_truth::observing::{ImageSettings, TruthImageObserver, TruthImages, WantedTruthImages};
use skiagraph_truth::scene::GroundTruth;

/// What takes the files of an image, with their paths.
type TakesFiles<'a> = dyn Fn(Vec<(String, Vec<u8>)>) -> Result<(), SetError> + Sync + 'a;

/// Memory limit while truth images are written, bytes. It bounds the number of rendering threads; a single image
/// may take more.
pub const TRUTH_IMAGE_MEMORY_BYTES: usize = 1 << 30;

/// Bytes per pixel of a thread that writes truth images: ray, depth and part, their crops, and the file's bytes.
const LAYER_BYTES_PER_PIXEL: usize = 16 + 8 + 8 + 8;

/// Additional bytes per pixel for a layer: images, their crops and surface points.
fn bytes_per_pixel(layer: &TruthImage) -> usize {
    match layer {
        TruthImage::Depth | TruthImage::Parts => 4,
        TruthImage::Normals | TruthImage::Flow => 120,
        // sixteen rays, and depths if there are props
        TruthImage::Coverage => 16 * (16 + 8),
        TruthImage::Colour => 160,
    }
}

/// Renders the images of every true camera and frame.
pub(super) struct TruthImageDrawing<'a> {
    pub(super) truth: &'a GroundTruth,
    pub(super) rig: &'a TimedRig,
    /// Appearance of colour images, and the seed of their random numbers.
    pub(super) scene: (ImageSettings, KeyedSeed),
    pub(super) truth_images: &'a [TruthImage],
}

impl TruthImageDrawing<'_> {
    /// Size of the images of one frame, bytes.
    pub(super) fn bytes(&self, frame: usize) -> Result<usize, SetError> {
        let size = |camera: usize| {
            let Some(images) = self.observer(camera).look(frame) else { return Ok(0) };
            Ok(truth_image_files(camera, frame, &images, self.truth_images)?
                .iter()
                .map(|(_, bytes)| bytes.len())
                .sum::<usize>())
        };
        (0..self.rig.cameras()).map(size).sum()
    }

    fn observer(&self, camera: usize) -> TruthImageObserver<'_> {
        let wanted = WantedTruthImages {
            // the data window of coverage depends on it
            depth: self.truth_images.iter().any(|layer| *layer != TruthImage::Colour),
            normals: self.truth_images.contains(&TruthImage::Normals),
            flow: self.truth_images.contains(&TruthImage::Flow),
            coverage: self.truth_images.contains(&TruthImage::Coverage),
            colour: self.truth_images.contains(&TruthImage::Colour).then_some(self.scene),
        };
        TruthImageObserver::new(self.truth, self.rig, camera, wanted)
    }

    /// Writes the images of all frames, one camera after another. Each image is rendered, written and dropped, so
    /// memory does not grow with their number. Existing images are kept. `tick` is called after every camera and frame.
    pub(super) fn write(&self, writer: &SetWriter<'_>, tick: &(dyn Fn() + Sync)) -> Result<(), SetError> {
        let frames: Vec<usize> = (0..self.truth.frames.len()).collect();
        self.visit(&frames, &|observer, camera, frame| {
            writer.stop_if_requested()?;
            let is_there = layer_paths(camera, frame, self.truth_images).iter().all(|path| writer.has(path));
            if let Some(images) = (!is_there).then(|| observer.look(frame)).flatten() {
                for (path, bytes) in truth_image_files(camera, frame, &images, self.truth_images)? {
                    if !writer.has(&path) {
                        writer.put(&path, &bytes)?;
                    }
                }
            }
            tick();
            Ok(())
        })
    }

    /// Passes the files of these frames, with their paths, to `take`, image by image.
    pub(super) fn each(&self, frames: &[usize], take: &TakesFiles<'_>) -> Result<(), SetError> {
        self.visit(frames, &|observer, camera, frame| {
            let Some(images) = observer.look(frame) else { return Ok(()) };
            take(truth_image_files(camera, frame, &images, self.truth_images)?)
        })
    }

    /// Calls `visit` for every camera and frame, one camera after another, on as many threads as memory allows.
    fn visit(
        &self,
        frames: &[usize],
        visit: &(dyn Fn(&TruthImageObserver<'_>, usize, usize) -> Result<(), SetError> + Sync),
    ) -> Result<(), SetError> {
        for (index, camera) in self.rig.rig().cameras.iter().enumerate() {
            let observer = self.observer(index);
            let workers = workers(camera, self.truth_images);
            let work = |worker| {
                let mut own = frames.iter().skip(worker).step_by(workers);
                own.try_for_each(|frame| visit(&observer, index, *frame))
            };
            parallel::map(workers, work).into_iter().collect::<Result<(), _>>()?;
        }
        Ok(())
    }
}

pub(super) fn layer_paths(camera: usize, frame: usize, truth_images: &[TruthImage]) -> Vec<String> {
    let geometry =
        truth_images.iter().any(|layer| *layer != TruthImage::Colour).then(|| exr_layers::path(camera, frame));
    let colour = truth_images.contains(&TruthImage::Colour).then(|| exr_layers::colour_path(camera, frame));
    let png = truth_images.contains(&TruthImage::Depth).then(|| depth_png::path(camera, frame));
    geometry.into_iter().chain(colour).chain(png).collect()
}

fn truth_image_files(
    camera: usize,
    frame: usize,
    images: &TruthImages,
    truth_images: &[TruthImage],
) -> Result<Vec<(String, Vec<u8>)>, SetError> {
    let mut files = exr_layers::files(camera, frame, images, truth_images)?;
    if truth_images.contains(&TruthImage::Depth) {
        let png = depth_png::path(camera, frame);
        files.push((png.clone(), depth_png::encode(&png, &images.depth)?));
    }
    Ok(files)
}

/// Number of threads that may render images of this camera at the same time, at least one.
fn workers(camera: &Camera, truth_images: &[TruthImage]) -> usize {
    let pixels = (camera.pinhole.width as usize * camera.pinhole.height as usize).max(1);
    let more: usize = truth_images.iter().map(bytes_per_pixel).sum();
    let bytes = pixels * (LAYER_BYTES_PER_PIXEL + more);
    (TRUTH_IMAGE_MEMORY_BYTES / bytes).clamp(1, rayon::current_num_threads().max(1))
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
        assert!(large > 1 && large * 3840 * 2160 * LAYER_BYTES_PER_PIXEL <= TRUTH_IMAGE_MEMORY_BYTES, "{large}");
    }
}
