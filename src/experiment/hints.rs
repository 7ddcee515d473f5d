//! What is said of a run whose error would mostly go away if its numbers were read in another way.

use std::collections::BTreeMap;

use nalgebra::{Point3, Vector3};
use serde::{Deserialize, Serialize};

use super::missing_values;
use super::poses_file::{ReadAs, UNITS_OF_LENGTH, other_side};
use super::tracking::Tracked;
use crate::benchmark_set::{BenchmarkSet, BlindSet, EstimatedSequence};
use crate::body::{Humanoid, LANDMARKS, Landmark, Markers, Pose};
use crate::camera::Camera;
use crate::evaluation::{
    AxisOrder, Correction, GivenPositions, Misreading, MisreadingCase, MisreadingKind, find_misreading,
    marker_of_other_side, with_sides_exchanged,
};

/// A pelvis that is nearer than this to the origin in every frame is there by definition, metres.
const AT_ORIGIN_M: f64 = 0.001;
/// A true pelvis that is farther than this from the origin on average is not, metres.
const AWAY_M: f64 = 0.25;
/// Frames of a program's answers that are compared with the start pose.
const FIRST_FRAMES: usize = 6;

/// An explanation of most of a run's error, with the options that mend it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hint {
    /// What seems to have been misread; empty for positions relative to the body.
    pub kinds: Vec<MisreadingKind>,
    /// The explanation in words, with what to do.
    pub text: String,
    /// Options of `skiagraph evaluate` that read the file so; empty where none applies.
    pub options: Vec<String>,
    /// Lines of a joint map that names the columns so; empty where the names are right.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub joint_map: BTreeMap<String, String>,
    /// Mean distance of the markers as they were read, over the frames that were looked at, millimetres.
    pub error_as_read_mm: Option<f64>,
    /// The same when they are read so, millimetres; `None` where that is not known.
    pub error_corrected_mm: Option<f64>,
}

/// The explanation of most of a run's error, if there is one. Nothing was read of the program's own trackers, so theirs
/// has none.
pub(super) fn hint(set: &BenchmarkSet, tracked: &Tracked) -> Option<Hint> {
    if tracked.record.is_some() {
        return None;
    }
    if let Some(doubt) = doubt(tracked) {
        return Some(doubt);
    }
    let truth: Vec<Markers> = set.truth.ground_truth.frames.iter().map(|frame| frame.markers).collect();
    let sequences: Vec<GivenSequence> = tracked
        .estimates
        .sequences
        .iter()
        .enumerate()
        .map(|(index, sequence)| GivenSequence::new(sequence, tracked.estimates.body(index, &set.blind.start.body)))
        .collect();
    let case = HintCase { truth: &truth, rate: set.blind.frames_per_second, cameras: &camera_centres(&set.blind) };
    let found = case.find(&sequences, tracked);
    found.map(|found| in_words(&found, tracked)).or_else(|| relative_to_the_body(&truth, tracked))
}

/// What is doubtful of the numbers themselves, whatever their errors.
fn doubt(tracked: &Tracked) -> Option<Hint> {
    let read_as = tracked.read_as.as_ref();
    let quaternions = read_as.and_then(|read_as| read_as.doubt.clone());
    let text = quaternions.or_else(|| missing_values::note(&tracked.estimates.sequences))?;
    let from = read_as.map_or("the program", |read_as| &read_as.file);
    Some(Hint::without_errors(format!("{from} {text}")))
}

impl Hint {
    fn without_errors(text: String) -> Self {
        let (options, joint_map) = Default::default();
        Self { kinds: Vec::new(), text, options, joint_map, error_as_read_mm: None, error_corrected_mm: None }
    }
}

