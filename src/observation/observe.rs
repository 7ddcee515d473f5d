//! Clean observations: the result of perfect background subtraction.

use std::sync::{Mutex, PoisonError};

use super::Observation;
use crate::body::{DepthImage, Humanoid, LinkFrames, Prop, SilhouettePainter, SurfacePixel};
use crate::camera::CameraRig;
use crate::parallel;
use crate::raster::Mask;
use crate::scene::{GroundTruth, TruthFrame};

/// Clean silhouettes of every frame, lens distortion included, without what props hide; the same bits for any number of
/// threads.
pub fn observe(truth: &GroundTruth, rig: &CameraRig) -> Vec<Observation> {
    let observer = Observer::new(truth, rig);
    parallel::map(truth.frames.len(), |frame| observer.observe(frame))
}

/// Clean silhouettes of one frame, which the truth must have. For many frames keep an [`Observer`].
pub fn observe_frame(truth: &GroundTruth, rig: &CameraRig, frame: usize) -> Observation {
    Observer::new(truth, rig).observe(frame)
}

/// Sees any frame of the truth, from any thread. Camera data (the rays of all pixels behind a lens) are computed once
/// for all frames and threads.
pub struct Observer<'a> {
    truth: &'a GroundTruth,
    /// Depth images of the props for every camera; empty without props.
    screens: Vec<DepthImage>,
    /// One per camera; painters of other threads are derived from it.
    painters: Vec<SilhouettePainter>,
    idle: Mutex<Vec<Vec<SilhouettePainter>>>,
}

impl<'a> Observer<'a> {
    /// An observer of `truth` through the cameras of `rig`.
    pub fn new(truth: &'a GroundTruth, rig: &CameraRig) -> Self {
        let mut painters: Vec<_> = rig.cameras.iter().map(SilhouettePainter::new).collect();
        let seen = if truth.props.is_empty() { &mut [][..] } else { &mut painters };
        let screens = seen.iter_mut().map(|painter| painter.depth_of_props(&truth.props)).collect();
        Self { truth, screens, painters, idle: Mutex::default() }
    }

    /// Clean silhouettes of one frame, which the truth must have.
    pub fn observe(&self, frame: usize) -> Observation {
        let TruthFrame { time_s, link_frames, .. } = &self.truth.frames[frame];
        let silhouettes = self.silhouettes(|_| (&self.truth.actor, link_frames));
        Observation { frame, time_s: *time_s, silhouettes }
    }

    /// Number of cameras.
    pub(super) fn cameras(&self) -> usize {
        self.painters.len()
    }

    /// Depths of the props as camera `camera` sees them; `None` without props.
    pub(super) fn screen(&self, camera: usize) -> Option<&DepthImage> {
        self.screens.get(camera)
    }

    /// Clean silhouettes of a body and link frames that are asked for camera by camera.
    pub(super) fn silhouettes<'b>(&self, shown: impl Fn(usize) -> (&'b Humanoid, &'b LinkFrames)) -> Vec<Mask> {
        self.through_every_camera(|camera, painter, screen| {
            let (body, link_frames) = shown(camera);
            let mut silhouette = painter.silhouette(body, link_frames);
            if let Some(screen) = screen {
                painter.depth(body, link_frames).clear_hidden(screen, &mut silhouette);
            }
            silhouette
        })
    }

    /// Depth and link at every pixel of one frame, which the truth must have, without what props hide; one image per
    /// camera.
    pub fn depths(&self, frame: usize) -> Vec<DepthImage> {
        let link_frames = &self.truth.frames[frame].link_frames;
        self.through_every_camera(|_, painter, screen| {
            let mut image = painter.depth(&self.truth.actor, link_frames);
            if let Some(screen) = screen {
                image.hide_behind(screen);
            }
            image
        })
    }

    /// The actor's surface pixel by pixel in one frame, as if there were no props; one list per camera.
    pub(super) fn surfaces(&self, frame: usize) -> Vec<Vec<SurfacePixel>> {
        let link_frames = &self.truth.frames[frame].link_frames;
        self.through_every_camera(|_, painter, _| painter.surface(&self.truth.actor, link_frames))
    }

    /// The surface of the props pixel by pixel; one list per camera, all empty without props.
    pub(super) fn props_surface(&self, props: &[Prop]) -> Vec<Vec<SurfacePixel>> {
        match props.is_empty() {
            true => vec![Vec::new(); self.painters.len()],
            false => self.through_every_camera(|_, painter, _| painter.surface_of_props(props)),
        }
    }

    fn through_every_camera<T>(
        &self,
        mut look: impl FnMut(usize, &mut SilhouettePainter, Option<&DepthImage>) -> T,
    ) -> Vec<T> {
        let idle = || self.idle.lock().unwrap_or_else(PoisonError::into_inner);
        let ready = idle().pop();
        let mut painters = ready.unwrap_or_else(|| self.painters.iter().map(SilhouettePainter::sharing).collect());
        let each = painters.iter_mut().enumerate();
        let seen = each.map(|(camera, painter)| look(camera, painter, self.screens.get(camera))).collect();
        idle().push(painters);
        seen
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::fixture::{person, walk};
    use crate::scene::fixture::rig;

    #[test]
    fn a_frame_looks_the_same_whoever_sees_it_and_whatever_was_seen_before() {
        let truth = GroundTruth::from_motion(person(), &walk(6), &rig()).unwrap();
        let with_threads = |n| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
            pool.install(|| observe(&truth, &rig()))
        };
        let one_by_one: Vec<_> = (0..6).map(|frame| Observer::new(&truth, &rig()).observe(frame)).collect();
        assert_eq!(with_threads(1), one_by_one);
        assert_eq!(with_threads(3), one_by_one);
    }

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
