//! Converts a file's points to metres, Z up, without gaps, keyed by marker name.

use std::collections::BTreeMap;
use std::ops::Range;

use nalgebra::{Point3, Vector3};

use super::gaps::{Track, fill, missing_frames};
use super::names::KnownPoints;
use super::{PointFile, malformed};
use crate::mocap::{MocapError, ReadOptions, SidesInFile, UpAxis, UpSource};

/// A point seen in a smaller share of the frames is dropped, and one with a long gap of this share of them.
const MIN_SHARE_SEEN: f64 = 0.5;
const MOST_IN_A_ROW: f64 = 0.4;

/// Interpolation over a longer gap is a guess, seconds.
const LONG_GAP: f64 = 0.25;

/// Largest accepted coordinate, metres.
const MAX_COORDINATE: f64 = 1e4;

/// Points that move with the trunk.
const TRUNK: [&str; 12] =
    ["LASI", "RASI", "LPSI", "RPSI", "SACR", "C7", "CLAV", "thorax", "pelvis", "left_hip", "right_hip", "STRN"];

/// Points of a frame by marker name, metres, Z up.
pub(super) type FramePoints = BTreeMap<String, Point3<f64>>;

/// The points of a recording.
pub(super) struct MetricPoints {
    pub(super) frames: Vec<FramePoints>,
    pub(super) notes: Vec<String>,
    /// The file's axis that is Z, and who says that it points up.
    pub(super) up: (UpAxis, UpSource),
    /// Points dropped because they are seldom seen.
    pub(super) seldom: Vec<String>,
    /// The longest run of frames in which all points that are seen at all are seen, and those of its first frame.
    pub(super) in_view: Option<(Range<usize>, FramePoints)>,
}

impl MetricPoints {
    pub(super) fn of(
        file: &str,
        points: PointFile,
        known: &KnownPoints,
        options: &ReadOptions,
    ) -> Result<Self, MocapError> {
        let mut notes = points.notes.clone();
        let metres = options.metres_per_unit.or(points.metres_per_unit);
        let metres = metres.ok_or_else(|| malformed(file, "the file declares no unit; set `metres_per_unit`"))?;
        let mean = |frame: &Vec<Option<[f64; 3]>>, columns: &[usize]| {
            let sum = columns.iter().try_fold(Vector3::zeros(), |sum, column| {
                let place = (*frame.get(*column)?)?;
                Some(sum + Vector3::from(place))
            })?;
            Some(Point3::from(sum * metres / columns.len().max(1) as f64))
        };
        let mut tracks: BTreeMap<&String, Track> = known
            .columns
            .iter()
            .map(|(name, columns)| (name, points.frames.iter().map(|frame| mean(frame, columns)).collect()))
            .collect();
        let mut places = tracks.values().flat_map(|track| track.iter().flatten());
        if let Some(far) = places.find(|place| !place.iter().all(|c| c.abs() <= MAX_COORDINATE)) {
            let found = far.coords.amax();
            let detail = format!(
                "a point is {found:.3e} m from the origin, expected at most {MAX_COORDINATE} m; check the unit"
            );
            return Err(malformed(file, detail));
        }
        let up = match (options.up, points.up) {
            (Some(up), _) => (up, UpSource::User),
            (None, Some(said)) => {
                let source = if points.up_is_usual { UpSource::Guess } else { UpSource::File };
                (check_up(&tracks, said, points.up_is_usual, &mut notes), source)
            }
            (None, None) => (guess_up_from_points(&tracks, &mut notes), UpSource::Guess),
        };
        for place in tracks.values_mut().flatten().flatten() {
            place.coords = up.0.upright(&place.coords);
            if options.sides == SidesInFile::Mirrored {
                place.y = -place.y;
            }
        }
        let rate = options.frames_per_second.or(points.frames_per_second).unwrap_or(1.0);
        let (frames, seldom) = fill_gaps(&tracks, points.frames.len(), rate, &mut notes);
        let mut seen = vec![true; points.frames.len()];
        for track in tracks.values().filter(|track| track.iter().any(Option::is_some)) {
            seen.iter_mut().zip(track).for_each(|(seen, place)| *seen &= place.is_some());
        }
        let in_view = longest_run(&seen).map(|run| {
            let first = tracks.iter().filter_map(|(name, track)| Some(((*name).clone(), track[run.start]?)));
            (run.clone(), first.collect())
        });
        Ok(Self { frames, notes, up, seldom, in_view })
    }
}

