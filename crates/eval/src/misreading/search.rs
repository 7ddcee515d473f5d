//! The table of explanations, and the conditions of a hint.

use nalgebra::{Isometry3, Point3, Vector3};

use super::fit::{Evidence, FIRST_ROWS, Pair, Score, common};
use super::{AxisOrder, Correction, FileTime, MisreadingKind, Root, Turn, marker_of_other_side};
use crate::mean;
use skiagraph_core::body::{LANDMARKS, Markers};

/// An estimate as it was read, with the truth.
#[derive(Clone, Debug)]
pub struct MisreadingCase<'a> {
    /// Frames per second; 0 excludes shifts and rates.
    pub frames_per_second: f64,
    /// The true markers, one entry per frame, metres.
    pub truth: &'a [Markers],
    /// The estimate as it was read, per repetition and row.
    pub as_read: Vec<Vec<Markers>>,
    /// The same before the `declared` camera and offset, then read in other ways.
    pub readings: Vec<Reading>,
    /// The camera and the offset by which it was read.
    pub declared: Correction,
    /// The roots of an estimate of poses before the `declared` camera and offset, per repetition and row: only these
    /// depend on the unit, as the body's size is known.
    pub roots: Option<Vec<Vec<Option<Point3<f64>>>>>,
    /// World from camera, one entry per frame, or a single one if cameras are fixed; empty if unknown.
    pub cameras: Vec<Vec<Isometry3<f64>>>,
    /// Factors of lengths for the other known units.
    pub scales: Vec<f64>,
    /// The axes by which the positions were read; those of a camera are the file's.
    pub axes: AxisOrder,
    /// Whether the file's own numbers or times begin at frame 1, as if they counted from 1.
    pub begins_at_one: bool,
}

/// The markers of a file, read in one way: per repetition and row.
#[derive(Clone, Debug)]
pub struct Reading {
    /// The kind of misreading that it corrects; `None` as it was read.
    pub kind: Option<MisreadingKind>,
    /// Per repetition and row.
    pub sequences: Vec<Vec<Markers>>,
}

/// An explanation of most of an estimate's error.
#[derive(Clone, Debug, PartialEq)]
pub struct Misreading {
    /// How the estimate should be read.
    pub correction: Correction,
    /// The kinds of change that the correction contains.
    pub kinds: Vec<MisreadingKind>,
    /// Mean distance of the markers as the estimate was read, metres.
    pub error_as_read_m: f64,
    /// The same after the correction, metres.
    pub error_corrected_m: f64,
    /// Greatest shift that was searched, frames in either direction: the right one may be beyond it.
    pub longest_shift: i64,
}

