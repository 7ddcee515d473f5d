//! The memory that background models of cameras need, compared with the available memory.

use std::path::Path;

use skiagraph_core::camera::CameraRig;
use skiagraph_core::input::{self, limits};
use skiagraph_truth::observing::ImageSettings;

/// Number of periods in which the background is recorded, and of components of its mixture.
const PERIODS: f64 = 3.0;

/// Memory of a pixel in every camera besides its mixture, bytes: its ray, its ground point, its brightness, and the
/// allocator's overhead. With the mixture of three channels this is 148 bytes. The formula agrees within 15 % with the
/// measured peaks of `render` with one to four cameras of 0.3 and 1.2 million pixels.
const KEPT: f64 = 16.0 + 8.0 + 22.0;

/// Memory of a pixel in every thread besides the images that it learns from, bytes; measured in the same way.
const LEARNING: f64 = 21.0;

/// Share of its peak memory that every further thread adds, because the peaks seldom coincide.
const FURTHER_THREAD: f64 = 0.5;

/// An error message if there is not enough memory to learn the backgrounds of these cameras.
pub(super) fn shortage(rig: &CameraRig, images: &ImageSettings, threads: usize) -> Option<String> {
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

pub(crate) fn needed(rig: &CameraRig, images: &ImageSettings, threads: usize) -> f64 {
    let channels = if images.grey { 1.0 } else { 3.0 };
    // densities in single precision, and bounds of one byte each
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

/// Available memory, without caches, bytes; `None` if the system does not report it.
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
    fn more_cameras_than_memory_are_refused_with_numbers_and_advice() {
        let (images, many) = (ImageSettings::default(), of_size(64, 1920, 1080));
        let bytes = needed(&many, &images, 2);
        // 148 bytes per pixel, and the background images of one and a half cameras (20 images with three channels)
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
    fn the_system_reports_its_available_memory() {
        let free = available().unwrap();
        assert!(free > 1e6 && free < 1e15, "{free}");
    }
}
