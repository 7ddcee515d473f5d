//! A complete set: the blind side and the truth.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use super::blind::{BlindSet, silhouette_path};
use super::files::{self, LISTING, SetFiles};
use super::layer_drawing::LayerDrawing;
use super::manifest::{self, BlindManifest, SequenceFacts, TruthFacts};
use super::start_file::{self, Start};
use super::{
    Layer, SetError, SourceRecording, body_file, cameras_file, contact_file, props_file, recording_file,
    silhouette_png, truth_file, views_file,
};
use crate::body::Motion;
use crate::camera::CameraRig;
use crate::npz::Npz;
use crate::observation::{Observation, ObservationFacts};
use crate::parallel;
use crate::scene::GroundTruth;

/// The entries of a set's directory.
pub const SET_ENTRIES: [&str; 8] =
    [manifest::PATH, README, truth_file::READER_PATH, cameras_file::PATH, LISTING, "observations", "start", "truth"];

const README: &str = "README.txt";

/// A set in memory or on disk. In both cases all content has passed through its files, so `run` sees bit for bit the
/// same as a reader of the set on disk.
#[derive(Clone, Debug)]
pub struct BenchmarkSet {
    /// What a tracker may see.
    pub blind: BlindSet,
    /// What a tracker may not see.
    pub truth: TruthSet,
}

/// The side of a set that trackers never see.
#[derive(Clone, Debug, PartialEq)]
pub struct TruthSet {
    /// The actor's truth, frame by frame.
    pub ground_truth: GroundTruth,
    /// The motion of the tracker's body that comes nearest to the truth, where it is known: one pose a frame.
    pub refitted: Option<Motion>,
    /// What is known beyond the numbers.
    pub facts: TruthFacts,
    /// The recordings that the actor performs, to detect models that learned from them; none in sets without them.
    pub recordings: Vec<SourceRecording>,
    /// The cameras that saw the actor, where trackers are told others; `None` where these are the same.
    pub cameras: Option<CameraRig>,
}

/// How observations differ from what the true cameras see.
#[derive(Clone, Copy, Debug, Default)]
pub struct Observed<'a> {
    /// How they were made; `None` where they are exact.
    pub facts: Option<&'a ObservationFacts>,
    /// The cameras that a tracker is told, where they differ from the true ones.
    pub tracker_rig: Option<&'a CameraRig>,
}

/// The parts of a set.
#[derive(Clone, Copy, Debug)]
pub struct SetParts<'a> {
    /// The set's name.
    pub name: &'a str,
    /// The true cameras.
    pub rig: &'a CameraRig,
    /// What the tracker is told.
    pub start: &'a Start,
    /// The truth.
    pub ground_truth: &'a GroundTruth,
    /// The tracker's body brought nearest to the truth; one pose a frame.
    pub refitted: Option<&'a Motion>,
    /// Facts for reports.
    pub facts: &'a TruthFacts,
    /// The recordings that the actor performs, where they are known.
    pub recordings: &'a [SourceRecording],
    /// How the observations differ from the truth.
    pub observed: Observed<'a>,
}

impl TruthSet {
    /// Reads the truth of a set on disk.
    ///
    /// # Errors
    /// [`SetError`] naming the file that is missing, changed or not what its format says.
    pub fn read(directory: &Path) -> Result<Self, SetError> {
        Self::from_files(&SetFiles::open(directory)?)
    }

    fn from_files(files: &SetFiles) -> Result<Self, SetError> {
        Self::parse(files).map_err(|e| files.locate(e))
    }