/// Tolerated height of the lowest point above a floor at 0, metres.
const FLOOR_TOLERANCE: f64 = 0.2;

/// The axis that the file declares, or the other one, with a note, if only that one has a floor on which the body
/// stands. The format's usual axis gives way to one along which the body stands, but a body lying on the floor of the
/// usual axis is not taken for one standing along the other.
fn check_up(tracks: &BTreeMap<&String, Track>, said: UpAxis, is_usual: bool, notes: &mut Vec<String>) -> UpAxis {
    let rise = rise(tracks);
    let other = if said == UpAxis::Y { UpAxis::Z } else { UpAxis::Y };
    let [along_said, along_other] = [said, other].map(|axis| axis.along(&rise));
    let [is_on_said, is_on_other] = [said, other].map(|axis| lowest(tracks, axis).abs() <= FLOOR_TOLERANCE);
    if is_usual {
        let stands = along_other > along_said.abs() && (is_on_other || !is_on_said);
        let (up, unused) = if stands { (other, said) } else { (said, other) };
        let why = if stands { "although TRC files usually have" } else { "as TRC files usually have it, not" };
        notes.push(format!(
            "up axis: {up:?}, {why} {unused:?}: the shoulders lie {along_said:.2} m above the feet along {said:?} and \
             {along_other:.2} m along {other:?}; set `up` to override"
        ));
        return up;
    }
    if along_other <= along_said || !is_on_other || is_on_said {
        return said;
    }
    notes.push(format!(
        "up axis: {other:?}, although Y_SCREEN says {said:?}: the body stands on a floor of {other:?} = 0; set `up` to override"
    ));
    other
}

/// Median over the frames of the lowest coordinate along an axis, metres.
fn lowest(tracks: &BTreeMap<&String, Track>, axis: UpAxis) -> f64 {
    let frames = tracks.values().map(Vec::len).max().unwrap_or(0);
    let of = |frame: usize| {
        let places = tracks.values().filter_map(|track| track.get(frame).copied().flatten());
        places.map(|place| axis.along(&place.coords)).min_by(f64::total_cmp)
    };
    let mut lowest: Vec<f64> = (0..frames).filter_map(of).collect();
    lowest.sort_by(f64::total_cmp);
    lowest.get(lowest.len() / 2).copied().unwrap_or(0.0)
}

/// The axis along which the shoulders are farthest above the feet, with a note.
fn guess_up_from_points(tracks: &BTreeMap<&String, Track>, notes: &mut Vec<String>) -> UpAxis {
    let rise = rise(tracks);
    // which of the two ends is up is judged later
    let up = if rise.y.abs() > rise.z.abs() { UpAxis::Y } else { UpAxis::Z };
    notes.push(format!("up axis guessed: {up:?}"));
    up
}

/// Vector from the mean of the feet to the mean of the shoulders, metres.
fn rise(tracks: &BTreeMap<&String, Track>) -> Vector3<f64> {
    let mean = |wanted: &dyn Fn(&str) -> bool| {
        let places = tracks.iter().filter(|(name, _)| wanted(name)).flat_map(|(_, track)| track.iter().flatten());
        let (sum, count) = places.fold((Vector3::zeros(), 0.0), |(sum, count), p| (sum + p.coords, count + 1.0));
        sum / f64::max(count, 1.0)
    };
    let shoulders = ["C7", "CLAV", "thorax", "LSHO", "RSHO", "left_shoulder", "right_shoulder"];
    // of legs alone, the pelvis is highest
    let has_shoulders = tracks.keys().any(|name| shoulders.contains(&name.as_str()));
    let high = mean(&|name| if has_shoulders { shoulders.contains(&name) } else { TRUNK.contains(&name) });
    let low = mean(&|name| name.ends_with("ANK") || name.ends_with("ankle") || name.ends_with("TOE"));
    high - low
}

