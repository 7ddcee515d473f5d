//! A complete set: the blind side and the truth.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use super::blind::BlindSet;
use super::files::SetFiles;
use super::format::colour_files::{ColourDrawing, OF_COLOUR};
use super::format::listing::{FORMATS, KEY_FILE, LISTING, READER, README, stop_if_requested};
use super::format::manifest::{self, BlindManifest, SequenceFacts, TruthFacts};
use super::format::start_file::{self, Start};
use super::format::{
    body_file, cameras_file, contact_file, distractors_file, filming_file, key_file, keypoints_file, moments_file,
    props_file, recording_file, silhouette_png, truth_file, views_file,
};
use super::set_writer::FileContent;
use super::truth_image_drawing::TruthImageDrawing;
use super::{RigMoments, SetError, SourceRecording, TruthImage};
use skiagraph_core::body::Motion;
use skiagraph_core::camera::{CameraRig, TimedRig};
use skiagraph_core::npz::Npz;
use skiagraph_core::observation::Observation;
use skiagraph_core::parallel;
use skiagraph_core::rng::ObservationKey;
use skiagraph_truth::observing::{Corruption, ObservationFacts, tracker_rig};
use skiagraph_truth::retarget::plausibility::ACCEPTED;
use skiagraph_truth::scene::GroundTruth;

/// Addition to `README.txt` in sets with distractors.
const OF_DISTRACTORS: &str = "
Other people. truth/distractors.json and distractors.npz have the bodies and motions of people besides the actor. Silhouettes show
them too, wherever they are; everything else below truth/ describes only the actor, without what they hide (in views.npz: code 2).
";

/// Addition to `README.txt` in sets of a recording that was used although it is implausible.
const OF_IMPLAUSIBLE: &str = "
Implausible. No human body moves as the actor does; truth/facts.toml says why. The scenario accepts it (`accept_implausible`).
";

/// Addition to `README.txt` in sets with moving cameras or own exposure times.
const OF_FILMING: &str = "
Cameras that move or have their own timing (set.toml: schema skiagraph.set/2). cameras.npz has, for T frames and C cameras,
camera_from_world (T, C, 7: x y z qw qx qy qz; x_camera = R x_world + t) and time_s (T, C), when the first row of the image was
exposed; NaN means that the camera took no image for the frame, and then there is none in observations/ and truth/layers/. Row r
was exposed line_delay_s[camera] * r seconds after the first. cameras.json has the same cameras in frame 0. Poses, joints and
markers of truth.npz refer to the frame's own time, f / fps; in_view, visible, views.npz and all images refer to the times of
exposure. truth/filming.json has the motion of the cameras between the rows of an image.
";

/// Addition to `README.txt` in sets with keypoints, also in those without their truth.
pub(super) const OF_KEYPOINTS: &str = "
Keypoints. observations/keypoints.npz has what a 2D detector found, for T frames, C cameras and K points: keypoints (T, C, K, 2;
pixels, lens included, pixel centres at integers; NaN: missing), confidence (T, C, K), keypoint_names and cameras. set.toml has the
layout.
";

/// Addition to that.
const OF_TRUE_KEYPOINTS: &str =
    "truth/keypoints.npz has keypoints_3d (T, K, 3; metres), keypoints_2d (exact pixels), sight (codes of views.npz), and which points
were missed, inverted (left and right exchanged) or have a gross error.
";

fn readme(truth: &GroundTruth, facts: &TruthFacts, is_filmed: bool, given: Option<&ObservationFacts>) -> Vec<u8> {
    let notes = facts.retargeting.iter().flat_map(|own| &own.notes);
    let accepted = if notes.into_iter().any(|note| note.contains(ACCEPTED)) { OF_IMPLAUSIBLE } else { "" };
    let has_keypoints = given.is_some_and(|facts| facts.keypoints.is_some());
    let found = if has_keypoints { [OF_KEYPOINTS, OF_TRUE_KEYPOINTS].concat() } else { String::new() };
    let images = if given.is_some_and(|facts| facts.colour_images.is_some()) { OF_COLOUR } else { "" };
    let others = if truth.distractors.is_empty() { "" } else { OF_DISTRACTORS };
    let filmed = if is_filmed { OF_FILMING } else { "" };
    let text = include_str!("format/readme.txt");
    let text = if is_filmed { text.replacen("skiagraph.set/1", "skiagraph.set/2", 1) } else { text.to_owned() };
    [&text, others, accepted, filmed, &found, images].concat().into_bytes()
}

