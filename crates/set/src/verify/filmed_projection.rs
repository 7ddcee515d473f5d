//! The truth of cameras that move, or that take their images at times of their own, as anybody with OpenCV's formula
//! sees it: every point where it was when its row was exposed, through the camera as `cameras.npz` has it.

use super::cameras::{ListedCamera, plain};
use super::parts::ReadParts;
use super::projection::{LEAST_MARKERS, LEAST_SHARE, SAMPLED_FRAMES, TOLERANCE_PX, VIEWS, is_near};
use super::{Fault, Outcome};
use crate::blind::silhouette_path;
use crate::body::LANDMARKS;
use crate::camera::TimedRig;
use crate::files::SetFiles;
use crate::npz::Npz;
use crate::parallel;
use crate::raster::Mask;
use crate::scene::{GroundTruth, SceneClock, Shot, ShotPoint, Sight};
use crate::{RigMoments, moments_file, silhouette_png};

/// What one camera-frame shows to be wrong.
#[derive(Default)]
struct FilmedFaults {
    /// Greatest distance between the formula and this program's projection, pixels.
    worst: f64,
    /// Points of `joints_2d` and `markers_2d` that are elsewhere.
    wrong_pixels: usize,
    /// Markers that are visible, and those of them that lie in the silhouette.
    visible: usize,
    inside: usize,
}

pub(super) fn check(files: &SetFiles, parts: &ReadParts) -> Outcome {
    let (truth, _) = parts.scene()?;
    if let Some(why) = parts.spoiled() {
        return Ok((why, Vec::new()));
    }
    let cameras = plain(files)?;
    let filming = parts.filming()?;
    let moments = parts.moments.as_ref().ok_or("not checked: cameras.npz cannot be read")?;
    let clock = SceneClock::new(truth, &filming);
    let views = files.read(VIEWS).ok().and_then(|bytes| Npz::from_bytes(VIEWS, &bytes).ok());
    let scene = FilmedScene { files, truth, filming: &filming, moments, clock: &clock, views: views.as_ref() };
    let mut faults = Vec::new();
    let (mut markers, mut wrong_pixels) = (0, 0);
    for (index, plain) in cameras.iter().enumerate() {
        let found = parallel::map(truth.frames.len(), |frame| scene.look(plain, index, frame));
        let worst = found.iter().map(|found| found.worst).fold(0.0, f64::max);
        let name = &plain.name;
        if worst > TOLERANCE_PX || worst.is_nan() {
            let detail = format!(
                "camera {name:?}: the truth seen by OpenCV's formula from where cameras.npz has the camera, and by the \
                camera that took the images, differ by {worst:.2e} pixels"
            );
            faults.push(Fault::new(moments_file::PATH, detail));
        }
        let sum = |of: fn(&FilmedFaults) -> usize| found.iter().map(of).sum::<usize>();
        let (visible, inside) = (sum(|found| found.visible), sum(|found| found.inside));
        if visible >= LEAST_MARKERS && (inside as f64) < LEAST_SHARE * visible as f64 {
            faults.push(Fault::new(
                moments_file::PATH,
                format!(
                    "camera {name:?}: only {inside} of {visible} visible markers lie in its silhouettes when they are \
                projected from where cameras.npz has it: places, times, markers or silhouettes belong to another \
                camera or frame"
                ),
            ));
        }
        markers += visible;
        wrong_pixels += sum(|found| found.wrong_pixels);
    }
    if wrong_pixels > 0 {
        let detail = format!(
            "joints_2d, markers_2d: {wrong_pixels} pixels are not what OpenCV's formula gives at the moment of exposure"
        );
        faults.push(Fault::new(VIEWS, detail));
    }
    Ok((format!("{} cameras, {markers} visible markers", cameras.len()), faults))
}

struct FilmedScene<'a> {
    files: &'a SetFiles,
    truth: &'a GroundTruth,
    filming: &'a TimedRig,
    moments: &'a RigMoments,
    clock: &'a SceneClock<'a>,
    views: Option<&'a Npz>,
}

impl FilmedScene<'_> {
    fn look(&self, plain: &ListedCamera, camera: usize, frame: usize) -> FilmedFaults {
        let mut found = FilmedFaults::default();
        let Some(mut shot) = Shot::new(self.clock, self.filming, camera, frame) else { return found };
        let step = self.truth.frames.len().div_ceil(SAMPLED_FRAMES).max(1);
        let mask = if frame.is_multiple_of(step) { self.silhouette(camera, frame) } else { None };
        let joints = self.truth.actor.joints.len();
        for joint in 0..joints {
            let seen = shot.joint(joint);
            self.compare(
                plain,
                camera,
                &seen,
                frame,
                &mut found,
                self.listed("joints_2d", joints, [frame, camera, joint]),
            );
        }
        for marker in 0..LANDMARKS.len() {
            let Some(seen) = shot.marker(marker) else { continue };
            let listed = self.listed("markers_2d", LANDMARKS.len(), [frame, camera, marker]);
            let pixel = self.compare(plain, camera, &seen, frame, &mut found, listed);
            if let (Some(mask), Sight::InView) = (&mask, seen.sight) {
                found.visible += 1;
                found.inside += usize::from(is_near(mask, pixel));
            }
        }
        found
    }

    /// Where the formula puts a point that was seen.
    fn compare(
        &self,
        plain: &ListedCamera,
        camera: usize,
        seen: &ShotPoint,
        frame: usize,
        found: &mut FilmedFaults,
        listed: Option<[f64; 2]>,
    ) -> [f64; 2] {
        // between the first rows of two images only the truth knows where a camera is
        let place = match self.filming.is_rolling(camera) {
            true => seen.camera.camera_from_world,
            false => self.moments.frames[frame].camera_from_world[camera],
        };
        let (pixel, _) = plain.placed(&place).project(&seen.place.coords);
        let off = |at: [f64; 2]| (at[0] - pixel[0]).abs().max((at[1] - pixel[1]).abs());
        let limit = TOLERANCE_PX * pixel[0].abs().max(pixel[1].abs()).max(1.0);
        if let Some(own) = seen.pixel {
            let own = off([own.x - 0.5, own.y - 0.5]) / (limit / TOLERANCE_PX);
            found.worst = if own.is_nan() { own } else { found.worst.max(own) };
        }
        if let Some(listed) = listed {
            let sound = match seen.pixel {
                Some(_) => off(listed) <= limit,
                None => listed.iter().all(|x| x.is_nan()),
            };
            found.wrong_pixels += usize::from(!sound);
        }
        pixel
    }

    /// The pixel of `views.npz`, where it has one for every point.
    fn listed(&self, array: &str, points: usize, [frame, camera, point]: [usize; 3]) -> Option<[f64; 2]> {
        let shape = [Some(self.truth.frames.len()), Some(self.filming.cameras()), Some(points), Some(2)];
        let pixels = self.views?.f64s(VIEWS, array, &shape).ok()?.as_chunks::<2>().0;
        pixels.get((frame * self.filming.cameras() + camera) * points + point).copied()
    }

    fn silhouette(&self, camera: usize, frame: usize) -> Option<Mask> {
        let path = silhouette_path(camera, frame);
        let pinhole = &self.filming.rig().cameras[camera].pinhole;
        silhouette_png::decode(&path, &self.files.read(&path).ok()?, pinhole.width, pinhole.height).ok()
    }
}
