//! The blind side of a set with other cameras or observations, for faults that are planted on purpose.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::SetError;
use super::blind::BlindSet;
use super::files::SetFiles;
use super::format::listing::COMPLETE;
use super::format::{cameras_file, keypoints_file, moments_file, silhouette_png};
use skiagraph_core::camera::Camera;
use skiagraph_core::observation::FoundKeypoint;
use skiagraph_core::parallel;
use skiagraph_core::raster::Mask;

/// What trackers are given instead. Cameras are numbered from 0.
pub struct BlindChange<'a> {
    /// Changes the camera with this number.
    pub camera: &'a (dyn Fn(usize, &mut Camera) + Sync),
    /// The camera and the frame whose image is shown as that of a camera and a frame; cameras must have images of one
    /// size. The last one before it is taken if that camera has no image of the frame.
    pub shown: &'a (dyn Fn([usize; 2]) -> [usize; 2] + Sync),
    /// Changes a silhouette and keeps its size.
    pub silhouette: Option<fn(&Mask) -> Mask>,
    /// Changes what was found in an image of the camera with this number.
    pub keypoints: &'a (dyn Fn(usize, &mut [Option<FoundKeypoint>]) + Sync),
}

impl BlindSet {
    /// The blind side with a change, in memory.
    ///
    /// # Errors
    /// [`SetError`] if a file of the set cannot be read, or the change is not valid in a set.
    pub fn changed(&self, change: &BlindChange<'_>) -> Result<Self, SetError> {
        let files = self.files();
        let is_kept = |path: &&str| !path.starts_with("truth/") && *path != COMPLETE && !path.ends_with(".png");
        let kept = files.paths().filter(is_kept);
        let mut changed: BTreeMap<String, Vec<u8>> =
            kept.map(|path| Ok((path.to_owned(), files.read(path)?.into_owned()))).collect::<Result<_, SetError>>()?;
        self.change_cameras(change, &mut changed)?;
        if let Some(keypoints) = &self.keypoints {
            let frame = |frame: usize| {
                let view = |camera: usize| {
                    let [from, at] = self.image_of((change.shown)([camera, frame]));
                    let mut points = keypoints.frame(at).views.swap_remove(from);
                    (change.keypoints)(camera, &mut points);
                    points
                };
                (0..self.rig.cameras.len()).map(view).collect::<Vec<_>>()
            };
            let views: Vec<_> = (0..self.frame_count).map(frame).collect();
            let npz = keypoints_file::found_to_npz(keypoints.layout, &self.rig, &views);
            changed.insert(keypoints_file::PATH.to_owned(), npz.to_bytes(keypoints_file::PATH)?);
        }
        let masks = parallel::map(self.frame_count, |frame| self.changed_silhouettes(change, frame));
        for of_frame in masks {
            changed.extend(of_frame?);
        }
        Self::from_files(Arc::new(SetFiles::in_memory(changed, &|| false)?))
    }

    fn change_cameras(&self, change: &BlindChange<'_>, files: &mut BTreeMap<String, Vec<u8>>) -> Result<(), SetError> {
        let mut rig = self.rig.clone();
        rig.cameras.iter_mut().enumerate().for_each(|(number, camera)| (change.camera)(number, camera));
        let moments = self.moments.as_ref().map(|given| {
            let mut moments = given.clone();
            for moment in &mut moments.frames {
                let cameras = self.rig.cameras.iter().zip(&mut moment.camera_from_world).enumerate();
                for (number, (camera, place)) in cameras {
                    let mut camera = Camera { camera_from_world: *place, ..camera.clone() };
                    (change.camera)(number, &mut camera);
                    *place = camera.camera_from_world;
                }
            }
            moments
        });
        let of_frames = moments.is_some().then_some(moments_file::PATH);
        files.insert(cameras_file::PATH.to_owned(), cameras_file::to_json(&rig, of_frames)?);
        if let Some(moments) = &moments {
            let npz = moments_file::to_npz(moments, &rig);
            files.insert(moments_file::PATH.to_owned(), npz.to_bytes(moments_file::PATH)?);
        }
        Ok(())
    }

