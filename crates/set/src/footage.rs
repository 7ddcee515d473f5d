//! Sets of recordings of people: the side for trackers alone, because nobody knows the true poses.

use std::path::Path;

use super::files::SetFiles;
use super::format::listing::{FOOTAGE_MADE_BY, FORMATS, README, Stop, stop_if_requested};
use super::format::manifest::{self, BlindManifest, SequenceFacts};
use super::format::start_file::{self, Start};
use super::format::{body_file, cameras_file, keypoints_file, silhouette_png};
use super::set::OF_KEYPOINTS;
use super::set_writer::SetWriter;
use super::{BlindSet, SetError};
use skiagraph_core::body::KeypointLayout;
use skiagraph_core::camera::CameraRig;
use skiagraph_core::observation::FoundKeypoint;
use skiagraph_core::parallel;
use skiagraph_core::raster::Mask;
use skiagraph_truth::observing::ObservationFacts;

/// The points found in the images of a frame, by camera.
type FoundViews = Vec<Vec<Option<FoundKeypoint>>>;

/// The parts of a recording's set.
#[derive(Clone, Copy, Debug)]
pub struct FootageParts<'a> {
    /// The set's name.
    pub name: &'a str,
    /// The cameras, which do not move.
    pub rig: &'a CameraRig,
    /// Number of frames.
    pub frames: usize,
    /// Frames per second.
    pub frames_per_second: f64,
    /// What trackers start from.
    pub start: &'a Start,
    /// What a detector found, by frame and camera, with its layout.
    pub keypoints: Option<(KeypointLayout, &'a [FoundViews])>,
    /// What made the set, as `made_by.json` records it.
    pub made_by: &'a str,
}

impl FootageParts<'_> {
    /// Writes the set into `folder`, which must have none of its files. `observe(frame)` returns the silhouette of
    /// every camera, and what else it found out about the frame; it is called once for every frame, on any thread.
    /// Returns the latter, frame by frame.
    ///
    /// # Errors
    /// Those of `observe`; [`SetError`] if the parts do not fit together or a file cannot be written, and
    /// [`SetError::Stopped`] once `stop` returns `true`.
    pub fn write<T: Send + Sync, E: From<SetError> + Send + Sync>(
        &self,
        folder: &Path,
        stop: Stop<'_>,
        observe: impl Fn(usize) -> Result<(Vec<Mask>, T), E> + Sync,
    ) -> Result<Vec<T>, E> {
        let writer = SetWriter::new(folder, stop);
        self.write_records(&writer)?;
        let of_frame = |frame: usize| -> Result<T, E> {
            stop_if_requested(stop)?;
            let (masks, found) = observe(frame)?;
            for (camera, mask) in masks.iter().enumerate() {
                let path = BlindSet::silhouette_path(camera, frame);
                writer.put(&path, &silhouette_png::encode(&path, mask)?)?;
            }
            Ok(found)
        };
        let found = parallel::map(self.frames, of_frame).into_iter().collect::<Result<Vec<T>, E>>()?;
        writer.finish()?;
        Ok(found)
    }

    /// Every file but the silhouettes.
    fn write_records(&self, writer: &SetWriter<'_>) -> Result<(), SetError> {
        let sequence = SequenceFacts {
            frames: self.frames,
            frames_per_second: self.frames_per_second,
            cameras: self.rig.cameras.len(),
            forward: self.start.pose.forward(),
        };
        sequence.check().map_err(SetError::inconsistent)?;
        let observation = ObservationFacts::of_footage(self.keypoints.map(|(layout, _)| layout));
        let manifest = BlindManifest::new(self.name, sequence, Some(observation));
        let found = if self.keypoints.is_some() { OF_KEYPOINTS } else { "" };
        writer.put(manifest::PATH, &manifest::to_toml(&manifest)?)?;
        writer.put(README, [include_str!("format/readme_footage.txt"), found].concat().as_bytes())?;
        writer.put(FORMATS, include_bytes!("format/formats.txt"))?;
        writer.put(FOOTAGE_MADE_BY, self.made_by.as_bytes())?;
        writer.put(cameras_file::PATH, &cameras_file::to_json(self.rig, None)?)?;
        writer.put(start_file::PATH, &self.start.to_json()?)?;
        writer.put(start_file::BODY_PATH, &body_file::to_json(start_file::BODY_PATH, &self.start.body)?)?;
        let (path, training) = self.start.training_file()?;
        writer.put(path, &training)?;
        if let Some((layout, views)) = self.keypoints {
            let npz = keypoints_file::found_to_npz(layout, self.rig, views);
            writer.put(keypoints_file::PATH, &npz.to_bytes(keypoints_file::PATH)?)?;
        }
        Ok(())
    }
}

impl SetFiles {
    /// Whether the set is of a recording, by its listing and `set.toml`.
    pub(super) fn is_footage(&self) -> bool {
        let manifest = || BlindManifest::from_toml(&self.read(manifest::PATH).ok()?).ok();
        let has_truth = self.is_sealed() || self.paths().any(|path| path.starts_with("truth/"));
        !has_truth && manifest().and_then(|manifest| manifest.observation).is_some_and(|facts| facts.is_footage())
    }
}

/// Whether `directory` has the set of a recording, which has no truth.
pub fn is_footage(directory: &Path) -> bool {
    SetFiles::open(directory).is_ok_and(|files| files.is_footage())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::with_parts;
    use crate::test_bodies::walk;
    use crate::{BenchmarkSet, VerifyOptions, verify};

    #[test]
    fn recordings_are_sets_without_truth() {
        let root = tempfile::tempdir().unwrap();
        let place = root.path().join("set");
        with_parts(&walk(3), |parts, observer| {
            let none = vec![vec![vec![None; 17]; parts.rig.cameras()]; 3];
            let footage = FootageParts {
                name: "someone",
                rig: parts.rig.rig(),
                frames: 3,
                frames_per_second: 60.0,
                start: parts.start,
                keypoints: Some((KeypointLayout::Coco17, &none)),
                made_by: "{}",
            };
            let observe = |frame| Ok::<_, SetError>((observer.observe(frame).silhouettes, frame));
            std::fs::create_dir(&place).unwrap();
            assert_eq!(footage.write(&place, &|| false, observe).unwrap(), [0, 1, 2]);
            let blind = BlindSet::read(&place).unwrap();
            assert_eq!(blind.observation(2).unwrap().silhouettes, observer.observe(2).silhouettes);
            assert_eq!((&blind.start, blind.name.as_str()), (parts.start, "someone"));
        });
        assert!(is_footage(&place) && !crate::is_public(&place));
        let refused = BenchmarkSet::read(&place).unwrap_err().to_string();
        assert!(refused.contains("is a recording"), "{refused}");
        let verified = verify(&place, VerifyOptions::default()).unwrap();
        let made: Vec<&str> = verified.checks.iter().filter(|check| check.made).map(|check| check.name).collect();
        assert!(verified.is_sound(), "{:?}", verified.faults().collect::<Vec<_>>());
        assert_eq!(made, ["hashes", "formats", "blindfold"]);
        assert!(verified.checks[4].looked_at.contains("a recording has no truth"), "{:?}", verified.checks[4]);
    }
}
