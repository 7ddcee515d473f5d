//! The blind side of a set: everything that a tracker may read.

use std::borrow::Cow;
use std::path::Path;
use std::sync::Arc;

use super::files::SetFiles;
use super::format::listing::COMPLETE;
use super::format::manifest::{self, BlindManifest, SequenceFacts};
use super::format::start_file::Start;
use super::format::{cameras_file, colour_files, keypoints_file, moments_file, silhouette_png};
use super::{RigMoments, SetError, SetKeypoints, Training};
use skiagraph_core::camera::{CameraRig, RigMoment};
use skiagraph_core::observation::Observation;
use skiagraph_core::raster::Mask;
use skiagraph_truth::observing::{ColourFormat, Image, ObservationFacts};

/// Cameras, observations and a start: `set.toml`, `cameras.json`, `observations/` and `start/`. Nothing below `truth/`
/// is opened; it may be absent.
#[derive(Clone, Debug)]
pub struct BlindSet {
    /// The set's name.
    pub name: String,
    /// Frame rate, frames per second.
    pub frames_per_second: f64,
    /// Number of frames, at least 1.
    pub frame_count: usize,
    /// Heading of the body in frame 0, a horizontal unit vector; `None` if it has no heading, and in sets of older
    /// versions.
    pub forward: Option<[f64; 3]>,
    /// The cameras that trackers are given; the true ones may differ ([`super::TruthSet::rig`]). Moving cameras are at
    /// their pose of frame 0; [`Self::rig_at`] returns the cameras of any frame.
    pub rig: CameraRig,
    /// Pose and exposure time of the cameras in every frame; `None` if all cameras are static and expose every frame at
    /// its own time.
    pub moments: Option<RigMoments>,
    /// What a 2D detector found in the images; `None` in a set without keypoints.
    pub keypoints: Option<Arc<SetKeypoints>>,
    /// How the observations were made; `None` if they are exact, and in sets of older versions.
    pub observation: Option<ObservationFacts>,
    /// The tracker's start: body, pose and training.
    pub start: Start,
    /// SHA-256 (hexadecimal) of what is tested, without layers. It is the same for a set in memory and on
    /// disk, and identifies the set of a run.
    pub set_hash: String,
    /// SHA-256 (hexadecimal) of `files.sha256`, which covers every file, truth images included.
    pub full_hash: String,
    files: Arc<SetFiles>,
}

impl BlindSet {
    /// Opens a set on disk. Observations are read on demand and checked against their SHA-256.
    ///
    /// # Errors
    /// [`SetError`] naming the file that is missing, changed or malformed.
    pub fn read(directory: &Path) -> Result<Self, SetError> {
        Self::from_files(Arc::new(SetFiles::open(directory)?))
    }

    pub(super) fn from_files(files: Arc<SetFiles>) -> Result<Self, SetError> {
        Self::parse(&files).map_err(|e| files.locate(e))
    }

    /// As [`Self::read`], with errors that name files by their paths inside the set.
    pub(super) fn parse(files: &Arc<SetFiles>) -> Result<Self, SetError> {
        let manifest = BlindManifest::from_toml(&files.read(manifest::PATH)?)?;
        let rig = cameras_file::from_json(cameras_file::PATH, &files.read(cameras_file::PATH)?)?;
        if rig.cameras.len() != manifest.sequence.cameras {
            let detail = format!("{} cameras, set.toml says {}", rig.cameras.len(), manifest.sequence.cameras);
            return Err(SetError::malformed(cameras_file::PATH, detail));
        }
        let moments = moments_file::read(files, &manifest, &rig)?;
        check_listed(files, &manifest, moments.as_ref())?;
        let keypoints = keypoints_file::read(files, &manifest, &rig)?.map(Arc::new);
        Ok(Self {
            name: manifest.name,
            frames_per_second: manifest.sequence.frames_per_second,
            frame_count: manifest.sequence.frames,
            rig,
            moments,
            keypoints,
            observation: manifest.observation,
            forward: manifest.sequence.forward,
            start: Start::from_files(files)?,
            set_hash: files.set_hash(),
            full_hash: files.full_hash().to_owned(),
            files: files.clone(),
        })
    }

