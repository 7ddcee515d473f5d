//! `cameras.npz`: pose and exposure time of the cameras in every frame, for T frames and C cameras; in sets with moving
//! cameras or own exposure times.
//!
//! | array | shape | meaning |
//! |---|---|---|
//! | `camera_from_world` | (T, C, 7) | x y z, qw qx qy qz: the camera at the exposure of the first row of its image |
//! | `time_s` | (T, C) | time of this exposure, seconds from frame 0; NaN if the camera has no image of the frame |
//! | `line_delay_s` | (C) | delay of every row after the row above it, seconds |
//! | `camera_names` | (C) | as in `cameras.json` |

use nalgebra::{Isometry3, Point3};

use super::manifest::BlindManifest;
use super::{rigid, truth_file};
use crate::SetError;
use crate::files::SetFiles;
use skiagraph_core::camera::{CameraRig, RigMoment, TimedRig};
use skiagraph_core::npz::{Array, Npz};
use skiagraph_core::rng::KeyedSeed;
use skiagraph_truth::observing::{Corruption, ObservationFacts, tracker_rig};
use skiagraph_truth::scene::{GroundTruth, TruthFrame};

pub(crate) const PATH: &str = "cameras.npz";

/// Greatest time and delay, seconds: a day.
const LATEST_S: f64 = 86_400.0;

/// The cameras of every frame as given to trackers.
#[derive(Clone, Debug, PartialEq)]
pub struct RigMoments {
    /// One entry per frame.
    pub frames: Vec<RigMoment>,
    /// Delay of every row of the image after the row above it, seconds; one entry per camera.
    pub line_delay_s: Vec<f64>,
}

impl RigMoments {
    /// The cameras of `rig` in every frame of `truth`, with the camera errors of these observations; `None` if all
    /// cameras are static and expose every frame at its own time.
    pub fn for_tracker(
        rig: &TimedRig,
        truth: &GroundTruth,
        observation: Option<&ObservationFacts>,
        seed: KeyedSeed,
    ) -> Option<Self> {
        let corruption = observation.map(|facts| facts.corruption).filter(Corruption::changes_cameras);
        let given = |(frame, known): (usize, &TruthFrame)| {
            let mut moment = rig.moment(frame, known.time_s)?;
            if let Some(corruption) = &corruption {
                let given = tracker_rig(&rig.rig().at(&moment), corruption, seed);
                moment.camera_from_world = given.cameras.iter().map(|camera| camera.camera_from_world).collect();
            }
            Some(moment)
        };
        let frames = truth.frames.iter().enumerate().map(given).collect::<Option<_>>()?;
        let line_delay_s = (0..rig.cameras()).map(|camera| rig.timing(camera).line_delay_s).collect();
        Some(Self { frames, line_delay_s })
    }

    /// Describes motion and timing of a camera, whose index must be valid; `None` if it is static and exposes every
    /// frame at its own time. `frames_per_second` is the frame rate of the set.
    pub fn describe(&self, camera: usize, frames_per_second: f64) -> Option<String> {
        let places: Vec<&Isometry3<f64>> = self.frames.iter().map(|moment| &moment.camera_from_world[camera]).collect();
        let centre = |place: &Isometry3<f64>| place.inverse_transform_point(&Point3::origin());
        let steps = places.windows(2).map(|pair| (centre(pair[1]) - centre(pair[0])).norm());
        let way = self.moves(camera).then(|| format!("moves, {:.2} m in all", steps.sum::<f64>()));
        let images = self.frames.iter().filter(|moment| moment.exposed_s[camera].is_some()).count();
        let fewer = (images < self.frames.len()).then(|| format!("images of {images} of {} frames", self.frames.len()));
        let exposed = self.frames.iter().enumerate().find_map(|(f, m)| Some((f, m.exposed_s[camera]?)));
        let late_ms = exposed.map_or(0.0, |(frame, time_s)| 1e3 * (time_s - frame as f64 / frames_per_second));
        let late = (late_ms.abs() > 1e-6)
            .then(|| if late_ms > 0.0 { format!("{late_ms:.3} ms late") } else { format!("{:.3} ms early", -late_ms) });
        let delay_us = 1e6 * self.line_delay_s[camera];
        let rolling = (delay_us > 0.0).then(|| format!("rolling shutter, {delay_us:.3} us from row to row"));
        let parts: Vec<String> = [way, fewer, late, rolling].into_iter().flatten().collect();
        (!parts.is_empty()).then(|| parts.join(", "))
    }

