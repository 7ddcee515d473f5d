//! Exact observations: the result of perfect background subtraction.

use std::sync::{Mutex, PoisonError};

use super::eye::Eye;
use crate::scene::{Distractor, GroundTruth, SceneClock, SceneFigure};
use skiagraph_core::body::{DepthImage, Humanoid, LinkFrames, Prop, SurfacePixel};
use skiagraph_core::camera::TimedRig;
use skiagraph_core::observation::Observation;
use skiagraph_core::parallel;
use skiagraph_core::raster::Mask;

/// Exact silhouettes of the actor in every frame, lens distortion included, without what props and distractors hide;
/// bit-identical for any number of threads.
pub fn observe(truth: &GroundTruth, rig: impl Into<TimedRig>) -> Vec<Observation> {
    let observer = Observer::new(truth, rig);
    parallel::map(truth.frames.len(), |frame| observer.observe(frame))
}

/// Renders any frame of the truth, from any thread. Camera data (the rays of all pixels with lens distortion) are
/// computed once for all frames and threads.
pub struct Observer<'a> {
    truth: &'a GroundTruth,
    pub(super) filming: TimedRig,
    pub(super) clock: SceneClock<'a>,
    /// Depth image of the props for every static camera; `None` without props.
    screens: Vec<Option<DepthImage>>,
    /// One per camera; those for other threads are derived from these.
    eyes: Vec<Eye>,
    idle: Mutex<Vec<Vec<Eye>>>,
}

/// One camera taking the image of one frame.
pub(super) struct Look<'o, 'a> {
    observer: &'o Observer<'a>,
    eye: &'o mut Eye,
    pub(super) camera: usize,
    frame: usize,
    /// Depth image of the props, for a moving camera.
    moved: Option<DepthImage>,
}

impl<'a> Observer<'a> {
    /// An observer of `truth` through the cameras of a rig.
    pub fn new(truth: &'a GroundTruth, rig: impl Into<TimedRig>) -> Self {
        let filming = rig.into();
        let cameras = filming.rig().cameras.iter().enumerate();
        let mut eyes: Vec<_> = cameras.map(|(index, camera)| Eye::new(camera, filming.is_rolling(index))).collect();
        let screen = |(index, eye): (usize, &mut Eye)| {
            let is_static = filming.path(index).is_none() && !truth.props.is_empty();
            is_static.then(|| eye.depth_of_props(&truth.props))
        };
        let screens = eyes.iter_mut().enumerate().map(screen).collect();
        let clock = SceneClock::new(truth, &filming);
        Self { truth, filming, clock, screens, eyes, idle: Mutex::default() }
    }

    /// Exact silhouettes of the actor in one frame, which must exist in the truth, without what props and distractors
    /// hide. Empty for a camera that takes no image in that frame.
    pub fn observe(&self, frame: usize) -> Observation {
        let actor = &self.truth.actor;
        let silhouettes = self.look_through_all(
            |_| frame,
            |mut look| {
                let (links, others) = (look.links(SceneFigure::Actor), look.others());
                look.silhouette(actor, &links, &others)
            },
        );
        self.observation(frame, silhouettes)
    }

    /// Exact silhouettes of the actor and all distractors together in one frame, which must exist in the truth, as by
    /// perfect background subtraction. Without distractors the same as [`Self::observe`].
    pub fn foreground(&self, frame: usize) -> Observation {
        let silhouettes = self.look_through_all(
            |_| frame,
            |mut look| {
                let mut everybody = look.silhouette(&self.truth.actor, &look.links(SceneFigure::Actor), &[]);
                for (body, links) in &look.others() {
                    everybody |= &look.silhouette(body, links, &[]);
                }
                everybody
            },
        );
        self.observation(frame, silhouettes)
    }

