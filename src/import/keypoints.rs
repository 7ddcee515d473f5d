//! The keypoints of a recording, from OpenPose's or COCO's JSON or an array.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use serde_json::Value;

use super::agreement::{Views, offsets};
use super::masks::places_of;
use super::start::LEAST_CONFIDENCE;
use crate::common::{ExperimentError, key_error, median, read_file, sort_by_numbers};
use crate::scenario::RecordedKeypoints;
use skiagraph_core::body::KeypointLayout;
use skiagraph_core::camera::{Camera, CameraRig};
use skiagraph_core::input::limits;
use skiagraph_core::npz::Npz;
use skiagraph_core::observation::FoundKeypoint;
use skiagraph_core::parallel;
use skiagraph_core::raster::Mask;

/// Greatest distance of a keypoint from the image's corner, pixels.
const FARTHEST_PX: f64 = 1e6;
/// Greatest distance between one person in different cameras, as a share of the image's height: more is another person.
const FARTHEST_PERSON: f64 = 0.05;

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

type Person = Vec<Option<FoundKeypoint>>;
type People = Vec<Vec<Person>>;

#[derive(Deserialize)]
struct OpenPoseImage {
    people: Vec<OpenPosePerson>,
}

#[derive(Deserialize)]
struct OpenPosePerson {
    pose_keypoints_2d: Vec<f64>,
}

/// COCO's annotations, or the list of a program's results.
#[derive(Deserialize)]
#[serde(untagged)]
enum CocoFile {
    Results(Vec<CocoPerson>),
    Annotations { images: Vec<CocoImage>, annotations: Vec<CocoPerson> },
}

#[derive(Deserialize)]
struct CocoImage {
    id: Value,
    file_name: String,
}

#[derive(Deserialize)]
struct CocoPerson {
    image_id: Value,
    #[serde(default)]
    keypoints: Vec<f64>,
}

/// Finds the keypoints of a recording with these images of masks by camera, in the images' pixels; with a note if
/// folders have other names than cameras.
pub(super) fn find(
    path: &Path,
    rig: &CameraRig,
    images: &[Vec<PathBuf>],
) -> Result<(Vec<People>, Option<String>), ExperimentError> {
    if path.extension().is_some_and(|ending| ending == "json") && path.is_file() {
        let file = read_coco(path)?;
        let of_camera = |(camera, images): (&Camera, &Vec<PathBuf>)| {
            of_coco(path, &file, images, |name| names_camera(name, &camera.name))
        };
        return Ok((rig.cameras.iter().zip(images).map(of_camera).collect::<Result<_, _>>()?, None));
    }
    let count = |found: usize, images: usize, what: &str| {
        let message = format!("expected one {what} for each of the {images} images of a camera, found {found}");
        if found == images { Ok(()) } else { Err(key_error("keypoints.path", message)) }
    };
    if path.is_file() {
        let most = images.iter().map(Vec::len).max().unwrap_or_default();
        return Ok((array_of(path, rig, |found| count(found, most, "frame"))?, None));
    }
    let (places, note) = places_of("keypoints.path", path, rig, &["", "_json"], &["json"])?;
    let of_camera = |index: usize| {
        let (place, images) = (&places[index], &images[index]);
        if place.is_file() {
            return of_coco(place, &read_coco(place)?, images, |_| true);
        }
        let unreadable = |source| ExperimentError::Unreadable { path: place.clone(), source };
        let entries = fs::read_dir(place).map_err(unreadable)?.flatten().map(|entry| entry.path());
        let mut files: Vec<PathBuf> =
            entries.filter(|path| path.extension().is_some_and(|ending| ending == "json")).collect();
        sort_by_numbers(&mut files);
        count(files.len(), images.len(), &format!("JSON file in {}", place.display()))?;
        files.iter().map(|file| of_openpose(file)).collect()
    };
    Ok((parallel::map(places.len(), of_camera).into_iter().collect::<Result<_, _>>()?, note))
}