/// Greatest share of the error that an explanation may leave; of exchanged sides, which nothing else looks like.
const LEFT: f64 = 0.1;
const LEFT_OF_SIDES: f64 = 0.25;
/// A marker that never moves farther is still, metres.
const STILL_M: f64 = 0.001;
/// A larger error is not explained, metres: about half an arm.
const LEFT_M: f64 = 0.25;
/// Greatest share of the error that a turn may leave when the body is moved and scaled to fit.
const LEFT_OF_POSE: f64 = 0.5;
/// Smaller errors need no explanation, metres.
const SMALL_M: f64 = 0.01;
/// Every further part of an explanation must reduce the error by this factor; smaller errors count as equal, metres.
const SIMPLER: f64 = 2.0;
const EQUAL_M: f64 = 0.002;
/// A number that is fitted always explains a little more than one of a list: it counts as a part and this share of one.
const FITTED: f64 = 0.25;
/// Least number of compared rows, and their least share of all.
const FEWEST_ROWS: usize = 3;
const LEAST_SHARE: f64 = 0.2;
/// A body whose pose, aligned in place and size, is farther than this from the true one is turned otherwise, metres.
const POSE_M: f64 = 0.3;
/// Number of best explanations that are combined with names and times.
const FOLLOWED: usize = 4;
/// Greatest share of the error in the first rows that may remain: a tracker starts from a given pose and is lost later,
/// whereas a file is misread from its first row.
const LEFT_AT_FIRST: f64 = 0.3;
/// Least offset of another origin, metres; a calibration error moves the whole body by centimetres only.
const OFFSET_M: f64 = 0.2;
/// Least share of an offset or scale that a camera must see: a tracker with one camera has constant errors of depth.
const SEEN: f64 = 0.5;
/// Factors nearer to 1 are errors of a tracker's body, or of a calibration.
const SCALE: f64 = 1.03;
/// A body that is too large by less than this stays a body: only its path shows that the file has another scale,
const BODY_SCALE: f64 = 1.33;
/// if it is farther than this from the origin, metres.
const AWAY_M: f64 = 0.5;
/// Least turn, radians; a calibration turns by a degree or two.
const TURN: f64 = 0.09;
/// A turn that keeps the vertical must remove an error of the body's path of at least this, metres, to this share: a
/// body that faces the other way or is mirrored in depth can have the same silhouettes.
const PATH_M: f64 = 0.25;
const PATH_LEFT: f64 = 0.2;
/// Least delay that is reported, frames and seconds: filters delay by a frame or two, whereas no tracker is early.
const LATE_FRAMES: f64 = 3.0;
const LATE_S: f64 = 0.05;
/// A filter that delays also smooths: its estimate is the delayed truth plus a share of the truth's second difference
/// over the delay, about 0.2 for a moving average, 0.5 for an exponential one and 0 for a shift, which must have less.
const SMOOTHING: f64 = 0.1;
/// Greatest shift that is searched, seconds; also at most a third of the clip.
const LONGEST_S: f64 = 1.0;
/// A farther shift or rate must be better by this share: gaits repeat.
const FARTHER: f64 = 0.98;
/// Rates are searched in steps of 2 % between a quarter and four times the set's, in clips of at least this length.
const RATE_STEP: f64 = 0.02;
const RATE_STEPS: i32 = 70;
const FRAMES_OF_RATES: usize = 20;
/// Part of the clip in which sides must be exchanged, and right.
const PART: f64 = 0.1;

/// The explanation of most of the error, if one meets every condition (see the module documentation).
pub fn find_misreading(case: &MisreadingCase<'_>) -> Option<Misreading> {
    let evidence = Evidence::new(case);
    let none = case.declared.clone();
    let pairs = evidence.pairs(&none);
    if pairs.len() < FEWEST_ROWS || evidence.score(&none, &pairs).before < SMALL_M {
        return None;
    }
    let mut table = Vec::new();
    for reading in 0..evidence.readings.len() {
        let base = Correction { reading, ..none.clone() };
        let pairs = evidence.pairs(&base);
        match evidence.readings[reading].kind {
            None | Some(MisreadingKind::Sides) => placements(&evidence, &base, &pairs, &mut table),
            _ => add(&evidence, base, &pairs, &mut table),
        }
    }
    if let Some(time) = reversed(&evidence) {
        // the axes of a file in reverse order are found in that order only
        let base = Correction { time, ..none.clone() };
        placements(&evidence, &base, &evidence.pairs(&base), &mut table);
    }
    table.sort_by(|one, other| one.0.after.total_cmp(&other.0.after));
    let is_plain = |correction: &Correction| {
        evidence.origins().contains(&correction.offset) && !matches!(correction.turn, Turn::Free(_))
    };
    let followed = table.iter().map(|(_, correction)| correction).filter(|one| is_plain(one)).take(FOLLOWED).cloned();
    let sides = (0..evidence.readings.len()).filter(|at| evidence.readings[*at].kind == Some(MisreadingKind::Sides));
    let plain = sides.map(|reading| Correction { reading, ..none.clone() }).chain([none.clone()]);
    for base in followed.chain(plain).collect::<Vec<_>>() {
        let named = names(&evidence, &base).map(|names| Correction { names, ..base.clone() });
        for one in [Some(base), named].into_iter().flatten() {
            let pairs = evidence.pairs(&one);
            add(&evidence, one.clone(), &pairs, &mut table);
            times(&evidence, &one, &pairs, &mut table);
        }
    }
    sides_in_part(&evidence, &mut table);
    let accepted = table.iter().filter(|(score, _)| score.after <= LEFT_OF_SIDES * score.before);
    let accepted = accepted.filter_map(|(score, correction)| judge(&evidence, correction, *score));
    accepted.min_by(|one, other| cost(one).total_cmp(&cost(other)))
}

