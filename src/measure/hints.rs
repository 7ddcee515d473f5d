//! Hints for a run most of whose error comes from a misread estimate: other axes, units, sides, frames or names.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Point3, Quaternion, Rotation3, Translation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use super::missing_values;
use super::poses_file::{ReadAs, UNITS_OF_LENGTH, other_side, places_of_camera};
use super::tracked::Tracked;
use skiagraph_core::body::{Humanoid, LANDMARKS, Landmark, Markers, Pose};
use skiagraph_eval::{
    AxisOrder, Correction, Misreading, MisreadingCase, MisreadingKind, Reading, Turn, find_misreading,
    marker_of_other_side, with_sides_exchanged,
};
use skiagraph_set::{BenchmarkSet, BlindSet, EstimatedSequence};

/// Number of a program's first frames that are compared with the start pose.
const FIRST_FRAMES: usize = 6;

/// An explanation of most of a run's error, with the options that correct it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hint {
    /// The properties that seem to be misread; empty for other explanations, such as placeholders for missing values.
    pub kinds: Vec<MisreadingKind>,
    /// The explanation, and what to do.
    pub text: String,
    /// Options of `skiagraph evaluate` that correct it; empty if there are none.
    pub options: Vec<String>,
    /// Given options that must be left out.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub without: Vec<String>,
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
    let file = tracked.read_as.as_ref().map_or("the program", |read_as| &read_as.file);
    let truth: Vec<Markers> = set.truth.ground_truth.frames.iter().map(|frame| frame.markers).collect();
    if let Some(found) = find(&set.blind, tracked, &truth, set.blind.frames_per_second) {
        return Some(found);
    }
    let remedy = match tracked.program {
        Some(_) => "answer null for that marker",
        None => "write NaN (in CSV: leave the field empty)",
    };
    let placeholders = missing_values::note(&tracked.estimates.sequences, remedy);
    placeholders
        .map(|note| Hint::without_errors(format!("{file} {note}")))
        .or_else(|| tracked.program.as_ref().and_then(|_| hint_from_start(&set.blind, tracked)))
}

impl Hint {
    fn without_errors(text: String) -> Self {
        let (options, without, joint_map) = Default::default();
        Self { kinds: Vec::new(), text, options, without, joint_map, error_as_read_mm: None, error_corrected_mm: None }
    }
}

/// The hint for a program's first frames, compared with the start pose that it was given: `track` does not know the
/// truth.
pub(crate) fn hint_from_start(set: &BlindSet, tracked: &Tracked) -> Option<Hint> {
    let body = &set.start.body;
    let start = body.markers(&body.link_frames(&set.start.pose));
    let frames = tracked.estimates.frames().min(FIRST_FRAMES);
    // a rate of 0 excludes shifts: a body that leaves its start pose would seem to be early
    let hint = find(set, tracked, &vec![start; frames], 0.0)?;
    Some(Hint { text: format!("compared with the start pose, {}", hint.text), ..hint })
}

/// The refusal of a file's units, with the hint if more than the units is wrong, or the hint alone if they are right.
pub(crate) fn with_hint(set: &BenchmarkSet, tracked: &Tracked, refusal: String) -> String {
    match hint(set, tracked) {
        Some(hint) if !hint.kinds.is_empty() && !hint.kinds.contains(&MisreadingKind::Units) => hint.text,
        Some(hint) if hint.kinds.len() > 1 => format!("{refusal}; {}", hint.text),
        _ => refusal,
    }
}