fn of_openpose(path: &Path) -> Result<Vec<Person>, ExperimentError> {
    let malformed = |detail: String| ExperimentError::Malformed { path: path.to_owned(), detail };
    let image: OpenPoseImage = serde_json::from_slice(&read_file(path, limits::JSON)?)
        .map_err(|e| malformed(format!("expected OpenPose's JSON with people[].pose_keypoints_2d: {e}")))?;
    image.people.iter().map(|person| points_of(&person.pose_keypoints_2d).map_err(malformed)).collect()
}

fn points_of(numbers: &[f64]) -> Result<Person, String> {
    let (points, rest) = numbers.as_chunks::<3>();
    if !rest.is_empty() {
        return Err(format!("expected x, y and confidence of every keypoint, found {} numbers", numbers.len()));
    }
    points.iter().map(|[x, y, confidence]| found([*x, *y], *confidence)).collect()
}

fn read_coco(path: &Path) -> Result<CocoFile, ExperimentError> {
    serde_json::from_slice(&read_file(path, limits::JSON)?).map_err(|_| {
        let detail =
            "expected COCO's keypoints: a list of results, or images and annotations, with image_id and keypoints";
        ExperimentError::Malformed { path: path.to_owned(), detail: detail.to_owned() }
    })
}

/// Whether the path of an image names a camera: as a folder, or at the beginning of the file's name.
fn names_camera(image: &str, camera: &str) -> bool {
    let mut parts = image.split(['/', '\\']);
    let begins = |rest: &str| !rest.starts_with(char::is_alphanumeric);
    parts.any(|part| part.strip_prefix(camera).is_some_and(begins))
}

/// The number at the end of a name without its extension, and the name.
fn order_of(name: &str) -> (Option<u64>, String) {
    let stem = Path::new(name).file_stem().unwrap_or_default().to_string_lossy().into_owned();
    (stem[stem.trim_end_matches(|c: char| c.is_ascii_digit()).len()..].parse().ok(), stem)
}

