//! Makes the files of a set again from what is stored: the bodies, root and angles, the cameras, the settings, the key.
//!
//! The files are compared by their SHA-256 in the list of the set; if that differs, the first difference is described.
//! A file on disk that is not the listed one is a fault of its check too.
//!
//! Not made again, because the recording and the scenario are not in the set: the tracker's body, unless it is the
//! actor's; the spread of another robot's changes; training motions; fingerprints of the recording; and the facts
//! that only describe. These files are read and written again, so that they hold nothing but what their format has.

use std::cell::RefCell;
use std::collections::BTreeSet;
use std::io::{self, Write};
use std::sync::Mutex;

use super::difference::difference;
use super::{CheckOutcome, Fault, VerifyOptions};
use crate::files::SetFiles;
use crate::format::exr_layers::{self, layers_of};
use crate::format::listing::{KEY_FILE, LAYERS, MADE_BY, stop_if_requested};
use crate::format::manifest::{self, BlindManifest};
use crate::format::{contact_file, keypoints_file, recording_file, truth_file};
use crate::set::silhouette_files;
use crate::set_writer::FileContent;
use crate::truth_image_drawing::layer_paths;
use crate::{BlindSet, SetError, SetParts, Start, StepSpread, Training, TruthImage, TruthSet};
use skiagraph_core::body::{Humanoid, Markers, Motion};
use skiagraph_core::camera::TimedRig;
use skiagraph_core::input::HashingWriter;
use skiagraph_core::parallel;
use skiagraph_truth::observing::{SilhouetteObserver, tracker_start};
use skiagraph_truth::retarget::{FitOptions, fit_motion_to_markers};
use skiagraph_truth::scene::GroundTruth;

/// What follows from the stored bodies, poses and cameras.
pub(super) struct Remade {
    pub(super) truth: GroundTruth,
    pub(super) rig: TimedRig,
    refitted: Option<Motion>,
    start: Start,
}

impl Remade {
    /// The truth made again; why it cannot be made, for parts that do not fit together.
    pub(super) fn new(manifest: &BlindManifest, side: &BlindSet, stored: &TruthSet) -> Result<Self, String> {
        let refused = |detail: String| format!("not checked: {detail}");
        let (known, rig) = (&stored.ground_truth, stored.rig.clone());
        if rig.cameras() != manifest.sequence.cameras {
            return Err(refused("both sides have different numbers of cameras".to_owned()));
        }
        let (props, others) = (known.props.clone(), known.distractors.clone());
        let motion = known.motion();
        let truth = GroundTruth::among(known.actor.clone(), &motion, &rig, props, others)
            .map_err(|error| refused(format!("{}: {error}", truth_file::PATH)))?;
        let body = &side.start.body;
        let is_actors = body.is_same_body(&truth.actor);
        let nearest = || if is_actors { motion.clone() } else { nearest_motion(body, &truth) };
        let refitted = stored.refitted.is_some().then(nearest);
        let mut start = side.start.clone();
        let first = refitted.as_ref().or(Some(&motion).filter(|_| is_actors)).and_then(|motion| motion.poses.first());
        if let Some(first) = first {
            let corruption = side.observation.as_ref().map(|facts| facts.corruption).unwrap_or_default();
            start.pose = tracker_start(body, first, &corruption, stored.facts.keyed_seed(stored.key));
        }
        let is_known = stored.facts.matched || !stored.facts.mismatch.is_empty();
        let is_of_one_robot = is_known && is_same_robot(body, &truth.actor);
        // a set made without a recording need not have a spread
        let has_spread = |spread: &StepSpread| {
            stored.facts.retargeting.is_some() || spread.change.iter().any(|change| *change > 0.0)
        };
        if let Training::Spread(spread) = &start.training
            && is_of_one_robot
            && has_spread(spread)
            && let Ok(own) = StepSpread::of_motion(body, &motion)
        {
            start.training = Training::Spread(own);
        }
        Ok(Self { truth, rig, refitted, start })
    }
}

/// Whether two bodies are shapes of one robot.
fn is_same_robot(body: &Humanoid, other: &Humanoid) -> bool {
    let names = |body: &Humanoid| body.links.iter().map(|link| link.name.clone()).collect::<Vec<_>>();
    body.name == other.name && body.step_len() == other.step_len() && names(body) == names(other)
}

/// The motion of a body whose markers are nearest to the actor's, found by the same fit as when the set was made.
fn nearest_motion(body: &Humanoid, truth: &GroundTruth) -> Motion {
    let markers: Vec<Markers> = truth.frames.iter().map(|frame| frame.markers).collect();
    let fits = fit_motion_to_markers(body, &markers, &body.zero_pose(), &FitOptions::default());
    let poses = fits.into_iter().map(|fit| fit.pose).collect();
    Motion { frames_per_second: truth.frames_per_second, poses }.made_continuous(body)
}

