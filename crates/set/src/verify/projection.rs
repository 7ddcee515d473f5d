//! Projects the truth with OpenCV's formula through the camera files: every point at the time its row was exposed,
//! through the cameras of `cameras.json`, at the poses of `cameras.npz` if they move. If trackers were given other
//! cameras, those of `truth/cameras.json` are used.

use std::borrow::Cow;

use super::cameras::{ListedCamera, plain};
use super::parts::ReadParts;
use super::{CheckOutcome, Fault};
use crate::blind::silhouette_path;
use crate::body::LANDMARKS;
use crate::camera::TimedRig;
use crate::files::SetFiles;
use crate::npz::Npz;
use crate::parallel;
use crate::raster::Mask;
use crate::scene::{GroundTruth, SceneClock, Shot, ShotPoint};
use crate::views_file::PATH as VIEWS;
use crate::{RigMoments, cameras_file, moments_file, silhouette_png, truth_file};

/// Tolerance between the formula and this program's own projection, pixels.
const TOLERANCE_PX: f64 = 1e-6;

/// Markers are inside the body or on its surface: this share of the visible ones must be in the silhouettes, within
/// [`REACH_PX`].
const LEAST_SHARE: f64 = 0.85;
const REACH_PX: i64 = 2;

/// Fewest visible markers for this check.
const LEAST_MARKERS: usize = 10;

/// Greatest number of frames whose silhouettes are read.
const SAMPLED_FRAMES: usize = 200;

/// Faults of one image.
#[derive(Default)]
struct ImageFaults {
    /// Greatest distance between the formula and this program's projection, pixels.
    worst: f64,
    /// Numbers of wrong points in `joints_2d` and in `markers_2d`.
    wrong_pixels: [usize; 2],
    /// Markers whose `in_view` differs from the formula.
    wrong_views: Vec<usize>,
    /// Number of visible markers.
    visible: usize,
    /// Number of visible markers in the silhouette.
    inside: usize,
}

struct ProjectedScene<'a> {
    files: &'a SetFiles,
    truth: &'a GroundTruth,
    rig: &'a TimedRig,
    /// The file of its cameras.
    path: &'static str,
    is_filmed: bool,
    /// For a rig that is not static, unless trackers were given another one.
    moments: Option<&'a RigMoments>,
    has_exact_silhouettes: bool,
    clock: &'a SceneClock<'a>,
    views: Option<&'a Npz>,
}

pub(super) fn check(files: &SetFiles, parts: &ReadParts) -> CheckOutcome {
    let (truth, _) = parts.scene()?;
    let (path, is_filmed) = (parts.true_cameras(), parts.is_filmed());
    let (cameras, rig) = (plain(files, path)?, parts.filming()?);
    let is_given = path == cameras_file::PATH;
    if is_filmed && is_given && parts.moments.is_none() {
        return Err("not checked: cameras.npz cannot be read".to_owned());
    }
    let moments = parts.moments.as_ref().filter(|_| is_filmed && is_given);
    let clock = SceneClock::new(truth, &rig);
    let views = files.read(VIEWS).ok().and_then(|bytes| Npz::from_bytes(VIEWS, &bytes).ok());
    let (inexact, views) = (parts.inexact_silhouettes(), views.as_ref());
    let has_exact_silhouettes = inexact.is_none();
    let clock = &clock;
    let scene =
        ProjectedScene { files, truth, rig: &rig, path, is_filmed, moments, has_exact_silhouettes, clock, views };
    let (mut faults, mut markers, mut wrong_pixels) = (scene.wrong_shapes(), 0, [0; 2]);
    for (index, plain) in cameras.iter().enumerate() {
        let found = parallel::map(truth.frames.len(), |frame| scene.look(plain, index, frame));
        let sum = |of: fn(&ImageFaults) -> usize| found.iter().map(of).sum::<usize>();
        let (worst, visible) = (found.iter().fold(0.0, |w, f| greater(w, f.worst)), sum(|found| found.visible));
        faults.extend(scene.disagreement(&plain.name, worst));
        faults.extend(scene.markers_outside(&plain.name, visible, sum(|found| found.inside)));
        faults.extend(wrong_views(&plain.name, &found));
        markers += visible;
        wrong_pixels[0] += sum(|found| found.wrong_pixels[0]);
        wrong_pixels[1] += sum(|found| found.wrong_pixels[1]);
    }
    for (array, wrong) in ["joints_2d", "markers_2d"].into_iter().zip(wrong_pixels).filter(|(_, wrong)| *wrong > 0) {
        let detail = format!("{array}: {wrong} pixels differ from OpenCV's formula at the time of exposure");
        faults.push(Fault::new(VIEWS, detail));
    }
    let compared = match inexact {
        None => format!("{markers} visible markers"),
        Some(silhouettes) => format!("without a comparison with the silhouettes, which are {silhouettes}"),
    };
    Ok((format!("{} cameras, {compared}", cameras.len()), faults))
}

