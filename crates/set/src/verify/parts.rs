//! The readable parts of a set.

use super::Fault;
use super::arrays::{wrong_names, wrong_numbers};
use crate::blind::silhouette_path;
use crate::body::Motion;
use crate::camera::{CameraRig, TimedRig};
use crate::files::SetFiles;
use crate::manifest::{self, BlindManifest};
use crate::npz::{Array, Npz};
use crate::observing::{ImageSettings, ObservationFacts, SilhouetteSource};
use crate::rng::{KeyedSeed, ObservationKey};
use crate::scene::GroundTruth;
use crate::set::read_truth;
use crate::start_file::{self, Start};
use crate::{
    KEY_FILE, RigMoments, SetError, TruthFacts, cameras_file, colour_files, contact_file, depth_png, exr_layers,
    filming_file, key_file, moments_file, recording_file, spread_file, training_file, truth_file,
};

/// The parts of a set; `None` for a part that cannot be read.
pub(super) struct ReadParts {
    pub(super) manifest: Option<BlindManifest>,
    /// The cameras for trackers.
    pub(super) rig: Option<CameraRig>,
    /// The cameras that saw the actor, if trackers are given others.
    pub(super) true_rig: Option<CameraRig>,
    /// Motion and timing of the true cameras, unless they are static.
    filming: Option<TimedRig>,
    /// Motion and timing of the cameras for trackers.
    pub(super) moments: Option<RigMoments>,
    pub(super) start: Option<Start>,
    pub(super) truth: Option<GroundTruth>,
    pub(super) refitted: Option<Motion>,
    /// Facts beyond the arrays.
    pub(super) facts: Option<TruthFacts>,
    /// The key of all random numbers of the observations.
    key: Option<ObservationKey>,
}

impl ReadParts {
    /// Reads all parts, and reports malformed files and contradictions. Changed files are not read; the check of the
    /// hashes reports them.
    pub(super) fn read(files: &SetFiles) -> (Self, Vec<Fault>) {
        let mut faults = Vec::new();
        let mut keep = |error: SetError| match error {
            SetError::Tampered { .. } | SetError::Io { .. } => {}
            other => faults.push(Fault::from(other)),
        };
        let manifest = files.read(manifest::PATH).and_then(|b| BlindManifest::from_toml(&b)).map_err(&mut keep).ok();
        let rig = files.read(cameras_file::PATH).and_then(|b| cameras_file::from_json(&b)).map_err(&mut keep).ok();
        let start = Start::from_files(files).map_err(&mut keep).ok();
        let facts = manifest::truth_facts(files).map_err(&mut keep).ok();
        let key = key_file::read(files).map_err(&mut keep).ok();
        if files.has(recording_file::PATH) {
            files
                .read(recording_file::PATH)
                .and_then(|b| recording_file::from_npz(recording_file::PATH, &b))
                .map_err(&mut keep)
                .ok();
        }
        let cameras = rig.as_ref().map(|rig| rig.cameras.len());
        let truth = cameras.and_then(|cameras| read_whole_truth(files, cameras).map_err(&mut keep).ok());
        let (truth, refitted) = truth.unzip();
        let true_rig = files.has(cameras_file::TRUTH_PATH).then(|| {
            let bytes = files.read(cameras_file::TRUTH_PATH)?;
            cameras_file::from_file(cameras_file::TRUTH_PATH, &bytes)
        });
        let true_rig = true_rig.and_then(|rig| rig.map_err(&mut keep).ok());
        let is_filmed = manifest.as_ref().is_some_and(BlindManifest::is_filmed);
        let given = manifest.as_ref().zip(rig.as_ref());
        let moments =
            given.and_then(|(manifest, rig)| moments_file::read(files, manifest, rig).map_err(&mut keep).ok());
        let moments = moments.flatten();
        let filming = true_rig.as_ref().or(rig.as_ref()).filter(|_| is_filmed).and_then(|rig| {
            let filming = files.read(filming_file::PATH).and_then(|bytes| filming_file::from_json(&bytes, rig));
            filming.map_err(&mut keep).ok()
        });
        let refitted = refitted.flatten();
        let parts = Self { manifest, rig, true_rig, filming, moments, start, truth, refitted, facts, key };
        let unknown = manifest::unknown_keys(files).into_iter();
        faults.extend(unknown.map(|(path, key)| Fault::new(path, format!("{key:?} is not a key of this file"))));
        faults.extend(parts.disagreements());
        faults.extend(parts.names(files));
        faults.extend(parts.missing(files));
        faults.extend(parts.rates(files));
        (parts, faults)
    }