/// Whether an explanation would put a body that never moves onto the path of the truth. With the truth's own root, or
/// in a unit so small that all places of the root are one, it always fits.
fn moves_what_is_stuck(case: &MisreadingCase<'_>, kinds: &[MisreadingKind]) -> bool {
    use MisreadingKind::{Differences, Rate, Relative, Reversed, Shift, Units};
    let of_motion = |kind: &MisreadingKind| match kind {
        Units => case.roots.is_some(),
        kind => [Differences, Rate, Relative, Reversed, Shift].contains(kind),
    };
    kinds.iter().any(of_motion) && case.as_read.iter().all(|rows| is_still(rows)) && !is_still(case.truth)
}

fn is_still(rows: &[Markers]) -> bool {
    let first = rows.iter().find(|row| row.iter().any(Option::is_some));
    let is_near = |row: &Markers, first| common(row, first).all(|(_, here, there)| (here - there).norm() < STILL_M);
    first.is_none_or(|first| rows.iter().all(|row| is_near(row, first)))
}

type Table = Vec<(Score, Correction)>;

fn add(evidence: &Evidence<'_>, correction: Correction, pairs: &[Pair], table: &mut Table) {
    table.push((evidence.score(&correction, pairs), correction));
}

fn cost(found: &Misreading) -> f64 {
    let weight = |kind: &MisreadingKind| match kind {
        MisreadingKind::Names => 2.0,
        MisreadingKind::Turn if matches!(found.correction.turn, Turn::Free(_)) => 2.0 + FITTED,
        MisreadingKind::Turn | MisreadingKind::Scale => 1.0 + FITTED,
        _ => 1.0,
    };
    found.error_corrected_m.max(EQUAL_M) * SIMPLER.powf(found.kinds.iter().map(weight).sum())
}

/// All turns, roots, scales and origins in which the body has about its true pose.
fn placements(evidence: &Evidence<'_>, base: &Correction, pairs: &[Pair], table: &mut Table) {
    let most = POSE_M.min(LEFT_OF_POSE * evidence.score(base, pairs).before);
    let cameras = evidence.case.cameras.first().map_or(0, Vec::len);
    let of_cameras = (0..cameras).flat_map(|index| [false, true].map(|opengl| Turn::Camera { index, opengl }));
    let mut turns: Vec<Turn> = AxisOrder::all().into_iter().map(Turn::Axes).chain(of_cameras).collect();
    turns.extend(evidence.turns(&Correction { turn: Turn::NONE, offset: Vector3::zeros(), ..base.clone() }, pairs));
    turns.retain(|turn| evidence.pose_error(&Correction { turn: *turn, ..base.clone() }, pairs) <= most);
    let units: Vec<f64> = std::iter::once(1.0).chain(evidence.units(pairs)).collect();
    let roots: Vec<Option<Root>> = std::iter::once(None).chain(Root::ALL.map(Some)).collect();
    for turn in turns {
        for (unit, root) in units.iter().flat_map(|unit| roots.iter().map(|root| (*unit, *root))) {
            let turned = Correction { turn, root, scale: unit, offset: Vector3::zeros(), ..base.clone() };
            if matches!(turn, Turn::Axes(_))
                && unit == 1.0
                && evidence.case.roots.is_none()
                && let Some(scale) = evidence.scale(&turned, pairs)
            {
                add(evidence, Correction { scale, ..turned.clone() }, pairs, table);
            }
            // a mirrored body elsewhere is one mirrored in depth
            if root.is_none() && !turn.is_mirrored() && !matches!(turn, Turn::Camera { .. }) {
                let offset = evidence.offset(&turned, pairs);
                add(evidence, Correction { offset, ..turned.clone() }, pairs, table);
            }
            let origins = match turn {
                // a camera has its own place
                Turn::Camera { .. } => vec![Vector3::zeros()],
                Turn::Free(_) => Vec::new(),
                _ if root.is_some() => vec![base.offset],
                _ => evidence.origins(),
            };
            for offset in origins {
                add(evidence, Correction { offset, ..turned.clone() }, pairs, table);
            }
        }
    }
}