/// A set in memory or on disk. In both cases all content was read from its files, so `run` uses exactly the same values
/// as a reader of the set on disk.
#[derive(Clone, Debug)]
pub struct BenchmarkSet {
    /// The side that trackers may see.
    pub blind: BlindSet,
    /// The side that trackers may not see.
    pub truth: TruthSet,
}

/// The side of a set that trackers never see.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct TruthSet {
    /// The truth of the actor, frame by frame.
    pub ground_truth: GroundTruth,
    /// The motion of the tracker's body nearest to the truth, one pose per frame, if known.
    pub refitted: Option<Motion>,
    /// Facts beyond the arrays.
    pub facts: TruthFacts,
    /// The recordings of the actor's motion, to detect models that learned from them; may be empty.
    pub recordings: Vec<SourceRecording>,
    /// The true cameras with their motion and timing, whatever cameras trackers are given.
    pub rig: TimedRig,
    /// The key of all random numbers of the observations; the public key if the set has none.
    pub key: ObservationKey,
}

/// The parts of a set.
#[derive(Clone, Copy, Debug)]
pub struct SetParts<'a> {
    /// The set's name.
    pub name: &'a str,
    /// The true cameras.
    pub rig: &'a TimedRig,
    /// The start that trackers are given.
    pub start: &'a Start,
    /// The truth.
    pub ground_truth: &'a GroundTruth,
    /// The motion of the tracker's body nearest to the truth, one pose per frame.
    pub refitted: Option<&'a Motion>,
    /// Facts for reports.
    pub facts: &'a TruthFacts,
    /// The recordings of the actor's motion, if known.
    pub recordings: &'a [SourceRecording],
    /// How the observations were made, with the errors of start and cameras for trackers; `None` if they are exact.
    pub observation: Option<&'a ObservationFacts>,
    /// The key of all random numbers of the observations. It is written with the truth, unless it is the public key.
    pub key: ObservationKey,
}

impl TruthSet {
    /// Reads the truth of a set on disk.
    ///
    /// # Errors
    /// [`SetError`] naming the file that is missing, changed or malformed.
    pub fn read(directory: &Path) -> Result<Self, SetError> {
        Self::from_files(&SetFiles::open(directory)?)
    }

    fn from_files(files: &SetFiles) -> Result<Self, SetError> {
        Self::parse(files, true).map_err(|e| files.locate(e))
    }

    /// As [`Self::read`], with errors that name files by their paths inside the set, and with the public key unless
    /// `has_key`.
    pub(super) fn parse(files: &SetFiles, has_key: bool) -> Result<Self, SetError> {
        files.refuse_without_truth()?;
        let sequence = BlindManifest::from_toml(&files.read(manifest::PATH)?)?.sequence;
        let (ground_truth, refitted) = read_truth(files, sequence.cameras)?;
        if ground_truth.frames.len() != sequence.frames {
            let detail = format!("{} frames, set.toml says {}", ground_truth.frames.len(), sequence.frames);
            return Err(SetError::malformed(truth_file::PATH, detail));
        }
        let recordings = if files.has(recording_file::PATH) {
            recording_file::from_npz(recording_file::PATH, &files.read(recording_file::PATH)?)?
        } else {
            Vec::new()
        };
        // if trackers are given other cameras than the true ones, these are in a separate file
        let own = files.has(cameras_file::TRUTH_PATH);
        let path = if own { cameras_file::TRUTH_PATH } else { cameras_file::PATH };
        let cameras = cameras_file::from_json(path, &files.read(path)?)?;
        let rig = if files.has(filming_file::PATH) {
            filming_file::from_json(&files.read(filming_file::PATH)?, &cameras)?
        } else {
            TimedRig::from(&cameras)
        };
        let key = if has_key { key_file::read(files)? } else { ObservationKey::PUBLIC };
        let facts = manifest::truth_facts(files)?;
        Ok(Self { ground_truth, refitted, facts, recordings, rig, key })
    }
}

/// The truth of a set with props and distractors, and the refitted motion if there is one.
pub(super) fn read_truth(files: &SetFiles, cameras: usize) -> Result<(GroundTruth, Option<Motion>), SetError> {
    let actor = body_file::from_json(truth_file::ACTOR_PATH, &files.read(truth_file::ACTOR_PATH)?)?;
    let npz = Npz::from_bytes(truth_file::PATH, &files.read(truth_file::PATH)?)?;
    let mut props = Vec::new();
    if files.has(props_file::PATH) {
        props = props_file::from_json(&files.read(props_file::PATH)?)?;
    }
    let (mut truth, refitted) = truth_file::from_npz(&npz, actor, props, cameras)?;
    truth.distractors = distractors_file::read(files)?;
    Ok((truth, refitted))
}