fn find(set: &BlindSet, tracked: &Tracked, truth: &[Markers], rate: f64) -> Option<Hint> {
    let read_as = tracked.read_as.as_ref();
    let metres = read_as.map_or(Some(1.0), |read_as| read_as.metres_per_unit);
    let world_from_cameras = |frame: usize| -> Vec<Isometry3<f64>> {
        set.rig_at(frame).cameras.iter().map(|camera| camera.camera_from_world.inverse()).collect()
    };
    let mut readings = readings(set, tracked);
    let as_read = readings[0].sequences.clone();
    let mut roots: Option<Vec<Vec<_>>> = tracked.estimates.sequences.iter().map(roots).collect();
    let (mut declared, mut set_from_file) = (Correction::none(), Vec::new());
    if let Some(camera) = read_as.and_then(|read_as| read_as.camera.as_deref()) {
        let index = set.rig.cameras.iter().position(|known| known.name == camera).unwrap_or_default();
        declared.turn = Turn::Camera { index, opengl: false };
        set_from_file = places_of_camera(&tracked.estimates, camera, set);
    } else if let Some(offset) = read_as.and_then(|read_as| read_as.offset_m) {
        declared.offset = offset.into();
        set_from_file = vec![Translation3::from(declared.offset).into(); tracked.estimates.frames()];
    }
    for rows in readings.iter_mut().flat_map(|reading| &mut reading.sequences) {
        for (markers, place) in rows.iter_mut().zip(&set_from_file) {
            *markers = markers.map(|marker| marker.map(|point| place.inverse_transform_point(&point)));
        }
    }
    for rows in roots.iter_mut().flatten() {
        for (root, place) in rows.iter_mut().zip(&set_from_file) {
            *root = root.map(|point| place.inverse_transform_point(&point));
        }
    }
    let case = MisreadingCase {
        frames_per_second: rate,
        truth,
        as_read,
        readings,
        declared,
        roots,
        cameras: (0..if set.moments.is_some() { truth.len() } else { 1 }).map(world_from_cameras).collect(),
        scales: metres.iter().flat_map(|metres| UNITS_OF_LENGTH.map(|(.., other)| other / metres)).collect(),
        axes: read_as.map_or(AxisOrder::SAME, |read_as| read_as.order),
        begins_at_one: read_as.is_some_and(|read_as| read_as.begins_at_one),
    };
    let found = find_misreading(&case)?;
    Some(Advice { set, tracked, found: &found }.hint())
}

/// The markers of all estimated poses after a change, by sequence and frame.
fn markers_of_changed(set: &BlindSet, tracked: &Tracked, change: impl Fn(&Humanoid, &mut Pose)) -> Vec<Vec<Markers>> {
    let mut sequences = Vec::new();
    for (index, sequence) in tracked.estimates.sequences.iter().enumerate() {
        let body = tracked.estimates.body(index, &set.start.body);
        let mut frames = Vec::new();
        for pose in sequence.poses().unwrap_or_default() {
            frames.push(match pose.clone() {
                None => [None; LANDMARKS.len()],
                Some(mut pose) => {
                    change(body, &mut pose);
                    body.markers(&body.link_frames(&pose))
                }
            });
        }
        sequences.push(frames);
    }
    sequences
}

/// The markers as read, and of poses read otherwise: with sides exchanged, joint angles in the other unit, and the real
/// part of quaternions last. Placeholders are left out.
fn readings(set: &BlindSet, tracked: &Tracked) -> Vec<Reading> {
    let is_placeholder = |point: &Point3<f64>| missing_values::has_equal_coordinates(point);
    let kept = |markers: &Markers| markers.map(|marker| marker.filter(|point| !is_placeholder(point)));
    let as_read: Vec<Vec<Markers>> =
        tracked.estimates.sequences.iter().map(|sequence| sequence.markers.iter().map(kept).collect()).collect();
    if !has_poses(tracked) {
        let exchanged = as_read.iter().map(|markers| markers.iter().map(with_sides_exchanged).collect()).collect();
        return vec![
            Reading { kind: None, sequences: as_read },
            Reading { kind: Some(MisreadingKind::Sides), sequences: exchanged },
        ];
    }
    let in_degrees = tracked.read_as.as_ref().is_some_and(|read_as| read_as.angles_in_degrees);
    let factor = if in_degrees { 1_f64.to_degrees() } else { 1_f64.to_radians() };
    let exchanged = markers_of_changed(set, tracked, |body, pose| {
        let given = pose.joint_angles.clone();
        for (to, from) in degrees_of_other_side(body).into_iter().enumerate() {
            pose.joint_angles[to] = given[from];
        }
    });
    let in_other_unit = markers_of_changed(set, tracked, |_, pose| pose.joint_angles *= factor);
    let order = tracked.read_as.as_ref().map_or(AxisOrder::SAME, |read_as| read_as.order);
    let set_from_file = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(order.set_from_file()));
    let with_real_part_last = markers_of_changed(set, tracked, |_, pose| {
        let read = set_from_file.inverse() * pose.world_from_root.rotation;
        let otherwise = UnitQuaternion::new_normalize(Quaternion::new(read.k, read.w, read.i, read.j));
        pose.world_from_root.rotation = set_from_file * otherwise;
    });
    vec![
        Reading { kind: None, sequences: as_read },
        Reading { kind: Some(MisreadingKind::Sides), sequences: exchanged },
        Reading { kind: Some(MisreadingKind::Angles), sequences: in_other_unit },
        Reading { kind: Some(MisreadingKind::Quaternions), sequences: with_real_part_last },
    ]
}

