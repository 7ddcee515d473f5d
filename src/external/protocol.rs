//! The messages that a program receives and sends.

use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use skiagraph_core::body::{Humanoid, KeypointLayout, LANDMARKS};
use skiagraph_core::input::excerpt;
use skiagraph_core::observation::{FoundKeypoint, Observation};
use skiagraph_core::raster::Mask;
use skiagraph_set::{BlindSet, FARTHEST_M};

/// Name and version of the protocol; a program that uses another one names it in `ready`.
const PROTOCOL: &str = "skiagraph.tracker/1";
/// The protocol of sets whose cameras move or have their own timing: every frame message has the camera poses and which
/// cameras have an image. A program that only knows version 1 would take the cameras for static ones.
const TIMED_PROTOCOL: &str = "skiagraph.tracker/2";

pub(super) fn protocol_of(set: &BlindSet) -> &'static str {
    if set.moments.is_some() { TIMED_PROTOCOL } else { PROTOCOL }
}
const QUATERNION_TOLERANCE: f64 = 1e-3;

pub(super) type Named = BTreeMap<String, [f64; 3]>;

#[derive(Serialize)]
#[serde(tag = "type", rename_all = "snake_case")]
pub(super) enum Request<'a> {
    Hello(Box<Hello<'a>>),
    Frame(FrameMessage<'a>),
    End {},
}

#[derive(Serialize)]
pub(super) struct Hello<'a> {
    pub(super) protocol: &'static str,
    pub(super) seed: u64,
    pub(super) frames: usize,
    pub(super) fps: f64,
    /// The blind side of the set.
    pub(super) folder: &'a Path,
    pub(super) cameras: Vec<CameraMessage<'a>>,
    pub(super) markers: Vec<&'static str>,
    pub(super) joints: Vec<&'a str>,
    pub(super) angles: Vec<&'a str>,
    /// Layout and names of the points of a 2D detector; absent in sets without keypoints.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) keypoints: Option<KeypointsMessage>,
    pub(super) start: StartMessage,
    pub(super) time_limit_s: f64,
    /// The first frame that will be requested; above 0 after a restart.
    pub(super) first_frame: usize,
    /// The program's last answer, after a restart.
    pub(super) last_answer: Option<&'a Value>,
    /// The program's settings; absent without any.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub(super) settings: BTreeMap<String, Value>,
}

#[derive(Serialize)]
pub(super) struct CameraMessage<'a> {
    name: &'a str,
    width: u32,
    height: u32,
    #[serde(rename = "K")]
    k: [[f64; 3]; 3],
    #[serde(rename = "R")]
    r: [[f64; 3]; 3],
    t: [f64; 3],
    distortion: [f64; 5],
    /// Distance of the near plane, metres.
    near: f64,
    /// Line delay of a rolling shutter; absent in sets with static cameras.
    #[serde(skip_serializing_if = "Option::is_none")]
    line_delay_s: Option<f64>,
    /// Paths of the background images in their order; absent in sets without images.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    background: Vec<String>,
}

#[derive(Serialize)]
pub(super) struct KeypointsMessage {
    layout: &'static str,
    names: Vec<&'static str>,
}

#[derive(Serialize)]
pub(super) struct StartMessage {
    root: [f64; 7],
    angles: Vec<f64>,
    markers: BTreeMap<&'static str, Option<[f64; 3]>>,
    joints: BTreeMap<String, [f64; 3]>,
}

#[derive(Serialize)]
pub(super) struct FrameMessage<'a> {
    frame: usize,
    time_s: f64,
    views: Vec<ViewMessage<'a>>,
}

#[derive(Serialize)]
struct ViewMessage<'a> {
    camera: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    mask: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    rle: Option<Vec<u32>>,
    /// Path of the image; absent in sets without images.
    #[serde(skip_serializing_if = "Option::is_none")]
    colour: Option<String>,
    /// Column, row (pixel centres at integers) and confidence of every keypoint; null for a missing one.
    #[serde(skip_serializing_if = "Option::is_none")]
    keypoints: Option<Vec<Option<[f64; 3]>>>,
    #[serde(flatten)]
    moment: Option<CameraMoment>,
}