impl BenchmarkSet {
    /// Makes a set in memory. `observe(frame)` returns the observation of the cameras; it is called once for every
    /// frame, on any thread. Keypoints are those of the observations if all have them; otherwise they are drawn.
    ///
    /// # Errors
    /// [`SetError`] if the parts are inconsistent.
    pub fn assemble(parts: &SetParts<'_>, observe: impl Fn(usize) -> Observation + Sync) -> Result<Self, SetError> {
        Self::assemble_unless(parts, &|| false, observe)
    }

    /// As [`Self::assemble`]; starts no other frame or file once `stop` returns `true`.
    ///
    /// # Errors
    /// As [`Self::assemble`], and [`SetError::Stopped`].
    pub fn assemble_unless(
        parts: &SetParts<'_>,
        stop: &(dyn Fn() -> bool + Sync),
        observe: impl Fn(usize) -> Observation + Sync,
    ) -> Result<Self, SetError> {
        parts.check()?;
        let colour = parts.colour()?;
        let of_frame = |frame| {
            stop_if_requested(stop)?;
            let seen = observe(frame);
            let mut files = silhouette_files(parts, frame, &seen)?;
            files.extend(colour.iter().map(|colour| colour.files(frame)).collect::<Result<Vec<_>, _>>()?.concat());
            Ok((files, seen.keypoints.map(|keypoints| keypoints.views)))
        };
        let frames = parts.ground_truth.frames.len();
        let of_frames = parallel::map(frames, of_frame).into_iter().collect::<Result<Vec<_>, SetError>>()?;
        let (of_frames, found): (Vec<_>, Vec<_>) = of_frames.into_iter().unzip();
        let mut files = BTreeMap::new();
        parts.each_file_without_observations(&mut |path, content| {
            files.insert(path.to_owned(), content.into_bytes(path)?);
            Ok(())
        })?;
        files.extend(of_frames.into_iter().flatten());
        let settings = parts.observation.and_then(|facts| facts.keypoints);
        if let (Some(settings), Some(found)) = (settings, found.into_iter().collect::<Option<Vec<_>>>()) {
            let npz = keypoints_file::found_to_npz(settings.layout, parts.rig.rig(), &found);
            files.insert(keypoints_file::PATH.to_owned(), npz.to_bytes(keypoints_file::PATH)?);
        }
        if let Some(colour) = &colour {
            let places: Vec<_> = colour.background_places().collect();
            let of_place = |index: usize| {
                let (camera, number, path) = &places[index];
                stop_if_requested(stop)?;
                colour.background(*camera, *number).map(|bytes| (path.clone(), bytes))
            };
            let backgrounds = parallel::map(places.len(), of_place).into_iter();
            files.extend(backgrounds.collect::<Result<Vec<_>, SetError>>()?);
        }
        Self::from_files(SetFiles::in_memory(files, stop)?)
    }

    /// Opens a complete set on disk.
    ///
    /// # Errors
    /// As [`BlindSet::read`] and [`TruthSet::read`].
    pub fn read(directory: &Path) -> Result<Self, SetError> {
        Self::from_files(SetFiles::open(directory)?)
    }

    /// A set whose truth is in another directory.
    pub(super) fn from_sides(blind: SetFiles, complete: &SetFiles) -> Result<Self, SetError> {
        let truth = TruthSet::from_files(complete)?;
        Ok(Self { blind: BlindSet::from_files(Arc::new(blind))?, truth })
    }

    fn from_files(files: SetFiles) -> Result<Self, SetError> {
        let truth = TruthSet::from_files(&files)?;
        Ok(Self { blind: BlindSet::from_files(Arc::new(files))?, truth })
    }

    /// A set in memory with an addition to its `README.txt`, which does not change its hash; a set on disk stays as it
    /// is.
    ///
    /// # Errors
    /// As [`Self::assemble`].
    pub fn with_readme(self, words: &str) -> Result<Self, SetError> {
        Self::from_files(self.blind.files().clone().with_words(README, words)?)
    }

    /// Writes the set into `folder`, which must contain none of its files; all data is synchronised to disk on return.
    /// The list of files is written last, so an unfinished directory is not a set. For an atomic result, write to a
    /// directory next to the target and rename it.
    ///
    /// # Errors
    /// [`SetError::Io`] naming the file that cannot be written.
    pub fn write(&self, folder: &Path) -> Result<(), SetError> {
        self.write_with_truth_images(folder, &[])
    }