/// The people of one camera in a COCO file, in whose images `is_own` says which are the camera's. They belong to the
/// masks of the same name or number, or of the same place in the order.
fn of_coco(
    path: &Path,
    file: &CocoFile,
    images: &[PathBuf],
    is_own: impl Fn(&str) -> bool,
) -> Result<People, ExperimentError> {
    let malformed = |detail: String| ExperimentError::Malformed { path: path.to_owned(), detail };
    let text = |id: &Value| id.as_str().map_or_else(|| id.to_string(), str::to_owned);
    let (people, names): (_, Vec<(String, String)>) = match file {
        CocoFile::Results(people) => {
            (people, people.iter().map(|own| (text(&own.image_id), text(&own.image_id))).collect())
        }
        CocoFile::Annotations { images, annotations } => {
            (annotations, images.iter().map(|image| (text(&image.id), image.file_name.clone())).collect())
        }
    };
    let own: BTreeMap<(Option<u64>, String), String> =
        names.into_iter().filter(|(_, name)| is_own(name)).map(|(id, name)| (order_of(&name), id)).collect();
    let masks: Vec<_> = images.iter().map(|image| order_of(&image.to_string_lossy())).collect();
    let named = |(number, stem): &(Option<u64>, String)| {
        let is_same = |mask: &(Option<u64>, String)| mask.1 == *stem || (number.is_some() && mask.0 == *number);
        masks.iter().position(is_same)
    };
    let frames: Option<Vec<usize>> = own.keys().map(named).collect();
    let distinct = |frames: &Vec<usize>| frames.iter().collect::<BTreeSet<_>>().len() == frames.len();
    let in_order = || (own.len() == images.len()).then(|| (0..images.len()).collect());
    let Some(frames) = frames.filter(distinct).or_else(in_order).filter(|frames| !frames.is_empty()) else {
        return Err(malformed(format!(
            "expected images of the names or numbers of the masks ({}), or as many, {}; found {} of this camera",
            images[0].file_name().unwrap_or_default().display(),
            images.len(),
            own.len()
        )));
    };
    let frame_of: BTreeMap<&String, usize> = own.values().zip(frames).collect();
    let mut found = vec![Vec::new(); images.len()];
    for person in people {
        if let Some(frame) = frame_of.get(&text(&person.image_id)) {
            found[*frame].push(points_of(&person.keypoints).map_err(malformed)?);
        }
    }
    Ok(found)
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

fn array_of(
    path: &Path,
    rig: &CameraRig,
    check_frames: impl Fn(usize) -> Result<(), ExperimentError>,
) -> Result<Vec<People>, ExperimentError> {
    let malformed = |detail: String| ExperimentError::Malformed { path: path.to_owned(), detail };
    let file = path.display().to_string();
    let npz = Npz::from_bytes(&file, &read_file(path, limits::ARRAYS)?)?;
    let shape = npz.get("keypoints").map(|array| array.shape.clone()).unwrap_or_default();
    let [frames, cameras, points, 2] = shape[..] else {
        return Err(malformed(format!("keypoints: expected the shape (frames, cameras, points, 2), found {shape:?}")));
    };
    check_frames(frames)?;
    let of_views = [frames, cameras, points].map(Some);
    let read = |name: &str, shape: &[Option<usize>]| npz.numbers(&file, name, shape);
    let pixels = read("keypoints", &[&of_views[..], &[Some(2)]].concat())?;
    let confidence = match npz.get("confidence") {
        Some(_) => read("confidence", &of_views)?,
        None => vec![1.0; frames * cameras * points],
    };
    let names = npz.names(&file, "cameras")?;
    let names: Vec<&str> = names.unwrap_or_default().iter().map(String::as_str).collect();
    if !names.is_empty() && names.len() != cameras {
        return Err(malformed(format!("cameras: expected the names of {cameras} cameras, found {}", names.len())));
    }
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
    let of_camera = |camera: &usize| (0..frames).map(|frame| Ok(vec![view(frame, *camera)?])).collect();
    columns.iter().map(of_camera).collect()
}

/// The keypoints of the frames of a set, with their layout: of several people the one in whom the cameras agree, and
/// who is in the masks. `people` are those of the frames of the set, and their pixels are `reduce` times as large as
/// those of the rig's images.
pub(super) fn read(
    mut people: Vec<People>,
    settings: &RecordedKeypoints,
    rig: &CameraRig,
    (frames, masks_of): (usize, &(impl Fn(usize) -> Result<Vec<Mask>, ExperimentError> + Sync)),
    reduce: u32,
) -> Result<(KeypointLayout, Views), ExperimentError> {
    for point in people.iter_mut().flatten().flatten().flatten().flatten() {
        point.pixel = point.pixel.map(|x| x / f64::from(reduce));
    }
    let mut views: Vec<Vec<Person>> = Vec::new();
    for frame in 0..frames {
        let seen: Vec<&[Person]> = people.iter().map(|people| people[frame].as_slice()).collect();
        // masks say which of several people is meant
        let masks = if seen.iter().any(|people| people.len() > 1) { masks_of(frame)? } else { Vec::new() };
        views.push(one_person(rig, &seen, &masks, views.last().map(Vec::as_slice)));
    }
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

const OF_MEDIAPIPE_POINTS: usize = 33;

/// Of the people in the images of a frame the one in whom cameras agree: of the people of two neighbouring cameras and
/// those of the others nearest to them, those that agree well and are in the masks, and then who is nearest to the
/// person `before`.
fn one_person(rig: &CameraRig, seen: &[&[Person]], masks: &[Mask], before: Option<&[Person]>) -> Vec<Person> {
    let first = |people: &&[Person]| people.first().cloned().unwrap_or_default();
    let some: Vec<usize> = (0..seen.len()).filter(|camera| !seen[*camera].is_empty()).collect();
    if seen.iter().all(|people| people.len() < 2) || some.len() < 2 {
        return seen.iter().map(first).collect();
    }
    let mut found: Vec<(f64, usize, f64, Vec<Person>)> = Vec::new();
    for (index, one) in some.iter().enumerate() {
        let other = some[(index + 1) % some.len()];
        for (own, neighbour) in seen[*one].iter().flat_map(|own| seen[other].iter().map(move |other| (own, other))) {
            let mut group = vec![Person::new(); seen.len()];
            (group[*one], group[other]) = (own.clone(), neighbour.clone());
            for camera in some.iter().filter(|camera| **camera != *one && **camera != other) {
                // each is tried beside the two: who is far from them in all is of another person
                let with = |person: &Person| {
                    let mut tried = group.clone();
                    tried[*camera] = person.clone();
                    (disagreement(rig, &tried), person.clone())
                };
                let best = seen[*camera].iter().map(with).min_by(|a, b| a.0.total_cmp(&b.0));
                let limit = FARTHEST_PERSON * f64::from(rig.cameras[*camera].pinhole.height);
                group[*camera] = best.filter(|(off, _)| *off < limit).map(|(_, person)| person).unwrap_or_default();
            }
            let points =
                |camera: usize| group[camera].iter().flatten().map(|point| point.pixel.map(|x| x.max(0.0) as u32));
            let inside = |camera: &usize| points(*camera).filter(|[x, y]| masks[*camera].get(*x, *y)).count();
            let moved = before.map_or(0.0, |before| distance(before, &group));
            found.push((disagreement(rig, &group), some.iter().map(inside).sum(), moved, group));
        }
    }
    let cameras = |group: &[Person]| group.iter().filter(|person| !person.is_empty()).count();
    let many = found.iter().map(|group| cameras(&group.3)).max().unwrap_or_default();
    found.retain(|group| cameras(&group.3) + 1 >= many);
    let least = found.iter().map(|group| group.0).fold(f64::INFINITY, f64::min);
    found.retain(|group| group.0 <= 2.0 * least + 1.0);
    let most = found.iter().map(|group| group.1).max().unwrap_or_default();
    found.retain(|group| 5 * group.1 >= 4 * most);
    let best = found.into_iter().min_by(|a, b| a.2.total_cmp(&b.2).then(a.0.total_cmp(&b.0)));
    best.map_or_else(|| seen.iter().map(first).collect(), |group| group.3)
}

/// Median distance of a group's points from where they are by all cameras, pixels; infinite without any.
fn disagreement(rig: &CameraRig, group: &[Person]) -> f64 {
    let points = group.iter().map(Vec::len).max().unwrap_or_default();
    let mut off = Vec::new();
    for point in 0..points {
        let pixel =
            |person: &Person| person.get(point).copied().flatten().filter(|found| found.confidence >= LEAST_CONFIDENCE);
        let seen: Vec<_> = group.iter().map(|person| Some(pixel(person)?.pixel)).collect();
        off.extend(offsets(rig, &seen).into_iter().flatten().flatten().map(|[x, y]| x.hypot(y)));
    }
    median(off).unwrap_or(f64::INFINITY)
}

/// Mean distance between the same points of two groups, pixels; infinite without any.
fn distance(one: &[Person], other: &[Person]) -> f64 {
    let pairs = one.iter().zip(other).flat_map(|(one, other)| one.iter().zip(other)).filter_map(|(a, b)| (*a).zip(*b));
    let all: Vec<f64> = pairs.map(|(a, b)| (a.pixel[0] - b.pixel[0]).hypot(a.pixel[1] - b.pixel[1])).collect();
    if all.is_empty() { f64::INFINITY } else { all.iter().sum::<f64>() / all.len() as f64 }
}
