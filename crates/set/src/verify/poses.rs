//! Checks link frames, joints, markers, and the visibility of the markers against the poses.

use nalgebra::Point3;

use super::arrays::wrong_names;
use super::explanation::{FramePoints, explain};
use super::parts::ReadParts;
use super::{CheckOutcome, Fault, start};
use crate::body::{LANDMARKS, LinkFrames, Markers};
use crate::camera::{CameraRig, TimedRig};
use crate::files::SetFiles;
use crate::npz::{Npz, Values};
use crate::parallel;
use crate::scene::{GroundTruth, TruthFrame};
use crate::truth_file::PATH;
use crate::views_file;

/// Tolerance of coordinates, metres.
const TOLERANCE_M: f64 = 1e-9;

/// Greatest speed of a body part, m/s: twice that of the hand of a javelin thrower.
const FASTEST_M_PER_S: f64 = 60.0;

/// Distance from the image border within which rounding may decide whether a marker is in view, pixels.
const BORDER_PX: f64 = 1e-6;

pub(super) fn check(parts: &ReadParts) -> CheckOutcome {
    let truth = parts.truth.as_ref().ok_or("not checked: the truth cannot be read")?;
    let actor = &truth.actor;
    let known: Vec<(LinkFrames, Markers)> = parallel::map(truth.frames.len(), |frame| {
        let frames = actor.link_frames(&truth.frames[frame].pose);
        let markers = actor.markers(&frames);
        (frames, markers)
    });
    let origins = |frames: &LinkFrames| -> FramePoints {
        frames.0.iter().map(|frame| Some(Point3::from(frame.translation.vector))).collect()
    };
    let links: Vec<String> = actor.links.iter().map(|link| link.name.clone()).collect();
    let joints: Vec<String> = actor.joints.iter().map(|joint| joint.name.clone()).collect();
    let landmarks = LANDMARKS.map(|landmark| landmark.name().to_owned()).to_vec();
    let of =
        |array, names: &[String], expected: &dyn Fn(usize) -> FramePoints, found: &dyn Fn(usize) -> FramePoints| {
            Points {
                array,
                names,
                expected: (0..known.len()).map(expected).collect(),
                found: (0..known.len()).map(found).collect(),
            }
            .fault()
        };
    let mut faults = Vec::new();
    faults.extend(of("link_frames", &links, &|f| origins(&known[f].0), &|f| origins(&truth.frames[f].link_frames)));
    faults.extend(turned_links(truth, &known, &links));
    faults.extend(of("joints", &joints, &|f| origins(&known[f].0)[1..].to_vec(), &|f| {
        truth.frames[f].joint_positions.iter().copied().map(Some).collect()
    }));
    faults.extend(of("markers", &landmarks, &|f| known[f].1.to_vec(), &|f| truth.frames[f].markers.to_vec()));
    faults.extend(jump(truth, &known));
    let angles = actor.degrees_of_freedom.len();
    let looked_at = format!("{} frames of {} links, {angles} angles", truth.frames.len(), links.len());
    let mut faults: Vec<Fault> = faults.into_iter().map(|detail| Fault::new(PATH, detail)).collect();
    faults.extend(start::refitted_faults(parts));
    Ok((looked_at, faults))
}

/// The expected and found points of an array.
struct Points<'a> {
    array: &'a str,
    names: &'a [String],
    expected: Vec<FramePoints>,
    found: Vec<FramePoints>,
}

impl Points<'_> {
    fn fault(&self) -> Option<String> {
        let mut worst: Option<(f64, usize, usize)> = None;
        let mut frames = 0;
        for (frame, (expected, found)) in self.expected.iter().zip(&self.found).enumerate() {
            let off = expected.iter().zip(found).map(|(expected, found)| match (expected, found) {
                (Some(a), Some(b)) => Some((a - b).norm()).filter(|off| !off.is_nan()).unwrap_or(f64::INFINITY),
                (None, None) => 0.0,
                _ => f64::INFINITY,
            });
            let (index, off) = off.enumerate().max_by(|a, b| a.1.total_cmp(&b.1))?;
            frames += usize::from(off > TOLERANCE_M);
            if off > TOLERANCE_M && worst.is_none_or(|(worst, ..)| off > worst) {
                worst = Some((off, frame, index));
            }
        }
        let (off, frame, index) = worst?;
        let why = explain(&self.expected, &self.found, self.names).map(|why| format!(": {why}")).unwrap_or_default();
        let name = self.names.get(index).map_or("", String::as_str);
        Some(format!(
            "{} do not follow from root and angles in {frames} of {} frames, worst {name} in frame {frame}, {off:.3e} \
            m off{why}",
            self.array,
            self.expected.len()
        ))
    }
}