fn roots(sequence: &EstimatedSequence) -> Option<Vec<Option<Point3<f64>>>> {
    let place = |pose: &Option<Pose>| Some(Point3::from(pose.as_ref()?.world_from_root.translation.vector));
    Some(sequence.poses()?.iter().map(place).collect())
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

fn has_poses(tracked: &Tracked) -> bool {
    tracked.estimates.sequences.iter().any(|sequence| sequence.poses().is_some())
}

/// What positions relative to the body are good for.
pub(super) const RELATIVE: &str = "so errors in the world are meaningless: compare mpjpe_root_mm and pa_mpjpe_mm";

const RELATIVE_WITHOUT_PELVIS: &str = "so errors in the world are meaningless: compare pa_mpjpe_mm (mpjpe_root_mm needs \
                                       a `pelvis`: add it, at 0, 0, 0 if it is the root)";

/// How a misread estimate is described.
struct Advice<'a> {
    set: &'a BlindSet,
    tracked: &'a Tracked,
    found: &'a Misreading,
}

/// What is wrong, the option that corrects it, and the given option that must be left out.
struct Part {
    text: String,
    option: Option<String>,
    without: Option<String>,
}

impl Part {
    fn new(text: impl Into<String>) -> Self {
        Self { text: text.into(), option: None, without: None }
    }

    fn with(self, option: String) -> Self {
        Self { option: Some(option), ..self }
    }

    fn without(self, option: &str) -> Self {
        Self { without: Some(option.to_owned()), ..self }
    }
}

