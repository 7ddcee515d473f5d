//! `skiagraph twin`: a synthetic scene like a recording: its cameras, a body of the tracked proportions, the tracked
//! motion, and errors of masks and keypoints as they were measured. Its truth is exact.

mod noise;

use std::path::Path;

use nalgebra::Matrix3;

use self::noise::{KeypointNoise, MeasuredNoise, TrackedBody};
use crate::artefacts::{Artefact, ArtefactKind, Destination, Inputs, MadeBy};
use crate::common::{ExperimentError, Progress, Stage};
use crate::external::EXTERNAL_FILE;
use crate::measure::measuring::check_fit;
use crate::measure::poses_file::read_poses;
use crate::measure::tracked::{POSES_FILE, TRACK_FILE};
use crate::measure::{PosesDeclared, Tracked};
use crate::prepare::skins::recorded_body;
use crate::scenario::RecordedBody;
use skiagraph_core::body::{
    Humanoid, LANDMARKS, LinkFrames, Markers, Pose, SHIPPED_SKINS, Solid, VARIED_GIRTHS, girth_segment, shipped,
};
use skiagraph_core::camera::CameraRig;
use skiagraph_core::input::hex_sha256;
use skiagraph_set::{BlindSet, bvh_text, cameras_to_toml, is_footage};
use skiagraph_truth::retarget::{SegmentLengths, fit_shape};

/// The files of a twin: the scenario, and what it names.
const SCENARIO: &str = "twin.toml";
const MOTION: &str = "motion.bvh";
const CAMERAS: &str = "cameras.toml";

/// Speed of a landmark that is the tracker's jump from its start, not the person's, metres per second.
const FASTEST_M_PER_S: f64 = 15.0;

/// Writes the twin of a recording's set, as a run tracked it, into a folder: a scenario with its files.
/// Returns notes for the user.
pub fn twin(
    set: &Path,
    run: &Path,
    to: Destination<'_>,
    progress: &dyn Progress,
) -> Result<Vec<String>, ExperimentError> {
    Inputs::new([set.to_owned(), run.to_owned()]).keep_from(to.path)?;
    let blind = BlindSet::read(set)?;
    let settings = MadeBy::at(set).filter(|_| is_footage(set)).map(|made_by| made_by.settings["tracker_body"].clone());
    let worn: Option<RecordedBody> = settings.and_then(|settings| serde_json::from_value(settings).ok());
    let Some(worn) = worn else {
        let detail = format!("expected the set of a recording, made by skiagraph import, found {}", set.display());
        return Err(ExperimentError::Argument { argument: "SET", detail });
    };
    let is_shipped = shipped(&worn.robot).is_ok();
    if !is_shipped || worn.skin.as_deref().is_some_and(|skin| !SHIPPED_SKINS.contains(&skin)) {
        let detail = format!(
            "expected a recording whose tracker_body has a robot and a skin that are built in, found {} and {}",
            worn.robot,
            worn.skin.as_deref().unwrap_or("none")
        );
        return Err(ExperimentError::Argument { argument: "SET", detail });
    }
    let own_body = &blind.start.body;
    let tracked = if run.join(TRACK_FILE).is_file() {
        Tracked::read(run, own_body)?
    } else if run.join(EXTERNAL_FILE).is_file() {
        Tracked::read_program(run, own_body)?
    } else {
        read_poses(
            &if run.is_dir() { run.join(POSES_FILE) } else { run.to_owned() },
            &blind,
            &PosesDeclared::default(),
        )?
    };
    let another = |detail| ExperimentError::AnotherSet { run: run.to_owned(), set: set.to_owned(), detail };
    check_fit(&blind, &tracked).map_err(another)?;
    let body = tracked.estimates.body(0, own_body);
    let (poses, mut notes) = all_poses(&tracked, run)?;
    let rig = tracked.corrected_rig(&blind, 0).unwrap_or_else(|| blind.rig.clone());
    let girths = girths(&worn, body)?;
    let first = settled(body, &poses, blind.frames_per_second);
    let poses = &poses[first..];
    notes.extend((first > 0).then(|| format!("begins with frame {first}, where the tracker has left its start pose")));
    progress.begin(Stage::Evaluate, poses.len());
    let noise = TrackedBody { set: &blind, rig: &rig, body, poses, first }.noise(progress)?;
    let frames: Vec<LinkFrames> = poses.iter().map(|pose| body.link_frames(pose)).collect();
    let motion = bvh_text(body, blind.frames_per_second, frames.iter(), Matrix3::identity()).into_bytes();
    let made_by = MadeBy::new("skiagraph twin", serde_json::json!({}));
    let made_by = made_by.of("set", &blind.set_hash).of("estimate", hex_sha256(&motion));
    let folder = Artefact::begin_folder(to, ArtefactKind::Folder, made_by)?;
    let scenario = scenario(&blind, &worn, &girths, &noise, off(&blind.rig, &rig));
    notes.push(format!("measured against the tracked body, whose own error is in it: {}", noise.describe()));
    folder.write_all(&[
        (MOTION.into(), motion),
        (CAMERAS.into(), cameras_to_toml(&rig.cameras).into_bytes()),
        (SCENARIO.into(), scenario.into_bytes()),
    ])?;
    folder.finish()?;
    Ok(notes)
}

