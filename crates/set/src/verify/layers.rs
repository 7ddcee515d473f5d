//! Compares truth images with newly rendered ones, and with the joints.

use std::collections::BTreeSet;

use super::parts::ReadParts;
use super::{CheckOutcome, Fault, VerifyOptions, surface, with_skipped};
use crate::body::{DepthImage, Humanoid};
use crate::camera::Camera;
use crate::depth_png;
use crate::exr_layers::{self, LayerImage};
use crate::files::SetFiles;
use crate::observing::{LayerObserver, WantedLayers};
use crate::parallel;
use crate::scene::{GroundTruth, TruthFrame};

/// Tolerance of depths, metres.
const TOLERANCE_M: f32 = 1e-5;

/// Distance from a half millimetre at which either rounding is accepted, millimetres.
const ROUNDING: f64 = 0.01;

/// Number of pixels in which part or depth may differ, as in silhouettes.
const TOLERANCE_PX: usize = 2;

/// Joints are inside the body, so the visible surface is at most this far behind them: the thickness of a body, metres.
const THICKEST_M: f64 = 0.6;

pub(super) fn check(files: &SetFiles, parts: &ReadParts, how: VerifyOptions<'_>) -> CheckOutcome {
    if !files.paths().any(|path| exr_layers::is_layer(path) || exr_layers::is_colour(path)) {
        return Ok(("the set has no truth images".to_owned(), Vec::new()));
    }
    let (truth, rig) = parts.scene()?;
    let filming = parts.filming()?;
    let (mut faults, mut skipped) = (Vec::new(), 0);
    let numbers: Vec<usize> = (0..truth.frames.len()).step_by(how.every.max(1)).collect();
    for index in 0..rig.cameras.len() {
        let observer = LayerObserver::new(truth, &filming, index, wanted(files, parts, index, &numbers));
        let of_frame = |at: usize| {
            let (number, mut faults, mut skipped) = (numbers[at], Vec::new(), 0);
            if (how.stop)() {
                return (faults, skipped);
            }
            let Some(expected) = observer.look(number) else { return (faults, skipped) };
            let opened_s = filming.row_s(index, truth.frames[number].time_s, 0);
            let camera = &filming.camera_at(index, opened_s);
            let (path, colour) = (exr_layers::path(index, number), exr_layers::colour_path(index, number));
            match exr_layers::read_layers(files, index, number) {
                // the check of the files reports missing ones
                Ok(None) => skipped += 1,
                Ok(Some(image)) => {
                    let checked = CheckedImage { truth, frame: number, camera, image: &image };
                    let own = checked.faults(&expected.depth);
                    if own.is_empty() {
                        let wrong = surface::colour_fault(&image, &expected.colour);
                        let of_colour = if files.has(&colour) { &colour } else { &path };
                        faults.extend(wrong.map(|detail| Fault::new(of_colour, detail)));
                        let wrong = surface::faults(&image, &expected, camera);
                        faults.extend(wrong.into_iter().map(|detail| Fault::new(&path, detail)));
                    }
                    faults.extend(own.into_iter().map(|detail| Fault::new(&path, detail)));
                }
                Err(error) if error.is_hash_fault() => skipped += 1,
                Err(error) => faults.push(error.into()),
            }
            match depth_png_fault(files, index, number, &expected.depth) {
                Ok(fault) => faults.extend(fault),
                Err(UnreadImage) => skipped += 1,
            }
            (faults, skipped)
        };
        for (found, unread) in parallel::map(numbers.len(), of_frame) {
            faults.extend(found);
            skipped += unread;
        }
    }
    with_skipped(skipped, "images", format!("{} images redrawn", numbers.len() * rig.cameras.len()), faults)
}

