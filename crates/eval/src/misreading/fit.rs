//! Pairs of truth and estimate, read with a correction, and the turns, scales and origins that fit them.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Vector3};

use super::{Correction, MisreadingCase, MisreadingKind, Reading, Turn};
use crate::{mean, quantile};
use skiagraph_core::body::Markers;

/// Greatest number of rows that a search uses.
const MOST_ROWS: usize = 60;
/// Rows at the beginning that are all used, from row 1: the pose of frame 0 is given.
pub(super) const FIRST_ROWS: usize = 3;
/// Frames with fewer common markers do not determine axes and sizes.
const FEWEST_MARKERS: usize = 3;
/// A unit is assumed if it explains the body's size to within this factor.
const NEARLY: f64 = 1.3;

/// A row of one repetition with the truth that it shows.
pub(super) struct Pair {
    sequence: usize,
    pub(super) row: usize,
    /// The set's frame that the row shows.
    pub(super) frame: f64,
    pub(super) truth: Markers,
    given: Markers,
    root: Option<Point3<f64>>,
    /// Mean distance as read, metres.
    pub(super) as_read: f64,
}

/// Mean errors over rows, metres: medians over repetitions, so that a few lost ones do not decide.
#[derive(Clone, Copy, Debug)]
pub(super) struct Score {
    pub(super) before: f64,
    pub(super) after: f64,
}

/// The readings of a case and the rows that are compared.
pub(super) struct Evidence<'a> {
    pub(super) case: &'a MisreadingCase<'a>,
    pub(super) readings: Vec<Reading>,
    rows: Vec<usize>,
}

/// Pairs of truth and estimate of the markers that both have.
pub(super) fn common<'a>(
    one: &'a Markers,
    other: &'a Markers,
) -> impl Iterator<Item = (usize, Point3<f64>, Point3<f64>)> + 'a {
    let both = one.iter().zip(other).enumerate();
    both.filter_map(|(marker, (one, other))| Some((marker, (*one)?, (*other)?)))
}

/// Mean distance of the markers, metres.
pub(super) fn distance(one: &Markers, other: &Markers) -> Option<f64> {
    mean(&common(one, other).map(|(_, a, b)| (a - b).norm()).collect::<Vec<f64>>())
}

fn centroid(points: &[Point3<f64>]) -> Vector3<f64> {
    points.iter().map(|point| point.coords).sum::<Vector3<f64>>() / points.len().max(1) as f64
}

/// Root of the sum of squared distances from the middle.
fn spread(points: &[Point3<f64>]) -> f64 {
    let middle = centroid(points);
    points.iter().map(|point| (point.coords - middle).norm_squared()).sum::<f64>().sqrt()
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    quantile(&values, 0.5)
}

impl<'a> Evidence<'a> {
    pub(super) fn new(case: &'a MisreadingCase<'a>) -> Self {
        let mut readings = case.readings.clone();
        readings.extend(case.readings.first().map(|given| Reading {
            kind: Some(MisreadingKind::Differences),
            sequences: given.sequences.iter().map(|sequence| summed(case.truth, sequence)).collect(),
        }));
        let later = FIRST_ROWS + 1..case.truth.len();
        let step = later.len().div_ceil(MOST_ROWS).max(1);
        let rows = (1..case.truth.len().min(FIRST_ROWS + 1)).chain(later.step_by(step)).collect();
        Self { case, readings, rows }
    }

    /// The pairs of the sampled rows.
    pub(super) fn pairs(&self, correction: &Correction) -> Vec<Pair> {
        self.pairs_of(correction, &self.rows)
    }

    /// The pairs of a third of the sampled rows, for times, of which many are tried.
    pub(super) fn few_pairs(&self, correction: &Correction) -> Vec<Pair> {
        self.pairs_of(correction, &self.rows.iter().copied().step_by(3).collect::<Vec<_>>())
    }

