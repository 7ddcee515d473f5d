//! Every silhouette against a new one.

use super::parts::ReadParts;
use super::{Fault, Outcome, Thoroughness};
use crate::benchmark_set::blind::silhouette_path;
use crate::benchmark_set::files::SetFiles;
use crate::benchmark_set::{SetError, silhouette_png};
use crate::camera::CameraRig;
use crate::observation::{Observation, Observer};
use crate::parallel;
use crate::raster::{Mask, overlap};

/// Pixels in which a silhouette may differ from the new one: the camera's numbers are rounded once in `cameras.json`,
/// which can decide a pixel whose centre lies on an outline.
const TOLERANCE_PX: u64 = 2;

pub(super) fn check(files: &SetFiles, parts: &ReadParts, how: Thoroughness<'_>) -> Outcome {
    let (truth, rig) = parts.scene()?;
    if parts.masks_are_spoiled() {
        return Ok((parts.spoiled().unwrap_or_default(), Vec::new()));
    }
    let observer = Observer::new(truth, rig);
    let numbers: Vec<usize> = (0..truth.frames.len()).step_by(how.every.max(1)).collect();
    let of_frame = |index: usize| {
        if (how.stop)() {
            return Vec::new();
        }
        let frame = Redrawn { files, rig, observer: &observer, number: numbers[index], frames: truth.frames.len() };
        let faults = frame.faults();
        (how.tick)();
        faults
    };
    let faults = parallel::map(numbers.len(), of_frame).concat();
    Ok((format!("{} silhouettes redrawn", numbers.len() * rig.cameras.len()), faults))
}

/// A frame to be redrawn.
struct Redrawn<'a> {
    files: &'a SetFiles,
    rig: &'a CameraRig,
    observer: &'a Observer<'a>,
    number: usize,
    frames: usize,
}

impl Redrawn<'_> {
    fn faults(&self) -> Vec<Fault> {
        let expected = self.observer.observe(self.number);
        let mut faults = Vec::new();
        for (index, camera) in self.rig.cameras.iter().enumerate() {
            let path = silhouette_path(index, self.number);
            let (width, height) = (camera.pinhole.width, camera.pinhole.height);
            let found = self.files.read(&path).and_then(|b| silhouette_png::decode(&path, &b, width, height));
            match found {
                Ok(found) if differing(&expected.silhouettes[index], &found) <= TOLERANCE_PX => {}
                Ok(found) => faults.push(Fault::new(&path, self.explain(&expected, index, &found))),
                // what is missing or was changed is named by other checks
                Err(SetError::Tampered { .. } | SetError::NotASet { .. } | SetError::Io { .. }) => {}
                Err(error) => faults.push(error.into()),
            }
        }
        faults
    }

    /// What is wrong with a silhouette: what it is instead, if that is known.
    fn explain(&self, expected: &Observation, camera: usize, found: &Mask) -> String {
        let own = &expected.silhouettes[camera];
        let (width, height) = (own.width(), own.height());
        let is = |other: &Mask| differing(other, found) <= TOLERANCE_PX;
        let size = |mask: &Mask| (mask.width(), mask.height());
        let mirrored = Mask::from_fn(width, height, |x, y| own.get(width - 1 - x, y));
        let upside_down = Mask::from_fn(width, height, |x, y| own.get(x, height - 1 - y));
        let inverted = Mask::from_fn(width, height, |x, y| !own.get(x, y));
        let neighbours = [self.number.checked_sub(1), Some(self.number + 1).filter(|next| *next < self.frames)];
        let neighbour =
            || neighbours.into_iter().flatten().find(|number| is(&self.observer.observe(*number).silhouettes[camera]));
        let other_camera = || {
            let others = expected.silhouettes.iter().enumerate().filter(|(index, _)| *index != camera);
            others.filter(|(_, other)| size(other) == size(found)).find(|(_, other)| is(other)).map(|(index, _)| index)
        };
        let iou = overlap(own, found).iou();
        let why = if found.is_empty() {
            "it is empty, and the body is in view".to_owned()
        } else if is(&mirrored) {
            "it is mirrored, left and right".to_owned()
        } else if is(&upside_down) {
            "it is upside down".to_owned()
        } else if is(&inverted) {
            "it is inverted".to_owned()
        } else if let Some(number) = neighbour() {
            format!("it is that of frame {number}")
        } else if let Some(other) = other_camera() {
            format!("it is that of camera {other}, {:?}", self.rig.cameras[other].name)
        } else {
            format!("{} of its {} pixels differ", differing(own, found), found.count())
        };
        format!("is not what camera {camera} sees of the body in frame {}: {why} (IoU {iou:.4})", self.number)
    }
}

/// Number of pixels in which two masks of one size differ.
fn differing(a: &Mask, b: &Mask) -> u64 {
    let common = a.count_common(b);
    a.count() + b.count() - 2 * common
}
