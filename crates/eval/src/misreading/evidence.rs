//! Pairs of truth and estimate, read with different corrections.

use nalgebra::{Point3, Vector3};

use super::{Correction, GivenPositions, MisreadingCase};
use crate::body::Markers;
use crate::{mean, quantile};

/// Greatest number of frames that a search uses.
const MOST_SAMPLES: usize = 150;
/// Frames with fewer common markers do not determine axes and sizes.
const FEWEST_MARKERS: usize = 3;
/// Number of frames at the beginning of the clip that are all used, from frame 1: the pose of frame 0 is given.
const FIRST_FRAMES: usize = 3;

/// A frame of one repetition.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Sample {
    pub(super) seed: usize,
    pub(super) frame: usize,
}

/// The sampled frames.
#[derive(Clone, Copy, Debug)]
pub(super) struct PairedFrames<'a> {
    pub(super) case: &'a MisreadingCase<'a>,
    pub(super) samples: &'a [Sample],
}

/// Frames of all repetitions that have an estimate, spread evenly, with the first ones of the clip.
pub(super) fn samples(case: &MisreadingCase<'_>) -> Vec<Sample> {
    let all: Vec<Sample> = (1..case.truth.len())
        .flat_map(|frame| (0..case.given.len()).map(move |seed| Sample { seed, frame }))
        .filter(|sample| {
            let estimate = case.given[sample.seed].markers.get(sample.frame);
            estimate.is_some_and(|estimate| common(&case.truth[sample.frame], estimate).count() >= FEWEST_MARKERS)
        })
        .collect();
    let first = all.iter().take_while(|sample| sample.frame <= FIRST_FRAMES).count();
    let (first, later) = all.split_at(first);
    [thinned(first, MOST_SAMPLES), thinned(later, MOST_SAMPLES)].concat()
}

/// About `most` of these samples, which are in order of their frames: every repetition in evenly spread frames, because
/// a constant step over samples could always select the same repetition.
pub(super) fn thinned(samples: &[Sample], most: usize) -> Vec<Sample> {
    let step = samples.len().div_ceil(most).max(1);
    let mut frames: Vec<usize> = samples.iter().map(|sample| sample.frame).collect();
    frames.dedup();
    let kept: Vec<usize> = frames.into_iter().step_by(step).collect();
    samples.iter().filter(|sample| kept.binary_search(&sample.frame).is_ok()).copied().collect()
}

/// Pairs of truth and estimate of the markers that both have.
pub(super) fn common<'a>(
    truth: &'a Markers,
    estimate: &'a Markers,
) -> impl Iterator<Item = (usize, Point3<f64>, Point3<f64>)> + 'a {
    truth
        .iter()
        .zip(estimate)
        .enumerate()
        .filter_map(|(marker, (truth, estimate))| Some((marker, (*truth)?, (*estimate)?)))
}

fn centroid(points: impl Iterator<Item = Point3<f64>>) -> Option<Point3<f64>> {
    let (sum, count) = points.fold((Vector3::zeros(), 0), |(sum, count), point| (sum + point.coords, count + 1));
    (count > 0).then(|| Point3::from(sum / f64::from(count)))
}