    pub(super) fn all_pairs(&self, correction: &Correction) -> Vec<Pair> {
        self.pairs_of(correction, &(1..self.case.truth.len()).collect::<Vec<_>>())
    }

    fn pairs_of(&self, correction: &Correction, rows: &[usize]) -> Vec<Pair> {
        let sequences = self.readings.first().map_or(0, |given| given.sequences.len());
        let pair = |sequence: usize, row: usize| {
            let as_given = self.case.as_read.get(sequence)?.get(row)?;
            let reading = if correction.rows.contains(&row) { correction.reading } else { 0 };
            let read = self.readings[reading].sequences[sequence].get(row)?;
            let given = correction.names.map(|name| read[name]);
            let frame = correction.time.at(row);
            let truth = self.truth_at(frame)?;
            let root = self.case.roots.as_ref().and_then(|roots| roots.get(sequence)?.get(row).copied().flatten());
            let as_read = distance(self.case.truth.get(row)?, as_given)?;
            let is_enough = common(&truth, &given).count() >= FEWEST_MARKERS;
            is_enough.then_some(Pair { sequence, row, frame, truth, given, root, as_read })
        };
        (0..sequences).flat_map(|sequence| rows.iter().filter_map(move |row| pair(sequence, *row))).collect()
    }

    /// The true markers between two frames; `None` outside the set.
    pub(super) fn truth_at(&self, frame: f64) -> Option<Markers> {
        let last = self.case.truth.len().checked_sub(1)? as f64;
        if !(0.0..=last).contains(&frame) {
            return None;
        }
        let (one, next) = (self.case.truth[frame as usize], self.case.truth[frame.ceil() as usize]);
        Some(std::array::from_fn(|marker| Some(one[marker]?.lerp(&next[marker]?, frame.fract()))))
    }

    fn cameras(&self, pair: &Pair) -> &[Isometry3<f64>] {
        let cameras = &self.case.cameras;
        cameras.get(pair.frame as usize).or(cameras.last()).map_or(&[], Vec::as_slice)
    }

    pub(super) fn placed(&self, correction: &Correction, pair: &Pair) -> Option<Markers> {
        let cameras = self.cameras(pair);
        let mut matrix = correction.turn.matrix(cameras);
        if matches!(correction.turn, Turn::Camera { .. }) {
            matrix *= self.case.axes.set_from_file().transpose();
        }
        let origin = match correction.root {
            Some(root) => root.of(&pair.truth, &pair.given)?,
            None => correction.turn.origin(cameras) + correction.offset,
        };
        let place = |point: Point3<f64>| {
            let scaled = match pair.root {
                // the size of a body of poses is known: the unit is that of its root
                Some(root) => point.coords + (correction.scale - 1.0) * root.coords,
                None => correction.scale * point.coords,
            };
            Point3::from(matrix * scaled + origin)
        };
        Some(pair.given.map(|marker| marker.map(place)))
    }

