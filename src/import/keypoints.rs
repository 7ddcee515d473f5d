//! The keypoints of a recording, from OpenPose's JSON or an array.

use std::fs;
use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::masks::folders_of;
use crate::common::{ExperimentError, key_error, read_file};
use crate::scenario::RecordedKeypoints;
use skiagraph_core::body::KeypointLayout;
use skiagraph_core::camera::CameraRig;
use skiagraph_core::input::limits;
use skiagraph_core::npz::Npz;
use skiagraph_core::observation::FoundKeypoint;
use skiagraph_core::parallel;
use skiagraph_core::raster::Mask;

/// Greatest distance of a keypoint from the image's corner, pixels.
const FARTHEST_PX: f64 = 1e6;

/// The points of HALPE-26 among the 33 of MediaPipe; head, neck, hips' middle and small toes are not among them.
const OF_MEDIAPIPE: [Option<usize>; 26] = [
    Some(0),
    Some(2),
    Some(5),
    Some(7),
    Some(8),
    Some(11),
    Some(12),
    Some(13),
    Some(14),
    Some(15),
    Some(16),
    Some(23),
    Some(24),
    Some(25),
    Some(26),
    Some(27),
    Some(28),
    None,
    None,
    None,
    Some(31),
    Some(32),
    None,
    None,
    Some(29),
    Some(30),
];

/// The points of one person in an image.
type Person = Vec<Option<FoundKeypoint>>;

/// Where the keypoints of a recording are.
pub(super) enum KeypointSource {
    /// Files of every camera, one a frame.
    Files(Vec<Vec<PathBuf>>),
    /// `[frame][camera]`.
    Array(Vec<Vec<Person>>),
}

#[derive(Deserialize)]
struct OpenPoseImage {
    people: Vec<OpenPosePerson>,
}

#[derive(Deserialize)]
struct OpenPosePerson {
    pose_keypoints_2d: Vec<f64>,
}

impl KeypointSource {
    /// Finds the keypoints of a recording of `images` images for each camera.
    pub(super) fn find(path: &Path, rig: &CameraRig, images: usize) -> Result<(Self, Option<String>), ExperimentError> {
        let count = |found: usize, what: &str| {
            let message = format!("expected one {what} for each of the {images} images of a camera, found {found}");
            if found == images { Ok(()) } else { Err(key_error("keypoints.path", message)) }
        };
        if path.is_file() {
            let array = array_of(path, rig)?;
            count(array.len(), "frame")?;
            return Ok((Self::Array(array), None));
        }
        let (folders, note) = folders_of("keypoints.path", path, rig, &["", "_json"])?;
        let mut files = Vec::new();
        for folder in folders {
            let unreadable = |source| ExperimentError::Unreadable { path: folder.clone(), source };
            let entries = fs::read_dir(&folder).map_err(unreadable)?.flatten().map(|entry| entry.path());
            let mut own: Vec<PathBuf> =
                entries.filter(|path| path.extension().is_some_and(|ending| ending == "json")).collect();
            own.sort();
            count(own.len(), &format!("JSON file in {}", folder.display()))?;
            files.push(own);
        }
        Ok((Self::Files(files), note))
    }

    /// The people in the image of a camera, in its own pixels.
    fn people(&self, frame: usize, camera: usize) -> Result<Vec<Person>, ExperimentError> {
        let files = match self {
            Self::Array(people) => return Ok(vec![people[frame][camera].clone()]),
            Self::Files(files) => files,
        };
        let path = &files[camera][frame];
        let malformed = |detail: String| ExperimentError::Malformed { path: path.clone(), detail };
        let image: OpenPoseImage = serde_json::from_slice(&read_file(path, limits::JSON)?)
            .map_err(|e| malformed(format!("expected OpenPose's JSON with people[].pose_keypoints_2d: {e}")))?;
        let person = |person: OpenPosePerson| {
            let (points, rest) = person.pose_keypoints_2d.as_chunks::<3>();
            if !rest.is_empty() {
                return Err(malformed("pose_keypoints_2d: expected x, y and confidence of every point".to_owned()));
            }
            points.iter().map(|[x, y, confidence]| found([*x, *y], *confidence).map_err(malformed)).collect()
        };
        image.people.into_iter().map(person).collect()
    }
}

/// A keypoint with pixel centres at integers; `None` for one that was not found.
fn found([x, y]: [f64; 2], confidence: f64) -> Result<Option<FoundKeypoint>, String> {
    if confidence.is_nan() || x.is_nan() || y.is_nan() || confidence <= 0.0 {
        return Ok(None);
    }
    if x.abs() > FARTHEST_PX || y.abs() > FARTHEST_PX {
        return Err(format!("a keypoint is at {x}, {y}; expected pixels"));
    }
    // stored in single precision, as in sets
    let [x, y, confidence] = [x as f32, y as f32, confidence.min(1.0) as f32].map(f64::from);
    Ok(Some(FoundKeypoint { pixel: [x + 0.5, y + 0.5], confidence }))
}