/// What the first answers of a program say when they are compared with the start pose, which it was given: `track` does
/// not know the truth.
pub(super) fn told_by_the_start(set: &BlindSet, tracked: &Tracked) -> Option<String> {
    let body = &set.start.body;
    let start = body.markers(&body.link_frames(&set.start.pose));
    let first = |sequence: &EstimatedSequence| {
        let mut given = GivenSequence::new(sequence, body);
        given.markers.truncate(FIRST_FRAMES);
        given.swapped.truncate(FIRST_FRAMES);
        given.roots.iter_mut().for_each(|roots| roots.truncate(FIRST_FRAMES));
        given
    };
    let sequences: Vec<GivenSequence> = tracked.estimates.sequences.iter().map(first).collect();
    let frames = sequences.first().map_or(0, |sequence| sequence.markers.len());
    // no shift is looked for (a rate of 0): a body that leaves its start would seem to be early
    let case = HintCase { truth: &vec![start; frames], rate: 0.0, cameras: &camera_centres(set) };
    let found = case.find(&sequences, tracked)?;
    Some(format!("judged by the start pose, {}", in_words(&found, tracked).text))
}

/// What a refusal of a file's units says, with all else that is wrong with its numbers.
pub(super) fn explained(set: &BenchmarkSet, tracked: &Tracked, refusal: String) -> String {
    match hint(set, tracked).filter(|hint| hint.kinds.len() > 1) {
        Some(hint) => format!("{refusal}; {}", hint.text),
        None => refusal,
    }
}

/// Positions of one repetition, as they are and with left and right exchanged.
struct GivenSequence {
    markers: Vec<Markers>,
    swapped: Vec<Markers>,
    roots: Option<Vec<Option<Point3<f64>>>>,
}

impl GivenSequence {
    fn new(sequence: &EstimatedSequence, body: &Humanoid) -> Self {
        let markers = sequence.markers.clone();
        match sequence.poses() {
            None => Self { swapped: markers.iter().map(with_sides_exchanged).collect(), markers, roots: None },
            Some(poses) => {
                let places =
                    |pose: &Option<Pose>| Some(Point3::from(pose.as_ref()?.world_from_root.translation.vector));
                let other = other_degrees(body);
                let swapped = |pose: &Option<Pose>| match pose {
                    None => [None; LANDMARKS.len()],
                    Some(pose) => {
                        let mut turned = pose.clone();
                        other
                            .iter()
                            .enumerate()
                            .for_each(|(to, from)| turned.joint_angles[to] = pose.joint_angles[*from]);
                        body.markers(&body.link_frames(&turned))
                    }
                };
                let roots = Some(poses.iter().map(places).collect());
                Self { swapped: poses.iter().map(swapped).collect(), markers, roots }
            }
        }
    }
}

/// For every degree of freedom that of the other side.
fn other_degrees(body: &Humanoid) -> Vec<usize> {
    let names: Vec<&str> = body.degrees_of_freedom.iter().map(|degree| degree.name.as_str()).collect();
    let other = |(index, name): (usize, &&str)| {
        let other = other_side(name, &names);
        names.iter().position(|known| *known == other).unwrap_or(index)
    };
    names.iter().enumerate().map(other).collect()
}

/// Where the cameras are, as trackers are told: one entry a frame where they move.
fn camera_centres(set: &BlindSet) -> Vec<Vec<Point3<f64>>> {
    let frames = if set.moments.is_some() { set.frame_count } else { 1 };
    (0..frames).map(|frame| set.rig_at(frame).cameras.iter().map(Camera::centre).collect()).collect()
}

/// What positions are compared with.
struct HintCase<'a> {
    truth: &'a [Markers],
    /// Frames a second.
    rate: f64,
    cameras: &'a [Vec<Point3<f64>>],
}

impl HintCase<'_> {
    fn find(&self, sequences: &[GivenSequence], tracked: &Tracked) -> Option<Misreading> {
        let given = sequences.iter().map(|sequence| GivenPositions {
            markers: &sequence.markers,
            swapped: &sequence.swapped,
            roots: sequence.roots.as_deref(),
        });
        let metres = tracked.read_as.as_ref().map_or(Some(1.0), |read_as| read_as.metres_per_unit);
        let scales = metres.iter().flat_map(|metres| UNITS_OF_LENGTH.map(|(.., other)| other / metres)).collect();
        find_misreading(&MisreadingCase {
            frames_per_second: self.rate,
            truth: self.truth,
            given: given.collect(),
            cameras: self.cameras,
            scales,
        })
    }
}