    /// Errors of every pair before and after a correction.
    pub(super) fn errors<'p>(&self, correction: &Correction, pairs: &'p [Pair]) -> Vec<(&'p Pair, f64)> {
        let error = |pair: &'p Pair| Some((pair, distance(&pair.truth, &self.placed(correction, pair)?)?));
        pairs.iter().filter_map(error).collect()
    }

    pub(super) fn score(&self, correction: &Correction, pairs: &[Pair]) -> Score {
        let mut repetitions: BTreeMap<usize, [Vec<f64>; 2]> = BTreeMap::new();
        for (pair, after) in self.errors(correction, pairs) {
            let [before, corrected] = repetitions.entry(pair.sequence).or_default();
            before.push(pair.as_read);
            corrected.push(after);
        }
        let over = |which: usize| median(repetitions.values().filter_map(|errors| mean(&errors[which])).collect());
        Score { before: over(0).unwrap_or(0.0), after: over(1).unwrap_or(f64::INFINITY) }
    }

    pub(super) fn centroids(&self, correction: &Correction, pairs: &[Pair]) -> Vec<[Vector3<f64>; 2]> {
        let of = |pair: &Pair| {
            let placed = self.placed(correction, pair)?;
            let (truth, found): (Vec<_>, Vec<_>) = common(&pair.truth, &placed).map(|(_, a, b)| (a, b)).unzip();
            Some([centroid(&truth), centroid(&found)])
        };
        pairs.iter().filter_map(of).collect()
    }

    /// The offset that brings the estimate nearest to the truth: the median of each coordinate.
    pub(super) fn offset(&self, correction: &Correction, pairs: &[Pair]) -> Vector3<f64> {
        let apart: Vec<Vector3<f64>> =
            self.centroids(correction, pairs).iter().map(|[truth, found]| truth - found).collect();
        let along = |axis: usize| median(apart.iter().map(|apart| apart[axis]).collect()).unwrap_or(0.0);
        correction.offset + Vector3::new(along(0), along(1), along(2))
    }

    /// Mean distance of the markers with the middle and the size of the body of the truth, metres.
    pub(super) fn pose_error(&self, correction: &Correction, pairs: &[Pair]) -> f64 {
        let error = |pair: &Pair| {
            let placed = self.placed(correction, pair)?;
            let (truth, found): (Vec<_>, Vec<_>) = common(&pair.truth, &placed).map(|(_, a, b)| (a, b)).unzip();
            let (middle, ratio) = ([centroid(&truth), centroid(&found)], spread(&truth) / spread(&found));
            let apart =
                truth.iter().zip(&found).map(|(a, b)| ((a.coords - middle[0]) - ratio * (b.coords - middle[1])).norm());
            mean(&apart.collect::<Vec<f64>>())
        };
        median(pairs.iter().filter_map(error).collect()).unwrap_or(f64::INFINITY)
    }

    /// The known unit that explains the size of the body; for poses all of them.
    pub(super) fn units(&self, pairs: &[Pair]) -> Vec<f64> {
        let known = &self.case.scales;
        if self.case.roots.is_some() {
            return known.iter().copied().filter(|scale| *scale != 1.0).collect();
        }
        let ratio = |pair: &Pair| {
            let (truth, found): (Vec<_>, Vec<_>) = common(&pair.truth, &pair.given).map(|(_, a, b)| (a, b)).unzip();
            Some(spread(&truth) / spread(&found)).filter(|ratio| ratio.is_normal())
        };
        let Some(ratio) = median(pairs.iter().filter_map(ratio).collect()) else { return Vec::new() };
        let apart = |scale: f64| (ratio / scale).ln().abs();
        let nearest = known.iter().copied().chain([1.0]).min_by(|a, b| apart(*a).total_cmp(&apart(*b)));
        nearest.filter(|scale| *scale != 1.0 && apart(*scale) < NEARLY.ln()).into_iter().collect()
    }

    /// Points of truth and estimate, corrected, relative to the root of the truth if the estimate is.
    fn points(&self, correction: &Correction, pairs: &[Pair]) -> Vec<[Vector3<f64>; 2]> {
        let mut all = Vec::new();
        for pair in pairs {
            let Some(placed) = self.placed(correction, pair) else { continue };
            let root = correction.root.map_or(Some(Vector3::zeros()), |root| root.of(&pair.truth, &pair.given));
            let Some(root) = root else { continue };
            all.extend(
                common(&pair.truth, &placed).map(|(_, truth, found)| [truth.coords - root, found.coords - root]),
            );
        }
        all
    }

    /// The factor about the origin that fits best.
    pub(super) fn scale(&self, correction: &Correction, pairs: &[Pair]) -> Option<f64> {
        let points = self.points(correction, pairs);
        let along: f64 = points.iter().map(|[truth, found]| truth.dot(found)).sum();
        let square: f64 = points.iter().map(|[_, found]| found.norm_squared()).sum();
        Some(along / square).filter(|scale| scale.is_normal() && *scale > 0.0)
    }

    /// The turns that fit best: about the vertical through the origin, about any vertical, and about any axis.
    pub(super) fn turns(&self, correction: &Correction, pairs: &[Pair]) -> Vec<Turn> {
        let points = self.points(correction, pairs);
        let middle =
            |which: usize| points.iter().map(|pair| pair[which]).sum::<Vector3<f64>>() / points.len().max(1) as f64;
        let (truth, found) = (middle(0), middle(1));
        let mut angles = Vec::new();
        for [truth, found] in [[Vector3::zeros(); 2], [truth, found]] {
            let (mut cross, mut dot) = (0.0, 0.0);
            for [a, b] in &points {
                let (a, b) = (a - truth, b - found);
                cross += b.x * a.y - b.y * a.x;
                dot += a.x * b.x + a.y * b.y;
            }
            angles.push(Turn::Vertical(cross.atan2(dot)));
        }
        let moments: Matrix3<f64> = points.iter().map(|[a, b]| (a - truth) * (b - found).transpose()).sum();
        let svd = moments.svd(true, true);
        if let (Some(u), Some(v)) = (svd.u, svd.v_t) {
            let sign = Vector3::new(1.0, 1.0, (u * v).determinant().signum());
            angles.push(Turn::Free(Rotation3::from_matrix_unchecked(u * Matrix3::from_diagonal(&sign) * v)));
        }
        angles
    }

    /// Greatest share of a move of the true body that a camera sees, because it is across the ray; 1 without cameras.
    pub(super) fn seen(&self, moved: &Vector3<f64>, pairs: &[Pair]) -> f64 {
        let Some(pair) = pairs.get(pairs.len() / 2) else { return 1.0 };
        let body = centroid(&pair.truth.iter().flatten().copied().collect::<Vec<_>>());
        let across = |camera: &Isometry3<f64>| {
            let ray = (body - camera.translation.vector).try_normalize(0.0).unwrap_or_else(Vector3::zeros);
            (moved - ray * ray.dot(moved)).norm() / moved.norm().max(f64::MIN_POSITIVE)
        };
        self.cameras(pair).iter().map(across).reduce(f64::max).unwrap_or(1.0)
    }

    /// The origins that need no fit: of the declared offset, and of the file.
    pub(super) fn origins(&self) -> Vec<Vector3<f64>> {
        let declared = self.case.declared.offset;
        if declared == Vector3::zeros() { vec![declared] } else { vec![declared, Vector3::zeros()] }
    }

    pub(super) fn kinds(&self, correction: &Correction) -> Vec<MisreadingKind> {
        let none = &self.case.declared;
        let is_part = correction.rows != none.rows;
        let units = || correction.scale == 1.0 || self.case.scales.contains(&correction.scale);
        let scale = if units() { MisreadingKind::Units } else { MisreadingKind::Scale };
        let reading = if is_part { Some(MisreadingKind::SidesInPart) } else { self.readings[correction.reading].kind };
        let mut kinds: Vec<MisreadingKind> = [
            (correction.turn != none.turn).then_some(correction.turn.kind()),
            (correction.scale != 1.0).then_some(scale),
            (correction.offset != none.offset).then_some(MisreadingKind::Offset),
            correction.root.map(|_| MisreadingKind::Relative),
            reading,
            correction.time.kind(),
            (correction.names != none.names).then_some(MisreadingKind::Names),
        ]
        .into_iter()
        .flatten()
        .collect();
        kinds.sort();
        kinds
    }
}

/// The sums of a sequence's rows, from the true pose of frame 0.
fn summed(truth: &[Markers], sequence: &[Markers]) -> Vec<Markers> {
    let mut at = truth.first().copied().unwrap_or_default();
    let mut all = vec![at];
    for row in sequence.iter().skip(1) {
        at = std::array::from_fn(|marker| Some(at[marker]? + row[marker]?.coords));
        all.push(at);
    }
    all
}
