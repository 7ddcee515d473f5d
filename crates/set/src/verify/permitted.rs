//! The files outside `truth/`: a list of those that trackers may read, each in the one form that skiagraph writes.
//!
//! Every file is read and written again. If the bytes are the same, it holds the arrays, keys and pixels of its format
//! and nothing beside them: no other array, no note, no chunk of an image. Only texts that explain the set may differ,
//! because other versions of this program explain it in other words; a JPEG is compared where it is drawn again.

use std::collections::{BTreeMap, BTreeSet};

use super::difference::difference;
use super::{CheckOutcome, Fault};
use crate::files::SetFiles;
use crate::format::listing::{COMPLETE, FOOTAGE_MADE_BY, FORMATS, READER, README};
use crate::format::manifest::{self, BlindManifest};
use crate::format::{
    body_file, cameras_file, colour_files, grey_png, keypoints_file, moments_file, silhouette_png, start_file,
};
use crate::{BlindSet, SetError};
use skiagraph_core::parallel;
use skiagraph_truth::observing::ObservationFacts;

/// Greatest number of missing images that are reported one by one.
const MOST_MISSING: usize = 20;

pub(super) fn check(files: &SetFiles, manifest: &BlindManifest, side: &BlindSet) -> CheckOutcome {
    let outside: Vec<&str> = files.paths().filter(|path| !path.starts_with("truth/")).collect();
    let looked_at = format!("{} files outside truth/", outside.len());
    let records = match records(manifest, side) {
        Ok(records) => records,
        Err(error) => return Ok((looked_at, vec![Fault::from_file("".as_ref(), error)])),
    };
    let backgrounds = (0..side.rig.cameras.len()).flat_map(|camera| side.background_paths(camera)).collect();
    let form = BlindForm { files, side, records, backgrounds };
    let found = parallel::map(outside.len(), |index| form.fault(outside[index]));
    let missing = form.missing_images().take(MOST_MISSING);
    let missing = missing.map(|path| Fault::new(&path, "is missing: the set needs one for every camera and frame"));
    Ok((looked_at, found.into_iter().flatten().chain(missing).collect()))
}

/// The files without images, as skiagraph writes what they say; `None` for those that only explain.
fn records(manifest: &BlindManifest, side: &BlindSet) -> Result<BTreeMap<&'static str, Option<Vec<u8>>>, SetError> {
    let moments_path = side.moments.is_some().then_some(moments_file::PATH);
    let (training_path, training) = side.start.training_file()?;
    let mut records = BTreeMap::from([
        (README, None),
        (FORMATS, None),
        (READER, None),
        (COMPLETE, None),
        (manifest::PATH, Some(manifest::to_toml(manifest)?)),
        (cameras_file::PATH, Some(cameras_file::to_json(&side.rig, moments_path)?)),
        (start_file::PATH, Some(side.start.to_json()?)),
        (start_file::BODY_PATH, Some(body_file::to_json(start_file::BODY_PATH, &side.start.body)?)),
        (training_path, Some(training)),
    ]);
    // of a set with a truth this file is on that side
    if side.observation.as_ref().is_some_and(ObservationFacts::is_footage) {
        records.insert(FOOTAGE_MADE_BY, None);
    }
    if let Some(moments) = &side.moments {
        let bytes = moments_file::to_npz(moments, &side.rig).to_bytes(moments_file::PATH)?;
        records.insert(moments_file::PATH, Some(bytes));
    }
    if let Some(keypoints) = &side.keypoints {
        let views: Vec<_> = (0..side.frame_count).map(|frame| keypoints.frame(frame).views).collect();
        let npz = keypoints_file::found_to_npz(keypoints.layout, &side.rig, &views);
        records.insert(keypoints_file::PATH, Some(npz.to_bytes(keypoints_file::PATH)?));
    }
    Ok(records)
}

struct BlindForm<'a> {
    files: &'a SetFiles,
    side: &'a BlindSet,
    records: BTreeMap<&'static str, Option<Vec<u8>>>,
    backgrounds: BTreeSet<String>,
}

impl BlindForm<'_> {
    fn fault(&self, path: &str) -> Option<Fault> {
        let again = match (self.records.get(path), self.camera_of(path)) {
            (Some(Some(record)), _) => Ok(record.clone()),
            (None, Some(camera)) if !path.ends_with(".jpg") => self.image_again(path, camera),
            (Some(None), _) | (None, Some(_)) => return None,
            (None, None) => return Some(Fault::new(path, "is not one of the files that trackers may read")),
        };
        let again = again.and_then(|again| Ok((again, self.files.read(path)?)));
        match again {
            Ok((again, found)) if again == *found => None,
            Ok((again, found)) => {
                let detail = difference(path, &again, &found);
                Some(Fault::new(path, format!("holds more or other than skiagraph writes there: {detail}")))
            }
            // the check of the hashes reports files that are missing or changed
            Err(error) if error.is_hash_fault() => None,
            Err(error) => Some(Fault::from_file("".as_ref(), error)),
        }
    }

    /// An image, decoded and encoded again.
    fn image_again(&self, path: &str, camera: usize) -> Result<Vec<u8>, SetError> {
        let (pinhole, bytes) = (&self.side.rig.cameras[camera].pinhole, self.files.read(path)?);
        if path.starts_with(colour_files::COLOUR) || path.starts_with(colour_files::BACKGROUND) {
            let image = colour_files::decode(path, &bytes, [pinhole.width, pinhole.height])?;
            return grey_png::encode_image(path, &image);
        }
        let mask = silhouette_png::decode(path, &bytes, pinhole.width, pinhole.height)?;
        silhouette_png::encode(path, &mask)
    }

    /// The camera of an image of the set; `None` for all other paths.
    fn camera_of(&self, path: &str) -> Option<usize> {
        let (camera, frame) = index_of(path).filter(|(camera, _)| *camera < self.side.rig.cameras.len())?;
        let is_of_frame = frame < self.side.frame_count
            && self.side.has_image(camera, frame)
            && (path == BlindSet::silhouette_path(camera, frame)
                || self.side.colour_path(camera, frame).as_deref() == Some(path));
        (is_of_frame || self.backgrounds.contains(path)).then_some(camera)
    }

    fn missing_images(&self) -> impl Iterator<Item = String> {
        let (cameras, frames) = (self.side.rig.cameras.len(), self.side.frame_count);
        let places = (0..frames).flat_map(move |frame| (0..cameras).map(move |camera| (camera, frame)));
        let taken = places.filter(|(camera, frame)| self.side.has_image(*camera, *frame));
        let paths = taken.flat_map(|(camera, frame)| {
            [Some(BlindSet::silhouette_path(camera, frame)), self.side.colour_path(camera, frame)].into_iter().flatten()
        });
        paths.filter(|path| !self.files.has(path))
    }
}

/// Camera and frame (or number) in the path of an image.
fn index_of(path: &str) -> Option<(usize, usize)> {
    let camera = path.split('/').find_map(|part| part.strip_prefix("cam")).and_then(|digits| digits.parse().ok());
    let name = path.rsplit('/').next();
    let frame = name.and_then(|name| name.split('.').next()).and_then(|digits| digits.parse().ok());
    camera.zip(frame)
}
