//! The masks of a recording: which images belong to which camera, their size, and what they show.

use std::fs;
use std::path::{Path, PathBuf};

use super::video;
use crate::common::{ExperimentError, key_error};
use crate::scenario::{ImageFit, MaskSettings};
use crate::segmentation::pictures::{images_in, read_image};
use skiagraph_core::camera::{Camera, CameraRig};
use skiagraph_core::raster::Mask;

/// The folder of each camera below `path`, or its file if it ends in one of `files`: by its name, or else in the order
/// of names, with a note that says so. The folder of a name may also end in one of `endings`.
pub(super) fn places_of(
    key: &str,
    path: &Path,
    rig: &CameraRig,
    endings: &[&str],
    files: &[&str],
) -> Result<(Vec<PathBuf>, Option<String>), ExperimentError> {
    let unreadable = |source| ExperimentError::Unreadable { path: path.to_owned(), source };
    let entries = fs::read_dir(path).map_err(unreadable)?.flatten();
    let is_file = |path: &Path| {
        let ending = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
        files.contains(&ending.as_str()) && path.is_file()
    };
    let mut places: Vec<PathBuf> =
        entries.map(|entry| entry.path()).filter(|path| path.is_dir() || is_file(path)).collect();
    places.sort();
    let name = |place: &Path| {
        let name = if place.is_dir() { place.file_name() } else { place.file_stem() };
        name.unwrap_or_default().to_string_lossy().into_owned()
    };
    let is_of = |place: &Path, camera: &Camera| {
        let (found, known) = (name(place), &camera.name);
        endings.iter().any(|ending| found.strip_suffix(ending) == Some(known))
    };
    let named: Option<Vec<PathBuf>> =
        rig.cameras.iter().map(|camera| places.iter().find(|place| is_of(place, camera)).cloned()).collect();
    if let Some(named) = named {
        return Ok((named, None));
    }
    let cameras: Vec<&str> = rig.cameras.iter().map(|camera| camera.name.as_str()).collect();
    let found: Vec<String> = places.iter().map(|place| name(place)).collect();
    let is_named = places.iter().any(|place| rig.cameras.iter().any(|camera| is_of(place, camera)));
    if places.len() != cameras.len() || is_named {
        let message = format!(
            "expected a folder (or a file .{}) for each camera ({}) in {}, found {}: rename them, or leave cameras out \
             with rig.leave_out",
            files[0],
            cameras.join(", "),
            path.display(),
            if found.is_empty() { "none".to_owned() } else { found.join(", ") }
        );
        return Err(key_error(key, message));
    }
    let pairs: Vec<String> = cameras.iter().zip(&found).map(|(camera, place)| format!("{camera}: {place}")).collect();
    let note =
        format!("{key}: no folders have the names of the cameras, so they are taken in order: {}", pairs.join(", "));
    Ok((places, Some(note)))
}

/// The images of the masks of every camera, of which videos are taken apart into `scratch`, with notes.
pub(super) fn images_of(
    path: &Path,
    rig: &CameraRig,
    frames_per_second: f64,
    scratch: &Path,
) -> Result<(Vec<Vec<PathBuf>>, Vec<String>), ExperimentError> {
    let (places, note) = places_of("masks.path", path, rig, &[""], &video::ENDINGS)?;
    let (mut images, mut notes) = (Vec::new(), Vec::from_iter(note));
    for (index, place) in places.iter().enumerate() {
        let inner = place.join("silhouette");
        let taken = scratch.join(format!("{index:03}"));
        let folder = match (place.is_dir(), inner.is_dir()) {
            (false, _) => {
                notes.extend(video::take_apart(place, frames_per_second, &taken)?);
                &taken
            }
            (true, true) => &inner,
            (true, false) => place,
        };
        images.push(images_in(folder)?);
    }
    Ok((images, notes))
}

