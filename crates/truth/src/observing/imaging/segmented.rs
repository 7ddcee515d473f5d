//! Silhouettes segmented from simulated images.

use super::{ImageSettings, PERIODS, SceneCamera};
use crate::observing::{BackgroundError, BackgroundSettings, Image, Segmenter};
use crate::scene::GroundTruth;
use skiagraph_core::camera::CameraRig;
use skiagraph_core::observation::Observation;
use skiagraph_core::parallel;
use skiagraph_core::raster::Mask;
use skiagraph_core::rng::KeyedSeed;

/// Observes any frame of the truth by segmentation of its images, from any thread.
pub struct SegmentedObserver<'a> {
    truth: &'a GroundTruth,
    camera: SceneCamera<'a>,
    segmenters: Vec<Segmenter>,
}

impl<'a> SegmentedObserver<'a> {
    /// Records the background of every camera in three periods and learns the models.
    pub fn new(
        truth: &'a GroundTruth,
        rig: &CameraRig,
        images: &ImageSettings,
        background: &BackgroundSettings,
        seed: impl Into<KeyedSeed>,
    ) -> Result<Self, BackgroundError> {
        let camera = SceneCamera::new(truth, rig, images, seed);
        let learn = |index: usize| {
            let numbers = 0..images.background_frames as usize;
            let image = |period, number| camera.background(index, period, number);
            let period = |period| numbers.clone().map(|number| image(period, number)).collect::<Vec<_>>();
            Segmenter::learn((0..PERIODS).map(period), background)
        };
        let segmenters = parallel::map(rig.cameras.len(), learn).into_iter().collect::<Result<_, _>>()?;
        Ok(Self { truth, camera, segmenters })
    }

    /// The silhouettes of one frame, which must exist in the truth.
    pub fn observe(&self, frame: usize) -> Observation {
        let mut silhouettes = Vec::with_capacity(self.segmenters.len());
        self.camera.each_image(frame, |camera, image: Image| {
            // cannot fail: the background was recorded by the same camera
            let silhouette = self.segmenters[camera].silhouette(&image);
            silhouettes.push(silhouette.unwrap_or_else(|_| Mask::new(image.width(), image.height())));
        });
        Observation { frame, time_s: self.truth.frames[frame].time_s, silhouettes, moment: None, keypoints: None }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::observing::observe;
    use crate::test_bodies::{person, walk};
    use crate::test_cameras::rig;
    use skiagraph_core::raster::overlap;

    #[test]
    fn the_actor_is_segmented_from_the_images() {
        let truth = GroundTruth::from_motion(person(), &walk(4), &rig()).unwrap();
        let images = ImageSettings {
            clothing_contrast: 100.0,
            background_frames: 10,
            // dark clothing with the background's hue looks like shadow
            shadow: false,
            ..ImageSettings::default()
        };
        let background = BackgroundSettings { remove_shadows: false, ..BackgroundSettings::default() };
        let observer = SegmentedObserver::new(&truth, &rig(), &images, &background, 4).unwrap();
        let observed = observer.observe(2);
        for (mask, exact) in observed.silhouettes.iter().zip(&observe(&truth, &rig())[2].silhouettes) {
            let iou = overlap(mask, exact).iou();
            assert!(iou > 0.85, "{iou}");
        }
        assert_eq!(observer.observe(2), observed);
        let none = ImageSettings { background_frames: 0, ..images };
        assert!(SegmentedObserver::new(&truth, &rig(), &none, &BackgroundSettings::default(), 4).is_err());
    }
}