    /// As [`Self::write`], with truth images of every camera and frame below `truth/layers/`. They are computed from
    /// the truth while writing and do not change [`BlindSet::set_hash`].
    ///
    /// # Errors
    /// As [`Self::write`].
    pub fn write_with_truth_images(&self, folder: &Path, truth_images: &[TruthImage]) -> Result<(), SetError> {
        self.blind.files().write(folder, |writer| {
            if truth_images.is_empty() { Ok(()) } else { self.truth_image_drawing(truth_images).write(writer, &|| {}) }
        })
    }

    /// Size of all files of a set in memory without truth images, bytes; 0 for a set on disk.
    pub fn bytes(&self) -> usize {
        self.blind.files().bytes_below("")
    }

    /// The part of [`Self::bytes`] that is silhouettes.
    pub fn silhouette_bytes(&self) -> usize {
        self.blind.files().bytes_below("observations/")
    }

    /// Size of the truth images of one frame of the set, bytes.
    ///
    /// # Errors
    /// [`SetError`] if an image cannot be encoded.
    pub fn truth_image_bytes(&self, frame: usize, truth_images: &[TruthImage]) -> Result<usize, SetError> {
        if truth_images.is_empty() { Ok(0) } else { self.truth_image_drawing(truth_images).bytes(frame) }
    }

    fn truth_image_drawing<'a>(&'a self, truth_images: &'a [TruthImage]) -> TruthImageDrawing<'a> {
        let scene = self.truth.facts.scene(self.blind.observation.as_ref(), self.truth.key);
        TruthImageDrawing { truth: &self.truth.ground_truth, rig: &self.truth.rig, scene, truth_images }
    }
}

/// Whether `directory` contains a set, valid or not.
pub fn is_set(directory: &Path) -> bool {
    directory.join(LISTING).is_file()
}

/// Reads every file of the set in `directory` and compares it with its SHA-256.
///
/// # Errors
/// [`SetError`] naming the first file (in alphabetical order) that is missing or changed, otherwise one that is a link
/// out of the set or not listed.
pub fn verify_hashes(directory: &Path) -> Result<(), SetError> {
    let files = SetFiles::open(directory)?;
    files.verify().map_err(|e| files.locate(e))
}

impl SetParts<'_> {
    pub(super) fn check(&self) -> Result<(), SetError> {
        let (truth, cameras) = (self.ground_truth, self.rig.cameras());
        let frames = truth.frames.len();
        if !(1..=manifest::MOST_FRAMES).contains(&frames) {
            return Err(SetError::inconsistent(format!("{frames} frames; expected 1 to {}", manifest::MOST_FRAMES)));
        }
        if truth.frames.iter().any(|f| f.in_view.len() != cameras || f.visible.len() != cameras) {
            return Err(SetError::inconsistent(format!("the ground truth does not match these {cameras} cameras")));
        }
        if let Some(motion) = self.refitted.filter(|m| m.poses.len() != frames) {
            let detail = format!("{} refitted poses for {frames} frames", motion.poses.len());
            return Err(SetError::inconsistent(detail));
        }
        let degrees = self.start.body.degrees_of_freedom.len();
        let motions = self.refitted.into_iter().chain(self.start.training.motions());
        let mut poses = motions.flat_map(|m| &m.poses).chain([&self.start.pose]);
        if poses.any(|p| p.joint_angles.len() != degrees) {
            let detail = format!("start and refitted poses need the {degrees} angles of {:?}", self.start.body.name);
            return Err(SetError::inconsistent(detail));
        }
        Ok(())
    }
}