/// The keypoints of an archive, `[frame][camera]`.
fn array_of(path: &Path, rig: &CameraRig) -> Result<Vec<Vec<Person>>, ExperimentError> {
    let malformed = |detail: String| ExperimentError::Malformed { path: path.to_owned(), detail };
    let file = path.display().to_string();
    let npz = Npz::from_bytes(&file, &read_file(path, limits::ARRAYS)?)?;
    let shape = npz.get("keypoints").map(|array| array.shape.clone()).unwrap_or_default();
    let [frames, cameras, points, 2] = shape[..] else {
        return Err(malformed(format!("keypoints: expected the shape (frames, cameras, points, 2), found {shape:?}")));
    };
    let of_views = [frames, cameras, points].map(Some);
    let read = |name: &str, shape: &[Option<usize>]| npz.numbers(&file, name, shape);
    let pixels = read("keypoints", &[&of_views[..], &[Some(2)]].concat())?;
    let confidence = match npz.get("confidence") {
        Some(_) => read("confidence", &of_views)?,
        None => vec![1.0; frames * cameras * points],
    };
    let names = npz.names(&file, "cameras")?;
    let names: Vec<&str> = names.unwrap_or_default().iter().map(String::as_str).collect();
    let mut columns = Vec::new();
    for (index, camera) in rig.cameras.iter().enumerate() {
        let named = names.iter().position(|name| *name == camera.name);
        let column = if names.is_empty() && cameras == rig.cameras.len() { Some(index) } else { named };
        columns.push(column.ok_or_else(|| {
            malformed(format!("cameras: expected `{}` among them, found {} cameras", camera.name, cameras))
        })?);
    }
    let pixels = pixels.as_chunks::<2>().0;
    let view = |frame: usize, camera: usize| -> Result<Person, ExperimentError> {
        let first = (frame * cameras + camera) * points;
        let own = first..first + points;
        own.map(|index| found(pixels[index], confidence[index]).map_err(malformed)).collect()
    };
    (0..frames).map(|frame| columns.iter().map(|camera| view(frame, *camera)).collect()).collect()
}

/// The keypoints of the frames of a set, with their layout: of several people the one in the mask of the camera.
/// `first` is the first image used, and pixels are `reduce` times as large as those of the images.
pub(super) fn read(
    source: &KeypointSource,
    settings: &RecordedKeypoints,
    masks: &[Vec<Mask>],
    (first, reduce): (usize, u32),
) -> Result<(KeypointLayout, Vec<Vec<Person>>), ExperimentError> {
    let of_frame = |index: usize| -> Result<Vec<Person>, ExperimentError> {
        let views = masks[index].iter().enumerate();
        views
            .map(|(camera, mask)| {
                let people = source.people(first + index, camera)?.into_iter().map(|person| scaled(person, reduce));
                let inside = |person: &Person| {
                    let points = person.iter().flatten().map(|point| point.pixel.map(|x| x.max(0.0) as u32));
                    points.filter(|[x, y]| mask.get(*x, *y)).count()
                };
                Ok(people.max_by_key(inside).unwrap_or_default())
            })
            .collect()
    };
    let views: Vec<Vec<Person>> = parallel::map(masks.len(), of_frame).into_iter().collect::<Result<_, _>>()?;
    let count = views.iter().flatten().map(Vec::len).find(|count| *count > 0).unwrap_or_default();
    let by_count = KeypointLayout::ALL.into_iter().find(|layout| layout.keypoints().len() == count);
    let is_mediapipe = count == OF_MEDIAPIPE_POINTS && settings.layout.is_none();
    let layout = if is_mediapipe { Some(KeypointLayout::Halpe26) } else { settings.layout.or(by_count) };
    let refuse = |what: String| key_error("keypoints.layout", what);
    let Some(layout) = layout else {
        return Err(refuse(format!(
            "expected people with 17 (coco17), 26 (halpe26), 25 (body25) or 33 (MediaPipe) points, found {count}"
        )));
    };
    let expected = if is_mediapipe { OF_MEDIAPIPE_POINTS } else { layout.keypoints().len() };
    let in_layout = |person: Person| match person.len() {
        0 => Ok(vec![None; layout.keypoints().len()]),
        found if found != expected => {
            Err(refuse(format!("expected {expected} points for every person ({}), found {found}", layout.name())))
        }
        _ if is_mediapipe => Ok(OF_MEDIAPIPE.iter().map(|index| person[(*index)?]).collect()),
        _ => Ok(person),
    };
    let in_frame = |frame: Vec<Person>| frame.into_iter().map(in_layout).collect::<Result<Vec<_>, _>>();
    Ok((layout, views.into_iter().map(in_frame).collect::<Result<_, _>>()?))
}

/// Number of MediaPipe's points.
const OF_MEDIAPIPE_POINTS: usize = 33;

fn scaled(person: Person, reduce: u32) -> Person {
    let scale = |point: FoundKeypoint| FoundKeypoint { pixel: point.pixel.map(|x| x / f64::from(reduce)), ..point };
    person.into_iter().map(|point| point.map(scale)).collect()
}