/// The poses of the first seed; a lost frame has that of the frame before.
fn all_poses(tracked: &Tracked, run: &Path) -> Result<(Vec<Pose>, Vec<String>), ExperimentError> {
    let sequence = tracked.estimates.sequences.first();
    let frames = 0..tracked.estimates.frames();
    let found: Vec<Option<&Pose>> = frames.map(|frame| sequence.and_then(|sequence| sequence.pose(frame))).collect();
    let Some(mut last) = found.iter().flatten().next().copied() else {
        let detail =
            "expected poses of the tracker's body, found none; a twin cannot be made of joints alone".to_owned();
        return Err(ExperimentError::Malformed { path: run.to_owned(), detail });
    };
    let mut poses = Vec::new();
    let mut lost = 0;
    for pose in found {
        lost += usize::from(pose.is_none());
        last = pose.unwrap_or(last);
        poses.push(last.clone());
    }
    let note = (lost > 0).then(|| format!("{lost} lost frames have the pose of the frame before"));
    Ok((poses, note.into_iter().collect()))
}

/// The first frame after which no landmark moves faster than a person's does; 0 if that is not among the first third.
fn settled(body: &Humanoid, poses: &[Pose], frames_per_second: f64) -> usize {
    let places: Vec<Markers> = poses.iter().map(|pose| body.markers(&body.link_frames(pose))).collect();
    let mut first = 0;
    for frame in 1..places.len() / 3 {
        let both = places[frame - 1].iter().flatten().zip(places[frame].iter().flatten());
        if both.map(|(early, late)| (late - early).norm()).fold(0.0, f64::max) * frames_per_second > FASTEST_M_PER_S {
            first = frame;
        }
    }
    first
}

/// Factors on the girths of the recording's robot, scaled to the lengths of `body`, that give the girths of `body`.
fn girths(worn: &RecordedBody, body: &Humanoid) -> Result<[f64; 8], ExperimentError> {
    let template = recorded_body(worn, Path::new(""))?;
    let scaled = template.reshaped(&fit_shape(&template, &SegmentLengths::from_body(body)));
    let (mut sums, mut counts) = ([0.0; 8], [0.0; 8]);
    for (own, scaled) in body.links.iter().zip(&scaled.links) {
        let Some(segment) = girth_segment(&own.name) else { continue };
        for (own, scaled) in own.solids.iter().zip(&scaled.solids) {
            if let (Solid::TaperedCapsule(own), Solid::TaperedCapsule(scaled)) = (own, scaled) {
                sums[segment] += (own.radius_a + own.radius_b) / (scaled.radius_a + scaled.radius_b);
                counts[segment] += 1.0;
            }
        }
    }
    Ok(std::array::from_fn(|segment| if counts[segment] > 0.0 { sums[segment] / counts[segment] } else { 1.0 }))
}

