//! A rig over time: the motion of its cameras, and the exposure times of their images.

use nalgebra::Isometry3;

use super::{Camera, CameraError, CameraPath, CameraRig};

/// When a camera takes its images. Row `r` of a frame's image is exposed at the frame's time plus `offset_s` plus `r`
/// times `line_delay_s`; between images the camera provides nothing new.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraTiming {
    /// Frames from one image to the next, at least 1; the first image is that of frame 0.
    pub every: usize,
    /// Time of an image after its frame, seconds; negative for earlier.
    pub offset_s: f64,
    /// Delay of every row after the row above it, seconds, at least 0: a rolling shutter.
    pub line_delay_s: f64,
}

impl Default for CameraTiming {
    /// An image of every frame, at the frame's time, all rows at once.
    fn default() -> Self {
        Self { every: 1, offset_s: 0.0, line_delay_s: 0.0 }
    }
}

/// The positions of a rig's cameras in one frame, and the exposure times of their images.
#[derive(Clone, Debug, PartialEq)]
pub struct RigMoment {
    /// World-to-camera transform of every camera when the first row of its image is exposed, or at the frame's time
    /// plus the camera's offset if it has no image in this frame. Metres.
    pub camera_from_world: Vec<Isometry3<f64>>,
    /// When the first row of every camera's image was exposed, seconds from frame 0; `None` for a camera without a new
    /// image in this frame.
    pub exposed_s: Vec<Option<f64>>,
}

/// A rig whose cameras may move and have individual exposure times. A [`CameraRig`] is the special case of static
/// cameras that expose all images at the frames' times; rendering and metrics accept either.
#[derive(Clone, Debug, PartialEq)]
pub struct TimedRig {
    rig: CameraRig,
    /// One entry per camera; `None` for a static camera.
    paths: Vec<Option<CameraPath>>,
    /// One entry per camera.
    timings: Vec<CameraTiming>,
    /// How fast the cameras' clocks run apart, seconds per second, one entry per camera; empty if they do not.
    drifts: Vec<f64>,
}

impl From<&CameraRig> for TimedRig {
    /// A static rig that takes all images at once.
    fn from(rig: &CameraRig) -> Self {
        let cameras = rig.cameras.len();
        let timings = vec![CameraTiming::default(); cameras];
        Self { rig: rig.clone(), paths: vec![None; cameras], timings, drifts: Vec::new() }
    }
}

impl From<&TimedRig> for TimedRig {
    fn from(rig: &TimedRig) -> Self {
        rig.clone()
    }
}

impl TimedRig {
    /// A rig with a path and a timing for every camera; cameras beyond the end of these lists are static and take
    /// their images at the frames' times. Moving cameras are placed where they take their first image.
    ///
    /// # Errors
    /// [`CameraError::Refused`] if a camera cannot look at its target in frame 0.
    pub fn new(
        rig: CameraRig,
        mut paths: Vec<Option<CameraPath>>,
        mut timings: Vec<CameraTiming>,
    ) -> Result<Self, CameraError> {
        paths.resize(rig.cameras.len(), None);
        timings.resize(rig.cameras.len(), CameraTiming::default());
        let mut filming = Self { rig, paths, timings, drifts: Vec::new() };
        for (index, path) in filming.paths.iter().enumerate() {
            let camera = &mut filming.rig.cameras[index];
            if let Some(path) = path {
                camera.camera_from_world = path.camera_from_world(&camera.name, filming.timings[index].offset_s)?;
            }
        }
        Ok(filming)
    }

    /// The cameras at their positions for the images of frame 0.
    pub fn rig(&self) -> &CameraRig {
        &self.rig
    }

    /// Number of cameras.
    pub fn cameras(&self) -> usize {
        self.rig.cameras.len()
    }

    /// The path of a camera; `None` if it is static. Panics if the rig has no such camera.
    pub fn path(&self, camera: usize) -> Option<&CameraPath> {
        self.paths[camera].as_ref()
    }

    /// The timing of a camera. Panics if the rig has no such camera.
    pub fn timing(&self, camera: usize) -> &CameraTiming {
        &self.timings[camera]
    }

