//! The energy around the truth on the plane of the two directions that the images tell least about.
//!
//! With `M` the matrix of the descent's normal equations at the truth (`J^T W J`) and `G` the metric of the markers
//! (the mean square of their displacements by a step), the directions are the generalised eigenvectors
//! `M v = lambda G v` of least `lambda`: those in which the outlines change least for a millimetre of the body.

use nalgebra::{Cholesky, DMatrix, DVector, SymmetricEigen};

use super::explanation::Landscape;
use crate::common::{ExperimentError, Progress};
use crate::scenario::TrackerSettings;
use crate::tracking::calibrating::Beginning;
use crate::tracking::truth_descent::Descent;
use skiagraph_core::body::{Humanoid, Pose};
use skiagraph_core::parallel;
use skiagraph_set::BenchmarkSet;
use skiagraph_track::tracker::Likelihood;

/// Points along an edge of the plane; odd, so that the truth is one of them.
const POINTS: usize = 41;
/// Least and greatest distance of the edge from the truth, metres.
const REACH_M: [f64; 2] = [0.08, 0.4];
/// Width of the robust weights at the truth, lengths: that of the last step of a descent.
const WIDTH: f64 = 1.5;
/// Step of the finite differences of the markers, metres or radians.
const STEP: f64 = 1e-5;
/// Radius at which a rotation counts even if it moves no marker, metres: about that of a forearm.
const LEVER_M: f64 = 0.03;

/// The landscape of a frame with the body and the cameras that the tracker used; `truth` is the pose of that body
/// nearest to the truth. `None` for trackers without a descent, and frames in which nothing is seen.
pub(super) fn landscape(
    set: &BenchmarkSet,
    tracker: &TrackerSettings,
    used: &Beginning,
    frame: usize,
    [truth, estimate]: [&Pose; 2],
    progress: &dyn Progress,
) -> Result<Option<Landscape>, ExperimentError> {
    let body = &used.body;
    let Some(Descent { mut likelihood, .. }) = Descent::new(&set.blind, tracker, used, progress)? else {
        return Ok(None);
    };
    likelihood.prepare(&set.blind.observation(frame)?)?;
    let Some(equations) = likelihood.linearise(truth, WIDTH, &mut likelihood.scratch()) else { return Ok(None) };
    let metric = marker_metric(body, truth);
    let Some(directions) = weakest(&equations.matrix, &metric) else { return Ok(None) };
    let mut towards = vec![0.0; body.step_len()];
    body.difference(truth, estimate, &mut towards);
    let towards = DVector::from_vec(towards);
    let place = directions.each_ref().map(|direction| (direction.transpose() * &metric * &towards)[(0, 0)]);
    let away = (towards.transpose() * &metric * &towards)[(0, 0)].max(0.0).sqrt();
    let reach = (1.3 * place[0].abs().max(place[1].abs())).clamp(REACH_M[0], REACH_M[1]);
    let row = |row: usize| {
        let mut scratch = likelihood.scratch();
        let energy = |column: usize| {
            let [a, b] = [column, row].map(|index| coordinate(index, reach));
            let step = &directions[0] * a + &directions[1] * b;
            likelihood.energy_unrejected(&body.step(truth, step.as_slice()), &mut scratch)
        };
        (0..POINTS).map(energy).collect::<Vec<f64>>()
    };
    let energies = parallel::map(POINTS, row).concat();
    let mut scratch = likelihood.scratch();
    let [of_truth, of_estimate] = [truth, estimate].map(|pose| likelihood.energy_unrejected(pose, &mut scratch));
    let shape = LandscapeShape::of(&energies, reach);
    let mm = |metres: f64| 1000.0 * metres;
    Ok(Some(Landscape {
        frame,
        directions: directions.each_ref().map(|direction| name(body, direction, &metric)),
        reach_mm: mm(reach),
        points: POINTS,
        energies,
        minimum_mm: shape.minimum.map(mm),
        bias_mm: mm(shape.minimum[0].hypot(shape.minimum[1])),
        width_mm: mm(shape.width),
        rivals_mm: shape.rivals.iter().map(|at| at.map(mm)).collect(),
        estimate_mm: place.map(mm),
        estimate_away_mm: mm(away),
        energy_of_truth: of_truth,
        energy_of_estimate: of_estimate,
    }))
}