/// The layers to render for checking the images of a camera.
fn wanted(files: &SetFiles, parts: &ReadParts, camera: usize, numbers: &[usize]) -> WantedLayers {
    let mut wanted = WantedLayers { depth: true, ..WantedLayers::default() };
    // all images of a set have the same layers; an image with others is found by its channels
    let first = numbers.iter().find_map(|number| exr_layers::read_layers(files, camera, *number).ok()?);
    let Some(image) = first else { return wanted };
    wanted.normals = image.floats(surface::NORMALS).is_some();
    wanted.flow = image.floats(surface::FLOW).is_some();
    wanted.coverage = image.floats(surface::COVERAGE).is_some();
    let colour = image.floats(surface::COLOUR).is_some() || image.floats(surface::GREY).is_some();
    wanted.colour = parts.images().filter(|_| colour);
    wanted
}

/// An image that is missing or changed, which the check of the hashes reports.
struct UnreadImage;

/// Checks the depth in millimetres, if the set has it.
fn depth_png_fault(
    files: &SetFiles,
    camera: usize,
    number: usize,
    expected: &DepthImage,
) -> Result<Option<Fault>, UnreadImage> {
    let path = depth_png::path(camera, number);
    if !files.has(&path) {
        return Ok(None);
    }
    let found = files.read(&path).and_then(|b| depth_png::decode(&path, &b, [expected.width, expected.height]));
    let found = match found {
        Ok(found) => found,
        Err(error) if error.is_hash_fault() => return Err(UnreadImage),
        Err(error) => return Ok(Some(error.into())),
    };
    let is_halfway = |depth: f32| ((f64::from(depth) * 1000.0).fract() - 0.5).abs() < ROUNDING;
    let is_wrong = |(found, depth): &(&u16, &f32)| {
        let expected = depth_png::millimetres(**depth);
        let is_rounded = found.abs_diff(expected) == 1 && **found > 0 && expected > 0 && is_halfway(**depth);
        **found != expected && !is_rounded
    };
    let pairs = || found.iter().zip(expected.depth.iter().map(|depth| depth_png::millimetres(*depth)));
    let wrong = found.iter().zip(&expected.depth).filter(is_wrong).count();
    let swapped = || pairs().filter(|(found, expected)| found.swap_bytes() != *expected).count() <= TOLERANCE_PX;
    let moved = |by: i32| {
        let is_moved = |(found, expected): &(&u16, u16)| i32::from(**found) == i32::from(*expected) + by;
        pairs().filter(|(_, expected)| *expected > 0).all(|pair| is_moved(&pair))
    };
    let why = match wrong > TOLERANCE_PX {
        true if swapped() => "; their bytes are swapped",
        true if moved(1) => "; all are 1 mm too far",
        true if moved(-1) => "; all are 1 mm too near",
        _ => "",
    };
    let pixels = found.len();
    Ok((wrong > TOLERANCE_PX).then(|| {
        let detail = format!("{wrong} of {pixels} pixels differ from the depth of the body{why}");
        Fault::new(&path, detail)
    }))
}

/// The truth images of a camera in a frame, to be checked.
struct CheckedImage<'a> {
    truth: &'a GroundTruth,
    frame: usize,
    camera: &'a Camera,
    image: &'a LayerImage,
}

