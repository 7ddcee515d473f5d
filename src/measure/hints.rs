//! Hints for a run most of whose error comes from a misread estimate: other axes, units, sides, frames or names.

use std::collections::BTreeMap;

use nalgebra::{Point3, Vector3};
use serde::{Deserialize, Serialize};

use super::missing_values;
use super::poses_file::{ReadAs, UNITS_OF_LENGTH, other_side};
use super::tracked::Tracked;
use crate::benchmark_set::{BenchmarkSet, BlindSet, EstimatedSequence};
use crate::body::{Humanoid, LANDMARKS, Landmark, Markers, Pose};
use crate::camera::Camera;
use crate::evaluation::{
    AxisOrder, Correction, GivenPositions, Misreading, MisreadingCase, MisreadingKind, find_misreading,
    marker_of_other_side, with_sides_exchanged,
};

/// If the pelvis is nearer than this to the origin in every frame, positions are relative to it; metres,
const AT_ORIGIN_M: f64 = 0.001;
/// provided that the true pelvis is on average farther than this from the origin; metres.
const AWAY_M: f64 = 0.25;
/// Number of a program's first frames that are compared with the start pose.
const FIRST_FRAMES: usize = 6;

/// An explanation of most of a run's error, with the options that correct it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hint {
    /// The properties that seem to be misread; empty for other explanations, such as positions relative to the body.
    pub kinds: Vec<MisreadingKind>,
    /// The explanation, and what to do.
    pub text: String,
    /// Options of `skiagraph evaluate` that correct it; empty if there are none.
    pub options: Vec<String>,
    /// Lines of a joint map that correct the names; empty if the names are right.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub joint_map: BTreeMap<String, String>,
    /// Mean distance of the markers as read, over the compared frames, millimetres.
    pub error_as_read_mm: Option<f64>,
    /// The same after the correction, millimetres; `None` if unknown.
    pub error_corrected_mm: Option<f64>,
}

/// The explanation of most of a run's error, if there is one. Estimates of this program's trackers are never misread.
/// Those of a program that tracks too poorly for a comparison with the truth are compared with its start pose.
pub(crate) fn hint(set: &BenchmarkSet, tracked: &Tracked) -> Option<Hint> {
    if tracked.record.is_some() {
        return None;
    }
    if let Some(hint) = suspicious_values(tracked) {
        return Some(hint);
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
    let from_start = || tracked.program.as_ref().and_then(|_| hint_from_start(&set.blind, tracked));
    found.map(|found| describe(&found, tracked)).or_else(|| relative_to_the_body(&truth, tracked)).or_else(from_start)
}

/// A hint about suspicious values, which does not depend on their errors: quaternions, placeholders.
fn suspicious_values(tracked: &Tracked) -> Option<Hint> {
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

/// The hint for a program's first frames, compared with the start pose that it was given: `track` does not know the
/// truth.
pub(crate) fn hint_from_start(set: &BlindSet, tracked: &Tracked) -> Option<Hint> {
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
    // a rate of 0 excludes shifts: a body that leaves its start pose would seem to be early
    let case = HintCase { truth: &vec![start; frames], rate: 0.0, cameras: &camera_centres(set) };
    let hint = describe(&case.find(&sequences, tracked)?, tracked);
    Some(Hint { text: format!("compared with the start pose, {}", hint.text), ..hint })
}

/// The refusal of a file's units, with a hint if more than the units is wrong.
pub(crate) fn with_hint(set: &BenchmarkSet, tracked: &Tracked, refusal: String) -> String {
    match hint(set, tracked).filter(|hint| hint.kinds.len() > 1) {
        Some(hint) => format!("{refusal}; {}", hint.text),
        None => refusal,
    }
}

/// Positions of one seed, as read and with left and right exchanged.
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
                let other = degrees_of_other_side(body);
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

/// The index of each degree of freedom's counterpart on the other side.
fn degrees_of_other_side(body: &Humanoid) -> Vec<usize> {
    let names: Vec<&str> = body.degrees_of_freedom.iter().map(|degree| degree.name.as_str()).collect();
    let other = |(index, name): (usize, &&str)| {
        let other = other_side(name, &names);
        names.iter().position(|known| *known == other).unwrap_or(index)
    };
    names.iter().enumerate().map(other).collect()
}

/// The camera centres that trackers are given: one entry per frame if cameras move, else one.
fn camera_centres(set: &BlindSet) -> Vec<Vec<Point3<f64>>> {
    let frames = if set.moments.is_some() { set.frame_count } else { 1 };
    (0..frames).map(|frame| set.rig_at(frame).cameras.iter().map(Camera::centre).collect()).collect()
}

/// The positions with which an estimate is compared.
struct HintCase<'a> {
    truth: &'a [Markers],
    /// Frames per second.
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

/// The hint for positions whose origin is the pelvis, as programs that lift image keypoints write them.
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
             the world are meaningless; compare mpjpe_root_mm and pa_mpjpe_mm, or add the path of the pelvis"
                .to_owned(),
        )
    })
}