/// The names under which every marker is the nearest to the truth of one marker; `None` if they are right or that is
/// ambiguous.
fn names(evidence: &Evidence<'_>, base: &Correction) -> Option<[usize; LANDMARKS.len()]> {
    let pairs = evidence.pairs(base);
    let placed: Vec<(Markers, Markers)> =
        pairs.iter().filter_map(|pair| Some((pair.truth, evidence.placed(base, pair)?))).collect();
    let cost = |marker: usize, other: usize| {
        let apart = placed.iter().filter_map(|(truth, found)| Some((truth[marker]? - found[other]?).norm()));
        let apart: Vec<f64> = apart.collect();
        // most rows must have both
        mean(&apart).filter(|_| 2 * apart.len() > placed.len())
    };
    let mut names = base.names;
    let mut taken = [false; LANDMARKS.len()];
    for (marker, name) in names.iter_mut().enumerate() {
        let costs = (0..LANDMARKS.len()).filter_map(|other| Some((cost(marker, other)?, other)));
        let Some((_, nearest)) = costs.min_by(|one, other| one.0.total_cmp(&other.0)) else { continue };
        if std::mem::replace(&mut taken[nearest], true) {
            return None;
        }
        *name = nearest;
    }
    let is_of_sides = (0..LANDMARKS.len()).all(|marker| names[marker] == marker_of_other_side(marker));
    (names != base.names && !is_of_sides).then_some(names)
}

/// The best shift, the best rate, and the reverse order, if the pose is about that of some time.
fn times(evidence: &Evidence<'_>, base: &Correction, pairs: &[Pair], table: &mut Table) {
    if evidence.case.frames_per_second <= 0.0 || evidence.pose_error(base, pairs) > POSE_M {
        return;
    }
    let error = |time: FileTime| {
        let correction = Correction { time, ..base.clone() };
        evidence.score(&correction, &evidence.few_pairs(&correction)).after
    };
    let nearest = |times: &mut dyn Iterator<Item = FileTime>| {
        let mut best = (f64::INFINITY, FileTime::SAME);
        for time in times {
            let error = error(time);
            if error < FARTHER * best.0 {
                best = (error, time);
            }
        }
        best.1
    };
    let shifts = (1..=reach(evidence)).flat_map(|frames| [frames, -frames]);
    let mut found = vec![nearest(&mut std::iter::once(0).chain(shifts).map(FileTime::shifted))];
    if evidence.case.begins_at_one {
        found.push(FileTime::shifted(-1));
    }
    let frames = evidence.case.truth.len();
    if frames >= FRAMES_OF_RATES {
        found.extend(reversed(evidence));
        let rate = |logarithm: f64| FileTime { first: 0.0, step: logarithm.exp() };
        let coarse = (-RATE_STEPS..=RATE_STEPS).filter(|step| *step != 0).map(|step| RATE_STEP * f64::from(step));
        let middle = nearest(&mut coarse.map(rate)).step.ln();
        let fine = (-20..=20).map(|step| middle + RATE_STEP * f64::from(step) / 20.0);
        found.push(nearest(&mut fine.map(rate)));
    }
    for time in found {
        let correction = Correction { time, ..base.clone() };
        let pairs = evidence.pairs(&correction);
        add(evidence, correction, &pairs, table);
    }
}

/// The reverse order of the rows, in clips that are long enough to tell it.
fn reversed(evidence: &Evidence<'_>) -> Option<FileTime> {
    let (frames, rate) = (evidence.case.truth.len(), evidence.case.frames_per_second);
    (frames >= FRAMES_OF_RATES && rate > 0.0).then(|| FileTime { first: (frames - 1) as f64, step: -1.0 })
}

fn reach(evidence: &Evidence<'_>) -> i64 {
    let longest = LONGEST_S * evidence.case.frames_per_second;
    (longest.min(1e6) as i64).min(evidence.case.truth.len() as i64 / 3)
}

