//! Clean observations: the result of perfect background subtraction.

use std::sync::{Mutex, PoisonError};

use super::Observation;
use crate::body::{DepthImage, Humanoid, LinkFrames, Prop, SilhouettePainter, SurfacePixel};
use crate::camera::CameraRig;
use crate::parallel;
use crate::raster::Mask;
use crate::scene::{Distractor, GroundTruth, TruthFrame};

/// Clean silhouettes of the actor in every frame, lens distortion included, without what props and distractors hide;
/// the same bits for any number of threads.
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

    /// Clean silhouettes of the actor in one frame, which the truth must have, without what props and distractors hide.
    pub fn observe(&self, frame: usize) -> Observation {
        let TruthFrame { time_s, link_frames, .. } = &self.truth.frames[frame];
        let (actor, others) = (&self.truth.actor, self.others(frame));
        let silhouettes = self.through_every_camera(|_, painter, screen| {
            let mut silhouette = painter.silhouette(actor, link_frames);
            if screen.is_some() || !others.is_empty() {
                let own = painter.depth(actor, link_frames);
                if let Some(screen) = screen {
                    own.clear_hidden(screen, &mut silhouette);
                }
                for (body, frames) in &others {
                    own.clear_hidden(&painter.depth(body, frames), &mut silhouette);
                }
            }
            silhouette
        });
        Observation { frame, time_s: *time_s, silhouettes }
    }

    /// Clean silhouettes of everybody in one frame, which the truth must have: the actor and distractors alike, as
    /// perfect background subtraction finds them. Without distractors the same as [`Self::observe`].
    pub fn foreground(&self, frame: usize) -> Observation {
        let TruthFrame { time_s, link_frames, .. } = &self.truth.frames[frame];
        let mut silhouettes = self.silhouettes(|_| (&self.truth.actor, link_frames));
        for (body, frames) in &self.others(frame) {
            let others = self.silhouettes(|_| (*body, frames));
            silhouettes.iter_mut().zip(&others).for_each(|(mask, other)| *mask |= other);
        }
        Observation { frame, time_s: *time_s, silhouettes }
    }

    /// The distractors with their links as they are in a frame.
    pub(super) fn others(&self, frame: usize) -> Vec<(&'a Humanoid, LinkFrames)> {
        let figure = |other: &'a Distractor| Some((&other.body, other.link_frames(frame)?));
        self.truth.distractors.iter().filter_map(figure).collect()
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

    /// Depth and link at every pixel of one frame, which the truth must have, without what props and distractors hide;
    /// one image per camera.
    pub fn depths(&self, frame: usize) -> Vec<DepthImage> {
        let link_frames = &self.truth.frames[frame].link_frames;
        let others = self.others(frame);
        self.through_every_camera(|_, painter, screen| {
            let mut image = painter.depth(&self.truth.actor, link_frames);
            if let Some(screen) = screen {
                image.hide_behind(screen);
            }
            for (body, frames) in &others {
                image.hide_behind(&painter.depth(body, frames));
            }
            image
        })
    }

    /// The actor's surface pixel by pixel in one frame, as if there were no props; one list per camera.
    pub(super) fn surfaces(&self, frame: usize) -> Vec<Vec<SurfacePixel>> {
        let link_frames = &self.truth.frames[frame].link_frames;
        self.through_every_camera(|_, painter, _| painter.surface(&self.truth.actor, link_frames))
    }

    /// As [`Self::surfaces`], of any body.
    pub(super) fn surfaces_of(&self, body: &Humanoid, link_frames: &LinkFrames) -> Vec<Vec<SurfacePixel>> {
        self.through_every_camera(|_, painter, _| painter.surface(body, link_frames))
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
    fn the_foreground_is_the_actor_and_who_else_is_there_and_both_fit_the_depths() {
        let mut poses = walk(1).poses;
        poses[0].world_from_root.translation.vector += nalgebra::Vector3::new(0.6, 0.25, 0.0);
        let passer_by = Distractor { name: "passer-by".into(), body: person(), poses };
        let alone = GroundTruth::from_motion(person(), &walk(3), &rig()).unwrap();
        let truth = GroundTruth::among(person(), &walk(3), &rig(), Vec::new(), vec![passer_by.clone()]).unwrap();
        let other = GroundTruth::from_motion(person(), &passer_by.motion_of(3), &rig()).unwrap();
        let (observer, of) = (Observer::new(&truth, &rig()), |t| Observer::new(t, &rig()).observe(2).silhouettes);
        let (actor, everybody) = (observer.observe(2).silhouettes, observer.foreground(2).silhouettes);
        let mut hidden = 0;
        for (camera, depth) in observer.depths(2).iter().enumerate() {
            let (whole, other) = (&of(&alone)[camera], &of(&other)[camera]);
            let mut both = whole.clone();
            both |= other;
            assert_eq!(everybody[camera], both);
            assert_eq!(actor[camera].count_common(whole), actor[camera].count(), "it is part of the actor");
            assert_eq!(whole.count() - actor[camera].count(), {
                let lost =
                    (0..320 * 240).filter(|i| whole.get(i % 320, i / 320) && !actor[camera].get(i % 320, i / 320));
                lost.filter(|i| other.get(i % 320, i / 320)).count() as u64
            });
            assert!(depth.mask().count().abs_diff(actor[camera].count()) <= 4);
            hidden += whole.count() - actor[camera].count();
        }
        assert!(hidden > 100, "{hidden}");
        assert_eq!(Observer::new(&alone, &rig()).foreground(2), Observer::new(&alone, &rig()).observe(2));
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