impl<'a> SetParts<'a> {
    pub(super) fn truth_image_drawing(&self, truth_images: &'a [TruthImage]) -> TruthImageDrawing<'a> {
        let scene = self.facts.scene(self.observation, self.key);
        TruthImageDrawing { truth: self.ground_truth, rig: self.rig, scene, truth_images }
    }

    /// The cameras for trackers, if they differ from the true ones.
    fn tracker_rig(&self) -> Option<CameraRig> {
        let corruption = self.observation.map(|facts| facts.corruption).filter(Corruption::changes_cameras)?;
        Some(tracker_rig(self.rig.rig(), &corruption, self.facts.keyed_seed(self.key)))
    }

    /// Passes every file except the silhouettes to `take`, one at a time: together they may be larger than memory.
    pub(super) fn each_file_without_observations(
        &self,
        take: &mut dyn FnMut(&str, FileContent) -> Result<(), SetError>,
    ) -> Result<(), SetError> {
        let truth = self.ground_truth;
        let bytes = FileContent::Bytes;
        take(manifest::PATH, bytes(manifest::to_toml(&self.manifest())?))?;
        take(manifest::FACTS_PATH, bytes(manifest::facts_to_toml(self.facts)?))?;
        let moments = RigMoments::for_tracker(self.rig, truth, self.observation, self.facts.keyed_seed(self.key));
        take(README, bytes(readme(truth, self.facts, moments.is_some(), self.observation)))?;
        take(FORMATS, bytes(include_bytes!("format/formats.txt").to_vec()))?;
        take(READER, bytes(truth_file::READER.as_bytes().to_vec()))?;
        let (rig, other) = (self.rig.rig(), self.tracker_rig());
        let given = other.as_ref().unwrap_or(rig);
        take(
            cameras_file::PATH,
            bytes(cameras_file::to_json(given, moments.is_some().then_some(moments_file::PATH))?),
        )?;
        if let Some(moments) = &moments {
            take(moments_file::PATH, FileContent::Arrays(moments_file::to_npz(moments, given)))?;
            take(filming_file::PATH, bytes(filming_file::to_json(self.rig)?))?;
        }
        take(start_file::PATH, bytes(self.start.to_json()?))?;
        let (training_path, training) = self.start.training_file()?;
        take(training_path, bytes(training))?;
        take(start_file::BODY_PATH, bytes(body_file::to_json(start_file::BODY_PATH, &self.start.body)?))?;
        take(truth_file::ACTOR_PATH, bytes(body_file::to_json(truth_file::ACTOR_PATH, &truth.actor)?))?;
        if !self.key.is_public() {
            take(KEY_FILE, bytes(key_file::to_text(self.key)))?;
        }
        if !self.recordings.is_empty() {
            take(recording_file::PATH, bytes(recording_file::to_npz(recording_file::PATH, self.recordings)?))?;
        }
        if other.is_some() {
            take(cameras_file::TRUTH_PATH, bytes(cameras_file::to_json(rig, None)?))?;
        }
        if !truth.distractors.is_empty() {
            for (path, own) in distractors_file::to_files(&truth.distractors)? {
                take(path, bytes(own))?;
            }
        }
        if !truth.props.is_empty() {
            take(props_file::PATH, bytes(props_file::to_json(&truth.props)?))?;
        }
        let refitted = self.refitted.map(|motion| (&self.start.body, motion));
        take(truth_file::PATH, FileContent::Arrays(truth_file::to_npz(truth, refitted, rig)))?;
        take(views_file::PATH, FileContent::Arrays(views_file::to_npz(truth, self.rig)))?;
        if let Some((facts, settings)) = self.observation.and_then(|facts| Some((facts, facts.keypoints?))) {
            let seed = self.facts.keyed_seed(self.key);
            let [found, exact] = keypoints_file::to_npz(truth, self.rig, &settings, &facts.corruption, seed);
            take(keypoints_file::PATH, FileContent::Arrays(found))?;
            take(keypoints_file::TRUTH_PATH, FileContent::Arrays(exact))?;
        }
        match contact_file::to_npz(truth) {
            Some(contact) => take(contact_file::PATH, FileContent::Arrays(contact)),
            None => Ok(()),
        }
    }

    /// Draws the images for trackers; `None` without any.
    pub(super) fn colour(&self) -> Result<Option<ColourDrawing<'a>>, SetError> {
        ColourDrawing::new(self.ground_truth, self.rig, self.observation, self.facts.keyed_seed(self.key))
    }

    pub(super) fn manifest(&self) -> BlindManifest {
        let sequence = SequenceFacts {
            frames: self.ground_truth.frames.len(),
            frames_per_second: self.ground_truth.frames_per_second,
            cameras: self.rig.cameras(),
            forward: self.start.pose.forward(),
        };
        BlindManifest::new(self.name, sequence, self.observation.cloned()).filmed(!self.rig.is_still())
    }
}

/// The silhouettes of one frame with their paths, without cameras that took no image.
pub(super) fn silhouette_files(
    parts: &SetParts<'_>,
    frame: usize,
    observation: &Observation,
) -> Result<Vec<(String, Vec<u8>)>, SetError> {
    let sizes = parts.rig.rig().cameras.iter().map(|c| (c.pinhole.width, c.pinhole.height));
    if observation.frame != frame || !observation.silhouettes.iter().map(|m| (m.width(), m.height())).eq(sizes) {
        return Err(SetError::inconsistent(format!(
            "the observation of set frame {frame} (from 0) does not match the cameras"
        )));
    }
    let taken = observation.silhouettes.iter().enumerate().filter(|(camera, _)| parts.rig.has_image(*camera, frame));
    let silhouettes = taken.map(|(camera, mask)| {
        let path = BlindSet::silhouette_path(camera, frame);
        silhouette_png::encode(&path, mask).map(|bytes| (path, bytes))
    });
    silhouettes.collect()
}

#[cfg(test)]
mod tests;