/// Leaves out the first images of some cameras, so that those of one place in the order are of the same time, and
/// returns the number of those that all cameras have.
pub(super) fn in_step(
    images: &mut [Vec<PathBuf>],
    rig: &CameraRig,
    skip: &[usize],
    is_cut: bool,
) -> Result<usize, ExperimentError> {
    let names = || rig.cameras.iter().map(|camera| &camera.name);
    for ((images, skip), name) in images.iter_mut().zip(skip).zip(names()) {
        if *skip >= images.len() {
            let message = format!("expected fewer than the {} images of this camera, found {skip}", images.len());
            return Err(key_error(format!("skip.{name}"), message));
        }
        images.drain(..*skip);
    }
    let counts: Vec<usize> = images.iter().map(Vec::len).collect();
    let least = counts.iter().copied().min().unwrap_or_default();
    if counts.iter().all(|count| *count == least) || is_cut {
        return Ok(least);
    }
    let each: Vec<String> = names().zip(&counts).map(|(camera, count)| format!("{camera}: {count}")).collect();
    let message = format!(
        "expected the same number of images for every camera, one a frame, found {}: if all began together, give last_frame = \
         {}; if some began earlier, give the number of images that only they have, [skip] CAMERA = NUMBER; images that a \
         camera dropped between others must be put in",
        each.join(", "),
        least - 1
    );
    Err(key_error("masks.path", message))
}

/// The camera that took images of this size, which the camera of the calibration may not be.
pub(super) fn fitted(camera: &Camera, size: [u32; 2], fit: ImageFit, image: &Path) -> Result<Camera, ExperimentError> {
    let calibrated = [camera.pinhole.width, camera.pinhole.height];
    if size == calibrated {
        return Ok(camera.clone());
    }
    let [x, y] = [0, 1].map(|axis| f64::from(size[axis]) / f64::from(calibrated[axis]));
    let scales = match fit {
        ImageFit::Same => {
            let ([width, height], [own, tall]) = (size, calibrated);
            let message = format!(
                "{} has {width} x {height} pixels, but camera `{}` is calibrated for {own} x {tall}: give masks.fit = \
                 \"scaled\" (stretched by {x:.4} and {y:.4}), \"letterboxed\" (scaled by {:.4}, with bars) or \"cropped\" \
                 (cut at both sides alike); {}",
                image.display(),
                camera.name,
                x.min(y),
                suggested(size, calibrated),
            );
            return Err(key_error("masks.fit", message));
        }
        ImageFit::Scaled => [x, y],
        ImageFit::Letterboxed => [x.min(y); 2],
        ImageFit::Cropped => [1.0; 2],
    };
    let mut fitted = camera.clone();
    for axis in 0..2 {
        // pixels count from the corner of the image, so scaling moves no centre of a pixel
        let bar = 0.5 * (f64::from(size[axis]) - scales[axis] * f64::from(calibrated[axis]));
        let (focal, middle) = (&mut fitted.pinhole.focal[axis], &mut fitted.pinhole.principal_point[axis]);
        (*focal, *middle) = (*focal * scales[axis], *middle * scales[axis] + bar);
    }
    [fitted.pinhole.width, fitted.pinhole.height] = size;
    Ok(fitted)
}

/// What the sizes alone suggest about images of another size than the calibration's.
fn suggested(size: [u32; 2], calibrated: [u32; 2]) -> String {
    let [width, height] = size.map(f64::from);
    let [own, tall] = calibrated.map(f64::from);
    let is_turned = (width > height) != (own > tall);
    // half a pixel is lost where a side is rounded
    let is_like = |[w, h]: [f64; 2]| (w * tall / own - h).abs() <= 1.0 || (h * own / tall - w).abs() <= 1.0;
    let (scale, one_side) = ((width / own).min(height / tall), size[0] == calibrated[0] || size[1] == calibrated[1]);
    let bars = [width - scale * own, height - scale * tall].map(|bar| (0.5 * bar).round());
    match one_side {
        _ if is_turned && is_like([height, width]) => {
            "they are on their side: turn the images by 90 degrees (or the calibration is of another camera)".to_owned()
        }
        _ if is_turned => {
            "one is portrait and the other landscape: turn the images, or it is another camera".to_owned()
        }
        _ if is_like([width, height]) => "the proportions are the same: \"scaled\"".to_owned(),
        true if width <= own && height <= tall => format!(
            "one side is shorter: \"letterboxed\" if the images have bars ({} columns left and right, {} rows above and \
             below), else \"cropped\"",
            bars[0], bars[1]
        ),
        _ => format!(
            "the proportions differ: \"letterboxed\" if the images have bars ({} columns left and right, {} rows above and \
             below)",
            bars[0], bars[1]
        ),
    }
}