    fn parse(files: &SetFiles) -> Result<Self, SetError> {
        let sequence = BlindManifest::from_toml(&files.read(manifest::PATH)?)?.sequence;
        let actor = body_file::from_json(truth_file::ACTOR_PATH, &files.read(truth_file::ACTOR_PATH)?)?;
        let npz = Npz::from_bytes(truth_file::PATH, &files.read(truth_file::PATH)?)?;
        let props = match files.has(props_file::PATH) {
            true => props_file::from_json(&files.read(props_file::PATH)?)?,
            false => Vec::new(),
        };
        let (ground_truth, refitted) = truth_file::from_npz(&npz, actor, props, sequence.cameras)?;
        if ground_truth.frames.len() != sequence.frames {
            let detail = format!("{} frames, set.toml says {}", ground_truth.frames.len(), sequence.frames);
            return Err(SetError::malformed(truth_file::PATH, detail));
        }
        let recordings = match files.has(recording_file::PATH) {
            true => recording_file::from_npz(recording_file::PATH, &files.read(recording_file::PATH)?)?,
            false => Vec::new(),
        };
        let cameras = match files.has(cameras_file::TRUTH_PATH) {
            true => Some(cameras_file::from_file(cameras_file::TRUTH_PATH, &files.read(cameras_file::TRUTH_PATH)?)?),
            false => None,
        };
        Ok(Self { ground_truth, refitted, facts: manifest::truth_facts(files)?, recordings, cameras })
    }
}

impl BenchmarkSet {
    /// Makes a set in memory. `observe(frame)` is what the cameras saw; it is called once for every frame, on any
    /// thread.
    ///
    /// # Errors
    /// [`SetError`] when the parts do not fit together.
    pub fn assemble(parts: &SetParts<'_>, observe: impl Fn(usize) -> Observation + Sync) -> Result<Self, SetError> {
        Self::assemble_unless(parts, &|| false, observe)
    }

    /// As [`Self::assemble`]; no frame and no file is begun once `stop` answers `true`.
    ///
    /// # Errors
    /// As [`Self::assemble`], and [`SetError::Stopped`].
    pub fn assemble_unless(
        parts: &SetParts<'_>,
        stop: &(dyn Fn() -> bool + Sync),
        observe: impl Fn(usize) -> Observation + Sync,
    ) -> Result<Self, SetError> {
        let truth = parts.ground_truth;
        parts.check()?;
        let of_frame = |frame| match stop() {
            true => Err(SetError::Stopped),
            false => silhouette_files(parts.rig, frame, &observe(frame)),
        };
        let of_frames = parallel::map(truth.frames.len(), of_frame).into_iter().collect::<Result<Vec<_>, _>>()?;
        let mut files: BTreeMap<String, Vec<u8>> = of_frames.into_iter().flatten().collect();
        let sequence = SequenceFacts {
            frames: truth.frames.len(),
            frames_per_second: truth.frames_per_second,
            cameras: parts.rig.cameras.len(),
            forward: parts.start.pose.forward(),
        };
        let (training_path, training) = parts.start.training_file()?;
        let refitted = parts.refitted.map(|motion| (&parts.start.body, motion));
        let npz = truth_file::to_npz(truth, refitted, parts.rig);
        for (path, bytes) in [
            (
                manifest::PATH,
                manifest::to_toml(&BlindManifest::new(parts.name, sequence, parts.observed.facts.cloned()))?,
            ),
            (manifest::FACTS_PATH, manifest::facts_to_toml(parts.facts)?),
            (README, include_bytes!("readme.txt").to_vec()),
            (truth_file::READER_PATH, truth_file::READER.as_bytes().to_vec()),
            (cameras_file::PATH, cameras_file::to_json(parts.observed.tracker_rig.unwrap_or(parts.rig))?),
            (start_file::PATH, parts.start.to_json()?),
            (training_path, training),
            (start_file::BODY_PATH, body_file::to_json(start_file::BODY_PATH, &parts.start.body)?),
            (truth_file::PATH, npz.to_bytes(truth_file::PATH)?),
            (truth_file::ACTOR_PATH, body_file::to_json(truth_file::ACTOR_PATH, &truth.actor)?),
        ] {
            files.insert(path.to_string(), bytes);
        }
        if !parts.recordings.is_empty() {
            let bytes = recording_file::to_npz(recording_file::PATH, parts.recordings)?;
            files.insert(recording_file::PATH.to_string(), bytes);
        }
        if parts.observed.tracker_rig.is_some() {
            files.insert(cameras_file::TRUTH_PATH.to_string(), cameras_file::to_json(parts.rig)?);
        }
        if !truth.props.is_empty() {
            files.insert(props_file::PATH.to_string(), props_file::to_json(&truth.props)?);
        }
        files.insert(views_file::PATH.to_string(), views_file::to_npz(truth, parts.rig).to_bytes(views_file::PATH)?);
        if let Some(contact) = contact_file::to_npz(truth) {
            files.insert(contact_file::PATH.to_string(), contact.to_bytes(contact_file::PATH)?);
        }
        Self::from_files(SetFiles::in_memory(files, stop)?)
    }

