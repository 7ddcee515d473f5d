//! Memory that backgrounds of cameras take, against what the machine has left.

use std::path::Path;

use crate::camera::CameraRig;
use crate::input::{self, limits};
use crate::observation::ImageSettings;

/// Periods in which the background is recorded, and components of its mixture.
const PERIODS: f64 = 3.0;

/// What every camera keeps of a pixel besides its mixture, bytes: its ray, its point of the ground, its brightness, and
/// what the allocator rounds up. With the mixture of three channels 148 bytes, by the peaks of `render` with one to
/// four cameras of 0.3 and 1.2 million pixels, which this formula gives within 15 %.
const KEPT: f64 = 16.0 + 8.0 + 22.0;

/// What a thread holds of a pixel besides the images that it learns from, bytes; measured likewise.
const LEARNING: f64 = 21.0;

/// Share of its peak that a second thread, and every further one, adds: their peaks seldom coincide.
const FURTHER_THREAD: f64 = 0.5;

/// Why the backgrounds of these cameras cannot be learned here, if they cannot.
pub(super) fn too_little_for(rig: &CameraRig, images: &ImageSettings, threads: usize) -> Option<String> {
    refusal(rig, needed(rig, images, threads), available()?)
}

fn refusal(rig: &CameraRig, needed: f64, available: f64) -> Option<String> {
    let [needed_gib, available_gib] = [needed, available].map(|bytes| bytes / f64::from(1 << 30));
    (needed > available).then(|| {
        format!(
            "the backgrounds of {} cameras with {:.1} million pixels need about {needed_gib:.1} GiB of memory, \
             {available_gib:.1} GiB are free; use fewer or smaller cameras (rig), or silhouettes that are not segmented",
            rig.cameras.len(),
            pixels(rig).sum::<f64>() / 1e6
        )
    })
}

/// Bytes that segmentation needs at most.
pub(super) fn needed(rig: &CameraRig, images: &ImageSettings, threads: usize) -> f64 {
    let channels = if images.grey { 1.0 } else { 3.0 };
    // densities in single precision, and bounds of a byte each
    let mixture = PERIODS * ((2.0 * channels + 1.0) * 4.0 + 2.0 * channels);
    // the images of a period
    let learned_from = f64::from(images.background_frames) * channels;
    let busy = threads.min(rig.cameras.len()) as f64;
    let largest = pixels(rig).fold(0.0, f64::max);
    (KEPT + mixture) * pixels(rig).sum::<f64>()
        + (learned_from + LEARNING) * (1.0 + FURTHER_THREAD * (busy - 1.0)) * largest
}

fn pixels(rig: &CameraRig) -> impl Iterator<Item = f64> + '_ {
    rig.cameras.iter().map(|camera| f64::from(camera.pinhole.width) * f64::from(camera.pinhole.height))
}

/// Bytes of memory that are free, or would be without caches; `None` where the system does not tell.
fn available() -> Option<f64> {
    let text = input::read_to_string(Path::new("/proc/meminfo"), limits::SETTINGS).ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    let kibibytes: f64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(1024.0 * kibibytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_cameras::rig;

    fn of_size(count: usize, width: u32, height: u32) -> CameraRig {
        let mut camera = rig().cameras.remove(0);
        (camera.pinhole.width, camera.pinhole.height) = (width, height);
        CameraRig { cameras: vec![camera; count] }
    }

    #[test]
    fn more_cameras_than_memory_are_refused_with_numbers_and_a_way_out() {
        let (images, many) = (ImageSettings::default(), of_size(64, 1920, 1080));
        let bytes = needed(&many, &images, 2);
        // 148 bytes of every pixel, and one and a half cameras' images of the background (20 of three channels)
        assert!((bytes - 1920.0 * 1080.0 * (64.0 * 148.0 + 1.5 * (60.0 + 21.0))).abs() < 1.0, "{bytes}");
        let words = refusal(&many, bytes, 8e9).unwrap();
        assert!(words.contains("64 cameras with 132.7 million pixels need about 18.5 GiB"), "{words}");
        assert!(words.contains("7.5 GiB are free; use fewer or smaller cameras"), "{words}");
        assert_eq!(refusal(&many, bytes, 64e9), None);
        let few = of_size(4, 640, 480);
        assert!(needed(&few, &images, 2) < 400e6);
        assert!(needed(&few, &ImageSettings { grey: true, ..images }, 2) < needed(&few, &images, 2));
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn the_system_tells_what_is_free() {
        let free = available().unwrap();
        assert!(free > 1e6 && free < 1e15, "{free}");
    }
}
