//! Recognises poses of the test with noise, and points of the body at any position and orientation.
//!
//! A row of numbers is recognised by features: joint angles themselves, or distances between points, which do not
//! change when all points are translated, rotated or mirrored. A row of a file matches a frame if the root mean square
//! difference of the features is small, so that noise does not hide it. Frames similar to frame 0 are ignored, because
//! the start pose is known.

use super::NumberSequence;

/// Fewest features that change over the frames; fewer are not conclusive.
const LEAST_FEATURES: usize = 6;

/// Most features; more add no information.
const MOST_FEATURES: usize = 24;

/// Greatest difference of a single feature, as a multiple of the tolerance.
const REACH: f64 = 4.0;

/// Least change of a feature over the frames, and least difference of a frame from frame 0, as a multiple of the
/// tolerance.
const DISTINCT: f64 = 20.0;

/// A feature of a row of numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Feature {
    /// The magnitude of a number: signs depend on conventions.
    Number(usize),
    /// The distance between two points with `dimensions` coordinates that begin at these indices.
    Distance { from: usize, to: usize, dimensions: usize },
}

impl Feature {
    /// The distances between all pairs of `points` points.
    pub(super) fn distances(points: usize, dimensions: usize) -> Vec<Self> {
        let pair = move |a: usize| {
            (a + 1..points).map(move |b| Self::Distance { from: a * dimensions, to: b * dimensions, dimensions })
        };
        (0..points).flat_map(pair).collect()
    }

    fn read(self, number: impl Fn(usize) -> f64) -> f64 {
        match self {
            Self::Number(index) => number(index).abs(),
            Self::Distance { from, to, dimensions } => {
                let square = |i: usize| (number(from + i) - number(to + i)).powi(2);
                (0..dimensions).map(square).sum::<f64>().sqrt()
            }
        }
    }
}

/// Rows of numbers, one per frame, that no file for trackers may contain, even approximately.
pub(super) struct NoisySecret {
    pub(super) what: String,
    /// Numbers per row.
    width: usize,
    /// The features that change most come first.
    features: Vec<Feature>,
    /// Features and frame, in ascending order of the first feature.
    rows: Vec<(Vec<f64>, usize)>,
    /// Greatest root mean square of the differences.
    tolerance: f64,
    /// Factors of the units that a file may use.
    units: &'static [f64],
}

impl NoisySecret {
    /// From one row per frame, all of equal length; `None` if they change too little to distinguish frames.
    pub(super) fn new(
        what: String,
        rows: &[Vec<f64>],
        features: Vec<Feature>,
        tolerance: f64,
        units: &'static [f64],
    ) -> Option<Self> {
        let width = rows.first()?.len();
        let value = |row: &Vec<f64>, feature: Feature| feature.read(|i| row[i]);
        let range = |feature: Feature| {
            let values = || rows.iter().map(|row| value(row, feature)).filter(|value| value.is_finite());
            values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min)
        };
        let ranges = features.into_iter().map(|feature| (range(feature), feature));
        let mut distinct: Vec<(f64, Feature)> = ranges.filter(|(range, _)| *range > DISTINCT * tolerance).collect();
        distinct.sort_by(|a, b| b.0.total_cmp(&a.0));
        distinct.truncate(MOST_FEATURES);
        let features: Vec<Feature> = distinct.into_iter().map(|(_, feature)| feature).collect();
        if features.len() < LEAST_FEATURES {
            return None;
        }
        let read = |row: &Vec<f64>| features.iter().map(|feature| value(row, *feature)).collect::<Vec<f64>>();
        let first = read(&rows[0]);
        let is_distinct =
            |row: &[f64]| row.iter().all(|x| x.is_finite()) && root_mean_square(row, &first) > DISTINCT * tolerance;
        let kept = rows.iter().enumerate().map(|(frame, row)| (read(row), frame)).filter(|(row, _)| is_distinct(row));
        let mut rows: Vec<(Vec<f64>, usize)> = kept.collect();
        rows.sort_by(|a, b| a.0[0].total_cmp(&b.0[0]));
        Some(Self { what, width, features, rows, tolerance, units })
    }

    /// A frame whose row is similar to a row of the sequence.
    pub(super) fn found_in(&self, sequence: &NumberSequence) -> Option<usize> {
        sequence.strides.iter().find_map(|stride| self.at_stride(&sequence.numbers, *stride))
    }

    fn at_stride(&self, numbers: &[f64], stride: usize) -> Option<usize> {
        let reach = self.width.checked_sub(1)?.checked_mul(stride)?;
        let starts = numbers.len().checked_sub(reach)?;
        (0..starts).find_map(|start| {
            let feature = |index: usize| self.features[index].read(|i| numbers[start + i * stride]);
            self.units.iter().find_map(|unit| self.similar_frame(&|index| feature(index) * unit))
        })
    }

    /// A frame with similar features.
    fn similar_frame(&self, feature: &dyn Fn(usize) -> f64) -> Option<usize> {
        let (anchor, most) = (feature(0), REACH * self.tolerance);
        let first = self.rows.partition_point(|(row, _)| row[0] < anchor - most);
        let near = self.rows[first..].iter().take_while(|(row, _)| row[0] <= anchor + most);
        let is_near = |row: &[f64]| {
            let limit = self.tolerance * self.tolerance * row.len() as f64;
            let mut sum = 0.0;
            row.iter().enumerate().all(|(index, expected)| {
                let off = feature(index) - expected;
                sum += off * off;
                off.abs() <= most && sum <= limit
            })
        };
        near.into_iter().find(|(row, _)| is_near(row)).map(|(_, frame)| *frame)
    }
}

