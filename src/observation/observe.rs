//! Clean observations: what perfect background subtraction would leave of the truth.

use rayon::prelude::*;

use super::Observation;
use crate::body::SilhouettePainter;
use crate::camera::CameraRig;
use crate::scene::GroundTruth;

/// Clean silhouettes of every frame, lens distortion included; the same bits for any number of threads.
pub fn observe(truth: &GroundTruth, rig: &CameraRig) -> Vec<Observation> {
    let frames = (0..truth.frames.len()).into_par_iter();
    frames.map_init(|| painters(rig), |painters, frame| observe_with(truth, painters, frame)).collect()
}

/// Clean silhouettes of one frame of the truth, which must have it.
pub fn observe_frame(truth: &GroundTruth, rig: &CameraRig, frame: usize) -> Observation {
    observe_with(truth, &mut painters(rig), frame)
}

fn painters(rig: &CameraRig) -> Vec<SilhouettePainter> {
    rig.cameras.iter().map(SilhouettePainter::new).collect()
}

fn observe_with(truth: &GroundTruth, painters: &mut [SilhouettePainter], frame: usize) -> Observation {
    let moment = &truth.frames[frame];
    let silhouettes =
        painters.iter_mut().map(|painter| painter.silhouette(&truth.actor, &moment.link_frames)).collect();
    Observation { frame, time_s: moment.time_s, silhouettes }
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
