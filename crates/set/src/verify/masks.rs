//! Compares every silhouette with a newly rendered one.

use super::parts::ReadParts;
use super::rounding::{MOST_ROUNDED_PX, Rounding};
use super::{CheckOutcome, Fault, VerifyOptions, with_skipped};
use crate::KEY_FILE;
use crate::blind::silhouette_path;
use crate::camera::CameraRig;
use crate::files::SetFiles;
use crate::observation::Observation;
use crate::observing::{SilhouetteObserver, SilhouetteSource};
use crate::parallel;
use crate::raster::{Mask, overlap};
use crate::silhouette_png;

/// Number of pixels, plus a share of the silhouette, in which a faulty silhouette may differ from its explanation.
const EXPLAINED_PX: u64 = 2;
const EXPLAINED_SHARE: f64 = 0.005;

pub(super) fn check(files: &SetFiles, parts: &ReadParts, how: VerifyOptions<'_>) -> CheckOutcome {
    let (truth, rig) = parts.scene()?;
    let (facts, seed) = parts.observed();
    let seed = seed.ok_or_else(|| format!("not checked: {KEY_FILE} cannot be read"))?;
    let filming = parts.filming()?;
    let observing = SilhouetteObserver::new(truth, &filming, &facts, seed);
    let observing = observing.map_err(|e| format!("not checked: set.toml: {e}"))?;
    let numbers: Vec<usize> = (0..truth.frames.len()).step_by(how.every.max(1)).collect();
    let exact = facts.silhouette == SilhouetteSource::Exact;
    let rounding = Rounding::new(truth, &filming, &facts, seed);
    let of_frame = |index: usize| {
        if (how.stop)() {
            return (Vec::new(), 0);
        }
        let frames = truth.frames.len();
        let frame =
            RenderedFrame { files, rig, observing: &observing, rounding: &rounding, number: numbers[index], frames };
        let faults = frame.faults();
        (how.tick)();
        faults
    };
    let (faults, skipped): (Vec<Vec<Fault>>, Vec<usize>) = parallel::map(numbers.len(), of_frame).into_iter().unzip();
    let (faults, skipped) = (faults.concat(), skipped.iter().sum::<usize>());
    let taken = |frame: &usize| (0..rig.cameras.len()).filter(|camera| filming.has_image(*camera, *frame)).count();
    let redrawn: usize = numbers.iter().map(taken).sum();
    let how_made = if exact { String::new() } else { format!(", {}", facts.describe()) };
    with_skipped(skipped, "silhouettes", format!("{redrawn} silhouettes redrawn{how_made}"), faults)
}

/// A frame to render again.
struct RenderedFrame<'a> {
    files: &'a SetFiles,
    rig: &'a CameraRig,
    observing: &'a SilhouetteObserver<'a>,
    number: usize,
    /// Decides which pixels may differ by rounding.
    rounding: &'a Rounding<'a>,
    frames: usize,
}

impl RenderedFrame<'_> {
    /// The faults, and the number of images that could not be read.
    fn faults(&self) -> (Vec<Fault>, usize) {
        let expected = self.observing.observe(self.number);
        let (mut faults, mut skipped) = (Vec::new(), 0);
        for (index, camera) in self.rig.cameras.iter().enumerate() {
            if !expected.has_image(index) {
                continue;
            }
            let path = silhouette_path(index, self.number);
            let (width, height) = (camera.pinhole.width, camera.pinhole.height);
            let found = self.files.read(&path).and_then(|b| silhouette_png::decode(&path, &b, width, height));
            match found {
                Ok(found) if self.is_sound(&expected.silhouettes[index], &found, index) => {}
                Ok(found) => faults.push(Fault::new(&path, self.explain(&expected, index, &found))),
                // other checks report missing and changed files
                Err(error) if error.is_hash_fault() => skipped += 1,
                Err(error) => faults.push(error.into()),
            }
        }
        (faults, skipped)
    }

    /// Whether a mask is the expected one, except for pixels that may differ by rounding.
    fn is_sound(&self, expected: &Mask, found: &Mask, camera: usize) -> bool {
        match differing(expected, found) {
            0 => true,
            // rounding changes fewer pixels than that, and rendering again takes time
            1..=MOST_ROUNDED_PX => self.rounding.explains(expected, found, camera, self.number),
            _ => false,
        }
    }

    /// Whether a mask is approximately the expected one.
    fn is_near(expected: &Mask, found: &Mask) -> bool {
        let more = (EXPLAINED_SHARE * expected.count() as f64) as u64;
        differing(expected, found) <= EXPLAINED_PX + more
    }

    /// Describes a wrong silhouette, with the mistake that explains it if known.
    fn explain(&self, expected: &Observation, camera: usize, found: &Mask) -> String {
        let own = &expected.silhouettes[camera];
        let (width, height) = (own.width(), own.height());
        let is = |other: &Mask| Self::is_near(other, found);
        let size = |mask: &Mask| (mask.width(), mask.height());
        let mirrored = Mask::from_fn(width, height, |x, y| own.get(width - 1 - x, y));
        let upside_down = Mask::from_fn(width, height, |x, y| own.get(x, height - 1 - y));
        let inverted = Mask::from_fn(width, height, |x, y| !own.get(x, y));
        let neighbours = [self.number.checked_sub(1), Some(self.number + 1).filter(|next| *next < self.frames)];
        let neighbour =
            || neighbours.into_iter().flatten().find(|number| is(&self.observing.observe(*number).silhouettes[camera]));
        let other_camera = || {
            let others = expected.silhouettes.iter().enumerate().filter(|(index, _)| *index != camera);
            others.filter(|(_, other)| size(other) == size(found)).find(|(_, other)| is(other)).map(|(index, _)| index)
        };
        let iou = overlap(own, found).iou();
        let why = if found.is_empty() {
            format!("it is empty; expected {} pixels", own.count())
        } else if is(&mirrored) {
            "it is mirrored left to right".to_owned()
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
        format!("is not the silhouette of camera {camera} in frame {}: {why} (IoU {iou:.4})", self.number)
    }
}

/// Number of pixels in which two masks of equal size differ.
fn differing(a: &Mask, b: &Mask) -> u64 {
    let common = a.count_common(b);
    a.count() + b.count() - 2 * common
}