/// The comparison of a set with the files made again.
pub(super) struct Remaking<'a> {
    pub(super) files: &'a SetFiles,
    /// Files that are not as listed.
    pub(super) spoilt: &'a BTreeSet<String>,
    pub(super) manifest: &'a BlindManifest,
    pub(super) side: &'a BlindSet,
    pub(super) truth: &'a TruthSet,
    pub(super) remade: &'a Remade,
    pub(super) has_key: bool,
    pub(super) how: VerifyOptions<'a>,
}

impl Remaking<'_> {
    /// The checks `given`, `truth`, `observations` and `layers`.
    pub(super) fn outcomes(&self) -> Result<[CheckOutcome; 4], SetError> {
        let parts = SetParts {
            name: &self.manifest.name,
            rig: &self.remade.rig,
            start: &self.remade.start,
            ground_truth: &self.remade.truth,
            refitted: self.remade.refitted.as_ref(),
            facts: &self.truth.facts,
            recordings: &self.truth.recordings,
            observation: self.side.observation.as_ref(),
            key: self.truth.key,
        };
        let (mut given, mut truth, mut observed) = (self.contradictions(), Vec::new(), Vec::new());
        let made = RefCell::new(BTreeSet::new());
        let stated = BlindManifest { version: self.manifest.version.clone(), ..parts.manifest() };
        given.extend(self.compare(manifest::PATH, FileContent::Bytes(manifest::to_toml(&stated)?))?);
        parts.each_file_without_observations(&mut |path, content| {
            made.borrow_mut().insert(path.to_owned());
            let faults = match path {
                manifest::PATH => return Ok(()),
                path if path.starts_with("truth/") => &mut truth,
                path if path.starts_with("observations/") => &mut observed,
                path if !path.contains('/') && !path.starts_with("cameras.") => return Ok(()),
                _ => &mut given,
            };
            faults.extend(self.compare(path, content)?);
            Ok(())
        })?;
        let mut made = made.into_inner();
        let truth_images = self.layers(&parts, &mut made);
        truth.extend(self.unknown_files(&made));
        let arrays = made.iter().filter(|path| path.starts_with("truth/") && !path.starts_with(LAYERS)).count();
        if !self.has_key {
            truth.retain(|fault| ![keypoints_file::TRUTH_PATH, KEY_FILE].contains(&fault.file.as_str()));
            let why = || Err(format!("not checked: {KEY_FILE} is kept elsewhere"));
            return Ok([why(), Ok((format!("{arrays} files"), truth)), why(), truth_images?]);
        }
        let observed = match self.images(&parts) {
            Ok((count, faults)) => {
                let stated = self.side.observation.as_ref().filter(|_| faults.is_empty());
                let how = stated.map(|facts| format!(", {}", facts.describe())).unwrap_or_default();
                Ok((format!("{count} images drawn again{how}"), [observed, faults].concat()))
            }
            Err(SetError::Stopped) => return Err(SetError::Stopped),
            Err(error) => Err(format!("not checked: {error}")),
        };
        let start = if self.side.start.training.motions().is_empty() { "" } else { ", training motions" };
        Ok([
            Ok((format!("set.toml, cameras, start{start}"), given)),
            Ok((format!("{arrays} files"), truth)),
            observed,
            truth_images?,
        ])
    }

    /// Facts about the truth that the bodies contradict.
    fn contradictions(&self) -> Vec<Fault> {
        let (facts, path) = (&self.truth.facts, manifest::FACTS_PATH);
        let mut faults = Vec::new();
        let is_same = self.side.start.body.is_same_body(&self.truth.ground_truth.actor);
        if facts.matched != is_same {
            let detail = format!(
                "matched is {}, but the bodies of tracker and actor are {}",
                facts.matched,
                if is_same { "the same" } else { "different" }
            );
            faults.push(Fault::new(path, detail));
        }
        if facts.retargeting.is_some() && self.truth.recordings.is_empty() {
            let detail =
                "is missing, but the motion was recorded: models that learned from the test cannot be detected";
            faults.push(Fault::new(recording_file::PATH, detail));
        }
        faults
    }

    fn compare(&self, path: &str, again: FileContent) -> Result<Option<Fault>, SetError> {
        let Some(listed) = self.files.digest(path) else {
            return Ok(Some(Fault::new(path, "is missing: it follows from the other files")));
        };
        let mut hashed = HashingWriter::new(io::sink());
        again.write_to(path, &mut |part| hashed.write_all(part).map_err(SetError::io(path.as_ref(), "write")))?;
        if hashed.finish().1 == listed {
            let is_spoilt = self.spoilt.contains(path);
            return Ok(is_spoilt.then(|| Fault::new(path, "is not the file made again, which the set lists")));
        }
        let expected = again.into_bytes(path)?;
        Ok(match self.files.read(path) {
            Ok(found) if path == contact_file::PATH && contact_file::is_of_earlier_version(&found, &expected) => None,
            Ok(found) => {
                let detail = difference(path, &expected, &found);
                Some(Fault::new(path, format!("differs from the file made again: {detail}")))
            }
            Err(error) => Some(Fault::from_file(self.files.folder().unwrap_or("".as_ref()), error)),
        })
    }

    /// Files below truth/ that skiagraph does not write.
    fn unknown_files(&self, made: &BTreeSet<String>) -> Vec<Fault> {
        let below = self.files.paths().filter(|path| path.starts_with("truth/"));
        let unknown = below.filter(|path| *path != MADE_BY && !made.contains(*path));
        unknown.map(|path| Fault::new(path, "is not a file of this set: it follows from none of its parts")).collect()
    }

    fn frames(&self) -> Vec<usize> {
        (0..self.remade.truth.frames.len()).step_by(self.how.every.max(1)).collect()
    }

    /// Draws the images for trackers again: their number, and the faults.
    fn images(&self, parts: &SetParts<'_>) -> Result<(usize, Vec<Fault>), SetError> {
        let facts = parts.observation.cloned().unwrap_or_default();
        let seed = parts.facts.keyed_seed(parts.key);
        let observer = SilhouetteObserver::new(parts.ground_truth, parts.rig, &facts, seed);
        let observer = observer.map_err(|error| SetError::malformed(manifest::PATH, error.to_string()))?;
        let (colour, numbers) = (parts.colour()?, self.frames());
        let of_frame = |index: usize| {
            stop_if_requested(self.how.stop)?;
            let mut drawn = silhouette_files(parts, numbers[index], &observer.observe(numbers[index]))?;
            if let Some(colour) = &colour {
                drawn.extend(colour.files(numbers[index])?);
            }
            (self.how.tick)();
            self.compare_all(drawn)
        };
        let mut compared = parallel::map(numbers.len(), of_frame).into_iter().collect::<Result<Vec<_>, SetError>>()?;
        if let Some(colour) = &colour {
            let places: Vec<_> = colour.background_places().step_by(self.how.every.max(1)).collect();
            let of_place = |index: usize| {
                stop_if_requested(self.how.stop)?;
                let (camera, number, path) = &places[index];
                self.compare_all(vec![(path.clone(), colour.background(*camera, *number)?)])
            };
            compared.extend(parallel::map(places.len(), of_place).into_iter().collect::<Result<Vec<_>, SetError>>()?);
        }
        let count = compared.iter().map(|(count, _)| count).sum();
        Ok((count, compared.into_iter().flat_map(|(_, faults)| faults).collect()))
    }

    fn compare_all(&self, drawn: Vec<(String, Vec<u8>)>) -> Result<(usize, Vec<Fault>), SetError> {
        let (count, mut faults) = (drawn.len(), Vec::new());
        for (path, bytes) in drawn {
            faults.extend(self.compare(&path, FileContent::Bytes(bytes))?);
        }
        Ok((count, faults))
    }

    /// Draws the truth images again, and adds their paths to the files that were `made`.
    fn layers(&self, parts: &SetParts<'_>, made: &mut BTreeSet<String>) -> Result<CheckOutcome, SetError> {
        let (files, rig) = (self.files, parts.rig);
        if !files.paths().any(|path| path.starts_with(LAYERS)) {
            return Ok(Ok(("the set has no truth images".to_owned(), Vec::new())));
        }
        let truth_images = match layers_of(files) {
            Ok(truth_images) => truth_images,
            Err(error) => return Ok(Ok((String::new(), vec![Fault::from_file("".as_ref(), error)]))),
        };
        let is_drawable = |path: &str| self.has_key || !exr_layers::is_colour(path);
        let mut faults = Vec::new();
        for frame in 0..parts.ground_truth.frames.len() {
            for camera in (0..rig.cameras()).filter(|camera| rig.has_image(*camera, frame)) {
                for path in layer_paths(camera, frame, &truth_images) {
                    if !files.has(&path) {
                        faults.push(Fault::new(&path, "is missing: the set needs one for every camera and frame"));
                    }
                    made.insert(path);
                }
            }
        }
        let drawing = parts.truth_image_drawing(&truth_images);
        let (numbers, found) = (self.frames(), Mutex::new((0, Vec::new())));
        drawing.each(&numbers, &|drawn| {
            stop_if_requested(self.how.stop)?;
            let drawn = drawn.into_iter().filter(|(path, _)| files.has(path) && is_drawable(path)).collect();
            let (count, faults) = self.compare_all(drawn)?;
            let mut found = found.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
            found.0 += count;
            found.1.extend(faults);
            Ok(())
        })?;
        let (count, drawn) = found.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
        faults.extend(drawn);
        faults.sort_by(|a, b| a.file.cmp(&b.file));
        let names: Vec<String> =
            truth_images.iter().map(|layer: &TruthImage| format!("{layer:?}").to_lowercase()).collect();
        Ok(Ok((format!("{count} files drawn again: {}", names.join(", ")), faults)))
    }
}