impl ProjectedScene<'_> {
    /// Checks the image of a camera and frame.
    fn look(&self, plain: &ListedCamera, camera: usize, frame: usize) -> ImageFaults {
        let (mut found, known) = (ImageFaults::default(), &self.truth.frames[frame]);
        let mut shot = Shot::new(self.clock, self.rig, frame);
        let joints = self.truth.actor.joints.len();
        for joint in 0..joints {
            let Some(seen) = shot.joint(camera, joint) else { return found };
            let listed = self.listed("joints_2d", joints, [frame, camera, joint]);
            let wrong = self.compare(&self.placed(plain, &seen, camera, frame), &seen, listed, &mut found.worst);
            found.wrong_pixels[0] += usize::from(wrong);
        }
        let step = self.truth.frames.len().div_ceil(SAMPLED_FRAMES).max(1);
        let is_looked_into = self.has_exact_silhouettes && frame.is_multiple_of(step);
        let mask = if is_looked_into { self.silhouette(camera, frame) } else { None };
        for marker in 0..LANDMARKS.len() {
            let Some(seen) = shot.marker(camera, marker) else { continue };
            let placed = self.placed(plain, &seen, camera, frame);
            let listed = self.listed("markers_2d", LANDMARKS.len(), [frame, camera, marker]);
            let wrong = self.compare(&placed, &seen, listed, &mut found.worst);
            found.wrong_pixels[1] += usize::from(wrong);
            let margin = placed.margin(&seen.place.coords);
            if (margin >= 0.0) != known.in_view[camera][marker] && margin.abs() > TOLERANCE_PX {
                found.wrong_views.push(marker);
            }
            if let (Some(mask), true) = (&mask, known.visible[camera][marker]) {
                found.visible += 1;
                found.inside += usize::from(is_near(mask, placed.project(&seen.place.coords).0));
            }
        }
        found
    }

    /// The camera at its pose in the files when a point was exposed.
    fn placed<'c>(
        &self,
        plain: &'c ListedCamera,
        seen: &ShotPoint,
        camera: usize,
        frame: usize,
    ) -> Cow<'c, ListedCamera> {
        if !self.is_filmed {
            return Cow::Borrowed(plain);
        }
        // between the first rows of two images only the truth has the pose of a camera
        Cow::Owned(plain.placed(match self.moments.filter(|_| !self.rig.is_rolling(camera)) {
            Some(moments) => &moments.frames[frame].camera_from_world[camera],
            None => &seen.camera.camera_from_world,
        }))
    }

    /// Compares the formula with this program's projection of a point, and returns whether the pixel listed in the set
    /// is wrong.
    fn compare(&self, plain: &ListedCamera, seen: &ShotPoint, listed: Option<[f64; 2]>, worst: &mut f64) -> bool {
        let (pixel, _) = plain.project(&seen.place.coords);
        let off = |at: [f64; 2]| (at[0] - pixel[0]).abs().max((at[1] - pixel[1]).abs());
        let scale = pixel[0].abs().max(pixel[1].abs()).max(1.0);
        if let Some(own) = seen.pixel {
            *worst = greater(*worst, off([own.x - 0.5, own.y - 0.5]) / scale);
        }
        listed.is_some_and(|listed| match seen.pixel {
            Some(_) => off(listed).is_nan() || off(listed) > TOLERANCE_PX * scale,
            None => !listed.iter().all(|x| x.is_nan()),
        })
    }

    /// The pixel in `views.npz`, if it has the expected shape.
    fn listed(&self, array: &str, points: usize, [frame, camera, point]: [usize; 3]) -> Option<[f64; 2]> {
        let pixels = self.views?.f64s(VIEWS, array, &self.shape(points)).ok()?.as_chunks::<2>().0;
        pixels.get((frame * self.rig.cameras() + camera) * points + point).copied()
    }

    fn shape(&self, points: usize) -> [Option<usize>; 4] {
        [Some(self.truth.frames.len()), Some(self.rig.cameras()), Some(points), Some(2)]
    }

    /// Arrays of pixels with a wrong shape.
    fn wrong_shapes(&self) -> Vec<Fault> {
        let Some(views) = self.views else { return Vec::new() };
        let arrays = [("joints_2d", self.truth.actor.joints.len()), ("markers_2d", LANDMARKS.len())];
        let there = arrays.into_iter().filter(|(array, _)| views.get(array).is_some());
        let errors = there.filter_map(|(array, points)| views.f64s(VIEWS, array, &self.shape(points)).err());
        errors.map(|error| Fault::new(VIEWS, error.detail)).collect()
    }

    fn silhouette(&self, camera: usize, frame: usize) -> Option<Mask> {
        let path = silhouette_path(camera, frame);
        let pinhole = &self.rig.rig().cameras[camera].pinhole;
        silhouette_png::decode(&path, &self.files.read(&path).ok()?, pinhole.width, pinhole.height).ok()
    }

    fn disagreement(&self, name: &str, worst: f64) -> Option<Fault> {
        let (path, what) = match self.moments {
            None => (self.path, "OpenCV's formula and camera_from_world"),
            Some(_) => {
                (moments_file::PATH, "OpenCV's formula at the poses of cameras.npz and the camera that took the images")
            }
        };
        (worst > TOLERANCE_PX || worst.is_nan())
            .then(|| Fault::new(path, format!("camera {name:?}: {what} differ by {worst:.2e} pixels")))
    }

    /// Markers outside the silhouettes of a camera.
    fn markers_outside(&self, name: &str, visible: usize, inside: usize) -> Option<Fault> {
        let (path, by, what) = match self.moments {
            None => (
                self.path,
                "by K, R, t and distortion",
                "these numbers, the markers or the silhouettes belong to another camera, axis or unit",
            ),
            Some(_) => (
                moments_file::PATH,
                "at the poses of cameras.npz",
                "poses, times, markers or silhouettes belong to another camera or frame",
            ),
        };
        (visible >= LEAST_MARKERS && (inside as f64) < LEAST_SHARE * visible as f64).then(|| {
            Fault::new(
                path,
                format!(
                    "camera {name:?}: only {inside} of {visible} visible markers are in its silhouettes when \
                projected {by}: {what}"
                ),
            )
        })
    }
}

