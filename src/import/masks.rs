//! The masks of a recording: which images belong to which camera, their size, and what they show.

use std::fs;
use std::path::{Path, PathBuf};

use crate::common::{ExperimentError, key_error};
use crate::scenario::{ImageFit, MaskSettings};
use crate::segmentation::pictures::{images_in, read_image};
use skiagraph_core::camera::{Camera, CameraRig};
use skiagraph_core::raster::Mask;

/// The folder of each camera below `path`, by its name, or else in the order of names, with a note that says so. The
/// folder of a name may also end in one of `endings`.
pub(super) fn folders_of(
    key: &str,
    path: &Path,
    rig: &CameraRig,
    endings: &[&str],
) -> Result<(Vec<PathBuf>, Option<String>), ExperimentError> {
    let unreadable = |source| ExperimentError::Unreadable { path: path.to_owned(), source };
    let entries = fs::read_dir(path).map_err(unreadable)?.flatten();
    let mut folders: Vec<PathBuf> = entries.map(|entry| entry.path()).filter(|path| path.is_dir()).collect();
    folders.sort();
    let name = |folder: &Path| folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let is_of = |folder: &Path, camera: &Camera| {
        let (found, known) = (name(folder), &camera.name);
        endings.iter().any(|ending| found.strip_suffix(ending) == Some(known))
    };
    let named: Option<Vec<PathBuf>> =
        rig.cameras.iter().map(|camera| folders.iter().find(|folder| is_of(folder, camera)).cloned()).collect();
    if let Some(named) = named {
        return Ok((named, None));
    }
    let cameras: Vec<&str> = rig.cameras.iter().map(|camera| camera.name.as_str()).collect();
    let found: Vec<String> = folders.iter().map(|folder| name(folder)).collect();
    if folders.len() != cameras.len() {
        let message = format!(
            "expected a folder for each camera ({}) in {}, found {}: rename the folders, or leave cameras out with \
             rig.leave_out",
            cameras.join(", "),
            path.display(),
            if found.is_empty() { "none".to_owned() } else { found.join(", ") }
        );
        return Err(key_error(key, message));
    }
    let pairs: Vec<String> = cameras.iter().zip(&found).map(|(camera, folder)| format!("{camera}: {folder}")).collect();
    let note =
        format!("{key}: no folders have the names of the cameras, so they are taken in order: {}", pairs.join(", "));
    Ok((folders, Some(note)))
}

/// The images of the masks of every camera.
pub(super) fn images_of(path: &Path, rig: &CameraRig) -> Result<(Vec<Vec<PathBuf>>, Option<String>), ExperimentError> {
    let (folders, note) = folders_of("masks.path", path, rig, &[""])?;
    let mut images = Vec::new();
    for folder in folders {
        let inner = folder.join("silhouette");
        images.push(images_in(if inner.is_dir() { &inner } else { &folder })?);
    }
    let counts: Vec<usize> = images.iter().map(Vec::len).collect();
    if counts.iter().any(|count| *count != counts[0]) {
        let each: Vec<String> =
            rig.cameras.iter().zip(&counts).map(|(camera, count)| format!("{}: {count}", camera.name)).collect();
        let message = format!(
            "expected the same number of images for every camera, one a frame, found {}: remove what the others lack (at \
             the beginning if a camera started early), so that images with the same place in the order are of the same time",
            each.join(", ")
        );
        return Err(key_error("masks.path", message));
    }
    Ok((images, note))
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
            let turned = if [height, width] == calibrated { ", or turn the images by 90 degrees" } else { "" };
            let message = format!(
                "{} has {width} x {height} pixels, but camera `{}` is calibrated for {own} x {tall}: give masks.fit = \
                 \"scaled\" (stretched by {x:.4} and {y:.4}), \"letterboxed\" (scaled by {:.4}, with bars) or \"cropped\" \
                 (cut at both sides alike){turned}",
                image.display(),
                camera.name,
                x.min(y),
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

/// Width and height of an image.
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
    let width = size[0] as usize;
    let brightness = |x: usize, y: usize| {
        let values = image.planes().iter().filter_map(|plane| plane.get(y * width + x));
        let brightest = values.copied().max().unwrap_or_default();
        u32::from(if settings.inverted { 255 - brightest } else { brightest })
    };
    let least = settings.threshold * 255.0 * f64::from(reduce) * f64::from(reduce);
    let is_person = |x: u32, y: u32| {
        let mut sum = 0;
        for dy in 0..reduce {
            for dx in 0..reduce {
                sum += brightness((x * reduce + dx) as usize, (y * reduce + dy) as usize);
            }
        }
        f64::from(sum) >= least
    };
    Ok(Mask::from_fn((size[0] / reduce).max(1), (size[1] / reduce).max(1), is_person))
}

/// What a mask shows.
#[derive(Clone, Copy, Debug)]
pub(super) struct MaskFacts {
    /// Whether anybody is in it.
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
pub(super) fn check(rig: &CameraRig, found: &[Vec<MaskFacts>]) -> Result<Vec<String>, ExperimentError> {
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
                 inverted; give masks.inverted = true",
                100.0 * border,
                100.0 * all
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