/// Root mean square over the coordinates of how far given cameras are off: millimetres and degrees.
fn off(given: &CameraRig, corrected: &CameraRig) -> [f64; 2] {
    let coordinates = 3.0 * given.cameras.len() as f64;
    let (mut moved, mut turned) = (0.0, 0.0);
    for (given, corrected) in given.cameras.iter().zip(&corrected.cameras) {
        moved += (given.centre() - corrected.centre()).norm_squared();
        let (given, corrected) = (given.camera_from_world.rotation, corrected.camera_from_world.rotation);
        turned += given.angle_to(&corrected).to_degrees().powi(2);
    }
    [1000.0 * (moved / coordinates).sqrt(), (turned / coordinates).sqrt()]
}

impl MeasuredNoise {
    fn describe(&self) -> String {
        let outlines = format!(
            "outlines {:.2} px, holes {:.2} %, added {:.2} %",
            self.boundary_px,
            100.0 * self.holes,
            100.0 * self.blobs
        );
        let keypoints = self.keypoints.map_or(String::new(), |k| {
            format!(
                "; keypoints {:.2} % of the person's height and {:.0} mm throughout, {:.1} % missing",
                k.slow_percent.hypot(k.white_percent),
                k.bias_mm,
                100.0 * k.missing
            )
        });
        outlines + &keypoints
    }
}

fn scenario(
    set: &BlindSet,
    worn: &RecordedBody,
    girths: &[f64; 8],
    noise: &MeasuredNoise,
    [moved_mm, turned_deg]: [f64; 2],
) -> String {
    // thicker soles would raise the body, and scale its path with its legs
    let own = VARIED_GIRTHS.iter().zip(girths).filter(|(name, _)| **name != "foot");
    let girths: Vec<String> = own.map(|(name, girth)| format!("{name} = {girth:.4}")).collect();
    let landmarks: Vec<String> =
        LANDMARKS.iter().map(|landmark| format!("{0} = \"marker_{0}\"", landmark.name())).collect();
    let skin = worn.skin.as_ref().map_or(String::new(), |skin| format!("skin = {skin:?}\n"));
    let keypoints = noise.keypoints.zip(set.keypoints.as_ref()).map_or(String::new(), |(noise, found)| {
        let KeypointNoise { slow_percent, white_percent, gross, missing, bias_mm } = noise;
        format!(
            "\n[observation.keypoints]\nlayout = \"{}\"\nslow_percent = {slow_percent:.3}\nwhite_percent = \
             {white_percent:.3}\ngross = {gross:.4}\nmissing = {missing:.4}\nbias_mm = {bias_mm:.2}\n",
            found.layout.name()
        )
    });
    let (robot, name, rate) = (&worn.robot, &set.name, set.frames_per_second);
    let MeasuredNoise { boundary_px, boundary_s, holes, blobs, .. } = noise;
    format!(
        "# The twin of the recording `{name}`: its cameras, the tracked motion on a body of the tracked proportions, and errors as\n\
         # they were measured against the tracked body. Everything here may be changed.\n\
         schema = \"skiagraph.scenario/1\"\nname = \"{name}-twin\"\n\n\
         [motion]\nclip = \"{MOTION}\"\nframes_per_second = {rate}\nmetres_per_unit = 0.01\nup = \"z\"\nground = \"file\"\n\
         joint_map = {{ {} }}\n\
         # trackers tremble more than people do\naccept_implausible = true\n\n\
         [actor]\nrobot = {robot:?}\n{skin}contact = \"off\"\nshape = {{ girths = {{ {} }} }}\n\n\
         [tracker_body]\nrobot = {robot:?}\n{skin}mismatch = \"population\"\n\n\
         [[rig.file]]\npath = \"{CAMERAS}\"\n\n\
         [observation]\nsilhouette = \"corrupted\"\n\n\
         [observation.corruption]\nboundary_px = {boundary_px:.3}\nboundary_s = {boundary_s:.3}\nholes = {holes:.5}\nblobs = {blobs:.5}\n\
         # as far as the tracker corrected the cameras\ncalibration_mm = {moved_mm:.2}\ncalibration_deg = {turned_deg:.4}\n{keypoints}",
        landmarks.join(", "),
        girths.join(", "),
    )
}