fn coordinate(index: usize, reach: f64) -> f64 {
    reach * (2.0 * index as f64 / (POINTS - 1) as f64 - 1.0)
}

/// `G`: mean over the markers of the squared displacement by a step, in square metres, plus the lever for rotations.
fn marker_metric(body: &Humanoid, pose: &Pose) -> DMatrix<f64> {
    let steps = body.step_len();
    let markers = |pose: &Pose| body.markers(&body.link_frames(pose));
    let here = markers(pose);
    let column = |number: usize| {
        let mut step = vec![0.0; steps];
        step[number] = STEP;
        let there = markers(&body.step(pose, &step));
        let pairs = there.iter().zip(&here).filter_map(|(there, here)| Some((*there)? - (*here)?));
        pairs.flat_map(|moved| [moved.x / STEP, moved.y / STEP, moved.z / STEP]).collect::<Vec<f64>>()
    };
    let columns: Vec<DVector<f64>> = (0..steps).map(|number| DVector::from_vec(column(number))).collect();
    let jacobian = DMatrix::from_columns(&columns);
    let count = (jacobian.nrows() / 3).max(1) as f64;
    let mut metric = jacobian.transpose() * &jacobian / count;
    for number in 3..steps {
        metric[(number, number)] += LEVER_M * LEVER_M;
    }
    metric
}

/// The two directions of least information, of unit length in the metric.
fn weakest(information: &DMatrix<f64>, metric: &DMatrix<f64>) -> Option<[DVector<f64>; 2]> {
    let lower = Cholesky::new(metric.clone())?.l();
    let half = lower.solve_lower_triangular(information)?;
    let whitened = lower.solve_lower_triangular(&half.transpose())?;
    let eigen = SymmetricEigen::new(0.5 * (&whitened + whitened.transpose()));
    let mut order: Vec<usize> = (0..eigen.eigenvalues.len()).collect();
    order.sort_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]));
    let direction = |place: usize| {
        let vector = eigen.eigenvectors.column(*order.get(place)?).into_owned();
        lower.transpose().solve_upper_triangular(&vector)
    };
    Some([direction(0)?, direction(1)?])
}

/// The components that move the body most in a direction.
fn name(body: &Humanoid, direction: &DVector<f64>, metric: &DMatrix<f64>) -> String {
    const ROOT: [&str; 6] = ["root x", "root y", "root z", "root roll", "root pitch", "root yaw"];
    let share = |number: usize| direction[number].abs() * metric[(number, number)].max(0.0).sqrt();
    let mut order: Vec<usize> = (0..direction.len()).collect();
    order.sort_by(|a, b| share(*b).total_cmp(&share(*a)));
    let greatest = order.first().map_or(0.0, |number| share(*number));
    let named = order.into_iter().take(2).filter(|number| share(*number) > 0.4 * greatest);
    let word = |number: usize| match ROOT.get(number) {
        Some(root) => (*root).to_owned(),
        None => body.degrees_of_freedom.get(number - ROOT.len()).map_or(String::new(), |d| d.name.replace('_', " ")),
    };
    named.map(word).collect::<Vec<_>>().join(", ")
}

/// The shape of a landscape, metres.
#[derive(Clone, Debug, PartialEq)]
struct LandscapeShape {
    minimum: [f64; 2],
    /// Diameter of a disc with the area below the middle between the minimum and the mean of the border.
    width: f64,
    /// Other minima below that level, lowest first.
    rivals: Vec<[f64; 2]>,
}