/// Interpolates the gaps, with notes. Returns the points of every frame, and the dropped points.
fn fill_gaps(
    tracks: &BTreeMap<&String, Track>,
    count: usize,
    rate: f64,
    notes: &mut Vec<String>,
) -> (Vec<BTreeMap<String, Point3<f64>>>, Vec<String>) {
    let still = vec![Vector3::zeros(); count];
    let trunk: Vec<Vec<Point3<f64>>> = tracks
        .iter()
        .filter(|(name, track)| TRUNK.contains(&name.as_str()) && is_seen(track, rate))
        .filter_map(|(_, track)| fill(track, &still))
        .collect();
    let reference: Vec<Vector3<f64>> = (0..count)
        .map(|frame| trunk.iter().map(|own| own[frame].coords).sum::<Vector3<f64>>() / trunk.len().max(1) as f64)
        .collect();
    let mut frames = vec![BTreeMap::new(); count];
    let (mut gaps, mut guesses, mut seldom) = (Vec::new(), Vec::new(), Vec::new());
    for (name, track) in tracks {
        let lost = missing_frames(track);
        if !is_seen(track, rate) {
            notes.push(format!("{name} is not seen in {} of {count} frames: dropped", lost.frames));
            seldom.push((*name).clone());
            continue;
        }
        if lost.frames > 0 {
            let entry = format!("{name} {} (at most {} in a row)", lost.frames, lost.longest);
            if lost.longest as f64 > LONG_GAP * rate { guesses.push(entry) } else { gaps.push(entry) }
        }
        for (frame, place) in frames.iter_mut().zip(fill(track, &reference).into_iter().flatten()) {
            frame.insert((*name).clone(), place);
        }
    }
    if !gaps.is_empty() {
        notes.push(format!("frames in which a point is not seen, interpolated: {}", gaps.join(", ")));
    }
    if !guesses.is_empty() {
        let detail = guesses.join(", ");
        notes.push(format!("gaps of more than {LONG_GAP} s, where the interpolation is a guess: {detail}"));
    }
    (frames, seldom)
}

/// The longest run of true values, of at least two.
fn longest_run(values: &[bool]) -> Option<Range<usize>> {
    let mut longest = 0..1;
    let mut start = 0;
    for (index, value) in values.iter().enumerate() {
        if !value {
            start = index + 1;
        } else if index + 1 - start > longest.len() {
            longest = start..index + 1;
        }
    }
    Some(longest).filter(|run| run.len() > 1)
}

fn is_seen(track: &Track, rate: f64) -> bool {
    let (lost, count) = (missing_frames(track), track.len() as f64);
    let is_long = lost.longest as f64 > LONG_GAP * rate && lost.longest as f64 > MOST_IN_A_ROW * count;
    lost.frames as f64 <= (1.0 - MIN_SHARE_SEEN) * count && !is_long
}

#[cfg(test)]
mod tests {
    use crate::mocap::{ReadOptions, UpAxis, parse_markers};

    /// A standing body, X forward, Y left, Z up, metres.
    const BODY: [(&str, [f64; 3]); 15] = [
        ("pelvis", [0.0, 0.0, 0.95]),
        ("thorax", [0.0, 0.0, 1.45]),
        ("head_top", [0.0, 0.0, 1.75]),
        ("left_shoulder", [0.0, 0.18, 1.4]),
        ("left_elbow", [0.0, 0.2, 1.1]),
        ("left_wrist", [0.05, 0.2, 0.85]),
        ("right_shoulder", [0.0, -0.18, 1.4]),
        ("right_elbow", [0.0, -0.2, 1.1]),
        ("right_wrist", [0.05, -0.2, 0.85]),
        ("left_hip", [0.0, 0.09, 0.93]),
        ("left_knee", [0.02, 0.09, 0.5]),
        ("left_ankle", [0.0, 0.09, 0.08]),
        ("right_hip", [0.0, -0.09, 0.93]),
        ("right_knee", [0.02, -0.09, 0.5]),
        ("right_ankle", [0.0, -0.09, 0.08]),
    ];

    /// Two frames of the body with coordinates transformed by `place`.
    fn file(place: impl Fn([f64; 3]) -> [f64; 3]) -> String {
        file_of(&BODY, place)
    }

    fn file_of(points: &[(&str, [f64; 3])], place: impl Fn([f64; 3]) -> [f64; 3]) -> String {
        let names: String = points.iter().map(|(name, _)| format!("\t{name}\t\t")).collect();
        let row: String = points.iter().flat_map(|(_, at)| place(*at)).map(|c| format!("\t{c}")).collect();
        format!(
            "PathFileType\t4\t(X/Y/Z)\ta.trc\nDataRate\tUnits\n10\tm\nFrame#\tTime{names}\n\t\tX1\n\n\
             1\t0.0{row}\n2\t0.1{row}\n"
        )
    }

    /// Height of the neck above the pelvis, and the notes.
    fn read(text: &str, up: Option<UpAxis>) -> (f64, String) {
        let options = ReadOptions { up, ..ReadOptions::default() };
        let clip = parse_markers(text.as_bytes(), "a.trc", &options).unwrap();
        let places = clip.joint_positions(0);
        let of = |name: &str| clip.skeleton.joints.iter().position(|joint| joint.name == name).unwrap();
        (places[of("neck")].z - places[of("pelvis")].z, clip.notes.join("; "))
    }