    /// Opens a whole set on disk.
    ///
    /// # Errors
    /// As [`BlindSet::read`] and [`TruthSet::read`].
    pub fn read(directory: &Path) -> Result<Self, SetError> {
        Self::from_files(SetFiles::open(directory)?)
    }

    /// The cameras that saw the actor, whatever trackers are told.
    pub fn true_rig(&self) -> &CameraRig {
        self.truth.cameras.as_ref().unwrap_or(&self.blind.rig)
    }

    fn from_files(files: SetFiles) -> Result<Self, SetError> {
        let truth = TruthSet::from_files(&files)?;
        Ok(Self { blind: BlindSet::from_files(Arc::new(files))?, truth })
    }

    /// Writes the set into `folder`, where none of its files may be yet; everything is on the disk when this returns.
    /// The list of files comes last, so an unfinished directory is not a set; for an atomic result, write to a
    /// directory next to the target and rename it.
    ///
    /// # Errors
    /// [`SetError::Io`] naming the file that cannot be written.
    pub fn write(&self, folder: &Path) -> Result<(), SetError> {
        self.write_with_layers(folder, &[])
    }

    /// As [`Self::write`], with truth images of every camera and frame below `truth/layers/`. They are computed from
    /// the truth while writing and do not change [`BlindSet::set_hash`].
    ///
    /// # Errors
    /// As [`Self::write`].
    pub fn write_with_layers(&self, folder: &Path, layers: &[Layer]) -> Result<(), SetError> {
        self.write_unless(folder, layers, &|| false)
    }

    /// Size of all files of a set in memory, layers left out; 0 for a set on disk.
    pub fn bytes(&self) -> usize {
        self.blind.files().bytes()
    }

    /// Size of the truth images of one frame, which the set must have.
    ///
    /// # Errors
    /// [`SetError`] where an image cannot be encoded.
    pub fn layer_bytes(&self, frame: usize, layers: &[Layer]) -> Result<usize, SetError> {
        if layers.is_empty() { Ok(0) } else { self.layer_drawing(layers).bytes(frame) }
    }