/// The pose of a camera, in sets whose cameras move or have their own timing.
#[derive(Serialize)]
struct CameraMoment {
    #[serde(rename = "R")]
    r: [[f64; 3]; 3],
    t: [f64; 3],
    /// Time at which the first row of the image was exposed; null for a camera without an image in this frame.
    exposed_s: Option<f64>,
}

impl<'a> Hello<'a> {
    pub(super) fn new(set: &'a BlindSet, folder: &'a Path, seed: u64, time_limit_s: f64) -> Self {
        let body = &set.start.body;
        let delays = set.moments.as_ref().map(|moments| &moments.line_delay_s);
        let camera = |(index, camera): (usize, &'a skiagraph_core::camera::Camera)| CameraMessage {
            name: &camera.name,
            width: camera.pinhole.width,
            height: camera.pinhole.height,
            k: camera.opencv_matrix(),
            r: camera.opencv_rotation(),
            t: camera.opencv_translation(),
            distortion: camera.distortion.coefficients(),
            near: camera.pinhole.near,
            line_delay_s: delays.and_then(|delays| delays.get(index).copied()),
            background: set.background_paths(index).iter().map(|path| absolute(folder, path)).collect(),
        };
        Self {
            protocol: protocol_of(set),
            seed,
            frames: set.frame_count,
            fps: set.frames_per_second,
            folder,
            cameras: set.rig.cameras.iter().enumerate().map(camera).collect(),
            markers: LANDMARKS.map(|landmark| landmark.name()).to_vec(),
            joints: body.joints.iter().map(|joint| joint.name.as_str()).collect(),
            angles: body.degrees_of_freedom.iter().map(|degree| degree.name.as_str()).collect(),
            keypoints: set.keypoints.as_ref().map(|keypoints| KeypointsMessage::new(keypoints.layout)),
            start: StartMessage::new(set),
            time_limit_s,
            first_frame: 0,
            last_answer: None,
            settings: BTreeMap::new(),
        }
    }
}

impl KeypointsMessage {
    fn new(layout: KeypointLayout) -> Self {
        Self { layout: layout.name(), names: layout.keypoints().iter().map(|point| point.name()).collect() }
    }
}

impl StartMessage {
    fn new(set: &BlindSet) -> Self {
        let (body, pose) = (&set.start.body, &set.start.pose);
        let (frames, root) = (body.link_frames(pose), &pose.world_from_root);
        let (place, turn) = (root.translation.vector, root.rotation);
        let markers = LANDMARKS.iter().zip(body.markers(&frames));
        let links = frames.0.iter().skip(1).map(|frame| frame.translation.vector.into());
        Self {
            root: [place.x, place.y, place.z, turn.w, turn.i, turn.j, turn.k],
            angles: pose.joint_angles.iter().copied().collect(),
            markers: markers.map(|(landmark, place)| (landmark.name(), place.map(|p| p.coords.into()))).collect(),
            joints: body.joints.iter().map(|joint| joint.name.clone()).zip(links).collect(),
        }
    }
}

impl<'a> FrameMessage<'a> {
    /// The message of a frame, with paths of silhouettes below `folder`, or with the silhouettes inline. Images always
    /// have paths.
    pub(super) fn new(set: &'a BlindSet, folder: &Path, observation: &Observation, inline: bool) -> Self {
        let frame = observation.frame;
        let path = |camera| absolute(folder, &BlindSet::silhouette_path(camera, frame));
        let view =
            |(index, camera): (usize, &'a skiagraph_core::camera::Camera)| {
                let has_image = observation.has_image(index);
                ViewMessage {
                    camera: &camera.name,
                    mask: (has_image && !inline).then(|| path(index)),
                    rle: (has_image && inline).then(|| run_lengths(&observation.silhouettes[index])),
                    colour: set.colour_path(index, frame).map(|path| absolute(folder, &path)),
                    keypoints: observation.keypoints.as_ref().filter(|_| has_image).map(|found| {
                        found.views[index].iter().map(|point| point.as_ref().map(keypoint_numbers)).collect()
                    }),
                    moment: observation.moment.as_ref().map(|moment| {
                        let placed = camera.placed(moment.camera_from_world[index]);
                        let (r, t) = (placed.opencv_rotation(), placed.opencv_translation());
                        CameraMoment { r, t, exposed_s: moment.exposed_s[index] }
                    }),
                }
            };
        Self { frame, time_s: observation.time_s, views: set.rig.cameras.iter().enumerate().map(view).collect() }
    }
}