fn describe(found: &Misreading, tracked: &Tracked) -> Hint {
    let correction = &found.correction;
    let kinds = correction.kinds();
    let [before, after] = [found.error_as_read_m, found.error_corrected_m].map(|metres| 1000.0 * metres);
    let advice = match &tracked.read_as {
        Some(read_as) => FileAdvice { read_as, found, poses: has_poses(tracked) }.advice(&kinds),
        None => ReadingAdvice { text: advice_for_program(correction), ..ReadingAdvice::default() },
    };
    Hint {
        kinds,
        text: format!(
            "most of the error would go away if the estimate were read differently (about {before:.0} mm as read, \
             {after:.0} mm corrected): {}",
            advice.text
        ),
        options: advice.options,
        joint_map: advice.joint_map,
        error_as_read_mm: Some(before),
        error_corrected_mm: Some(after),
    }
}

fn has_poses(tracked: &Tracked) -> bool {
    tracked.estimates.sequences.iter().any(|sequence| sequence.poses().is_some())
}

/// How a file was read, and the correction.
struct FileAdvice<'a> {
    read_as: &'a ReadAs,
    found: &'a Misreading,
    poses: bool,
}

#[derive(Default)]
struct ReadingAdvice {
    text: String,
    options: Vec<String>,
    joint_map: BTreeMap<String, String>,
}

impl FileAdvice<'_> {
    fn advice(&self, kinds: &[MisreadingKind]) -> ReadingAdvice {
        let mut advice = ReadingAdvice::default();
        let mut parts = Vec::new();
        for kind in kinds {
            let (part, option) = self.part(*kind, &mut advice.joint_map);
            parts.push(part);
            advice.options.extend(option);
        }
        let file = &self.read_as.file;
        advice.text = format!("{file}: {}", parts.join("; "));
        if !advice.options.is_empty() {
            advice.text += &format!(". Use {}", advice.options.join(" "));
        }
        if !advice.joint_map.is_empty() {
            let names: Vec<String> =
                advice.joint_map.iter().map(|(theirs, ours)| format!("{theirs:?} is {ours:?}")).collect();
            advice.text += &format!(". Use a --joint-map: {}", names.join(", "));
        }
        if kinds.contains(&MisreadingKind::Offset) {
            advice.text += ". The offset was derived from the truth: use it only if the file's origin is really there";
        }
        advice
    }

    /// The description of one correction, and the option that makes it.
    fn part(&self, kind: MisreadingKind, map: &mut BTreeMap<String, String>) -> (String, Option<String>) {
        let (read_as, correction) = (self.read_as, &self.found.correction);
        match kind {
            MisreadingKind::Axes => {
                let order = read_as.order.then(correction.axes);
                let up = order.up_axis();
                let handed = if order.is_mirrored() { ", left-handed" } else { "" };
                if order.is_mirrored() && self.poses {
                    return (format!("its axes are {order}, left-handed: convert the file to right-handed axes"), None);
                }
                (format!("its axes are {order} ({up}{handed})"), Some(format!("--axes {order}")))
            }
            MisreadingKind::Units => {
                let metres = correction.scale * read_as.metres_per_unit.unwrap_or(1.0);
                let unit = UNITS_OF_LENGTH.iter().find(|(.., known)| (known / metres - 1.0).abs() < 1e-6);
                let subject = if self.poses { "the root is in" } else { "it is in" };
                match unit {
                    Some((word, plural, _)) => (format!("{subject} {plural}"), Some(format!("--units {word}"))),
                    None => (format!("{subject} units of {metres} m"), None),
                }
            }
            MisreadingKind::Sides if read_as.swapped_sides => {
                ("left and right are exchanged by --swap-sides: leave it out".to_owned(), None)
            }
            MisreadingKind::Sides => {
                let text = "left and right are exchanged, unless the body faces backwards";
                (text.to_owned(), Some("--swap-sides".to_owned()))
            }
            MisreadingKind::Shift => {
                let shift = read_as.shift_frames.unwrap_or(0) + correction.shift;
                let late = if correction.shift < 0 { ", unless the tracker is always that late" } else { "" };
                let end = end_of_shifts(self.found, read_as.shift_frames.unwrap_or(0));
                (format!("its frame 0 is the set's frame {shift}{end}{late}"), Some(format!("--shift {shift}")))
            }
            MisreadingKind::Offset => {
                let carried: Vector3<f64> = correction.axes.set_from_file() * (correction.scale * read_as.offset());
                let [x, y, z] = to_millimetres(carried + correction.offset);
                (format!("its origin is at {x}, {y}, {z} m"), Some(format!("--offset {x},{y},{z}")))
            }
            MisreadingKind::Names => {
                self.names(map);
                ("names are given to the wrong markers".to_owned(), None)
            }
        }
    }

    /// Adds the lines of the joint map; sides are exchanged after it.
    fn names(&self, map: &mut BTreeMap<String, String>) {
        let side = |marker: usize| if self.found.correction.swapped { marker_of_other_side(marker) } else { marker };
        let moved = self.found.correction.names.iter().enumerate().filter(|(marker, name)| marker != *name);
        for (marker, name) in moved.filter(|_| !self.poses) {
            let there = LANDMARKS[side(*name)].name();
            let theirs = self.read_as.columns.get(there).cloned().unwrap_or_else(|| there.to_owned());
            map.insert(theirs, LANDMARKS[side(marker)].name().to_owned());
        }
    }
}