    /// Describes what trackers may learn from, one entry per recording.
    #[doc(hidden)]
    pub fn describe_training(&self) -> Vec<String> {
        match &self.start.training {
            Training::Spread(_) if self.observation.as_ref().is_some_and(ObservationFacts::is_footage) => {
                vec!["how much a person usually moves from frame to frame (no poses)".to_owned()]
            }
            training => training.describe(),
        }
    }

    /// The same set as if these cameras, by index, had taken no images.
    #[doc(hidden)]
    pub fn without_images_of(mut self, cameras: &[usize]) -> Self {
        if cameras.is_empty() {
            return self;
        }
        let placed: Vec<_> = self.rig.cameras.iter().map(|camera| camera.camera_from_world).collect();
        let still = |frame: usize| RigMoment {
            camera_from_world: placed.clone(),
            exposed_s: vec![Some(frame as f64 / self.frames_per_second); placed.len()],
        };
        let line_delay_s = vec![0.0; placed.len()];
        let of_still = || RigMoments { frames: (0..self.frame_count).map(still).collect(), line_delay_s };
        let mut moments = self.moments.take().unwrap_or_else(of_still);
        for moment in &mut moments.frames {
            cameras.iter().for_each(|camera| moment.exposed_s[*camera] = None);
        }
        self.moments = Some(moments);
        self
    }

    /// Checks that all silhouettes are there, without reading them.
    ///
    /// # Errors
    /// [`SetError`] naming the first that is missing.
    #[doc(hidden)]
    pub fn expect_silhouettes(&self) -> Result<(), SetError> {
        self.files.expect_there(|path| path.starts_with("observations/") && path.contains("/silhouette/"))
    }

    /// The observation of frame `frame`.
    ///
    /// # Errors
    /// [`SetError`] if a file is missing or changed.
    pub fn observation(&self, frame: usize) -> Result<Observation, SetError> {
        self.parse_observation(frame).map_err(|e| self.files.locate(e))
    }

    fn parse_observation(&self, frame: usize) -> Result<Observation, SetError> {
        let silhouettes = self.rig.cameras.iter().enumerate().map(|(index, camera)| {
            let (width, height) = (camera.pinhole.width, camera.pinhole.height);
            if !self.has_image(index, frame) {
                return Ok(Mask::new(width, height));
            }
            let path = Self::silhouette_path(index, frame);
            silhouette_png::decode(&path, &self.files.read(&path)?, width, height)
        });
        let silhouettes = silhouettes.collect::<Result<_, SetError>>()?;
        let time_s = frame as f64 / self.frames_per_second;
        let mut keypoints = self.keypoints.as_ref().map(|keypoints| keypoints.frame(frame));
        for (camera, view) in keypoints.iter_mut().flat_map(|own| own.views.iter_mut().enumerate()) {
            if !self.has_image(camera, frame) {
                view.fill(None);
            }
        }
        Ok(Observation { frame, time_s, silhouettes, moment: self.moment(frame).cloned(), keypoints })
    }

    /// Pose and exposure time of the cameras in a frame; `None` if all cameras are static.
    pub fn moment(&self, frame: usize) -> Option<&RigMoment> {
        self.moments.as_ref()?.frames.get(frame)
    }