    fn observation(&self, frame: usize, silhouettes: Vec<Option<Mask>>) -> Observation {
        let time_s = self.truth.frames[frame].time_s;
        let silhouettes = self.with_empty_masks(silhouettes);
        Observation { frame, time_s, silhouettes, moment: self.filming.moment(frame, time_s), keypoints: None }
    }

    /// Replaces masks of missing images with empty ones.
    pub(super) fn with_empty_masks(&self, masks: Vec<Option<Mask>>) -> Vec<Mask> {
        let pinholes = self.filming.rig().cameras.iter().map(|camera| camera.pinhole);
        masks.into_iter().zip(pinholes).map(|(mask, p)| mask.unwrap_or_else(|| Mask::new(p.width, p.height))).collect()
    }

    /// Depth image of the props in camera `camera`; `None` without props, and for a moving camera.
    pub(super) fn screen(&self, camera: usize) -> Option<&DepthImage> {
        self.screens.get(camera)?.as_ref()
    }

    /// Depth and link at every pixel of one frame, which must exist in the truth, without what props and distractors
    /// hide; one image per camera, `None` for a camera that takes no image in that frame.
    pub fn depths(&self, frame: usize) -> Vec<Option<DepthImage>> {
        self.look_through_all(
            |_| frame,
            |look| {
                let links = look.links(SceneFigure::Actor);
                let mut image = look.eye.depth(&self.truth.actor, &links);
                if let Some(screen) = look.screen() {
                    image.hide_behind(screen);
                }
                for (body, links) in &look.others() {
                    image.hide_behind(&look.eye.depth(body, links));
                }
                image
            },
        )
    }

    /// The surface of a figure pixel by pixel in frame `shown(camera)`, ignoring occluders; one list per camera, empty
    /// for a camera that takes no image in that frame.
    pub(super) fn surfaces(&self, figure: SceneFigure, shown: impl Fn(usize) -> usize) -> Vec<Vec<SurfacePixel>> {
        let body = self.body(figure);
        let seen = self.look_through_all(shown, |look| look.eye.surface(body, &look.links(figure)));
        seen.into_iter().map(Option::unwrap_or_default).collect()
    }

    /// The surface of the props pixel by pixel, for static cameras; one list per camera, all empty without props.
    pub(super) fn props_surface(&self, props: &[Prop]) -> Vec<Vec<SurfacePixel>> {
        if props.is_empty() {
            return vec![Vec::new(); self.eyes.len()];
        }
        let seen = self.look_through_all(|_| 0, |look| look.eye.surface_of_props(props));
        seen.into_iter().map(Option::unwrap_or_default).collect()
    }

    fn body(&self, figure: SceneFigure) -> &'a Humanoid {
        match figure {
            SceneFigure::Actor => &self.truth.actor,
            SceneFigure::Distractor(other) => &self.truth.distractors[other].body,
        }
    }

    /// Calls `look` for every camera, with the scene of frame `shown(camera)`; `None` for a camera that takes no image
    /// in that frame.
    pub(super) fn look_through_all<T>(
        &self,
        shown: impl Fn(usize) -> usize,
        mut look: impl FnMut(Look<'_, 'a>) -> T,
    ) -> Vec<Option<T>> {
        let idle = || self.idle.lock().unwrap_or_else(PoisonError::into_inner);
        let ready = idle().pop();
        let mut eyes = ready.unwrap_or_else(|| self.eyes.iter().map(Eye::sharing).collect());
        let each = eyes.iter_mut().enumerate();
        let of_camera = |(camera, eye): (usize, &mut Eye)| {
            let frame = shown(camera);
            self.filming.has_image(camera, frame).then(|| look(Look::new(self, eye, camera, frame)))
        };
        let seen = each.map(of_camera).collect();
        idle().push(eyes);
        seen
    }
}