impl<'a> PairedFrames<'a> {
    pub(super) fn given(&self, sample: Sample) -> &GivenPositions<'a> {
        &self.case.given[sample.seed]
    }

    /// Truth and corrected estimate of a sample; `None` without an estimate.
    pub(super) fn read(&self, sample: Sample, correction: &Correction) -> Option<(&'a Markers, Markers)> {
        Some((self.case.truth.get(sample.frame)?, correction.markers(self.given(sample), sample.frame)?))
    }

    /// Mean distance of the markers in a sample, metres.
    pub(super) fn error(&self, sample: Sample, correction: &Correction) -> Option<f64> {
        let (truth, estimate) = self.read(sample, correction)?;
        let (sum, count) =
            common(truth, &estimate).fold((0.0, 0), |(sum, count), (_, a, b)| (sum + (a - b).norm(), count + 1));
        (count > 0).then(|| sum / f64::from(count))
    }

    /// Mean distance over all samples, metres; infinite if nothing can be compared.
    pub(super) fn mean_error(&self, correction: &Correction) -> f64 {
        let errors: Vec<f64> = self.samples.iter().filter_map(|sample| self.error(*sample, correction)).collect();
        mean(&errors).unwrap_or(f64::INFINITY)
    }

    /// The samples that have an error with either correction, and both errors.
    pub(super) fn both(&self, one: &Correction, other: &Correction) -> Vec<(Sample, f64, f64)> {
        let pair = |sample: &Sample| Some((*sample, self.error(*sample, one)?, self.error(*sample, other)?));
        self.samples.iter().filter_map(pair).collect()
    }

    /// Centroids of the markers that truth and estimate have in each sample.
    pub(super) fn centroids(&self, correction: &Correction) -> Vec<(Point3<f64>, Point3<f64>)> {
        let of = |sample: &Sample| {
            let (truth, estimate) = self.read(*sample, correction)?;
            let pairs = || common(truth, &estimate);
            Some((centroid(pairs().map(|(_, a, _)| a))?, centroid(pairs().map(|(_, _, b)| b))?))
        };
        self.samples.iter().filter_map(of).collect()
    }

    /// The offset that brings the estimate nearest to the truth: the median of each coordinate.
    pub(super) fn offset(&self, correction: &Correction) -> Vector3<f64> {
        let apart: Vec<Vector3<f64>> = self.centroids(correction).iter().map(|(truth, found)| truth - found).collect();
        let median = |axis: usize| {
            let mut values: Vec<f64> = apart.iter().map(|apart| apart[axis]).collect();
            values.sort_by(f64::total_cmp);
            quantile(&values, 0.5).unwrap_or(0.0)
        };
        correction.offset + Vector3::new(median(0), median(1), median(2))
    }

    /// Greatest component of a shift of the true body across a camera's ray, over the cameras, metres: the median over
    /// the samples. The whole shift if no camera is known.
    pub(super) fn across_rays(&self, shift: &Vector3<f64>) -> f64 {
        let cameras = self.case.cameras;
        let across = |camera: &Point3<f64>, body: &Point3<f64>| {
            let ray = (body - camera).try_normalize(0.0).unwrap_or_else(Vector3::zeros);
            (shift - ray * ray.dot(shift)).norm()
        };
        let most = |sample: &Sample| {
            let body = centroid(self.case.truth.get(sample.frame)?.iter().flatten().copied())?;
            let cameras = cameras.get(sample.frame).or(cameras.last())?;
            cameras.iter().map(|camera| across(camera, &body)).reduce(f64::max)
        };
        let mut all: Vec<f64> = self.samples.iter().filter_map(most).collect();
        all.sort_by(f64::total_cmp);
        quantile(&all, 0.5).unwrap_or_else(|| shift.norm())
    }

    /// Size of the true body relative to the estimated one; `None` if either is a point.
    pub(super) fn size_ratio(&self) -> Option<f64> {
        let spread = |points: &[Point3<f64>]| {
            let middle = centroid(points.iter().copied())?;
            Some(points.iter().map(|point| (point - middle).norm_squared()).sum::<f64>().sqrt())
        };
        let ratio = |sample: &Sample| {
            let (truth, estimate) = self.read(*sample, &Correction::none())?;
            let (a, b): (Vec<_>, Vec<_>) = common(truth, &estimate).map(|(_, a, b)| (a, b)).unzip();
            let ratio = spread(&a)? / spread(&b)?;
            (ratio.is_finite() && ratio > 0.0).then_some(ratio)
        };
        let mut ratios: Vec<f64> = self.samples.iter().filter_map(ratio).collect();
        ratios.sort_by(f64::total_cmp);
        quantile(&ratios, 0.5)
    }
}
