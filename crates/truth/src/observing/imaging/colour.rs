//! The images that trackers are given: what the cameras saw, with the time errors of the corruption.

use super::{ImageSettings, PERIODS, SceneCamera, jpeg};
use crate::observing::corruption::timing::{exposed, shown_frame};
use crate::observing::{ColourFormat, Image, ObservationFacts};
use crate::scene::GroundTruth;
use skiagraph_core::camera::TimedRig;
use skiagraph_core::rng::KeyedSeed;

/// Quality of JPEG files if the settings name none.
const JPEG_QUALITY: u8 = 95;

/// Takes the images of the scene that trackers are given, of any frame, from any thread.
pub struct ColourCamera<'a> {
    camera: SceneCamera<'a>,
    filming: TimedRig,
    facts: ObservationFacts,
    seed: KeyedSeed,
    images: ImageSettings,
    format: ColourFormat,
}

impl<'a> ColourCamera<'a> {
    /// The true cameras, which must not move; `None` if trackers are given no images.
    pub fn new(truth: &'a GroundTruth, rig: &TimedRig, facts: &ObservationFacts, seed: KeyedSeed) -> Option<Self> {
        let format = facts.colour_images?;
        let images = facts.images.unwrap_or_default();
        // a JPEG file is compressed when it is encoded
        let taken = match format {
            ColourFormat::Png => images,
            ColourFormat::Jpeg => ImageSettings { jpeg_quality: None, ..images },
        };
        let camera = SceneCamera::new(truth, exposed(rig, &facts.corruption, seed), &taken, seed);
        Some(Self { camera, filming: rig.clone(), facts: facts.clone(), seed, images, format })
    }

    /// Format of the files.
    pub fn format(&self) -> ColourFormat {
        self.format
    }

    /// Number of background images of every camera.
    pub fn backgrounds(&self) -> usize {
        PERIODS * self.images.background_frames as usize
    }

    /// A background image of a camera: those of the first period come first.
    pub fn background(&self, camera: usize, number: usize) -> Image {
        let in_period = (self.images.background_frames as usize).max(1);
        self.camera.background(camera, number / in_period, number % in_period)
    }

    /// Calls `take` with every camera's index and image of a frame, which must exist in the truth, without cameras that
    /// take no image in that frame. The image of a lost frame is the one that the camera showed instead.
    pub fn each_image(&self, frame: usize, take: impl FnMut(usize, Image)) {
        let shown = |camera: usize| {
            let every = self.filming.timing(camera).every;
            let is_taken = self.filming.has_image(camera, frame);
            if is_taken { shown_frame(&self.facts.corruption, self.seed, frame, camera, every) } else { frame }
        };
        self.camera.each_shown_image(shown, take);
    }

    /// The image as a JPEG file; `None` for an image too large for JPEG.
    pub fn jpeg(&self, image: &Image) -> Option<Vec<u8>> {
        jpeg::encoded(image, self.images.jpeg_quality.unwrap_or(JPEG_QUALITY))
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::QUIET;
    use super::*;
    use crate::observing::{CorruptedObserver, Corruption, Observer, SilhouetteSource};
    use crate::test_bodies::{person, walk};
    use crate::test_cameras::rig;
    use skiagraph_core::raster::{Mask, overlap};

    /// Images without noise or shadow, in which every changed pixel is the actor's.
    fn quiet(corruption: Corruption, format: ColourFormat) -> ObservationFacts {
        ObservationFacts {
            silhouette: SilhouetteSource::Corrupted,
            corruption,
            images: Some(QUIET),
            colour_images: Some(format),
            ..ObservationFacts::default()
        }
    }

    fn images(camera: &ColourCamera<'_>, frame: usize) -> Vec<Image> {
        let mut images = Vec::new();
        camera.each_image(frame, |_, image| images.push(image));
        images
    }

    fn changed(image: &Image, background: &Image) -> Mask {
        let differs = |index: usize| (0..3).any(|c| image.planes()[c][index] != background.planes()[c][index]);
        Mask::from_fn(image.width(), image.height(), |x, y| differs((y * image.width() + x) as usize))
    }

    #[test]
    fn images_show_the_scene_at_the_times_of_the_corrupted_silhouettes() {
        let truth = GroundTruth::from_motion(person(), &walk(12), &rig()).unwrap();
        let (rig, seed) = (TimedRig::from(&rig()), KeyedSeed::from(4));
        let errors = Corruption {
            desynchronisation_ms: 60.0,
            dropped_frames: 0.5,
            line_delay_us: 100.0,
            ..Corruption::default()
        };
        let camera = ColourCamera::new(&truth, &rig, &quiet(errors, ColourFormat::Png), seed).unwrap();
        let (late, exact) = (CorruptedObserver::new(&truth, &rig, errors, seed), Observer::new(&truth, &rig));
        let (mut moved, mut off) = (0, 0);
        for frame in [3, 7, 11] {
            let (late, exact) = (late.observe(frame), exact.observe(frame));
            for (index, image) in images(&camera, frame).iter().enumerate() {
                let mask = changed(image, &camera.background(index, 0));
                let iou = overlap(&mask, &late.silhouettes[index]).iou();
                assert!(iou > 0.97, "frame {frame}, camera {index}: {iou}");
                moved += usize::from(overlap(&late.silhouettes[index], &exact.silhouettes[index]).iou() < 0.97);
                off += usize::from(overlap(&mask, &exact.silhouettes[index]).iou() < 0.97);
            }
        }
        assert!(moved > 3 && off >= moved, "the errors are visible in {moved} of 12 silhouettes and {off} images");
    }

    #[test]
    fn backgrounds_are_those_of_all_periods_and_jpeg_files_are_read_back() {
        let truth = GroundTruth::from_motion(person(), &walk(2), &rig()).unwrap();
        let (rig, seed) = (TimedRig::from(&rig()), KeyedSeed::from(4));
        let facts = ObservationFacts {
            images: Some(ImageSettings { background_frames: 2, jpeg_quality: Some(60), ..ImageSettings::default() }),
            ..quiet(Corruption::default(), ColourFormat::Jpeg)
        };
        let camera = ColourCamera::new(&truth, &rig, &facts, seed).unwrap();
        let own = facts.images.unwrap();
        let scene = SceneCamera::new(&truth, &rig, &own, seed);
        assert_eq!(camera.backgrounds(), 6);
        for (image, same) in images(&camera, 1).iter().zip(scene.images(1)) {
            // the file has what silhouettes are segmented from
            assert_eq!(jpeg::decoded(&camera.jpeg(image).unwrap(), [320, 240]), Some(same));
        }
        let last = camera.background(1, 5);
        let file = camera.jpeg(&last).unwrap();
        assert_eq!(jpeg::decoded(&file, [320, 240]), Some(scene.background(1, 2, 1)));
        assert_eq!(jpeg::decoded(&file, [320, 241]), None);
        assert_eq!(jpeg::decoded(b"\xff\xd8 no image", [320, 240]), None);
        let none = ObservationFacts { colour_images: None, ..facts };
        assert!(ColourCamera::new(&truth, &rig, &none, seed).is_none());
    }
}