impl<'o, 'a> Look<'o, 'a> {
    fn new(observer: &'o Observer<'a>, eye: &'o mut Eye, camera: usize, frame: usize) -> Self {
        let mut look = Self { observer, eye, camera, frame, moved: None };
        if observer.filming.path(camera).is_some() {
            let placements: Vec<_> = look.times().map(|time_s| observer.filming.placement(camera, time_s)).collect();
            look.eye.place(placements.into_iter());
            let props = &observer.truth.props;
            look.moved = (!props.is_empty()).then(|| look.eye.depth_of_props(props));
        }
        look
    }

    /// Exposure times of the image: one, or one per row, seconds.
    fn times(&self) -> impl Iterator<Item = f64> + use<'o, 'a> {
        let (filming, camera) = (&self.observer.filming, self.camera);
        let frame_s = self.observer.truth.frames[self.frame].time_s;
        (0..filming.exposures(camera)).map(move |row| filming.row_s(camera, frame_s, row))
    }

    /// Link frames of a figure for each exposure.
    pub(super) fn links(&self, figure: SceneFigure) -> Vec<LinkFrames> {
        self.times().map(|time_s| self.observer.clock.links(figure, self.frame, time_s)).collect()
    }

    /// Bodies of the distractors with their link frames for each exposure.
    fn others(&self) -> Vec<(&'a Humanoid, Vec<LinkFrames>)> {
        let figure = |(other, distractor): (usize, &'a Distractor)| {
            (&distractor.body, self.links(SceneFigure::Distractor(other)))
        };
        self.observer.truth.distractors.iter().enumerate().map(figure).collect()
    }

    /// Depth image of the props; `None` without props.
    pub(super) fn screen(&self) -> Option<&DepthImage> {
        self.moved.as_ref().or(self.observer.screens[self.camera].as_ref())
    }

    /// The visible silhouette of a body behind props and other bodies, with link frames for each exposure.
    pub(super) fn silhouette(
        &mut self,
        body: &Humanoid,
        links: &[LinkFrames],
        others: &[(&Humanoid, Vec<LinkFrames>)],
    ) -> Mask {
        let mut silhouette = self.eye.silhouette(body, links);
        if self.screen().is_none() && others.is_empty() {
            return silhouette;
        }
        let own = self.eye.depth(body, links);
        if let Some(screen) = self.screen() {
            own.clear_hidden(screen, &mut silhouette);
        }
        for (body, links) in others {
            own.clear_hidden(&self.eye.depth(body, links), &mut silhouette);
        }
        silhouette
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_bodies::{person, walk};
    use crate::test_cameras::rig;
    use skiagraph_core::body::Motion;

    #[test]
    fn a_frame_does_not_depend_on_threads_or_earlier_frames() {
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
    fn the_foreground_is_the_union_of_all_figures_and_agrees_with_the_depths() {
        let mut poses = walk(1).poses;
        poses[0].world_from_root.translation.vector += nalgebra::Vector3::new(0.6, 0.25, 0.0);
        let distractor = Distractor { name: "passer-by".into(), body: person(), poses };
        let alone = GroundTruth::from_motion(person(), &walk(3), &rig()).unwrap();
        let others = Motion { frames_per_second: 60.0, poses: vec![distractor.poses[0].clone(); 3] };
        let truth = GroundTruth::among(person(), &walk(3), &rig(), Vec::new(), vec![distractor]).unwrap();
        let other = GroundTruth::from_motion(person(), &others, &rig()).unwrap();
        let (observer, of) = (Observer::new(&truth, &rig()), |t| Observer::new(t, &rig()).observe(2).silhouettes);
        let (actor, everybody) = (observer.observe(2).silhouettes, observer.foreground(2).silhouettes);
        let mut hidden = 0;
        for (camera, depth) in observer.depths(2).iter().flatten().enumerate() {
            let (whole, other) = (&of(&alone)[camera], &of(&other)[camera]);
            let mut both = whole.clone();
            both |= other;
            assert_eq!(everybody[camera], both);
            assert_eq!(actor[camera].count_common(whole), actor[camera].count(), "it is a part of the actor");
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
}
