//! Compares the images that trackers are given with newly drawn ones.

use super::parts::ReadParts;
use super::{CheckOutcome, Fault, VerifyOptions, with_skipped};
use crate::colour_files::{self, BACKGROUND, COLOUR};
use crate::files::SetFiles;
use crate::observing::{ColourCamera, ColourFormat, Image, image_from_jpeg};
use crate::parallel;

/// Difference of a value that rounding explains: brightness and noise are rounded once, JPEG's blocks once more.
const ROUNDING: u8 = 1;
const ROUNDING_OF_JPEG: u8 = 6;
/// Share of the values that may differ by more, because the outline of a figure moved by a pixel.
const DIFFERENT: f64 = 1e-3;

pub(super) fn check(files: &SetFiles, parts: &ReadParts, how: VerifyOptions<'_>) -> CheckOutcome {
    let (facts, seed) = parts.observed();
    let given: Vec<&str> =
        files.paths().filter(|path| path.starts_with(COLOUR) || path.starts_with(BACKGROUND)).collect();
    let Some(format) = facts.colour_images else {
        let faults = given.into_iter().map(|path| Fault::new(path, "is present, but set.toml states no images"));
        return Ok(("the set has no images for trackers".to_owned(), faults.collect()));
    };
    let (truth, rig) = parts.scene()?;
    let (filming, seed) = (parts.filming()?, seed.ok_or("not checked: truth/key.txt cannot be read")?);
    if (0..filming.cameras()).any(|camera| filming.path(camera).is_some()) {
        return Err("not checked: set.toml states images, but cameras move".to_owned());
    }
    let Some(camera) = ColourCamera::new(truth, &filming, &facts, seed) else {
        return Err("not checked: set.toml states no images".to_owned());
    };
    let redrawn = Redrawn { files, camera: &camera, format };
    let sizes: Vec<[u32; 2]> = rig.cameras.iter().map(|c| [c.pinhole.width, c.pinhole.height]).collect();
    let every = how.every.max(1);
    let numbers: Vec<usize> = (0..truth.frames.len()).step_by(every).collect();
    let of_frame = |index: usize| {
        let mut found = Vec::new();
        if !(how.stop)() {
            camera.each_image(numbers[index], |camera, image| {
                let path = colour_files::path(format, camera, numbers[index]);
                found.push(redrawn.compare(&path, &image, sizes[camera]));
            });
        }
        found
    };
    let of_background = |camera_index: usize| {
        let of_number = |number: usize| {
            let path = colour_files::background_path(format, camera_index, number);
            redrawn.compare(&path, &camera.background(camera_index, number), sizes[camera_index])
        };
        (0..camera.backgrounds()).step_by(every).take_while(|_| !(how.stop)()).map(of_number).collect()
    };
    let images = parallel::map(numbers.len(), of_frame);
    let backgrounds: Vec<Vec<ImageFinding>> = parallel::map(sizes.len(), of_background);
    let compared: Vec<ImageFinding> = images.into_iter().chain(backgrounds).flatten().collect();
    let (drawn, skipped) = (compared.len(), compared.iter().filter(|one| matches!(one, ImageFinding::Unread)).count());
    let wrong =
        compared.into_iter().filter_map(|one| if let ImageFinding::Wrong(fault) = one { Some(fault) } else { None });
    let missing = redrawn.missing_backgrounds(sizes.len());
    with_skipped(skipped, "images", format!("{drawn} images redrawn"), missing.chain(wrong).collect())
}

/// The result for one image.
enum ImageFinding {
    Same,
    Wrong(Fault),
    /// Missing or changed, which another check reports.
    Unread,
}

struct Redrawn<'a> {
    files: &'a SetFiles,
    camera: &'a ColourCamera<'a>,
    format: ColourFormat,
}

impl Redrawn<'_> {
    fn compare(&self, path: &str, drawn: &Image, size: [u32; 2]) -> ImageFinding {
        if !self.files.has(path) {
            return ImageFinding::Unread;
        }
        let found = match self.files.read(path).and_then(|bytes| colour_files::decode(path, &bytes, size)) {
            Ok(found) => found,
            Err(error) if error.is_hash_fault() => return ImageFinding::Unread,
            Err(error) => return ImageFinding::Wrong(error.into()),
        };
        let (expected, rounding) = match self.format {
            ColourFormat::Png => (Some(drawn.clone()), ROUNDING),
            ColourFormat::Jpeg => {
                let file = self.camera.jpeg(drawn);
                (file.and_then(|file| image_from_jpeg(&file, size)), ROUNDING_OF_JPEG)
            }
        };
        let differs = expected.and_then(|expected| difference(&expected, &found, rounding));
        differs.map_or(ImageFinding::Same, |detail| ImageFinding::Wrong(Fault::new(path, detail)))
    }

    /// Background images that are missing, and those beyond their number.
    fn missing_backgrounds(&self, cameras: usize) -> impl Iterator<Item = Fault> {
        let numbers = self.camera.backgrounds();
        let path = |camera, number| colour_files::background_path(self.format, camera, number);
        let all: std::collections::BTreeSet<String> =
            (0..cameras).flat_map(|camera| (0..numbers).map(move |number| path(camera, number))).collect();
        let missing = all.iter().filter(|path| !self.files.has(path)).map(|path| Fault::new(path, "is missing"));
        let is_other = |path: &&str| path.starts_with(BACKGROUND) && !all.contains(*path);
        let detail = format!("is not one of the {numbers} background images of {cameras} cameras");
        let other = self.files.paths().filter(is_other).map(|path| Fault::new(path, detail.clone()));
        missing.chain(other).collect::<Vec<_>>().into_iter()
    }
}

fn difference(expected: &Image, found: &Image, rounding: u8) -> Option<String> {
    if expected.shape() != found.shape() {
        return Some(format!("has the shape {:?}, expected {:?}", found.shape(), expected.shape()));
    }
    let (expected, found) = (expected.interleaved(), found.interleaved());
    let differing = |expected: &[u8]| expected.iter().zip(&found).filter(|(a, b)| a.abs_diff(**b) > rounding).count();
    let allowed = (DIFFERENT * found.len() as f64) as usize;
    let wrong = differing(&expected);
    (wrong > allowed).then(|| {
        let turned: Vec<u8> = expected.as_chunks::<3>().0.iter().flat_map(|[r, g, b]| [*b, *g, *r]).collect();
        let is_turned = turned.len() == found.len() && differing(&turned) <= allowed;
        let why = if is_turned { "; red and blue are exchanged" } else { "" };
        format!("{wrong} of {} values differ from the image of the scene{why}", found.len())
    })
}