    /// Unreadable files that the other checks need.
    pub(super) fn unread(&self) -> Vec<&'static str> {
        let parts = [
            (self.manifest.is_some(), manifest::PATH),
            (self.rig.is_some(), cameras_file::PATH),
            (self.start.is_some(), start_file::PATH),
            (self.truth.is_some(), truth_file::PATH),
            (self.facts.is_some(), manifest::FACTS_PATH),
            (self.key.is_some(), KEY_FILE),
        ];
        parts.into_iter().filter(|(is_read, _)| !is_read).map(|(_, path)| path).collect()
    }

    /// Describes the numbers of frames and cameras.
    pub(super) fn describe(&self) -> String {
        let count = |n: Option<usize>, what: &str| n.map_or(format!("no readable {what}"), |n| format!("{n} {what}"));
        let frames = self.truth.as_ref().map(|truth| truth.frames.len());
        format!("{}, {}", count(frames, "frames"), count(self.rig.as_ref().map(|rig| rig.cameras.len()), "cameras"))
    }

    /// Truth and cameras, or why they are unavailable.
    pub(super) fn scene(&self) -> Result<(&GroundTruth, &CameraRig), String> {
        let truth = self.truth.as_ref().ok_or("not checked: the truth cannot be read")?;
        let rig = self.rig.as_ref().ok_or("not checked: cameras.json cannot be read")?;
        let count = rig.cameras.len();
        match self.true_rig.as_ref().unwrap_or(rig) {
            rig if rig.cameras.len() == count => Ok((truth, rig)),
            _ => Err("not checked: truth/cameras.json and cameras.json have different numbers of cameras".to_owned()),
        }
    }

    /// Whether cameras move or have their own exposure times.
    pub(super) fn is_filmed(&self) -> bool {
        self.manifest.as_ref().is_some_and(BlindManifest::is_filmed)
    }

    /// The true cameras with motion and timing.
    pub(super) fn filming(&self) -> Result<TimedRig, String> {
        let (_, rig) = self.scene()?;
        match (self.is_filmed(), &self.filming) {
            (false, _) => Ok(TimedRig::from(rig)),
            (true, Some(filming)) => Ok(filming.clone()),
            (true, None) => Err("not checked: truth/filming.json cannot be read".to_owned()),
        }
    }

    /// Whether a camera took an image of a frame; `true` if unknown.
    pub(super) fn has_image(&self, camera: usize, frame: usize) -> bool {
        let moment = self.moments.as_ref().and_then(|moments| moments.frames.get(frame));
        moment.and_then(|moment| moment.exposed_s.get(camera)).is_none_or(Option::is_some)
    }

    /// How the observations were made according to the set, and the seed of their random numbers; `None` if the key
    /// cannot be read.
    pub(super) fn observed(&self) -> (ObservationFacts, Option<KeyedSeed>) {
        let facts = self.manifest.as_ref().and_then(|manifest| manifest.observation.clone());
        let seed = self.key.map(|key| self.facts.clone().unwrap_or_default().keyed_seed(key));
        (facts.unwrap_or_default(), seed)
    }

    /// Appearance of images of the scene, and the seed of their random numbers; `None` if the key cannot be read.
    pub(super) fn images(&self) -> Option<(ImageSettings, KeyedSeed)> {
        let observation = self.manifest.as_ref().and_then(|manifest| manifest.observation.as_ref());
        Some(self.facts.clone().unwrap_or_default().scene(observation, self.key?))
    }

    /// Describes how silhouettes differ from the truth, if set.toml states it.
    pub(super) fn inexact_silhouettes(&self) -> Option<String> {
        let facts = self.manifest.as_ref()?.observation.as_ref()?;
        (facts.silhouette != SilhouetteSource::Exact).then(|| facts.describe())
    }

    /// The file of the true cameras; trackers may have been given others.
    pub(super) fn true_cameras(&self) -> &'static str {
        if self.true_rig.is_some() { cameras_file::TRUTH_PATH } else { cameras_file::PATH }
    }

    /// Counts, rates and directions of `set.toml` that contradict other parts.
    fn disagreements(&self) -> Vec<Fault> {
        let Some(sequence) = self.manifest.as_ref().map(|manifest| &manifest.sequence) else { return Vec::new() };
        let mut faults = Vec::new();
        let mut add = |detail: String| faults.push(Fault::new(manifest::PATH, detail));
        if let Some(rig) = self.rig.as_ref().filter(|rig| rig.cameras.len() != sequence.cameras) {
            add(format!("sequence.cameras is {}, cameras.json has {}", sequence.cameras, rig.cameras.len()));
        }
        if let Some(truth) = &self.truth {
            if truth.frames.len() != sequence.frames {
                add(format!("sequence.frames is {}, truth.npz has {}", sequence.frames, truth.frames.len()));
            }
            let (stated, known) = (sequence.frames_per_second, truth.frames_per_second);
            if stated != known {
                add(format!(
                    "sequence.frames_per_second is {stated}, truth.npz has fps {known}: the times of all frames differ"
                ));
            }
        }
        if let (Some(refitted), Some(truth)) = (&self.refitted, &self.truth)
            && refitted.poses.len() != truth.frames.len()
        {
            let detail = format!("refitted_root has {} rows for {} frames", refitted.poses.len(), truth.frames.len());
            faults.push(Fault::new(truth_file::PATH, detail));
        }
        faults.extend(self.forward_fault());
        faults
    }

    /// `sequence.forward` against the start pose.
    fn forward_fault(&self) -> Option<Fault> {
        let stated = self.manifest.as_ref()?.sequence.forward?;
        let known = self.start.as_ref()?.pose.forward()?;
        let off = stated.iter().zip(known).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let detail = format!("sequence.forward is {stated:?}, but the start pose faces {known:?}");
        (off > 1e-6).then(|| Fault::new(manifest::PATH, detail))
    }

    /// Names of cameras that are not unique, or differ between `cameras.json` and `truth.npz`; other wrong names.
    fn names(&self, files: &SetFiles) -> Vec<Fault> {
        let Some(rig) = &self.rig else { return Vec::new() };
        let mut faults = Vec::new();
        let names: Vec<&str> = rig.cameras.iter().map(|camera| camera.name.as_str()).collect();
        let twice = names.iter().enumerate().find(|(i, name)| names[..*i].contains(name));
        if let Some((_, name)) = twice {
            faults.push(Fault::new(cameras_file::PATH, format!("two cameras are named {name:?}")));
        }
        let npz = files.read(truth_file::PATH).ok().and_then(|bytes| Npz::from_bytes(truth_file::PATH, &bytes).ok());
        let truth = npz.as_ref().and_then(|npz| truth_file::names(npz, "camera_names"));
        if let Some(truth) = truth.filter(|truth| !truth.iter().eq(&names)) {
            let detail = format!("camera_names are {truth:?}, cameras.json has {names:?}");
            faults.push(Fault::new(truth_file::PATH, detail));
        }
        let of_actor = npz.as_ref().zip(self.truth.as_ref()).into_iter();
        let of_actor = of_actor.flat_map(|(npz, truth)| wrong_names(npz, &truth_file::name_arrays(&truth.actor)));
        let others = npz.iter().flat_map(|npz| self.other_names(npz));
        faults.extend(of_actor.chain(others).map(|detail| Fault::new(truth_file::PATH, detail)));
        faults
    }

    /// Arrays of `truth.npz` that follow from the bodies and are not used by the reader.
    fn other_names(&self, npz: &Npz) -> Vec<String> {
        let parents = self.truth.as_ref().and_then(|truth| {
            let actor = &truth.actor;
            let parent = |link| actor.parent(link).map_or(-1, |parent| parent as i64);
            wrong_numbers(npz, "parents", &(0..actor.links.len()).map(parent).collect::<Vec<_>>())
        });
        let refitted = self.start.as_ref().filter(|_| self.refitted.is_some()).map(|start| {
            let names = start.body.degrees_of_freedom.iter().map(|degree| degree.name.as_str());
            wrong_names(npz, &Npz::from_iter([("refitted_angle_names", Array::names(names))]))
        });
        parents.into_iter().chain(refitted.into_iter().flatten()).collect()
    }

    /// Images that are missing for the numbers of cameras and frames, and images beyond them.
    fn missing(&self, files: &SetFiles) -> Vec<Fault> {
        let Some(sequence) = self.manifest.as_ref().map(|manifest| &manifest.sequence) else { return Vec::new() };
        let every = |path: &dyn Fn(usize, usize) -> String| {
            let of_camera = move |camera| {
                (0..sequence.frames).map(move |frame| (camera, frame)).filter(|(c, f)| self.has_image(*c, *f))
            };
            let images = (0..sequence.cameras).flat_map(of_camera).map(|(camera, frame)| path(camera, frame));
            let detail = "is missing: the set needs one for every camera and frame";
            images.filter(|path| !files.has(path)).map(|path| Fault::new(&path, detail)).collect::<Vec<_>>()
        };
        let mut faults = every(&silhouette_path);
        if files.paths().any(exr_layers::is_layer) {
            faults.extend(every(&exr_layers::path));
        }
        if files.paths().any(exr_layers::is_colour) {
            faults.extend(every(&exr_layers::colour_path));
        }
        if files.paths().any(depth_png::is_depth) {
            faults.extend(every(&depth_png::path));
        }
        let observed = self.manifest.as_ref().and_then(|manifest| manifest.observation.as_ref());
        if let Some(format) = observed.and_then(|facts| facts.colour_images) {
            faults.extend(every(&|camera, frame| colour_files::path(format, camera, frame)));
        }
        let beyond = files.paths().filter(|path| {
            let is_image = (path.starts_with("observations/") && path.contains("/silhouette/"))
                || path.starts_with(colour_files::COLOUR)
                || exr_layers::is_layer(path)
                || exr_layers::is_colour(path)
                || depth_png::is_depth(path);
            is_image
                && !index_of(path)
                    .is_some_and(|(c, f)| c < sequence.cameras && f < sequence.frames && self.has_image(c, f))
        });
        let (cameras, frames) = (sequence.cameras, sequence.frames);
        let detail = |path: &str| match index_of(path).filter(|(c, f)| *c < cameras && *f < frames) {
            Some((camera, frame)) => {
                format!("according to cameras.npz, camera {camera} took no image of frame {frame}")
            }
            None => format!("belongs to none of the {cameras} cameras and {frames} frames"),
        };
        faults.extend(beyond.map(|path| Fault::new(path, detail(path))));
        faults
    }

    /// Frame rates of other files that differ from the truth.
    fn rates(&self, files: &SetFiles) -> Vec<Fault> {
        let Some(truth) = &self.truth else { return Vec::new() };
        let rate = |path: &'static str| {
            let npz = Npz::from_bytes(path, &files.read(path).ok()?).ok()?;
            let fps = npz.f64s(path, "fps", &[]).ok()?.first().copied()?;
            let detail = format!("fps is {fps}, truth.npz has {}", truth.frames_per_second);
            (fps != truth.frames_per_second).then(|| Fault::new(path, detail))
        };
        [contact_file::PATH, training_file::PATH, spread_file::PATH]
            .into_iter()
            .filter(|path| files.has(path))
            .filter_map(rate)
            .collect()
    }
}

/// Camera and frame from the path of an image.
fn index_of(path: &str) -> Option<(usize, usize)> {
    let camera = path.split('/').find_map(|part| part.strip_prefix("cam")).and_then(|digits| digits.parse().ok());
    let name = path.rsplit('/').next();
    let frame = name.and_then(|name| name.split(['.', '-']).next()).and_then(|digits| digits.parse().ok());
    camera.zip(frame)
}

fn read_whole_truth(files: &SetFiles, cameras: usize) -> Result<(GroundTruth, Option<Motion>), SetError> {
    let (truth, refitted) = read_truth(files, cameras)?;
    if files.has(start_file::PATH) && !truth.frames.is_empty() {
        return Ok((truth, refitted));
    }
    Err(SetError::malformed(truth_file::PATH, "has no frame"))
}
