//! Points of a file in metres, Z up, without gaps, by the names of markers.

use std::collections::BTreeMap;

use nalgebra::{Point3, Vector3};

use super::gaps::{Track, filled, missing};
use super::names::KnownPoints;
use super::{PointFile, malformed};
use crate::mocap::{MocapError, ReadOptions, UpAxis};

/// A point that is seen in a smaller share of the frames is left out.
const LEAST_SEEN: f64 = 0.5;

/// A gap longer than this is a guess, seconds.
const LONG_GAP: f64 = 0.25;

/// Farthest that a point may be, metres.
const FARTHEST: f64 = 1e4;

/// Points that move with the trunk.
const TRUNK: [&str; 12] =
    ["LASI", "RASI", "LPSI", "RPSI", "SACR", "C7", "CLAV", "thorax", "pelvis", "left_hip", "right_hip", "STRN"];

/// Points of every frame, metres, Z up.
pub(super) struct Placed {
    pub(super) frames: Vec<BTreeMap<String, Point3<f64>>>,
    pub(super) notes: Vec<String>,
    /// Points that are left out for they are seldom seen, in words.
    pub(super) seldom: Vec<String>,
}

impl Placed {
    pub(super) fn of(
        file: &str,
        points: PointFile,
        known: &KnownPoints,
        options: &ReadOptions,
    ) -> Result<Self, MocapError> {
        let mut notes = points.notes.clone();
        let metres = options.metres_per_unit.or(points.metres_per_unit);
        let metres = metres.ok_or_else(|| malformed(file, "it does not say its unit; set `metres_per_unit`"))?;
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
        if let Some(far) = places.find(|place| !place.iter().all(|c| c.abs() <= FARTHEST)) {
            let found = far.coords.amax();
            let detail = format!("a point {found:.3e} m away; expected {FARTHEST} at most: is the unit right?");
            return Err(malformed(file, detail));
        }
        let up = match (options.up, points.up) {
            (Some(up), _) => up,
            (None, Some(usual)) if points.up_is_usual => confirmed_up(&tracks, usual, &mut notes),
            (None, Some(up)) => up,
            (None, None) => guessed_up(&tracks, &mut notes),
        };
        if up == UpAxis::Y {
            let turned = |place: &mut Option<Point3<f64>>| *place = place.map(|p| Point3::new(p.x, -p.z, p.y));
            tracks.values_mut().flatten().for_each(turned);
        }
        let (frames, seldom) = without_gaps(&tracks, &points, options, &mut notes);
        Ok(Self { frames, notes, seldom })
    }
}

/// Floors are usually at 0, metres.
const NEAR_FLOOR: f64 = 0.2;

/// The format's usual axis, or the other one where the body stands along that: a note says why. A body that lies on the
/// floor of the usual axis does not stand along the other.
fn confirmed_up(tracks: &BTreeMap<&String, Track>, usual: UpAxis, notes: &mut Vec<String>) -> UpAxis {
    let rise = rise(tracks);
    let (along_usual, along_other, other) = match usual {
        UpAxis::Y => (rise.y, rise.z, UpAxis::Z),
        UpAxis::Z => (rise.z, rise.y, UpAxis::Y),
    };
    let is_on_floor = |axis: UpAxis| lowest(tracks, axis).abs() <= NEAR_FLOOR;
    let stands = along_other > along_usual && (is_on_floor(other) || !is_on_floor(usual));
    let up = if stands { other } else { usual };
    let why = if stands { "although TRC files usually have" } else { "as TRC files usually have it, not" };
    let unused = if stands { usual } else { other };
    notes.push(format!(
        "up axis: {up:?}, {why} {unused:?}: the shoulders lie {along_usual:.2} m above the feet along {usual:?} and \
         {along_other:.2} m along {other:?}; `up` sets another"
    ));
    up
}

/// Where the lowest point is along an axis in the middle one of the frames, metres.
fn lowest(tracks: &BTreeMap<&String, Track>, axis: UpAxis) -> f64 {
    let frames = tracks.values().map(Vec::len).max().unwrap_or(0);
    let of = |frame: usize| {
        let places = tracks.values().filter_map(|track| track.get(frame).copied().flatten());
        places.map(|place| if axis == UpAxis::Y { place.y } else { place.z }).min_by(f64::total_cmp)
    };
    let mut lowest: Vec<f64> = (0..frames).filter_map(of).collect();
    lowest.sort_by(f64::total_cmp);
    lowest.get(lowest.len() / 2).copied().unwrap_or(0.0)
}

/// The axis along which the highest points of the body lie farthest above the lowest.
fn guessed_up(tracks: &BTreeMap<&String, Track>, notes: &mut Vec<String>) -> UpAxis {
    let rise = rise(tracks);
    let up = if rise.y > rise.z { UpAxis::Y } else { UpAxis::Z };
    notes.push(format!("up axis guessed: {up:?}"));
    up
}

/// From the mean of the feet to the mean of the shoulders, metres.
fn rise(tracks: &BTreeMap<&String, Track>) -> Vector3<f64> {
    let mean = |wanted: &dyn Fn(&str) -> bool| {
        let places = tracks.iter().filter(|(name, _)| wanted(name)).flat_map(|(_, track)| track.iter().flatten());
        let (sum, count) = places.fold((Vector3::zeros(), 0.0), |(sum, count), p| (sum + p.coords, count + 1.0));
        sum / f64::max(count, 1.0)
    };
    let high =
        mean(&|name| ["C7", "CLAV", "thorax", "LSHO", "RSHO", "left_shoulder", "right_shoulder"].contains(&name));
    let low = mean(&|name| name.ends_with("ANK") || name.ends_with("ankle") || name.ends_with("TOE"));
    high - low
}