/// Sides that are exchanged from a row on, or up to it.
fn sides_in_part(evidence: &Evidence<'_>, table: &mut Table) {
    let Some(reading) = evidence.readings.iter().position(|one| one.kind == Some(MisreadingKind::Sides)) else {
        return;
    };
    let rows = evidence.case.truth.len();
    let sums = [0, reading].map(|reading| {
        let correction = Correction { reading, ..evidence.case.declared.clone() };
        let pairs = evidence.all_pairs(&correction);
        let mut errors = vec![0.0; rows];
        evidence.errors(&correction, &pairs).iter().for_each(|(pair, error)| errors[pair.row] += error);
        errors
    });
    let [mut as_read, mut exchanged] = sums.clone().map(|errors| errors.iter().sum::<f64>());
    let (mut until, mut from) = ((f64::INFINITY, 0), (f64::INFINITY, 0));
    // with the rows before `row` in one way and the others in the other
    let (mut before_as_read, mut before_exchanged) = (0.0, 0.0);
    for (row, (error_as_read, error_exchanged)) in sums[0].iter().zip(&sums[1]).enumerate() {
        if before_exchanged + as_read < until.0 {
            until = (before_exchanged + as_read, row);
        }
        if before_as_read + exchanged < from.0 {
            from = (before_as_read + exchanged, row);
        }
        before_as_read += error_as_read;
        before_exchanged += error_exchanged;
        as_read -= error_as_read;
        exchanged -= error_exchanged;
    }
    let part = (PART * rows as f64) as usize + 1;
    for (row, range) in [(until.1, 0..until.1), (from.1, from.1..usize::MAX)] {
        if (part..rows.saturating_sub(part)).contains(&row) {
            let correction = Correction { reading, rows: range, ..evidence.case.declared.clone() };
            let pairs = evidence.pairs(&correction);
            add(evidence, correction, &pairs, table);
        }
    }
}

/// The explanation with its errors, if it meets every condition.
fn judge(evidence: &Evidence<'_>, correction: &Correction, Score { before, after }: Score) -> Option<Misreading> {
    let kinds = evidence.kinds(correction);
    let most = if kinds == [MisreadingKind::Sides] { LEFT_OF_SIDES } else { LEFT };
    if kinds.is_empty() || after > most * before || after > LEFT_M || moves_what_is_stuck(evidence.case, &kinds) {
        return None;
    }
    let pairs = evidence.pairs(correction);
    let rows = evidence.pairs(&evidence.case.declared).len();
    let is_met = pairs.len() as f64 >= LEAST_SHARE * rows as f64
        && pairs.len() >= FEWEST_ROWS
        && is_shift(evidence, correction, &pairs)
        && is_from_the_first_row(evidence, correction, &kinds, &pairs)
        && corrects_path(evidence, correction, &pairs)
        && is_another_origin(evidence, correction, &pairs)
        && is_another_scale(evidence, correction, &kinds, &pairs);
    is_met.then(|| Misreading {
        correction: correction.clone(),
        kinds,
        error_as_read_m: before,
        error_corrected_m: after,
        longest_shift: reach(evidence),
    })
}

/// Explanations whose effect grows along the clip, or that apply to a part of it, are not judged by its beginning.
fn is_from_the_first_row(
    evidence: &Evidence<'_>,
    correction: &Correction,
    kinds: &[MisreadingKind],
    pairs: &[Pair],
) -> bool {
    let is_of_later = |kind: &MisreadingKind| {
        matches!(kind, MisreadingKind::Shift | MisreadingKind::Rate | MisreadingKind::SidesInPart)
    };
    let (mut before, mut after) = (0.0, 0.0);
    for (pair, error) in evidence.errors(correction, pairs).iter().filter(|(pair, _)| pair.row <= FIRST_ROWS) {
        before += pair.as_read;
        after += error;
    }
    kinds.iter().any(is_of_later) || after <= LEFT_AT_FIRST * before
}