    /// As [`Self::write_with_layers`]; no image and no file is begun once `stop` answers `true`.
    ///
    /// # Errors
    /// As [`Self::write`], and [`SetError::Stopped`].
    pub fn write_unless(
        &self,
        folder: &Path,
        layers: &[Layer],
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<(), SetError> {
        self.blind.files().write(folder, stop, |sink| match layers.is_empty() {
            true => Ok(()),
            false => self.layer_drawing(layers).write(stop, sink),
        })
    }

    fn layer_drawing<'a>(&'a self, layers: &'a [Layer]) -> LayerDrawing<'a> {
        LayerDrawing {
            truth: &self.truth.ground_truth,
            rig: self.true_rig(),
            images: self.blind.observation.as_ref().and_then(|facts| facts.images).unwrap_or_default(),
            seed: self.truth.facts.observation_seed.unwrap_or(1).into(),
            layers,
        }
    }
}

/// Whether `directory` holds a set and nothing else.
pub fn holds_only_a_set(directory: &Path) -> bool {
    files::holds_only_listed(directory)
}

/// Whether `directory` contains a set, valid or not.
pub fn is_set(directory: &Path) -> bool {
    directory.join(LISTING).is_file()
}

/// Reads every file of the set in `directory` and compares it with its SHA-256.
///
/// # Errors
/// [`SetError`] naming the first file (in alphabetical order) that is missing or changed, else one that is not listed.
pub fn verify_hashes(directory: &Path) -> Result<(), SetError> {
    let files = SetFiles::open(directory)?;
    files.verify().map_err(|e| files.locate(e))
}

impl SetParts<'_> {
    fn check(&self) -> Result<(), SetError> {
        let (truth, cameras) = (self.ground_truth, &self.rig.cameras);
        let frames = truth.frames.len();
        if !(1..=manifest::MOST_FRAMES).contains(&frames) {
            return Err(SetError::inconsistent(format!("{frames} frames; expected 1 to {}", manifest::MOST_FRAMES)));
        }
        if truth.frames.iter().any(|f| f.in_view.len() != cameras.len() || f.visible.len() != cameras.len()) {
            return Err(SetError::inconsistent(format!(
                "the ground truth does not fit these {} cameras",
                cameras.len()
            )));
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

fn silhouette_files(
    rig: &CameraRig,
    frame: usize,
    observation: &Observation,
) -> Result<Vec<(String, Vec<u8>)>, SetError> {
    let sizes = rig.cameras.iter().map(|c| (c.pinhole.width, c.pinhole.height));
    if observation.frame != frame || !observation.silhouettes.iter().map(|m| (m.width(), m.height())).eq(sizes) {
        return Err(SetError::inconsistent(format!(
            "the observation of set frame {frame} (from 0) does not fit the cameras"
        )));
    }
    let silhouettes = observation.silhouettes.iter().enumerate().map(|(camera, mask)| {
        let path = silhouette_path(camera, frame);
        silhouette_png::encode(&path, mask).map(|bytes| (path, bytes))
    });
    silhouettes.collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::benchmark_set::fixture::small_set;
    use std::fs;

    fn written(set: &BenchmarkSet) -> tempfile::TempDir {
        let directory = tempfile::tempdir().unwrap();
        set.write(directory.path()).unwrap();
        directory
    }

    fn same(a: &BenchmarkSet, b: &BenchmarkSet) {
        assert_eq!(a.truth, b.truth);
        assert_eq!((&a.blind.name, &a.blind.set_hash), (&b.blind.name, &b.blind.set_hash));
        assert_eq!((&a.blind.rig, &a.blind.start), (&b.blind.rig, &b.blind.start));
        assert_eq!((a.blind.frame_count, a.blind.frames_per_second), (b.blind.frame_count, b.blind.frames_per_second));
        for (x, y) in a.blind.observations().zip(b.blind.observations()) {
            assert_eq!(x.unwrap(), y.unwrap());
        }
    }

    #[test]
    fn a_set_on_disk_is_the_set_in_memory() {
        let set = small_set(3).unwrap();
        let directory = written(&set);
        verify_hashes(directory.path()).unwrap();
        let read = BenchmarkSet::read(directory.path()).unwrap();
        same(&set, &read);
        assert_eq!(set.blind.observations().count(), 3);
        // and a copy made from disk is the same again
        let copy = written(&read);
        same(&set, &BenchmarkSet::read(copy.path()).unwrap());
    }

    #[test]
    fn a_set_consists_of_its_entries() {
        let directory = written(&small_set(1).unwrap());
        let mut found: Vec<String> =
            fs::read_dir(directory.path()).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        let mut expected = SET_ENTRIES.map(str::to_owned);
        found.sort();
        expected.sort();
        assert_eq!(found, expected);
        assert!(is_set(directory.path()) && !is_set(&directory.path().join("truth")));
    }

    #[test]
    fn a_tracker_needs_no_truth_and_does_not_read_it() {
        let set = small_set(2).unwrap();
        let directory = written(&set);
        fs::remove_dir_all(directory.path().join("truth")).unwrap();
        let blind = BlindSet::read(directory.path()).unwrap();
        assert_eq!(blind.observation(1).unwrap(), set.blind.observation(1).unwrap());
        let error = TruthSet::read(directory.path()).unwrap_err().to_string();
        assert!(error.contains("truth/actor.json: cannot read"), "{error}");
    }

    #[test]
    fn one_flipped_byte_in_any_file_is_found_and_the_file_named() {
        let directory = written(&small_set(1).unwrap());
        let listing = fs::read_to_string(directory.path().join("files.sha256")).unwrap();
        assert_eq!(listing.lines().count(), 12 + 3);
        for file in listing.lines().map(|line| &line[66..]) {
            let path = directory.path().join(file);
            let whole = fs::read(&path).unwrap();
            let mut broken = whole.clone();
            broken[whole.len() / 2] ^= 1;
            fs::write(&path, broken).unwrap();
            let error = verify_hashes(directory.path()).unwrap_err().to_string();
            assert!(error.starts_with(&format!("{} was changed or truncated", path.display())), "{error}");
            fs::write(&path, &whole[..whole.len() - 1]).unwrap();
            assert!(verify_hashes(directory.path()).is_err());
            fs::write(&path, whole).unwrap();
        }
        verify_hashes(directory.path()).unwrap();
    }

    #[test]
    fn a_set_half_written_is_no_set() {
        let directory = written(&small_set(1).unwrap());
        fs::remove_file(directory.path().join("files.sha256")).unwrap();
        for error in [
            BlindSet::read(directory.path()).map(|_| ()).unwrap_err(),
            TruthSet::read(directory.path()).map(|_| ()).unwrap_err(),
            verify_hashes(directory.path()).unwrap_err(),
        ] {
            assert!(error.to_string().contains("is not a complete benchmark set: it has no files.sha256"), "{error}");
        }
        let nowhere = BlindSet::read(&directory.path().join("nowhere")).unwrap_err().to_string();
        assert!(nowhere.contains("cannot read: No such file"), "{nowhere}");
    }

    #[test]
    fn the_same_bytes_come_from_any_number_of_threads() {
        let hash = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| small_set(4).unwrap().blind.set_hash)
        };
        assert_eq!(hash(1), hash(3));
        assert_ne!(hash(1), small_set(5).unwrap().blind.set_hash);
    }

    #[test]
    fn layers_lie_beside_the_truth_and_leave_the_hash_alone() {
        let set = small_set(2).unwrap();
        let directory = tempfile::tempdir().unwrap();
        set.write_with_layers(directory.path(), &[Layer::Depth, Layer::Parts]).unwrap();
        verify_hashes(directory.path()).unwrap();
        assert!(directory.path().join("truth/layers/cam02/000001.exr").exists());
        same(&set, &BenchmarkSet::read(directory.path()).unwrap());
    }

    #[test]
    fn a_set_that_is_stopped_is_not_made_and_its_layers_are_not_drawn() {
        let set = small_set(2).unwrap();
        let directory = tempfile::tempdir().unwrap();
        let asked = std::sync::atomic::AtomicUsize::new(0);
        // the files of the set are asked for one by one, then the layers
        let stop = || asked.fetch_add(1, std::sync::atomic::Ordering::SeqCst) >= 15;
        let stopped = set.write_unless(directory.path(), &[Layer::Depth], &stop).unwrap_err();
        assert!(matches!(stopped, SetError::Stopped), "{stopped}");
        assert!(directory.path().join("set.toml").exists() && !is_set(directory.path()));
        assert!(!directory.path().join("truth/layers/cam02").exists());
    }

    #[test]
    fn parts_that_do_not_fit_together_make_no_set() {
        let set = small_set(2).unwrap();
        let (truth, blind) = (&set.truth, &set.blind);
        let parts = SetParts {
            name: "x",
            rig: &blind.rig,
            start: &blind.start,
            ground_truth: &truth.ground_truth,
            refitted: None,
            facts: &truth.facts,
            recordings: &[],
            observed: Observed::default(),
        };
        let refused = |parts: &SetParts<'_>| {
            BenchmarkSet::assemble(parts, |frame| blind.observation(frame).unwrap()).unwrap_err().to_string()
        };
        let two = CameraRig { cameras: blind.rig.cameras[..2].to_vec() };
        assert!(refused(&SetParts { rig: &two, ..parts }).contains("does not fit these 2 cameras"));
        let mut start = blind.start.clone();
        start.pose.joint_angles = nalgebra::DVector::zeros(3);
        assert!(refused(&SetParts { start: &start, ..parts }).contains("start and refitted poses"));
        let short = Motion { frames_per_second: 60.0, poses: vec![blind.start.pose.clone()] };
        assert!(refused(&SetParts { refitted: Some(&short), ..parts }).contains("1 refitted poses for 2 frames"));
        let other_frame = BenchmarkSet::assemble(&parts, |_| blind.observation(0).unwrap()).unwrap_err();
        assert!(other_frame.to_string().contains("frame 1 (from 0) does not fit the cameras"), "{other_frame}");
    }
}