/// Positions whose pelvis is the origin: what lifters from images answer.
fn relative_to_the_body(truth: &[Markers], tracked: &Tracked) -> Option<Hint> {
    let pelvis = Landmark::Pelvis as usize;
    let sequences = &tracked.estimates.sequences;
    let mut places = sequences.iter().flat_map(|sequence| &sequence.markers).filter_map(|markers| markers[pelvis]);
    let far: Vec<f64> = truth.iter().filter_map(|markers| Some(markers[pelvis]?.coords.norm())).collect();
    let away = crate::evaluation::mean(&far).is_some_and(|away| away > AWAY_M);
    let is_given = sequences.iter().any(|sequence| sequence.markers.iter().any(|markers| markers[pelvis].is_some()));
    (is_given && away && places.all(|place| place.coords.norm() < AT_ORIGIN_M)).then(|| {
        Hint::without_errors(
            "the estimate's pelvis is at the origin in every frame: its positions are relative to the body, so errors in \
             the world say nothing of it; compare mpjpe_root_mm and pa_mpjpe_mm, or add the path of the pelvis"
                .to_owned(),
        )
    })
}

fn in_words(found: &Misreading, tracked: &Tracked) -> Hint {
    let correction = &found.correction;
    let kinds = correction.kinds();
    let [before, after] = [found.error_as_read_m, found.error_corrected_m].map(|metres| 1000.0 * metres);
    let told = match &tracked.read_as {
        Some(read_as) => FileAdvice { read_as, correction, poses: has_poses(tracked) }.told(&kinds),
        None => ReadingAdvice { text: of_program(correction), ..ReadingAdvice::default() },
    };
    Hint {
        kinds,
        text: format!(
            "most of the error would go away if the estimate were read in another way (about {before:.0} mm as it \
             is, {after:.0} mm then): {}",
            told.text
        ),
        options: told.options,
        joint_map: told.joint_map,
        error_as_read_mm: Some(before),
        error_corrected_mm: Some(after),
    }
}

fn has_poses(tracked: &Tracked) -> bool {
    tracked.estimates.sequences.iter().any(|sequence| sequence.poses().is_some())
}

/// A file as it was read, and how it should be.
struct FileAdvice<'a> {
    read_as: &'a ReadAs,
    correction: &'a Correction,
    poses: bool,
}

#[derive(Default)]
struct ReadingAdvice {
    text: String,
    options: Vec<String>,
    joint_map: BTreeMap<String, String>,
}