/// The same camera with pixels that are `reduce` times as wide and high; what is left at the right and lower edges is
/// cut off.
pub(super) fn reduced(mut camera: Camera, reduce: u32) -> Camera {
    let scale = f64::from(reduce);
    let pinhole = &mut camera.pinhole;
    pinhole.focal = pinhole.focal.map(|focal| focal / scale);
    pinhole.principal_point = pinhole.principal_point.map(|middle| middle / scale);
    (pinhole.width, pinhole.height) = ((pinhole.width / reduce).max(1), (pinhole.height / reduce).max(1));
    camera
}

/// The greatest brightness in an image, from 0 to 1.
pub(super) fn brightest(path: &Path) -> Result<f64, ExperimentError> {
    Ok(f64::from(read_image(path)?.brightest()) / 255.0)
}

pub(super) fn size_of(path: &Path) -> Result<[u32; 2], ExperimentError> {
    read_image(path).map(|image| [image.width(), image.height()])
}

/// The mask of an image of this size, reduced.
pub(super) fn read_mask(
    path: &Path,
    size: [u32; 2],
    settings: &MaskSettings,
    reduce: u32,
) -> Result<Mask, ExperimentError> {
    let image = read_image(path)?;
    if [image.width(), image.height()] != size {
        let detail = format!(
            "{} x {} pixels, but the first image of this camera has {} x {}; expected one size",
            image.width(),
            image.height(),
            size[0],
            size[1]
        );
        return Err(ExperimentError::Malformed { path: path.to_owned(), detail });
    }
    Ok(image.mask(settings.threshold * 255.0, settings.inverted, reduce))
}

#[derive(Clone, Copy, Debug)]
pub(super) struct MaskFacts {
    is_seen: bool,
    /// Share of all pixels, and of those at the border, that are the person.
    shares: [f64; 2],
}

impl MaskFacts {
    pub(super) fn new(mask: &Mask) -> Self {
        let (width, height) = (mask.width(), mask.height());
        let sides = (0..height).flat_map(|y| [(0, y), (width - 1, y)]);
        let edges = (0..width).flat_map(|x| [(x, 0), (x, height - 1)]);
        let set = sides.chain(edges).filter(|(x, y)| mask.get(*x, *y)).count();
        let all = f64::from(width) * f64::from(height);
        let shares = [mask.count() as f64 / all, set as f64 / f64::from(2 * (width + height))];
        Self { is_seen: !mask.is_empty(), shares }
    }
}

/// Refuses masks that cannot be those of a person, `[frame][camera]`; otherwise notes about frames without anybody.
pub(super) fn check(
    rig: &CameraRig,
    found: &[Vec<MaskFacts>],
    is_inverted: bool,
) -> Result<Vec<String>, ExperimentError> {
    let mut notes = Vec::new();
    for (index, camera) in rig.cameras.iter().enumerate() {
        let seen: Vec<&MaskFacts> = found.iter().map(|frame| &frame[index]).filter(|facts| facts.is_seen).collect();
        let name = &camera.name;
        if seen.is_empty() {
            let message = format!(
                "nobody is in any mask of camera `{name}`: lower masks.threshold if the person is grey there, or leave the \
                 camera out with rig.leave_out = [{name:?}]"
            );
            return Err(key_error("masks", message));
        }
        let mean = |which: usize| seen.iter().map(|facts| facts.shares[which]).sum::<f64>() / seen.len() as f64;
        let [all, border] = [mean(0), mean(1)];
        if border > 0.5 {
            let message = format!(
                "{:.0} % of the border and {:.0} % of all pixels of camera `{name}` are the person: the masks are probably \
                 inverted; give masks.inverted = {}",
                100.0 * border,
                100.0 * all,
                !is_inverted
            );
            return Err(key_error("masks", message));
        }
        if all > 0.4 {
            notes.push(format!("masks of camera `{name}`: {:.0} % of all pixels are the person", 100.0 * all));
        }
    }
    let unseen = found.iter().filter(|frame| frame.iter().filter(|facts| facts.is_seen).count() < 2).count();
    if unseen > 0 {
        notes.push(format!("fewer than two cameras see anybody in {unseen} of {} frames", found.len()));
    }
    Ok(notes)
}