/// Links at the right position with a wrong rotation.
fn turned_links(truth: &GroundTruth, known: &[(LinkFrames, Markers)], names: &[String]) -> Option<String> {
    truth.frames.iter().zip(known).enumerate().find_map(|(number, (frame, (links, _)))| {
        let off = frame.link_frames.0.iter().zip(&links.0).map(|(a, b)| a.rotation.angle_to(&b.rotation));
        let (index, off) = off.enumerate().max_by(|a, b| a.1.total_cmp(&b.1))?;
        (off > 1e-6).then(|| {
            let degrees = off.to_degrees();
            format!("link_frames: the rotation of {} is {degrees:.3} degrees off in frame {number}", names[index])
        })
    })
}

/// A link that moves faster than a body can.
fn jump(truth: &GroundTruth, known: &[(LinkFrames, Markers)]) -> Option<String> {
    known.windows(2).enumerate().find_map(|(frame, pair)| {
        let steps = pair[0].0.0.iter().zip(&pair[1].0.0).zip(&truth.actor.links);
        let fastest = steps.map(|((a, b), link)| ((a.translation.vector - b.translation.vector).norm(), &link.name));
        let (step, link) = fastest.max_by(|a, b| a.0.total_cmp(&b.0))?;
        let speed = step * truth.frames_per_second;
        (speed > FASTEST_M_PER_S).then(|| {
            format!(
                "root, angles: from frame {frame} to {} link {link:?} moves {step:.2} m, {speed:.0} m/s; a frame is \
                missing or out of order, or lengths are not in metres",
                frame + 1
            )
        })
    })
}

/// Compares `in_view`, `visible` and the sights of `views.npz` with those of body, props and cameras.
pub(super) fn check_visibility(files: &SetFiles, parts: &ReadParts) -> CheckOutcome {
    let (truth, rig) = parts.scene()?;
    let (props, others) = (truth.props.clone(), truth.distractors.clone());
    let filming = parts.filming()?;
    let known = GroundTruth::among(truth.actor.clone(), &truth.motion(), &filming, props, others);
    let known = match known {
        Ok(known) => known,
        Err(error) => return Ok((String::new(), vec![Fault::new(PATH, error.to_string())])),
    };
    let mut faults = Vec::new();
    for (index, camera) in rig.cameras.iter().enumerate() {
        for (array, pick) in [("in_view", views as Pick), ("visible", sights)] {
            let wrong = wrong_flags(truth, &known, &filming, index, pick);
            faults.extend(wrong.first().map(|(frame, marker)| {
                let flag = pick(&truth.frames[*frame])[index][*marker];
                let name = LANDMARKS[*marker].name();
                let (count, camera) = (wrong.len(), &camera.name);
                Fault::new(PATH, format!(
                    "{array}: {count} of {} flags of camera {camera:?} are wrong, first {name} in frame {frame}: {flag}",
                    truth.frames.len() * LANDMARKS.len()
                ))
            }));
        }
    }
    faults.extend(visible_but_not_in_view(truth, rig));
    faults.extend(wrong_sights(files, &known, &filming));
    let flags = 2 * truth.frames.len() * rig.cameras.len() * LANDMARKS.len();
    Ok((format!("{flags} flags"), faults))
}

/// Wrong sights of joints and markers, except those on the border of the image.
fn wrong_sights(files: &SetFiles, known: &GroundTruth, filming: &TimedRig) -> Vec<Fault> {
    if !files.has(views_file::PATH) {
        return Vec::new();
    }
    let read = files.read(views_file::PATH).ok().and_then(|bytes| Npz::from_bytes(views_file::PATH, &bytes).ok());
    // the check of projections reports unreadable files
    let Some(found) = read else { return Vec::new() };
    let expected = views_file::to_npz(known, filming);
    let names = wrong_names(&found, &expected);
    let check = SightCheck { found: &found, expected: &expected, known, filming };
    let joints: Vec<String> = known.actor.joints.iter().map(|joint| joint.name.clone()).collect();
    let markers = LANDMARKS.map(|landmark| landmark.name().to_owned());
    let of_joints = check.fault("joint_sight", &|frame, joint| frame.joint_positions.get(joint).copied(), &joints);
    let of_markers = check.fault("marker_sight", &|frame, marker| frame.markers[marker], &markers);
    names.into_iter().chain(of_joints).chain(of_markers).map(|detail| Fault::new(views_file::PATH, detail)).collect()
}