    /// Whether a camera, whose index must be valid, has another pose in any frame.
    pub(crate) fn moves(&self, camera: usize) -> bool {
        self.frames.windows(2).any(|pair| pair[0].camera_from_world[camera] != pair[1].camera_from_world[camera])
    }

    /// The last frame with an image of a camera, whose index must be valid.
    pub(crate) fn last_image(&self, camera: usize) -> Option<usize> {
        self.frames.iter().rposition(|moment| moment.exposed_s[camera].is_some())
    }
}

pub(crate) fn to_npz(moments: &RigMoments, rig: &CameraRig) -> Npz {
    let (frames, cameras) = (moments.frames.len(), rig.cameras.len());
    let places: Vec<f64> =
        moments.frames.iter().flat_map(|moment| moment.camera_from_world.iter().flat_map(rigid::to_row)).collect();
    let times = moments.frames.iter().flat_map(|moment| moment.exposed_s.iter().map(|time| time.unwrap_or(f64::NAN)));
    Npz::from_iter([
        ("camera_from_world", Array::new(&[frames, cameras, 7], places)),
        ("time_s", Array::new(&[frames, cameras], times.collect::<Vec<f64>>())),
        ("line_delay_s", Array::new(&[cameras], moments.line_delay_s.clone())),
        ("camera_names", Array::names(rig.cameras.iter().map(|camera| camera.name.as_str()))),
    ])
}

/// Reads the file of a set with the cameras of `rig`; `None` for static cameras, which have no such file.
pub(crate) fn read(
    files: &SetFiles,
    manifest: &BlindManifest,
    rig: &CameraRig,
) -> Result<Option<RigMoments>, SetError> {
    match manifest.is_filmed() {
        true => from_npz(&Npz::from_bytes(PATH, &files.read(PATH)?)?, manifest.sequence.frames, rig).map(Some),
        false if files.has(PATH) => {
            let detail = "is only valid with the schema skiagraph.set/2; set.toml has that of static cameras";
            Err(SetError::malformed(PATH, detail.to_owned()))
        }
        false => Ok(None),
    }
}

fn from_npz(npz: &Npz, frames: usize, rig: &CameraRig) -> Result<RigMoments, SetError> {
    let malformed = |detail: String| SetError::malformed(PATH, detail);
    let cameras = rig.cameras.len();
    let names = rig.cameras.iter().map(|camera| &camera.name);
    if !truth_file::names(npz, "camera_names").is_some_and(|found| found.iter().eq(names)) {
        return Err(malformed("camera_names: expected the names of cameras.json in the same order".to_owned()));
    }
    let places = npz.f64s(PATH, "camera_from_world", &[Some(frames), Some(cameras), Some(7)])?.as_chunks::<7>().0;
    let times = npz.f64s(PATH, "time_s", &[Some(frames), Some(cameras)])?;
    let line_delay_s = npz.f64s(PATH, "line_delay_s", &[Some(cameras)])?.to_vec();
    if let Some(delay) = line_delay_s.iter().find(|delay| !(0.0..=LATEST_S).contains(*delay)) {
        return Err(malformed(format!("line_delay_s: expected 0 s or more, found {delay}")));
    }
    if let Some(time) = times.iter().find(|time| !time.is_nan() && time.abs() > LATEST_S) {
        return Err(malformed(format!("time_s: expected seconds from frame 0, found {time}")));
    }
    let placement = |row: &[f64; 7]| rigid::from_row(row).map_err(|e| malformed(format!("camera_from_world: {e}")));
    let of_frame = |frame: usize| {
        let own = frame * cameras..(frame + 1) * cameras;
        let camera_from_world: Vec<Isometry3<f64>> =
            places[own.clone()].iter().map(placement).collect::<Result<_, _>>()?;
        let exposed_s = times[own].iter().map(|time| Some(*time).filter(|time| !time.is_nan())).collect();
        Ok(RigMoment { camera_from_world, exposed_s })
    };
    let moments = RigMoments { frames: (0..frames).map(of_frame).collect::<Result<_, SetError>>()?, line_delay_s };
    match (0..cameras).find(|camera| moments.frames.first().is_some_and(|first| first.exposed_s[*camera].is_none())) {
        None => Ok(moments),
        Some(camera) => {
            Err(malformed(format!("time_s: camera {camera} has no image of frame 0; every camera needs one")))
        }
    }
}