impl Advice<'_> {
    fn hint(&self) -> Hint {
        let kinds = self.found.kinds.clone();
        let parts: Vec<Part> = kinds.iter().map(|kind| self.part(*kind)).collect();
        let texts: Vec<&str> = parts.iter().map(|part| part.text.as_str()).collect();
        let [before, after] = [self.found.error_as_read_m, self.found.error_corrected_m].map(|metres| 1000.0 * metres);
        let mut text = format!(
            "most of the error would go away if the estimate were read differently (about {before:.0} mm as read, \
             {after:.0} mm corrected): "
        );
        let (mut options, mut without) = (Vec::new(), Vec::new());
        let mut joint_map = BTreeMap::new();
        match &self.tracked.read_as {
            None => {
                text +=
                    &format!("{}. Correct the program: no option of evaluate changes its answers", texts.join("; "));
            }
            Some(read_as) => {
                options.extend(parts.iter().filter_map(|part| part.option.clone()));
                without.extend(parts.iter().filter_map(|part| part.without.clone()));
                joint_map = self.joint_map(read_as);
                text += &format!("{}: {}", read_as.file, texts.join("; "));
                if !options.is_empty() {
                    // names have a joint map
                    let mut of_kinds = kinds.iter().zip(&parts);
                    let is_all = of_kinds.all(|(kind, part)| {
                        *kind == MisreadingKind::Names || part.option.is_some() || part.without.is_some()
                    });
                    let beside = if is_all { "" } else { " beside the other changes: alone it leaves another error" };
                    text += &format!(". Use {}{beside}", options.join(" "));
                }
                if !without.is_empty() {
                    text += &format!(". Leave out {}", without.join(" and "));
                }
                if !joint_map.is_empty() {
                    let names: Vec<String> =
                        joint_map.iter().map(|(theirs, ours)| format!("{theirs:?} is {ours:?}")).collect();
                    text += &format!(". Use a --joint-map: {}", names.join(", "));
                }
                if self.found.correction.offset != Vector3::zeros() && kinds.contains(&MisreadingKind::Offset) {
                    text += ". The offset was derived from the truth: use it only if the file's origin is really there";
                }
            }
        }
        let (error_as_read_mm, error_corrected_mm) = (Some(before), Some(after));
        Hint { kinds, text, options, without, joint_map, error_as_read_mm, error_corrected_mm }
    }

    /// A part with the option for these axes of the file: none if it has them without the options that were given.
    fn in_order(&self, part: Part, order: AxisOrder) -> Part {
        let is_usual = self.tracked.read_as.as_ref().is_some_and(|read_as| read_as.usual_order == order);
        let axes = format!("--axes {order}");
        match self.given_axes() {
            Some(given) if is_usual => part.without(given),
            None | Some("--axes") => part.with(axes),
            Some(given) => part.with(axes).without(given),
        }
    }

    fn given_axes(&self) -> Option<&'static str> {
        let read_as = self.tracked.read_as.as_ref()?;
        ["--up", "--axes", "--camera"].into_iter().find(|option| read_as.axes_from == *option)
    }

    fn turned(&self) -> Part {
        let part = match self.found.correction.turn {
            Turn::Axes(axes) => {
                let order = self.tracked.read_as.as_ref().map_or(AxisOrder::SAME, |read_as| read_as.order).then(axes);
                let handed = if order.is_mirrored() { ", left-handed" } else { "" };
                let text = format!("its axes are {order} ({}{handed})", order.up_axis());
                return match order.is_mirrored() && has_poses(self.tracked) {
                    true => Part::new(text + ": convert the file to right-handed axes"),
                    false => self.in_order(Part::new(text), order),
                };
            }
            Turn::Camera { index, opengl } => {
                let name = self.set.rig.cameras.get(index).map_or("", |camera| &camera.name);
                let text = format!("its positions are in the axes of camera {name}");
                let part = match opengl {
                    true => Part::new(text + " with y up and z backwards: reverse them, and use --camera " + name),
                    false => Part::new(text + " (x right, y down, z forward)").with(format!("--camera {name}")),
                };
                let refused = self.given_axes().filter(|option| *option != "--camera");
                return refused.into_iter().fold(part, Part::without);
            }
            Turn::Vertical(angle) => {
                let degrees = angle.to_degrees();
                Part::new(format!("it must be turned by {degrees:.1} degrees about the vertical, from x to y"))
            }
            Turn::Free(rotation) => {
                let (axis, angle) = rotation.axis_angle().map_or((Vector3::z(), 0.0), |(axis, a)| (*axis, a));
                let [x, y, z] = to_millimetres(axis);
                Part::new(format!("it must be turned by {:.1} degrees about {x}, {y}, {z}", angle.to_degrees()))
            }
        };
        if self.given_axes() == Some("--camera") { self.in_order(part, AxisOrder::SAME) } else { part }
    }

    fn part(&self, kind: MisreadingKind) -> Part {
        let correction = &self.found.correction;
        let read_as = self.tracked.read_as.as_ref();
        let is_turned = self.found.kinds.contains(&MisreadingKind::Turn);
        match kind {
            MisreadingKind::Axes | MisreadingKind::Camera | MisreadingKind::Turn => self.turned(),
            MisreadingKind::Units => {
                let metres = correction.scale * read_as.and_then(|read_as| read_as.metres_per_unit).unwrap_or(1.0);
                let unit = UNITS_OF_LENGTH.iter().find(|(.., known)| (known / metres - 1.0).abs() < 1e-6);
                let subject = if has_poses(self.tracked) { "the root is in" } else { "it is in" };
                match unit {
                    Some((word, plural, _)) => Part::new(format!("{subject} {plural}")).with(format!("--units {word}")),
                    None => Part::new(format!("{subject} units of {metres} m")),
                }
            }
            MisreadingKind::Scale => {
                let (size, factor) = (1.0 / correction.scale, correction.scale);
                Part::new(format!("all its lengths are {size:.3} times the true ones: multiply them by {factor:.4}"))
            }
            MisreadingKind::Offset if correction.offset == Vector3::zeros() => {
                Part::new("its origin is that of its axes").without("--offset")
            }
            MisreadingKind::Offset => {
                let [x, y, z] = to_millimetres(correction.offset);
                let part = Part::new(format!("its origin is at {x}, {y}, {z} m"));
                if is_turned { part } else { part.with(format!("--offset {x},{y},{z}")) }
            }
            MisreadingKind::Relative => {
                let root = correction.root.map_or("the body", |root| root.name());
                let mut markers = self.tracked.estimates.sequences.iter().flat_map(|sequence| &sequence.markers);
                let has_pelvis = markers.any(|markers| markers[Landmark::Pelvis as usize].is_some());
                let metrics = if has_pelvis { RELATIVE } else { RELATIVE_WITHOUT_PELVIS };
                Part::new(format!("its positions are relative to {root}, {metrics}, or add the path of {root}"))
            }
            MisreadingKind::Sides if read_as.is_some_and(|read_as| read_as.swapped_sides) => {
                Part::new("left and right are exchanged by --swap-sides").without("--swap-sides")
            }
            MisreadingKind::Sides => Part::new("left and right are exchanged, unless the body faces backwards")
                .with("--swap-sides".to_owned()),
            MisreadingKind::SidesInPart => {
                let part = match correction.rows.start {
                    0 => format!("before frame {}", correction.rows.end),
                    start => format!("from frame {start} on"),
                };
                Part::new(format!("left and right are exchanged {part}: in the file, or by the tracker"))
            }
            MisreadingKind::Angles => {
                let in_degrees = read_as.is_some_and(|read_as| read_as.angles_in_degrees);
                let (unit, option) = if in_degrees { ("radians", "rad") } else { ("degrees", "deg") };
                Part::new(format!("its joint angles are in {unit}")).with(format!("--angles {option}"))
            }
            MisreadingKind::Quaternions => Part::new(
                "the real part of its root quaternions is last: write estimate_root as x y z qw qx qy qz, in NumPy \
                 root[..., [0, 1, 2, 6, 3, 4, 5]]",
            ),
            MisreadingKind::Differences => {
                Part::new("it has the differences between frames, not positions: add them up from the start pose")
            }
            MisreadingKind::Shift => {
                let declared = read_as.and_then(|read_as| read_as.shift_frames).unwrap_or(0);
                let found = correction.time.first as i64;
                let (shift, end) = (declared.saturating_add(found), end_of_shifts(self.found, declared));
                let why = match read_as.is_some_and(|read_as| read_as.begins_at_one) && found == -1 {
                    true => {
                        ": its first row is numbered as frame 1, or has its time, as if it counted from 1; \
                             leave it if the first row is frame 1, and the tracker late"
                    }
                    false if found < 0 => ", unless the tracker is always that late",
                    false => "",
                };
                Part::new(format!("its frame 0 is the set's frame {shift}{end}{why}")).with(format!("--shift {shift}"))
            }
            MisreadingKind::Rate => {
                let (own, rate) = (self.set.frames_per_second / correction.time.step, self.set.frames_per_second);
                Part::new(format!(
                    "its rows have a rate of {own:.1} frames a second and not the set's {rate}, as the shift grows along the \
                     clip: resample it to the set's rate, or write the times of its rows (.trc)"
                ))
            }
            MisreadingKind::Reversed => Part::new("its frames are in the reverse order: reverse its rows"),
            MisreadingKind::Names => Part::new("names are given to the wrong markers"),
        }
    }

    /// The lines of a joint map; sides are exchanged after it.
    fn joint_map(&self, read_as: &ReadAs) -> BTreeMap<String, String> {
        let mut map = BTreeMap::new();
        if self.found.kinds.contains(&MisreadingKind::Names) {
            map.clone_from(&read_as.joint_map);
        }
        let is_swapped = read_as.swapped_sides != self.found.kinds.contains(&MisreadingKind::Sides);
        let side = |marker: usize| if is_swapped { marker_of_other_side(marker) } else { marker };
        let moved = self.found.correction.names.iter().enumerate().filter(|(marker, name)| marker != *name);
        for (marker, name) in moved.filter(|_| !has_poses(self.tracked)) {
            let there = LANDMARKS[side(*name)].name();
            let theirs = read_as.columns.get(there).cloned().unwrap_or_else(|| there.to_owned());
            map.insert(theirs, LANDMARKS[side(marker)].name().to_owned());
        }
        map
    }
}