    /// The last image of a camera until a frame; the first one if there is none.
    fn image_of(&self, [camera, frame]: [usize; 2]) -> [usize; 2] {
        let frame = frame.min(self.frame_count - 1);
        let has = |frame: &usize| self.has_image(camera, *frame);
        let found = (0..=frame).rev().find(has).or_else(|| (frame..self.frame_count).find(has));
        [camera, found.unwrap_or(frame)]
    }

    fn changed_silhouettes(&self, change: &BlindChange<'_>, frame: usize) -> Result<Vec<(String, Vec<u8>)>, SetError> {
        let with_image = (0..self.rig.cameras.len()).filter(|camera| self.has_image(*camera, frame));
        let of_camera = |camera: usize| {
            let [from, at] = self.image_of((change.shown)([camera, frame]));
            let (shown, path) = (Self::silhouette_path(from, at), Self::silhouette_path(camera, frame));
            let bytes = self.files().read(&shown)?;
            let Some(change) = change.silhouette else { return Ok((path, bytes.into_owned())) };
            let pinhole = &self.rig.cameras[from].pinhole;
            let mask = silhouette_png::decode(&shown, &bytes, pinhole.width, pinhole.height)?;
            let bytes = silhouette_png::encode(&path, &change(&mask))?;
            Ok((path, bytes))
        };
        with_image.map(of_camera).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::observed_set;
    use skiagraph_core::body::KeypointLayout;
    use skiagraph_truth::observing::{KeypointSettings, ObservationFacts};

    const NOTHING: BlindChange<'_> =
        BlindChange { camera: &|_, _| {}, shown: &|at| at, silhouette: None, keypoints: &|_, _| {} };

    fn set() -> BlindSet {
        let keypoints = Some(KeypointSettings { missing: 0.2, ..KeypointSettings::exact(KeypointLayout::Coco17) });
        observed_set(4, &ObservationFacts { keypoints, ..ObservationFacts::default() }).blind
    }

    #[test]
    fn without_a_change_trackers_are_given_the_same_and_the_truth_is_left_out() {
        let set = set();
        let same = set.changed(&NOTHING).unwrap();
        assert_eq!(same.rig, set.rig);
        for frame in 0..4 {
            assert_eq!(same.observation(frame).unwrap(), set.observation(frame).unwrap());
        }
        assert!(same.files().paths().all(|path| !path.starts_with("truth/")));
        assert!(set.files().paths().any(|path| path.starts_with("truth/")));
    }

    #[test]
    fn images_cameras_and_keypoints_change_as_asked() {
        let set = set();
        let shown = |[camera, frame]: [usize; 2]| [camera, if camera == 1 { frame + 1 } else { frame }];
        let camera = |number: usize, camera: &mut Camera| camera.pinhole.focal[0] *= (1 + number) as f64;
        let keypoints = |camera: usize, points: &mut [Option<FoundKeypoint>]| {
            if camera == 2 {
                points[0] = None;
            }
        };
        let silhouette: fn(&Mask) -> Mask = |mask| Mask::new(mask.width(), mask.height());
        let change =
            BlindChange { shown: &shown, camera: &camera, keypoints: &keypoints, silhouette: Some(silhouette) };
        let changed = set.changed(&change).unwrap();
        let keypoints = |set: &BlindSet, frame| set.observation(frame).unwrap().keypoints.unwrap().views;
        assert_eq!(keypoints(&changed, 1)[1], keypoints(&set, 2)[1]);
        assert_eq!(keypoints(&changed, 3)[1], keypoints(&set, 3)[1], "after the last frame it stays");
        assert_eq!(keypoints(&changed, 1)[0], keypoints(&set, 1)[0]);
        assert_eq!(keypoints(&changed, 1)[2][0], None);
        assert_eq!(keypoints(&changed, 1)[2][1..], keypoints(&set, 1)[2][1..]);
        assert!(changed.observation(2).unwrap().silhouettes.iter().all(Mask::is_empty));
        let focal = |set: &BlindSet, camera: usize| set.rig.cameras[camera].pinhole.focal[0];
        assert_eq!((focal(&changed, 0), focal(&changed, 2)), (focal(&set, 0), 3.0 * focal(&set, 2)));
    }
}