    /// Whether no camera moves and all take an image of every frame at the frame's time, all rows at once.
    pub fn is_still(&self) -> bool {
        let is_usual = |timing: &CameraTiming| *timing == CameraTiming::default();
        self.paths.iter().all(Option::is_none) && self.timings.iter().all(is_usual) && self.drifts.is_empty()
    }

    /// Whether any image is exposed at another time than its frame's.
    pub fn leaves_frames(&self) -> bool {
        let is_late = |timing: &CameraTiming| timing.offset_s != 0.0 || timing.line_delay_s != 0.0;
        self.timings.iter().any(is_late) || !self.drifts.is_empty()
    }

    /// Whether a camera takes an image in a frame.
    pub fn has_image(&self, camera: usize, frame: usize) -> bool {
        frame.is_multiple_of(self.timings[camera].every.max(1))
    }

    /// When a row of a camera's image is exposed, seconds; `frame_s` is the frame's time.
    pub fn row_s(&self, camera: usize, frame_s: f64, row: u32) -> f64 {
        let (timing, drift) = (&self.timings[camera], self.drifts.get(camera).map_or(0.0, |drift| drift * frame_s));
        frame_s + timing.offset_s + drift + timing.line_delay_s * f64::from(row)
    }

    /// Whether the rows of a camera's image are exposed one after another.
    pub fn is_rolling(&self, camera: usize) -> bool {
        self.timings[camera].line_delay_s != 0.0
    }

    /// Number of different exposure times within an image of a camera: one, or one per row.
    pub fn exposures(&self, camera: usize) -> u32 {
        if self.is_rolling(camera) { self.rig.cameras[camera].pinhole.height } else { 1 }
    }

    /// World-to-camera transform at a time; that of the first image where the path has no valid view
    /// ([`Self::check`]).
    pub fn placement(&self, camera: usize, time_s: f64) -> Isometry3<f64> {
        let known = &self.rig.cameras[camera];
        let moved = self.paths[camera].as_ref().and_then(|path| path.camera_from_world(&known.name, time_s).ok());
        moved.unwrap_or(known.camera_from_world)
    }

    /// A camera at its position at a time.
    pub fn camera_at(&self, camera: usize, time_s: f64) -> Camera {
        self.rig.cameras[camera].placed(self.placement(camera, time_s))
    }

    /// The cameras at their positions for the images of the frame at `frame_s` seconds.
    pub fn rig_at(&self, frame_s: f64) -> CameraRig {
        let camera = |index| self.camera_at(index, self.row_s(index, frame_s, 0));
        CameraRig { cameras: (0..self.cameras()).map(camera).collect() }
    }

    /// Positions and exposure times of the cameras in a frame at `frame_s` seconds; `None` for a static rig.
    pub fn moment(&self, frame: usize, frame_s: f64) -> Option<RigMoment> {
        if self.is_still() {
            return None;
        }
        let cameras = 0..self.cameras();
        let first = |camera: usize| self.row_s(camera, frame_s, 0);
        Some(RigMoment {
            camera_from_world: cameras.clone().map(|camera| self.placement(camera, first(camera))).collect(),
            exposed_s: cameras.map(|camera| self.has_image(camera, frame).then(|| first(camera))).collect(),
        })
    }

    /// A rig of one camera only, replaced by `seen`.
    pub fn alone(&self, camera: usize, seen: Camera) -> Self {
        let seen = seen.placed(self.rig.cameras[camera].camera_from_world);
        let (paths, timings) = (vec![self.paths[camera].clone()], vec![self.timings[camera]]);
        let drifts = self.drifts.get(camera).copied().into_iter().collect();
        Self { rig: CameraRig { cameras: vec![seen] }, paths, timings, drifts }
    }

    /// The same rig with each camera's images delayed by its own offset in seconds (0 if none is given), and every row
    /// of all cameras delayed by another `line_delay_s` after the row above it.
    pub fn delayed(&self, offsets_s: &[f64], line_delay_s: f64) -> Self {
        let mut late = self.clone();
        for (timing, offset_s) in late.timings.iter_mut().zip(offsets_s) {
            timing.offset_s += offset_s;
        }
        late.timings.iter_mut().for_each(|timing| timing.line_delay_s += line_delay_s);
        late
    }