fn root_mean_square(a: &[f64], b: &[f64]) -> f64 {
    (a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / a.len().max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    const POINTS: usize = 6;

    fn rows(frames: usize) -> Vec<Vec<f64>> {
        let number = |frame: usize, i: usize| (0.2 * frame as f64 * (1.0 + 0.3 * i as f64) + i as f64).sin();
        (0..frames).map(|frame| (0..3 * POINTS).map(|i| number(frame, i)).collect()).collect()
    }

    fn found(secret: &NoisySecret, numbers: Vec<f64>) -> Option<usize> {
        secret.found_in(&NumberSequence { place: String::new(), numbers, strides: vec![1] })
    }

    #[test]
    fn points_are_found_when_they_are_translated_rotated_mirrored_and_in_another_unit() {
        let rows = rows(9);
        let features = Feature::distances(POINTS, 3);
        assert_eq!(features.len(), POINTS * (POINTS - 1) / 2);
        let secret = NoisySecret::new("points".into(), &rows, features, 2e-3, &[1.0, 0.001]).unwrap();
        let changed = |change: &dyn Fn([f64; 3]) -> [f64; 3]| {
            let points = rows[5].as_chunks::<3>().0.iter().flat_map(|p| change(*p)).collect::<Vec<f64>>();
            found(&secret, [vec![0.3, -7.0], points, vec![4.0]].concat())
        };
        assert_eq!(changed(&|[x, y, z]| [x + 3.0, y - 1.0, z + 0.25]), Some(5));
        assert_eq!(changed(&|[x, y, z]| [1000.0 * y + 70.0, 1000.0 * z, 1000.0 * x - 90.0]), Some(5));
        assert_eq!(changed(&|[x, y, z]| [x, -y, z]), Some(5));
        assert_eq!(changed(&|[x, y, z]| [1.1 * x, y, z]), None);
    }

    #[test]
    fn noise_hides_nothing_below_the_tolerance_and_frames_like_the_first_are_known() {
        let rows = rows(9);
        let numbers = || (0..3 * POINTS).map(Feature::Number).collect::<Vec<_>>();
        let secret = NoisySecret::new("numbers".into(), &rows, numbers(), 2.5e-3, &[1.0]).unwrap();
        let with = |frame: usize, noise: f64| {
            let spoiled = rows[frame].iter().enumerate();
            found(&secret, spoiled.map(|(i, x)| x + noise * (7.0 * i as f64).sin()).collect())
        };
        assert_eq!((with(4, 1e-3), with(4, 2e-2), with(0, 1e-3)), (Some(4), None, None));
        let still = vec![rows[0].clone(); 5];
        assert!(NoisySecret::new("still".into(), &still, numbers(), 2.5e-3, &[1.0]).is_none());
    }
}