/// Compares `in_view` with the formula.
fn wrong_views(name: &str, found: &[ImageFaults]) -> Option<Fault> {
    let count: usize = found.iter().map(|found| found.wrong_views.len()).sum();
    let (frame, marker) = found.iter().enumerate().find_map(|(frame, f)| Some((frame, *f.wrong_views.first()?)))?;
    let marker = LANDMARKS[marker].name();
    let detail = format!(
        "in_view: {count} flags of camera {name:?} differ from OpenCV's formula, first {marker} in frame {frame}"
    );
    Some(Fault::new(truth_file::PATH, detail))
}

/// The greater of two numbers; NaN if one is NaN.
fn greater(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) }
}

/// Whether a pixel of the mask is set within [`REACH_PX`] of a position, with pixel centres at integers.
fn is_near(mask: &Mask, [u, v]: [f64; 2]) -> bool {
    if !(u.is_finite() && v.is_finite()) {
        return false;
    }
    let (x, y) = (u.round() as i64, v.round() as i64);
    let around = (-REACH_PX..=REACH_PX).flat_map(|dy| (-REACH_PX..=REACH_PX).map(move |dx| (x + dx, y + dy)));
    around.filter_map(|(x, y)| Some((u32::try_from(x).ok()?, u32::try_from(y).ok()?))).any(|(x, y)| mask.get(x, y))
}