    /// The same rig with clocks that run apart: in every second, the images of a camera come this much later, in
    /// seconds; one entry per camera.
    pub fn drifting(self, drifts: Vec<f64>) -> Self {
        Self { drifts, ..self }
    }

    /// Checks that every camera can look at its target at all exposure times of this many frames.
    ///
    /// # Errors
    /// [`CameraError::Refused`] for the first camera that cannot.
    pub fn check(&self, frames: usize, frames_per_second: f64) -> Result<(), CameraError> {
        for (index, path) in self.paths.iter().enumerate() {
            let Some(path) = path else { continue };
            let last_row = self.exposures(index) - 1;
            for frame in 0..frames {
                for row in [0, last_row] {
                    let time_s = self.row_s(index, frame as f64 / frames_per_second, row);
                    path.camera_from_world(&self.rig.cameras[index].name, time_s)?;
                }
            }
        }
        Ok(())
    }
}

impl CameraRig {
    /// The same cameras at their positions at this moment.
    pub fn at(&self, moment: &RigMoment) -> Self {
        let cameras = self.cameras.iter().zip(&moment.camera_from_world);
        Self { cameras: cameras.map(|(camera, placement)| camera.placed(*placement)).collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{CameraKeyframe, RingParameters};

    fn ring() -> CameraRig {
        CameraRig::ring(&RingParameters { count: 2, image_size: [64, 48], ..RingParameters::default() }).unwrap()
    }

    /// From one place to another in two seconds.
    fn path(ends: [[f64; 3]; 2]) -> CameraPath {
        let keyframe = |(time_s, position)| CameraKeyframe { time_s, position, look_at: [0.0, 0.0, 1.0], roll: 0.0 };
        CameraPath::new("moving", [0.0, 2.0].into_iter().zip(ends).map(keyframe).collect()).unwrap()
    }

    #[test]
    fn a_static_rig_is_the_same_at_any_time_and_has_no_moment() {
        let still = TimedRig::from(&ring());
        assert!(still.is_still() && still.moment(3, 0.5).is_none());
        assert_eq!(still.rig_at(7.0), ring());
        assert_eq!(TimedRig::new(ring(), Vec::new(), Vec::new()).unwrap(), still);
    }

    #[test]
    fn images_are_taken_at_their_interval_plus_offset_row_by_row() {
        let timing = CameraTiming { every: 3, offset_s: 0.25, line_delay_s: 1e-3 };
        let moving = path([[3.0, 0.0, 1.5], [5.0, 0.0, 1.5]]);
        let filming = TimedRig::new(ring(), vec![None, Some(moving)], vec![CameraTiming::default(), timing]).unwrap();
        assert!(!filming.is_still() && filming.leaves_frames());
        let seconds = |camera: usize| (0..7).filter(|frame| filming.has_image(camera, *frame)).collect::<Vec<_>>();
        assert_eq!((seconds(0), seconds(1)), ((0..7).collect(), vec![0, 3, 6]));
        assert_eq!((filming.exposures(0), filming.exposures(1)), (1, 48));
        assert!((filming.row_s(1, 1.0, 10) - 1.26).abs() < 1e-12);
        // cameras are placed where their first row is exposed
        let x = |rig: &CameraRig| rig.cameras[1].centre().x;
        assert!((x(filming.rig()) - 3.25).abs() < 1e-12);
        assert!((x(&filming.rig_at(1.0)) - 4.25).abs() < 1e-12);
        let moment = filming.moment(1, 1.0).unwrap();
        assert_eq!(moment.exposed_s, [Some(1.0), None]);
        assert_eq!(filming.rig().at(&moment), filming.rig_at(1.0));
        let late = filming.delayed(&[0.5], 1e-3);
        assert_eq!((late.row_s(0, 1.0, 0), late.timing(1).offset_s, late.exposures(0)), (1.5, 0.25, 48));
    }

    #[test]
    fn an_impossible_view_along_a_path_is_found() {
        let over = path([[-1.0, 0.0, 3.0], [1.0, 0.0, 3.0]]);
        let filming = TimedRig::new(ring(), vec![Some(over)], Vec::new()).unwrap();
        assert!(filming.check(10, 10.0).is_ok());
        assert!(filming.check(11, 10.0).unwrap_err().to_string().contains("along the view"));
    }
}