    /// The cameras that trackers are given for a frame.
    pub fn rig_at(&self, frame: usize) -> Cow<'_, CameraRig> {
        match self.moment(frame) {
            None => Cow::Borrowed(&self.rig),
            Some(moment) => Cow::Owned(self.rig.at(moment)),
        }
    }

    /// Whether a camera took an image for a frame.
    pub fn has_image(&self, camera: usize, frame: usize) -> bool {
        self.moment(frame).is_none_or(|moment| moment.exposed_s[camera].is_some())
    }

    /// All observations in order, read one at a time.
    pub fn observations(&self) -> impl Iterator<Item = Result<Observation, SetError>> + '_ {
        (0..self.frame_count).map(|frame| self.observation(frame))
    }

    /// Path of the silhouette of a camera and frame, relative to the set.
    pub fn silhouette_path(camera: usize, frame: usize) -> String {
        format!("{}/silhouette/{frame:06}.png", cameras_file::observations_directory(camera))
    }

    /// Path of the image of a camera and frame, relative to the set; `None` in a set without images, and if the camera
    /// took no image.
    pub fn colour_path(&self, camera: usize, frame: usize) -> Option<String> {
        self.has_image(camera, frame).then_some(())?;
        Some(colour_files::path(self.colour_format()?, camera, frame))
    }

    /// Paths of the background images of a camera, relative to the set, in the order in which they were taken; empty in
    /// a set without images.
    pub fn background_paths(&self, camera: usize) -> Vec<String> {
        let path = |number| self.colour_format().map(|format| colour_files::background_path(format, camera, number));
        (0..).map_while(path).take_while(|path| self.files.has(path)).collect()
    }

    /// Whether trackers are given images.
    pub fn has_colour(&self) -> bool {
        self.colour_format().is_some()
    }

    /// The image of a camera and frame; `None` as for [`Self::colour_path`].
    ///
    /// # Errors
    /// [`SetError`] if the file is missing, changed or malformed.
    pub fn colour(&self, camera: usize, frame: usize) -> Result<Option<Image>, SetError> {
        let Some(path) = self.colour_path(camera, frame) else { return Ok(None) };
        let pinhole = &self.rig.cameras[camera].pinhole;
        let bytes = self.files.read(&path).map_err(|e| self.files.locate(e))?;
        colour_files::decode(&path, &bytes, [pinhole.width, pinhole.height]).map(Some).map_err(|e| self.files.locate(e))
    }

    /// The bytes of a file of the blind side, checked against its SHA-256.
    ///
    /// # Errors
    /// [`SetError`] if the file is missing or changed.
    #[doc(hidden)]
    pub fn file(&self, path: &str) -> Result<Vec<u8>, SetError> {
        self.files.read(path).map(Cow::into_owned).map_err(|e| self.files.locate(e))
    }

    fn colour_format(&self) -> Option<ColourFormat> {
        self.observation.as_ref()?.colour_images
    }

    /// Copies the blind side into a folder, for a program that must not see the truth. The list of files is left out,
    /// because hashes of the truth would confirm a guess.
    ///
    /// # Errors
    /// [`SetError`] if a file is missing or cannot be written.
    pub fn copy_to(&self, folder: &Path) -> Result<(), SetError> {
        self.files.copy_to(folder, |path| !path.starts_with("truth/") && path != COMPLETE)
    }

    pub(super) fn files(&self) -> &SetFiles {
        &self.files
    }
}

/// Checks the manifest's number of frames against the last silhouette of every camera, so that no unverified number
/// determines an allocation.
fn check_listed(files: &SetFiles, manifest: &BlindManifest, moments: Option<&RigMoments>) -> Result<(), SetError> {
    let SequenceFacts { frames, cameras, .. } = manifest.sequence;
    let last = |camera| moments.and_then(|moments| moments.last_image(camera)).unwrap_or(frames - 1);
    match (0..cameras).map(|camera| BlindSet::silhouette_path(camera, last(camera))).find(|path| !files.has(path)) {
        None => Ok(()),
        Some(path) => {
            let detail =
                format!("sequence.frames: expected a silhouette of every frame, found {frames} frames and no {path}");
            Err(SetError::malformed(manifest::PATH, detail))
        }
    }
}