/// The sights in a file and those computed from the truth.
struct SightCheck<'a> {
    found: &'a Npz,
    expected: &'a Npz,
    known: &'a GroundTruth,
    filming: &'a TimedRig,
}

impl SightCheck<'_> {
    /// Describes the wrong sights of an array; `points` returns the position of a point in a frame.
    fn fault(
        &self,
        array: &str,
        points: &dyn Fn(&TruthFrame, usize) -> Option<Point3<f64>>,
        names: &[String],
    ) -> Option<String> {
        let (found, expected) = (sights_of(self.found, array)?, sights_of(self.expected, array)?);
        if found.len() != expected.len() {
            return Some(format!("{array}: has {} visibility codes, expected {}", found.len(), expected.len()));
        }
        let cameras = &self.filming.rig().cameras;
        let place = |index: usize| {
            let (point, view) = (index % names.len(), index / names.len());
            (view / cameras.len(), view % cameras.len(), point)
        };
        let is_wrong = |index: &usize| {
            let (frame, camera, point) = place(*index);
            let frame = &self.known.frames[frame];
            let on_border =
                || points(frame, point).is_some_and(|point| is_on_border(self.filming, camera, frame, &point));
            found[*index] != expected[*index] && !on_border()
        };
        let wrong: Vec<usize> = (0..found.len()).filter(is_wrong).collect();
        let first = *wrong.first()?;
        let (frame, camera, point) = place(first);
        Some(format!(
            "{array}: {} of {} visibility codes are wrong, first {} of camera {:?} in frame {frame}: {}, expected {}",
            wrong.len(),
            found.len(),
            names[point],
            cameras[camera].name,
            sight_name(found[first]),
            sight_name(expected[first])
        ))
    }
}

fn sight_name(sight: i64) -> &'static str {
    usize::try_from(sight).ok().and_then(|sight| views_file::NAMES.get(sight)).unwrap_or(&"unknown")
}

/// The sights of an array; `None` if it is missing or has another type.
fn sights_of(npz: &Npz, array: &str) -> Option<Vec<i64>> {
    match npz.get(array).map(|array| &array.values) {
        Some(Values::I64(sights)) => Some(sights.clone()),
        _ => None,
    }
}

type Pick = fn(&TruthFrame) -> &Vec<[bool; LANDMARKS.len()]>;

fn views(frame: &TruthFrame) -> &Vec<[bool; LANDMARKS.len()]> {
    &frame.in_view
}

fn sights(frame: &TruthFrame) -> &Vec<[bool; LANDMARKS.len()]> {
    &frame.visible
}

/// Frames and markers with a wrong flag, except markers on the border of the image.
fn wrong_flags(
    truth: &GroundTruth,
    known: &GroundTruth,
    filming: &TimedRig,
    index: usize,
    pick: Pick,
) -> Vec<(usize, usize)> {
    let mut wrong = Vec::new();
    for (number, (frame, known)) in truth.frames.iter().zip(&known.frames).enumerate() {
        for (marker, (found, expected)) in pick(frame)[index].iter().zip(&pick(known)[index]).enumerate() {
            let on_border = || known.markers[marker].is_some_and(|point| is_on_border(filming, index, known, &point));
            if found != expected && !on_border() {
                wrong.push((number, marker));
            }
        }
    }
    wrong
}

/// Whether a point is on the border of the image of a camera in a frame.
fn is_on_border(filming: &TimedRig, camera: usize, frame: &TruthFrame, point: &Point3<f64>) -> bool {
    let camera = filming.camera_at(camera, filming.row_s(camera, frame.time_s, 0));
    let Some(pixel) = camera.project(point) else { return false };
    let (width, height) = (f64::from(camera.pinhole.width), f64::from(camera.pinhole.height));
    [pixel.x, pixel.y, width - pixel.x, height - pixel.y].iter().any(|distance| distance.abs() < BORDER_PX)
}

fn visible_but_not_in_view(truth: &GroundTruth, rig: &CameraRig) -> Option<Fault> {
    let both = |frame: &TruthFrame| {
        (0..rig.cameras.len())
            .any(|c| frame.visible[c].iter().zip(&frame.in_view[c]).any(|(seen, inside)| *seen && !*inside))
    };
    let frame = truth.frames.iter().position(both)?;
    Some(Fault::new(PATH, format!("visible: a marker is visible but not in view in frame {frame}")))
}