impl LandscapeShape {
    fn of(energies: &[f64], reach: f64) -> Self {
        let at = |row: usize, column: usize| energies.get(row * POINTS + column).copied().unwrap_or(f64::NAN);
        let place = |index: usize| [index % POINTS, index / POINTS].map(|index| coordinate(index, reach));
        let mut order: Vec<usize> = (0..energies.len()).filter(|index| energies[*index].is_finite()).collect();
        order.sort_by(|a, b| energies[*a].total_cmp(&energies[*b]));
        let lowest = order.first().copied().unwrap_or_default();
        let edge = POINTS - 1;
        let border = (0..edge).flat_map(|i| [at(0, i), at(i, edge), at(edge, edge - i), at(edge - i, 0)]);
        let border: Vec<f64> = border.filter(|energy| energy.is_finite()).collect();
        let level =
            0.5 * (at(lowest / POINTS, lowest % POINTS) + border.iter().sum::<f64>() / border.len().max(1) as f64);
        let below = order.iter().filter(|index| energies[**index] < level).count() as f64;
        let spacing = 2.0 * reach / edge as f64;
        let is_minimum = |index: &usize| {
            let (row, column) = (*index / POINTS, *index % POINTS);
            let rows = row.saturating_sub(2)..=(row + 2).min(edge);
            let inside = row > 0 && row < edge && column > 0 && column < edge;
            inside
                && rows
                    .flat_map(|r| (column.saturating_sub(2)..=(column + 2).min(edge)).map(move |c| (r, c)))
                    .all(|(r, c)| (r, c) == (row, column) || at(r, c) > energies[*index])
        };
        let rivals = order.iter().filter(|index| **index != lowest && energies[**index] < level);
        Self {
            minimum: place(lowest),
            width: 2.0 * spacing * (below / std::f64::consts::PI).sqrt(),
            rivals: rivals.filter(|index| is_minimum(index)).map(|index| place(*index)).take(3).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Energies of a function on the plane with edges 1 m from the truth.
    fn energies(energy: impl Fn(f64, f64) -> f64) -> Vec<f64> {
        let place = |index: usize| [index % POINTS, index / POINTS].map(|index| coordinate(index, 1.0));
        (0..POINTS * POINTS).map(place).map(|[a, b]| energy(a, b)).collect()
    }

    #[test]
    fn a_shifted_bowl_has_its_bias_and_width_and_no_rival() {
        let bowl = |a: f64, b: f64| (((a - 0.3).powi(2) + b * b) / 0.04).min(1.0);
        let shape = LandscapeShape::of(&energies(bowl), 1.0);
        assert!((shape.minimum[0] - 0.3).abs() < 1e-9 && shape.minimum[1].abs() < 1e-9, "{shape:?}");
        // below one half: a disc of radius 0.2 / sqrt(2)
        assert!((shape.width - 0.4 / 2_f64.sqrt()).abs() < 0.04, "{shape:?}");
        assert!(shape.rivals.is_empty(), "{shape:?}");
    }

    #[test]
    fn a_second_bowl_is_a_rival_if_it_is_deep_enough() {
        let bowl = |a: f64, depth: f64, at: f64, b: f64| depth * (((a - at).powi(2) + b * b) / 0.04).min(1.0) - depth;
        let two =
            |depth: f64| LandscapeShape::of(&energies(|a, b| bowl(a, 1.0, -0.5, b) + bowl(a, depth, 0.5, b)), 1.0);
        let deep = two(0.8);
        assert_eq!(deep.rivals.len(), 1);
        assert!((deep.rivals[0][0] - 0.5).abs() < 1e-9 && (deep.minimum[0] + 0.5).abs() < 1e-9, "{deep:?}");
        assert!(two(0.2).rivals.is_empty());
    }

    #[test]
    fn the_weakest_directions_are_those_of_least_information_for_a_millimetre() {
        // the third number has little information, but moves the body even less
        let information = DMatrix::from_diagonal(&DVector::from_vec(vec![4.0, 1.0, 0.5]));
        let metric = DMatrix::from_diagonal(&DVector::from_vec(vec![1.0, 1.0, 0.01]));
        let [first, second] = weakest(&information, &metric).unwrap();
        assert!((first[1].abs() - 1.0).abs() < 1e-9 && (second[0].abs() - 1.0).abs() < 1e-9, "{first} {second}");
    }
}