impl FileAdvice<'_> {
    fn told(&self, kinds: &[MisreadingKind]) -> ReadingAdvice {
        let mut told = ReadingAdvice::default();
        let mut parts = Vec::new();
        for kind in kinds {
            let (part, option) = self.part(*kind, &mut told.joint_map);
            parts.push(part);
            told.options.extend(option);
        }
        let file = &self.read_as.file;
        told.text = format!("{file}: {}", parts.join("; "));
        if !told.options.is_empty() {
            told.text += &format!(". Say {}", told.options.join(" "));
        }
        if !told.joint_map.is_empty() {
            let names: Vec<String> =
                told.joint_map.iter().map(|(theirs, ours)| format!("{theirs:?} is {ours:?}")).collect();
            told.text += &format!(". Give a --joint-map: {}", names.join(", "));
        }
        if kinds.contains(&MisreadingKind::Offset) {
            told.text += ". The offset was found from the truth: use it only if the file's origin is there";
        }
        told
    }

    /// One kind of change in words, and the option that makes it.
    fn part(&self, kind: MisreadingKind, map: &mut BTreeMap<String, String>) -> (String, Option<String>) {
        let (read_as, correction) = (self.read_as, self.correction);
        match kind {
            MisreadingKind::Axes => {
                let order = read_as.order.then(correction.axes);
                let up = order.up_axis();
                match order.is_mirrored() {
                    true if self.poses => {
                        (format!("its axes are {order}, left-handed: turn it before it is read"), None)
                    }
                    true => (format!("its axes are {order} ({up}, left-handed)"), Some(format!("--axes {order}"))),
                    false => (format!("its axes are {order} ({up})"), Some(format!("--axes {order}"))),
                }
            }
            MisreadingKind::Units => {
                let metres = correction.scale * read_as.metres_per_unit.unwrap_or(1.0);
                let unit = UNITS_OF_LENGTH.iter().find(|(.., known)| (known / metres - 1.0).abs() < 1e-6);
                let of = if self.poses { "the root is in" } else { "it is in" };
                match unit {
                    Some((word, plural, _)) => (format!("{of} {plural}"), Some(format!("--units {word}"))),
                    None => (format!("{of} units of {metres} m"), None),
                }
            }
            MisreadingKind::Sides => {
                let option = if read_as.swapped_sides { "nothing of sides (no --swap-sides)" } else { "--swap-sides" };
                ("left and right are exchanged, unless the body faces backwards".to_owned(), Some(option.to_owned()))
            }
            MisreadingKind::Shift => {
                let shift = read_as.shift_frames.unwrap_or(0) + correction.shift;
                let late = if correction.shift < 0 { ", unless the tracker is late by as much throughout" } else { "" };
                (format!("its frame 0 is the set's frame {shift}{late}"), Some(format!("--shift {shift}")))
            }
            MisreadingKind::Offset => {
                let carried: Vector3<f64> = correction.axes.set_from_file() * (correction.scale * read_as.offset());
                let place: [f64; 3] = (carried + correction.offset).into();
                let [x, y, z] = place.map(|metres| (1000.0 * metres).round() / 1000.0);
                (format!("its origin is at {x}, {y}, {z} m"), Some(format!("--offset {x},{y},{z}")))
            }
            MisreadingKind::Names => {
                self.names(map);
                ("names belong to other markers".to_owned(), None)
            }
        }
    }

    /// The lines of the joint map: sides are exchanged after it.
    fn names(&self, map: &mut BTreeMap<String, String>) {
        let side = |marker: usize| if self.correction.swapped { marker_of_other_side(marker) } else { marker };
        let moved = self.correction.names.iter().enumerate().filter(|(marker, name)| marker != *name);
        for (marker, name) in moved.filter(|_| !self.poses) {
            let there = LANDMARKS[side(*name)].name();
            let theirs = self.read_as.columns.get(there).cloned().unwrap_or_else(|| there.to_owned());
            map.insert(theirs, LANDMARKS[side(marker)].name().to_owned());
        }
    }
}

/// What has to be corrected in the program.
fn of_program(correction: &Correction) -> String {
    let mut parts = Vec::new();
    for kind in correction.kinds() {
        parts.push(match kind {
            MisreadingKind::Axes => {
                let order: AxisOrder = correction.axes;
                let handed = if order.is_mirrored() { ", left-handed" } else { "" };
                format!(
                    "the program answers in the axes {order} ({}{handed}); the set has Z up, x,y,z",
                    order.up_axis()
                )
            }
            MisreadingKind::Units => format!("it answers in units of {} m, expected metres", correction.scale),
            MisreadingKind::Sides => "it exchanges left and right".to_owned(),
            MisreadingKind::Shift if correction.shift < 0 => {
                format!("its answers are {} frames late throughout", -correction.shift)
            }
            MisreadingKind::Shift => format!("its answers are {} frames early throughout", correction.shift),
            MisreadingKind::Offset => {
                let [x, y, z] = <[f64; 3]>::from(correction.offset);
                format!("its origin is at {x:.3}, {y:.3}, {z:.3} m of the set")
            }
            MisreadingKind::Names => "it exchanges names of markers".to_owned(),
        });
    }
    format!("{}. Correct it in the program: no option of evaluate changes answers", parts.join("; "))
}
