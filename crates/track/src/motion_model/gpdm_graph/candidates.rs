//! Candidates for transitions between motions: turning points of the body, found without labels.

use nalgebra::{DMatrix, Point3};
use serde::{Deserialize, Serialize};

/// Distance between the starts of consecutive windows of the short-term PCA, and length of a window, seconds.
const HOP_S: f64 = 0.25;
const WINDOW_S: f64 = 1.0;
/// Least time between turning points, and from the ends of the motion, seconds.
const SEPARATION_S: f64 = 0.1;

/// Method of finding inter-transition candidates in a motion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Detector {
    /// Turning points along the leading direction of a short-term PCA (`[GPDM graph]` section 3.2).
    #[default]
    ShortTermPca,
    /// Local minima of the mean speed of the joints: moments of rest.
    SpeedMinima,
    /// Every frame except the ends.
    EveryFrame,
}

impl Detector {
    /// Frames at which the motion turns, in order. `positions[t]` are the joints at frame `t` in the root's frame,
    /// metres.
    pub(super) fn detect(self, positions: &[Vec<Point3<f64>>], frames_per_second: f64) -> Vec<usize> {
        match self {
            Self::ShortTermPca => turns_of_pca(positions, frames_per_second),
            Self::SpeedMinima => speed_minima(positions, frames_per_second),
            // Nothing precedes or follows the ends. Turning points are few, and a particle rarely meets one with a
            // similar motion; with every frame as a candidate, only the jump rule decides how similar poses and
            // velocities must be. Not in [GPDM graph].
            Self::EveryFrame => (1..positions.len().saturating_sub(1)).collect(),
        }
    }

    pub fn describe(self) -> &'static str {
        match self {
            Self::ShortTermPca => "short term pca",
            Self::SpeedMinima => "speed minima",
            Self::EveryFrame => "every frame",
        }
    }
}

/// Peaks and valleys of the first principal component in a sliding window (short-term PCA, as sketched in `[GPDM
/// graph]` section 3.2).
///
/// `[GPDM graph]` does not define window and smoothing. Here: within each window the leading right singular vector,
/// with a consistent sign between windows; the coordinates, centred per window, averaged where windows overlap;
/// smoothed; local extrema at least [`SEPARATION_S`] apart.
fn turns_of_pca(positions: &[Vec<Point3<f64>>], frames_per_second: f64) -> Vec<usize> {
    let coordinate = smoothed(&leading_coordinate(positions, frames_per_second));
    let turns = |t: &usize| {
        let (before, after) = (coordinate[*t] - coordinate[t - 1], coordinate[t + 1] - coordinate[*t]);
        before * after < 0.0 || (before != 0.0 && after == 0.0)
    };
    let found = (1..coordinate.len().saturating_sub(1)).filter(turns);
    spaced(found, &coordinate, frames_per_second)
}

/// The coordinate along each window's first component, averaged over windows.
fn leading_coordinate(positions: &[Vec<Point3<f64>>], frames_per_second: f64) -> Vec<f64> {
    let frames = positions.len();
    let window = ((WINDOW_S * frames_per_second).round() as usize).clamp(2, frames.max(2));
    let hop = ((HOP_S * frames_per_second).round() as usize).max(1);
    let (mut sum, mut count) = (vec![0.0; frames], vec![0_u32; frames]);
    let mut previous: Option<Vec<f64>> = None;
    let mut start = 0;
    while start < frames {
        let first = start.min(frames.saturating_sub(window));
        let end = (first + window).min(frames);
        let (component, coordinates) = leading_component(&positions[first..end], previous.as_deref());
        for (t, value) in (first..end).zip(coordinates) {
            sum[t] += value;
            count[t] += 1;
        }
        previous = Some(component);
        if end == frames {
            break;
        }
        start += hop;
    }
    sum.iter().zip(&count).map(|(s, n)| s / f64::from((*n).max(1))).collect()
}

fn speed_minima(positions: &[Vec<Point3<f64>>], frames_per_second: f64) -> Vec<usize> {
    let frames = positions.len();
    if frames < 3 {
        return Vec::new();
    }
    let speed: Vec<f64> = (0..frames)
        .map(|t| {
            let (a, b) = (&positions[t.saturating_sub(1)], &positions[(t + 1).min(frames - 1)]);
            a.iter().zip(b).map(|(a, b)| (b - a).norm()).sum::<f64>() / a.len().max(1) as f64
        })
        .collect();
    let speed = smoothed(&speed);
    let rests = |t: &usize| speed[*t] < speed[t - 1] && speed[*t] <= speed[t + 1];
    spaced((1..frames - 1).filter(rests), &speed, frames_per_second)
}