/// The path of a file of the set in the program's folder.
fn absolute(folder: &Path, path: &str) -> String {
    folder.join(path).display().to_string()
}

fn keypoint_numbers(found: &FoundKeypoint) -> [f64; 3] {
    let [x, y] = found.pixel;
    [x - 0.5, y - 0.5, found.confidence]
}

/// Lengths of runs of equal pixels, row by row from the top left. The first run is of empty pixels and may be 0.
fn run_lengths(mask: &Mask) -> Vec<u32> {
    let (width, mut lengths, mut end) = (mask.width(), Vec::new(), 0);
    for (y, run) in (0..mask.height()).flat_map(|y| mask.runs(y).map(move |run| (y, run))) {
        let (start, stop) = (y * width + run.start, y * width + run.end);
        match lengths.last_mut().filter(|_| start == end) {
            // the run continues from the end of the previous row
            Some(last) => *last += stop - start,
            None => lengths.extend([start - end, stop - start]),
        }
        end = stop;
    }
    let rest = width * mask.height() - end;
    if rest > 0 || lengths.is_empty() {
        lengths.push(rest);
    }
    lengths
}

/// The answer to `hello`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub(super) struct Ready {
    pub(super) protocol: Option<String>,
    pub(super) name: Option<String>,
    pub(super) version: Option<String>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Reply {
    pub(super) frame: usize,
    /// `None`: lost.
    pub(super) pose: Option<RepliedPose>,
    /// From 0 to 1.
    pub(super) confidence: Option<f64>,
}

/// A pose in one of three forms.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) enum RepliedPose {
    Markers(Named),
    Joints(Named),
    Angles { root: [f64; 7], angles: Vec<f64> },
}

impl RepliedPose {
    pub(super) fn kind(&self) -> &'static str {
        match self {
            Self::Markers(_) => "markers",
            Self::Joints(_) => "joints",
            Self::Angles { .. } => "angles",
        }
    }
}

/// Reads the answer to `hello`, which named `protocol`.
pub(super) fn read_ready(line: &str, protocol: &str) -> Result<Ready, String> {
    let object = object(line)?;
    let kind = kind_of(&object)?;
    if kind != "ready" {
        return Err(format!("expected {{\"type\": \"ready\"}} after hello, found the type {:?}", excerpt(&kind)));
    }
    let ready: Ready = serde_json::from_value(Value::Object(object)).map_err(|e| excerpt(&format!("ready: {e}")))?;
    // they are printed and written into pages and files
    let [name, version] = [&ready.name, &ready.version].map(|word| word.as_deref().map(excerpt));
    let ready = Ready { name, version, ..ready };
    match &ready.protocol {
        Some(other) if other != protocol => {
            Err(format!("uses the protocol {:?}, expected {protocol:?}", excerpt(other)))
        }
        None if protocol == TIMED_PROTOCOL => Err(format!(
            "expected \"protocol\": {protocol:?} in ready: the set's cameras move or have their own timing, and a program \
            must confirm that it reads the camera poses of every frame"
        )),
        _ => Ok(ready),
    }
}

/// Reads the answer to frame `expected_frame`; `None` for an answer to an earlier frame, whose content is ignored.
pub(super) fn read_answer(line: &str, expected_frame: usize, body: &Humanoid) -> Result<Option<Reply>, String> {
    let object = object(line)?;
    if object.get("frame").and_then(Value::as_u64).is_some_and(|frame| frame < expected_frame as u64) {
        return Ok(None);
    }
    let kind = kind_of(&object)?;
    let frame = object.get("frame").and_then(Value::as_u64);
    let frame = frame.ok_or("expected \"frame\": the number of the answered frame")?;
    let frame = usize::try_from(frame).map_err(|_| "frame: too large a number")?;
    let confidence = match object.get("confidence") {
        None | Some(Value::Null) => None,
        Some(value) => match value.as_f64() {
            Some(share) if (0.0..=1.0).contains(&share) => Some(share),
            _ => return Err("confidence: expected a number from 0 to 1".to_owned()),
        },
    };
    let pose = match kind.as_str() {
        "lost" => None,
        "pose" => Some(pose(&object, body)?),
        other => return Err(format!("expected the type \"pose\" or \"lost\", found {:?}", excerpt(other))),
    };
    Ok(Some(Reply { frame, pose, confidence }))
}