/// Metres rounded to millimetres; zero has no sign.
fn to_millimetres(place: Vector3<f64>) -> [f64; 3] {
    <[f64; 3]>::from(place).map(|metres| (1000.0 * metres).round() / 1000.0 + 0.0)
}

/// The warning that the best shift is at the end of those searched, which are around the `declared` one; empty if it is
/// not.
fn end_of_shifts(found: &Misreading, declared: i64) -> String {
    let (shift, longest) = (found.correction.time.first as i64, found.longest_shift);
    if shift == 0 || shift.abs() < longest {
        return String::new();
    }
    let (farther, least, most) =
        (if shift > 0 { "more" } else { "less" }, declared.saturating_sub(longest), declared.saturating_add(longest));
    format!(" or {farther} (the best of the shifts searched, {least} to {most}, is at their end: try farther ones)")
}

#[cfg(test)]
mod tests {
    use super::*;
    use skiagraph_eval::FileTime;

    #[test]
    fn an_offset_of_less_than_a_millimetre_is_zero_without_a_sign() {
        let place = to_millimetres(Vector3::new(-0.0002, -0.7, 0.0));
        assert_eq!(place.map(|metres| metres.to_string()), ["0", "-0.7", "0"]);
    }

    #[test]
    fn a_shift_at_the_end_of_those_searched_is_not_said_to_be_the_right_one() {
        let found = |shift: i64| Misreading {
            correction: Correction { time: FileTime::shifted(shift), ..Correction::none() },
            kinds: vec![MisreadingKind::Shift],
            error_as_read_m: 0.5,
            error_corrected_m: 0.018,
            longest_shift: 30,
        };
        assert_eq!(end_of_shifts(&found(29), 0), "");
        let words = " or more (the best of the shifts searched, -30 to 30, is at their end: try farther ones)";
        assert_eq!(end_of_shifts(&found(30), 0), words);
    }
}