/// First principal component of a window of positions and the coordinates along it; its sign is that of `previous`.
fn leading_component(window: &[Vec<Point3<f64>>], previous: Option<&[f64]>) -> (Vec<f64>, Vec<f64>) {
    let columns = 3 * window[0].len();
    let mut matrix = DMatrix::from_fn(window.len(), columns, |t, c| window[t][c / 3][c % 3]);
    for mut column in matrix.column_iter_mut() {
        let mean = column.mean();
        column.add_scalar_mut(-mean);
    }
    let svd = matrix.clone().svd(false, true);
    let mut component: Vec<f64> = match &svd.v_t {
        Some(v) => v.row(svd.singular_values.imax()).iter().copied().collect(),
        None => vec![0.0; columns],
    };
    let agreement: f64 = match previous {
        Some(previous) => component.iter().zip(previous).map(|(a, b)| a * b).sum(),
        None => component.iter().copied().fold(0.0_f64, |a, b| if b.abs() > a.abs() { b } else { a }),
    };
    if agreement < 0.0 {
        component.iter_mut().for_each(|value| *value = -*value);
    }
    let coordinates = matrix.row_iter().map(|row| row.iter().zip(&component).map(|(a, b)| a * b).sum()).collect();
    (component, coordinates)
}

/// Five-tap Hann smoothing with repeated ends.
fn smoothed(values: &[f64]) -> Vec<f64> {
    const TAPS: [f64; 5] = [1.0 / 12.0, 3.0 / 12.0, 4.0 / 12.0, 3.0 / 12.0, 1.0 / 12.0];
    let at = |t: isize| values[t.clamp(0, values.len() as isize - 1) as usize];
    (0..values.len() as isize).map(|t| TAPS.iter().zip(-2..).map(|(tap, lag)| tap * at(t + lag)).sum()).collect()
}

/// Drops candidates nearer than the separation to the ends of the motion or to an earlier kept one.
fn spaced(found: impl Iterator<Item = usize>, values: &[f64], frames_per_second: f64) -> Vec<usize> {
    let separation = ((SEPARATION_S * frames_per_second).round() as usize).max(1);
    let mut kept: Vec<usize> = Vec::new();
    for t in found.filter(|t| *t >= separation && *t + separation < values.len()) {
        if kept.last().is_none_or(|last| t - last >= separation) {
            kept.push(t);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two joints that swing along a line with a period of 60 frames, with turning points at 15, 45, 75, ...
    fn swing(frames: usize) -> Vec<Vec<Point3<f64>>> {
        (0..frames)
            .map(|t| {
                let s = (t as f64 * std::f64::consts::TAU / 60.0).sin();
                vec![Point3::new(0.3 * s, 0.1 * s, 0.0), Point3::new(-0.2 * s, 0.0, 0.05 * s)]
            })
            .collect()
    }

    #[test]
    fn both_detectors_find_the_turning_points_of_a_swing() {
        for detector in [Detector::ShortTermPca, Detector::SpeedMinima] {
            let found = detector.detect(&swing(240), 60.0);
            let expected: Vec<usize> = (0..8).map(|k| 15 + 30 * k).collect();
            assert_eq!(found.len(), expected.len(), "{detector:?}: {found:?}");
            assert!(found.iter().zip(&expected).all(|(a, b)| a.abs_diff(*b) <= 1), "{detector:?}: {found:?}");
        }
    }

    #[test]
    fn a_motion_at_rest_or_of_a_few_frames_has_no_candidates() {
        let rest = vec![vec![Point3::new(0.1, 0.2, 0.3)]; 120];
        for detector in [Detector::ShortTermPca, Detector::SpeedMinima] {
            assert!(detector.detect(&rest, 60.0).is_empty(), "{detector:?}");
            assert!(detector.detect(&swing(2), 60.0).is_empty(), "{detector:?}");
        }
    }

    #[test]
    fn every_frame_between_the_ends_is_a_candidate_including_those_of_other_detectors() {
        let every = Detector::EveryFrame;
        for frames in 0..3 {
            assert!(every.detect(&swing(frames), 60.0).is_empty(), "{frames} frames");
        }
        let all = every.detect(&swing(240), 60.0);
        assert_eq!((all.len(), all[0], all[237]), (238, 1, 238));
        for detector in [Detector::ShortTermPca, Detector::SpeedMinima] {
            assert!(detector.detect(&swing(240), 60.0).iter().all(|t| all.contains(t)), "{detector:?}");
        }
    }
}
