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
        let up = match options.up.or(points.up) {
            Some(up) => up,
            None => guessed_up(&tracks, &mut notes),
        };
        if up == UpAxis::Y {
            let turned = |place: &mut Option<Point3<f64>>| *place = place.map(|p| Point3::new(p.x, -p.z, p.y));
            tracks.values_mut().flatten().for_each(turned);
        }
        Ok(Self { frames: without_gaps(&tracks, &points, options, &mut notes), notes })
    }
}

/// The axis along which the highest points of the body lie farthest above the lowest.
fn guessed_up(tracks: &BTreeMap<&String, Track>, notes: &mut Vec<String>) -> UpAxis {
    let mean = |wanted: &dyn Fn(&str) -> bool| {
        let places = tracks.iter().filter(|(name, _)| wanted(name)).flat_map(|(_, track)| track.iter().flatten());
        let (sum, count) = places.fold((Vector3::zeros(), 0.0), |(sum, count), p| (sum + p.coords, count + 1.0));
        sum / f64::max(count, 1.0)
    };
    let high =
        mean(&|name| ["C7", "CLAV", "thorax", "LSHO", "RSHO", "left_shoulder", "right_shoulder"].contains(&name));
    let low = mean(&|name| name.ends_with("ANK") || name.ends_with("ankle") || name.ends_with("TOE"));
    let up = if (high - low).y > (high - low).z { UpAxis::Y } else { UpAxis::Z };
    notes.push(format!("up axis guessed: {up:?}"));
    up
}

/// Points of every frame, with what was filled in told.
fn without_gaps(
    tracks: &BTreeMap<&String, Track>,
    points: &PointFile,
    options: &ReadOptions,
    notes: &mut Vec<String>,
) -> Vec<BTreeMap<String, Point3<f64>>> {
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
    let (mut gaps, mut guesses) = (Vec::new(), Vec::new());
    for (name, track) in tracks {
        let lost = missing(track);
        if !is_seen(track, count) {
            notes.push(format!("{name} is not seen in {} of {count} frames: left out", lost.frames));
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
    frames
}

fn is_seen(track: &Track, count: usize) -> bool {
    missing(track).frames as f64 <= (1.0 - LEAST_SEEN) * count as f64
}