impl CheckedImage<'_> {
    fn faults(&self, expected: &DepthImage) -> Vec<String> {
        let mut faults = Vec::new();
        let pixels = expected.part.len();
        if (self.image.width, self.image.height) != (expected.width, expected.height) {
            let (w, h) = (self.image.width, self.image.height);
            return vec![format!(
                "the image has {w} x {h} pixels, its camera {} x {}",
                expected.width, expected.height
            )];
        }
        if let Some(part) = &self.image.part {
            faults.extend(unknown_parts(part, &self.truth.actor));
            let wrong = (0..pixels).filter(|i| part[*i] != expected.part[*i]).count();
            if wrong > TOLERANCE_PX {
                let shift = |by: i64| {
                    let is_off =
                        |i: &usize| expected.part[*i] > 0 && i64::from(part[*i]) != i64::from(expected.part[*i]) + by;
                    (0..pixels).filter(is_off).count() <= TOLERANCE_PX
                };
                let why = [(-1, "; all are one too low"), (1, "; all are one too high")];
                let why = why.into_iter().find(|(by, _)| shift(*by)).map_or("", |(_, why)| why);
                faults.push(format!("id.part: {wrong} of {pixels} pixels differ from the parts of the body{why}"));
            }
        }
        if let Some(depth) = &self.image.depth {
            let off =
                |i: &usize| !(depth[*i] == expected.depth[*i] || (depth[*i] - expected.depth[*i]).abs() < TOLERANCE_M);
            let wrong = (0..pixels).filter(off).count();
            if wrong > TOLERANCE_PX {
                let why = self.wrong_depth(depth, expected);
                faults.push(format!("depth.Z: {wrong} of {pixels} pixels differ from the depth of the body{why}"));
            }
            faults.extend(self.joints_before_surface(depth));
        }
        faults
    }

    fn frame(&self) -> &TruthFrame {
        &self.truth.frames[self.frame]
    }

    /// Explains wrong depths by another unit, or by distances from the camera's centre instead of along z.
    fn wrong_depth(&self, depth: &[f32], expected: &DepthImage) -> &'static str {
        let width = expected.width.max(1) as usize;
        let along_ray = |i: usize| {
            let pixel = nalgebra::Point2::new((i % width) as f64 + 0.5, (i / width) as f64 + 0.5);
            let (x, y) = self.camera.pinhole.normalised(&pixel);
            let bent = self.camera.distortion.undistort(x, y);
            bent.map_or(f64::NAN, |(x, y)| (x * x + y * y + 1.0).sqrt())
        };
        let figure: Vec<usize> = (0..depth.len()).filter(|i| expected.depth[*i].is_finite()).collect();
        let all = |factor: &dyn Fn(usize) -> f64| {
            let off = |i: &&usize| {
                let expected = f64::from(expected.depth[**i]) * factor(**i);
                (f64::from(depth[**i]) - expected).abs() > 1e-4 * expected.abs()
            };
            !figure.is_empty() && figure.iter().filter(off).count() <= TOLERANCE_PX
        };
        if all(&|_| 1000.0) {
            "; it is in millimetres"
        } else if all(&along_ray) {
            "; it is measured along the ray, not along the camera's z axis"
        } else {
            ""
        }
    }

    /// Joints are inside the body, so the visible surface at their pixels cannot be behind them.
    fn joints_before_surface(&self, depth: &[f32]) -> Option<String> {
        let width = self.camera.pinhole.width as usize;
        let joints = self.frame().joint_positions.iter().zip(&self.truth.actor.joints).enumerate();
        let moved = joints.filter(|(joint, _)| has_solids(&self.truth.actor, joint + 1));
        let mut wrong = moved.filter_map(|(_, (place, joint))| {
            let pixel = self.camera.project(place).filter(|pixel| self.camera.pinhole.contains(pixel))?;
            let at = pixel.y as usize * width + pixel.x as usize;
            let (surface, own) = (f64::from(*depth.get(at)?), (self.camera.camera_from_world * place).z);
            (surface.is_finite() && surface > own + THICKEST_M).then(|| {
                format!(
                    "depth.Z: at the pixel of joint {:?} it is {surface:.3} m, but the joint is at {own:.3} m",
                    joint.name
                )
            })
        });
        wrong.next()
    }
}

/// Numbers of parts that the robot does not have, or that have no geometry.
fn unknown_parts(part: &[u32], actor: &Humanoid) -> Option<String> {
    let numbers: BTreeSet<u32> = part.iter().copied().filter(|part| *part > 0).collect();
    let unknown: Vec<u32> = numbers.into_iter().filter(|part| !has_solids(actor, *part as usize - 1)).collect();
    let links = actor.links.len();
    (!unknown.is_empty()).then(|| format!("id.part: {unknown:?} are not visible parts of the actor's {links} links"))
}

/// Whether a link has geometry.
fn has_solids(actor: &Humanoid, link: usize) -> bool {
    actor.links.get(link).is_some_and(|link| !link.solids.is_empty())
}