/// Whether a turn or mirror that keeps the vertical corrects the path of the body: its position, or its motion if the
/// origin differs.
fn corrects_path(evidence: &Evidence<'_>, correction: &Correction, pairs: &[Pair]) -> bool {
    let declared = &evidence.case.declared;
    let is_small = match correction.turn {
        turn if turn == declared.turn => return true,
        Turn::Axes(AxisOrder::SAME) | Turn::Camera { .. } => return true,
        Turn::Axes(order) if !order.keeps_vertical() => return true,
        Turn::Axes(_) => false,
        Turn::Vertical(angle) => angle.abs() < TURN,
        Turn::Free(rotation) => rotation.angle() < TURN,
    };
    let path = |correction: &Correction| {
        let pairs = evidence.centroids(correction, pairs);
        let middle = match evidence.origins().contains(&correction.offset) {
            true => Vector3::zeros(),
            false => pairs.iter().map(|[truth, found]| truth - found).sum::<Vector3<f64>>() / pairs.len().max(1) as f64,
        };
        mean(&pairs.iter().map(|[truth, found]| (truth - found - middle).norm()).collect::<Vec<_>>()).unwrap_or(0.0)
    };
    let before = path(&Correction { turn: declared.turn, ..correction.clone() });
    !is_small && before >= PATH_M && path(correction) <= PATH_LEFT * before
}

/// Whether an offset is too large for a calibration error and is not an error of depth, from the file's own origin and
/// from the declared one. If axes or unit are wrong too, the offset is the file's.
fn is_another_origin(evidence: &Evidence<'_>, correction: &Correction, pairs: &[Pair]) -> bool {
    let is_of_file = correction.turn != evidence.case.declared.turn || correction.scale != 1.0;
    let is_far = |moved: Vector3<f64>| {
        moved.norm() >= OFFSET_M && (is_of_file || evidence.seen(&moved, pairs) * moved.norm() >= OFFSET_M)
    };
    let origins = evidence.origins();
    origins.contains(&correction.offset) || origins.iter().all(|origin| is_far(correction.offset - origin))
}

/// Whether a factor that is no unit is one of the file: bodies of trackers have other sizes too.
fn is_another_scale(
    evidence: &Evidence<'_>,
    correction: &Correction,
    kinds: &[MisreadingKind],
    pairs: &[Pair],
) -> bool {
    if !kinds.contains(&MisreadingKind::Scale) {
        return true;
    }
    let scale = correction.scale;
    let factor = scale.max(1.0 / scale);
    let places = evidence.centroids(correction, pairs);
    let middle = places.iter().map(|[truth, _]| truth).sum::<Vector3<f64>>() / places.len().max(1) as f64;
    let is_away = correction.root.is_none() && middle.xy().norm() >= AWAY_M;
    factor >= SCALE && (factor >= BODY_SCALE || is_away && evidence.seen(&middle, pairs) >= SEEN)
}

/// Whether a delay is longer than a filter's, or that of numbers that count from 1, and without a filter's smoothing.
/// True of other explanations.
fn is_shift(evidence: &Evidence<'_>, correction: &Correction, pairs: &[Pair]) -> bool {
    let late = -correction.time.first;
    if correction.time.kind() != Some(MisreadingKind::Shift) || late < 0.0 {
        return true;
    }
    let (mut both, mut square) = (0.0, 0.0);
    for pair in pairs {
        let ends = [pair.frame - late, pair.frame + late].map(|frame| evidence.truth_at(frame));
        let ([Some(before), Some(after)], Some(found)) = (ends, evidence.placed(correction, pair)) else { continue };
        for (marker, there, found) in common(&pair.truth, &found) {
            let [Some(before), Some(after)] = [before[marker], after[marker]] else { continue };
            let bend = (before - there) + (after - there);
            both += bend.dot(&(found - there));
            square += bend.norm_squared();
        }
    }
    let is_long = late >= LATE_FRAMES && late >= LATE_S * evidence.case.frames_per_second;
    let counts_from_one =
        evidence.case.begins_at_one && late == 1.0 && evidence.kinds(correction) == [MisreadingKind::Shift];
    (is_long || counts_from_one) && square > 0.0 && both / square < SMOOTHING
}