    #[test]
    fn up_is_z_for_a_body_standing_along_z_but_not_for_a_lying_one() {
        let (height, notes) = read(&file(|[x, y, z]| [x + 2.0, y + 3.0, z]), None);
        assert!(height > 0.4 && notes.contains("up axis: Z, although TRC files usually have Y"), "{height} {notes}");
        let (height, notes) = read(&file(|[x, y, z]| [x + 2.0, z, 3.0 - y]), None);
        assert!(height > 0.4 && notes.contains("up axis: Y, as TRC files usually have it"), "{height} {notes}");
        // lying on its back: longest along Z, but on the floor of Y
        let (height, notes) = read(&file(|[x, y, z]| [-y, x + 0.1, z + 2.0]), None);
        assert!(height.abs() < 0.1 && notes.contains("up axis: Y"), "{height} {notes}");
        let (height, notes) = read(&file(|[x, y, z]| [-y, x + 0.1, z + 2.0]), Some(UpAxis::Z));
        assert!(height > 0.4 && !notes.contains("up axis"), "{height} {notes}");
    }

    #[test]
    fn the_error_about_a_missing_joint_names_seldom_seen_points() {
        let text = file(|place| place);
        let without_knee = text.lines().last().unwrap().replace("\t0.02\t0.09\t0.5", "\t\t\t");
        let text = format!("{text}{without_knee}\n{without_knee}\n{without_knee}\n");
        let message = parse_markers(text.as_bytes(), "a.trc", &ReadOptions::default()).unwrap_err().to_string();
        let found = "cannot locate left_knee in frame 1 (from 1): left_knee not seen often enough";
        assert!(message.contains(found) && !message.contains("marker_map"), "{message}");
        assert!(message.contains("set `first_frame = 1` and `last_frame = 2`"), "{message}");
        // of a basketball player without markers on the right leg
        let text = text.replace("right_knee", "other");
        let message = parse_markers(text.as_bytes(), "a.trc", &ReadOptions::default()).unwrap_err().to_string();
        assert!(message.contains("left_knee, right_knee") && !message.contains("first_frame"), "{message}");
    }

    /// Most gait laboratories have no head and no arms, and many only legs.
    #[test]
    fn legs_alone_get_an_upper_body_by_proportion() {
        // legs alone, and with the right arm
        for points in [&BODY[9..], &BODY[6..]] {
            let clip = parse_markers(file_of(points, |p| p).as_bytes(), "a.trc", &ReadOptions::default()).unwrap();
            let is_noted = clip.notes.iter().any(|note| note.starts_with("no markers of thorax, head_top"));
            assert!(is_noted, "{:?}", clip.notes);
            let places = clip.joint_positions(0);
            for (joint, place) in clip.skeleton.joints.iter().zip(&places) {
                let Some((_, known)) = BODY.iter().find(|(name, _)| *name == joint.name) else { continue };
                let off = (place - nalgebra::Point3::from(*known)).norm();
                assert!(off < 0.1, "{} is {off:.3} m off", joint.name);
            }
        }
    }

    #[test]
    fn a_collinear_trunk_has_its_own_message() {
        let text = file(|[x, _, z]| [x, 0.0, z]);
        let message = parse_markers(text.as_bytes(), "a.trc", &ReadOptions::default()).unwrap_err().to_string();
        assert!(message.contains("are collinear in frame 1 (from 1)") && !message.contains("marker_map"), "{message}");
    }

    #[test]
    fn points_at_zero_are_interpolated_and_counted() {
        let text = file(|place| place);
        let last = text.lines().last().unwrap();
        let text = format!("{text}{}\n{last}\n", last.replace("\t0.02\t0.09\t0.5", "\t0\t0\t0"));
        let clip = parse_markers(text.as_bytes(), "a.trc", &ReadOptions::default()).unwrap();
        let knee = clip.skeleton.joints.iter().position(|joint| joint.name == "left_knee").unwrap();
        let [seen, filled] = [1, 2].map(|frame| clip.joint_positions(frame)[knee]);
        assert!((seen - filled).norm() < 1e-9, "{seen} {filled}");
        let notes = clip.notes.join("; ");
        assert!(notes.contains("1 points at exactly 0, 0, 0") && notes.contains("left_knee 1"), "{notes}");
    }
}