/// Metres rounded to millimetres; zero has no sign.
fn to_millimetres(place: Vector3<f64>) -> [f64; 3] {
    <[f64; 3]>::from(place).map(|metres| (1000.0 * metres).round() / 1000.0 + 0.0)
}

/// The warning that the best shift is at the end of those searched, which are around the `declared` one; empty if it is
/// not.
fn end_of_shifts(found: &Misreading, declared: i64) -> String {
    let (shift, longest) = (found.correction.shift, found.longest_shift);
    if shift == 0 || shift.abs() < longest {
        return String::new();
    }
    let (farther, least, most) =
        (if shift > 0 { "more" } else { "less" }, declared.saturating_sub(longest), declared.saturating_add(longest));
    format!(" or {farther} (the best of the shifts searched, {least} to {most}, is at their end: try farther ones)")
}

/// The corrections that a program needs.
fn advice_for_program(correction: &Correction) -> String {
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
                format!("all its answers are {} frames late", -correction.shift)
            }
            MisreadingKind::Shift => format!("all its answers are {} frames early", correction.shift),
            MisreadingKind::Offset => {
                let [x, y, z] = to_millimetres(correction.offset);
                format!("its origin is at {x:.3}, {y:.3}, {z:.3} m in the set")
            }
            MisreadingKind::Names => "it exchanges names of markers".to_owned(),
        });
    }
    format!("{}. Correct the program: no option of evaluate changes its answers", parts.join("; "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_offset_of_less_than_a_millimetre_is_zero_without_a_sign() {
        let place = to_millimetres(Vector3::new(-0.0002, -0.7, 0.0));
        assert_eq!(place.map(|metres| metres.to_string()), ["0", "-0.7", "0"]);
    }

    #[test]
    fn a_shift_at_the_end_of_those_searched_is_not_said_to_be_the_right_one() {
        let found = |shift: i64| Misreading {
            correction: Correction { shift, ..Correction::none() },
            error_as_read_m: 0.5,
            error_corrected_m: 0.018,
            longest_shift: 30,
        };
        assert_eq!(end_of_shifts(&found(29), 0), "");
        let words = " or more (the best of the shifts searched, -30 to 30, is at their end: try farther ones)";
        assert_eq!(end_of_shifts(&found(30), 0), words);
        let words = " or less (the best of the shifts searched, -20 to 40, is at their end: try farther ones)";
        assert_eq!(end_of_shifts(&found(-30), 10), words);
    }
}