/// Points of every frame, with what was filled in told, and what is left out.
fn without_gaps(
    tracks: &BTreeMap<&String, Track>,
    points: &PointFile,
    options: &ReadOptions,
    notes: &mut Vec<String>,
) -> (Vec<BTreeMap<String, Point3<f64>>>, Vec<String>) {
    let count = points.frames.len();
    let rate = options.frames_per_second.or(points.frames_per_second).unwrap_or(1.0);
    let still = vec![Vector3::zeros(); count];
    let trunk: Vec<Vec<Point3<f64>>> = tracks
        .iter()
        .filter(|(name, track)| TRUNK.contains(&name.as_str()) && is_seen(track, count))
        .filter_map(|(_, track)| filled(track, &still))
        .collect();
    let reference: Vec<Vector3<f64>> = (0..count)
        .map(|frame| trunk.iter().map(|own| own[frame].coords).sum::<Vector3<f64>>() / trunk.len().max(1) as f64)
        .collect();
    let mut frames = vec![BTreeMap::new(); count];
    let (mut gaps, mut guesses, mut seldom) = (Vec::new(), Vec::new(), Vec::new());
    for (name, track) in tracks {
        let lost = missing(track);
        if !is_seen(track, count) {
            notes.push(format!("{name} is not seen in {} of {count} frames: left out", lost.frames));
            seldom.push(format!("`{name}` is seen in {} of {count} frames", count - lost.frames));
            continue;
        }
        if lost.frames > 0 {
            let entry = format!("{name} {} (at most {} in a row)", lost.frames, lost.longest);
            if lost.longest as f64 > LONG_GAP * rate { guesses.push(entry) } else { gaps.push(entry) }
        }
        for (frame, place) in frames.iter_mut().zip(filled(track, &reference).into_iter().flatten()) {
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

fn is_seen(track: &Track, count: usize) -> bool {
    missing(track).frames as f64 <= (1.0 - LEAST_SEEN) * count as f64
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

    /// Two frames of it with its coordinates as `place` writes them.
    fn file(place: impl Fn([f64; 3]) -> [f64; 3]) -> String {
        let names: String = BODY.iter().map(|(name, _)| format!("\t{name}\t\t")).collect();
        let row: String = BODY.iter().flat_map(|(_, at)| place(*at)).map(|c| format!("\t{c}")).collect();
        format!(
            "PathFileType\t4\t(X/Y/Z)\ta.trc\nDataRate\tUnits\n60\tm\nFrame#\tTime{names}\n\t\tX1\n\n\
             1\t0.0{row}\n2\t0.1{row}\n"
        )
    }

    /// Height of the head above the pelvis, and what is said of the axis.
    fn read(text: &str, up: Option<UpAxis>) -> (f64, String) {
        let options = ReadOptions { up, ..ReadOptions::default() };
        let clip = parse_markers(text.as_bytes(), "a.trc", &options).unwrap();
        let places = clip.joint_positions(0);
        let of = |name: &str| clip.skeleton.joints.iter().position(|joint| joint.name == name).unwrap();
        (places[of("neck")].z - places[of("pelvis")].z, clip.notes.join("; "))
    }

    /// Files with Z up were laid on their side.
    #[test]
    fn a_body_that_stands_along_z_has_z_up_and_one_that_lies_has_not() {
        let (height, notes) = read(&file(|[x, y, z]| [x + 2.0, y + 3.0, z]), None);
        assert!(height > 0.4 && notes.contains("up axis: Z, although TRC files usually have Y"), "{height} {notes}");
        let (height, notes) = read(&file(|[x, y, z]| [x + 2.0, z, 3.0 - y]), None);
        assert!(height > 0.4 && notes.contains("up axis: Y, as TRC files usually have it"), "{height} {notes}");
        // on its back, the head away: along Z it is long, but the floor is that of Y
        let (height, notes) = read(&file(|[x, y, z]| [-y, x + 0.1, z + 2.0]), None);
        assert!(height.abs() < 0.1 && notes.contains("up axis: Y"), "{height} {notes}");
        let (height, notes) = read(&file(|[x, y, z]| [-y, x + 0.1, z + 2.0]), Some(UpAxis::Z));
        assert!(height > 0.4 && !notes.contains("up axis"), "{height} {notes}");
    }

    /// The reason was in a note, which an error does not show.
    #[test]
    fn a_point_that_is_seldom_seen_is_told_where_it_is_needed() {
        let text = file(|place| place);
        let without_knee = text.lines().last().unwrap().replace("\t0.02\t0.09\t0.5", "\t\t\t");
        let text = format!("{text}{without_knee}\n{without_knee}\n{without_knee}\n");
        let told = parse_markers(text.as_bytes(), "a.trc", &ReadOptions::default()).unwrap_err().to_string();
        assert!(told.contains("`left_knee` is seen in 2 of 5 frames, expected at least half;"), "{told}");
        assert!(told.contains("do not tell left_knee (frame 1"), "{told}");
    }

    /// The message had words in place of a key of `marker_map`.
    #[test]
    fn a_flat_trunk_has_a_message_of_its_own() {
        let text = file(|[x, _, z]| [x, 0.0, z]);
        let told = parse_markers(text.as_bytes(), "a.trc", &ReadOptions::default()).unwrap_err().to_string();
        assert!(told.contains("lie on one line in frame 1 (from 1)") && !told.contains("marker_map"), "{told}");
    }

    /// Missing points are often written as zeros.
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
        assert!(notes.contains("exactly 0, 0, 0: 1 points") && notes.contains("left_knee 1"), "{notes}");
    }
}
