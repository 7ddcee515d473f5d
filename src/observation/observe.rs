//! Clean observations: what perfect background subtraction would leave of the truth.

use nalgebra::Point2;
use rayon::prelude::*;

use super::Observation;
use crate::body::{Humanoid, LinkFrames, Ray};
use crate::camera::{Camera, CameraRig};
use crate::raster::Mask;
use crate::scene::GroundTruth;

/// Clean silhouettes of every frame, lens distortion included; the same bits for any number of threads.
pub fn observe(truth: &GroundTruth, rig: &CameraRig) -> Vec<Observation> {
    (0..truth.frames.len()).into_par_iter().map(|frame| observe_frame(truth, rig, frame)).collect()
}

/// Clean silhouettes of one frame of the truth, which must have it.
pub fn observe_frame(truth: &GroundTruth, rig: &CameraRig, frame: usize) -> Observation {
    let moment = &truth.frames[frame];
    let silhouette = |camera: &Camera| {
        let mut mask = Mask::new(camera.pinhole.width, camera.pinhole.height);
        cast_silhouette(&truth.actor, &moment.link_frames, camera, &mut mask);
        mask
    };
    Observation { frame, time_s: moment.time_s, silhouettes: rig.cameras.iter().map(silhouette).collect() }
}

/// Sets every pixel whose ray through the centre meets flesh beyond the near plane.
fn cast_silhouette(body: &Humanoid, frames: &LinkFrames, camera: &Camera, mask: &mut Mask) {
    for y in 0..camera.pinhole.height {
        for x in 0..camera.pinhole.width {
            let pixel = Point2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
            let Some(direction) = camera.ray_through(&pixel) else { continue };
            let forward = (camera.camera_from_world * direction.into_inner()).z;
            let start = camera.centre() + direction.into_inner() * (camera.pinhole.near / forward);
            let ray = Ray { origin: start, direction: direction.into_inner() };
            let hit = body.links.iter().enumerate().any(|(link, part)| {
                let ray = ray.transformed(&frames[link].inverse());
                part.flesh.iter().any(|flesh| flesh.ray_entry(&ray).is_some())
            });
            if hit {
                mask.set(x, y, true);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::fixture::{person, walk};
    use crate::scene::fixture::rig;

    #[test]
    fn markers_in_view_project_into_the_silhouette() {
        let truth = GroundTruth::from_motion(person(), &walk(2), &rig()).unwrap();
        for observation in observe(&truth, &rig()) {
            for (camera, mask) in rig().cameras.iter().zip(&observation.silhouettes) {
                for marker in truth.frames[observation.frame].markers.iter().flatten() {
                    let pixel = camera.project(marker).unwrap();
                    assert!(mask.get(pixel.x as u32, pixel.y as u32), "{} {pixel}", camera.name);
                }
                assert!(mask.count() < 320 * 240 / 8);
            }
        }
    }
}