fn object(line: &str) -> Result<Map<String, Value>, String> {
    let value: Value = serde_json::from_str(line).map_err(|_| {
        let has_nan = line.starts_with('{') && ["NaN", "Infinity"].iter().any(|word| line.contains(word));
        let hint = if has_nan {
            "NaN and Infinity are not valid JSON; use null for points that are not estimated"
        } else {
            "print messages to standard error"
        };
        format!("expected one JSON object per line, found {:?}; {hint}", excerpt(line))
    })?;
    match value {
        Value::Object(object) => Ok(object),
        _ => Err(format!("expected a JSON object, found {:?}", excerpt(line))),
    }
}

fn kind_of(object: &Map<String, Value>) -> Result<String, String> {
    let kind = object.get("type").and_then(Value::as_str);
    kind.map(str::to_owned).ok_or_else(|| "expected \"type\": \"pose\" or \"lost\"".to_owned())
}

fn pose(object: &Map<String, Value>, body: &Humanoid) -> Result<RepliedPose, String> {
    let joints = || body.joints.iter().map(|joint| joint.name.as_str()).collect::<Vec<_>>();
    match (object.get("markers"), object.get("joints"), object.get("root"), object.get("angles")) {
        (Some(markers), None, None, None) => {
            let known = LANDMARKS.map(|landmark| landmark.name());
            Ok(RepliedPose::Markers(points("markers", markers, &known)?))
        }
        (None, Some(found), None, None) => Ok(RepliedPose::Joints(points("joints", found, &joints())?)),
        (None, None, Some(root), Some(angles)) => {
            Ok(RepliedPose::Angles { root: root_of(root)?, angles: angles_of(angles, body)? })
        }
        _ => Err("expected exactly one of \"markers\", \"joints\", and \"root\" with \"angles\"".to_owned()),
    }
}

/// Points by name; null or omitted points are not estimated.
fn points(what: &str, value: &Value, known: &[&str]) -> Result<Named, String> {
    let Value::Object(entries) = value else {
        return Err(format!("{what}: expected an object of names with [x, y, z] in metres"));
    };
    let mut found = Named::new();
    for (name, value) in entries {
        if !known.contains(&name.as_str()) {
            return Err(format!("{what}: {:?} is unknown; hello lists the names", excerpt(name)));
        }
        if !value.is_null() {
            let numbers = numbers::<3>(value).ok_or_else(|| format!("{what}: {name}: expected [x, y, z] in metres"))?;
            found.insert(name.clone(), numbers);
        }
    }
    if found.is_empty() {
        Err(format!("{what}: expected at least one point, found none; answer \"lost\" instead"))
    } else {
        Ok(found)
    }
}

fn root_of(value: &Value) -> Result<[f64; 7], String> {
    let root = numbers::<7>(value).ok_or("root: expected [x, y, z, qw, qx, qy, qz]")?;
    let length = root[3..].iter().map(|q| q * q).sum::<f64>().sqrt();
    if (length - 1.0).abs() <= QUATERNION_TOLERANCE {
        return Ok(root);
    }
    Err(format!("root: expected a quaternion of length 1, found length {length:.3}"))
}

/// Angles in the order of hello, or by name.
fn angles_of(value: &Value, body: &Humanoid) -> Result<Vec<f64>, String> {
    let degrees = &body.degrees_of_freedom;
    let number = |value: &Value| value.as_f64().filter(|angle| angle.is_finite() && angle.abs() < FARTHEST_M);
    let found: Option<Vec<f64>> = match value {
        Value::Array(list) if list.len() == degrees.len() => list.iter().map(number).collect(),
        Value::Object(entries) if entries.len() == degrees.len() => {
            degrees.iter().map(|degree| number(entries.get(&degree.name)?)).collect()
        }
        _ => None,
    };
    found.ok_or_else(|| {
        format!("angles: expected {} numbers in radians, in the order of hello or by name", degrees.len())
    })
}

fn numbers<const N: usize>(value: &Value) -> Option<[f64; N]> {
    let list = value.as_array().filter(|list| list.len() == N)?;
    let mut found = [0.0; N];
    for (number, value) in found.iter_mut().zip(list) {
        *number = value.as_f64().filter(|n| n.is_finite() && n.abs() <= FARTHEST_M)?;
    }
    Some(found)
}

#[cfg(test)]
mod tests;
