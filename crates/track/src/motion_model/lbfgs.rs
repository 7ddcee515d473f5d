//! Limited-memory BFGS with box bounds, for objectives that compute value and gradient in one evaluation.
//!
//! A step that leaves the box is projected onto it; a variable at a bound that is pushed outwards is held for that
//! iteration. An infinite value (a kernel that is not positive definite) makes the line search backtrack.

use std::collections::VecDeque;

/// Stopping criteria and memory.
#[derive(Clone, Copy, Debug)]
pub(super) struct LbfgsOptions {
    /// Number of remembered pairs of steps and gradient differences.
    pub(super) memory: usize,
    pub(super) iterations: usize,
    /// Stops when an iteration lowers the value by less than this share of it.
    pub(super) relative_decrease: f64,
}

/// Minimises `objective(x, gradient) -> value` over the box `lower <= x <= upper` from `x`, in place; returns the
/// value reached, which is never above the initial one.
pub(super) fn minimise(
    mut objective: impl FnMut(&[f64], &mut [f64]) -> f64,
    x: &mut [f64],
    lower: &[f64],
    upper: &[f64],
    options: &LbfgsOptions,
) -> f64 {
    let n = x.len();
    for i in 0..n {
        x[i] = x[i].clamp(lower[i], upper[i]);
    }
    let mut gradient = vec![0.0; n];
    let mut value = objective(x, &mut gradient);
    let mut pairs: VecDeque<Pair> = VecDeque::with_capacity(options.memory);
    let (mut trial, mut trial_gradient) = (vec![0.0; n], vec![0.0; n]);
    for _ in 0..options.iterations {
        let held: Vec<bool> = (0..n)
            .map(|i| (x[i] <= lower[i] && gradient[i] > 0.0) || (x[i] >= upper[i] && gradient[i] < 0.0))
            .collect();
        let direction = descent_direction(&pairs, &gradient, &held);
        let slope = dot(&direction, &gradient);
        if slope >= 0.0 {
            if pairs.is_empty() {
                break;
            }
            pairs.clear();
            continue;
        }
        let first = if pairs.is_empty() { (1.0 / dot(&gradient, &gradient).sqrt()).min(1.0) } else { 1.0 };
        let Some(found) = backtrack(first, value, slope, |step| {
            for i in 0..n {
                trial[i] = (x[i] + step * direction[i]).clamp(lower[i], upper[i]);
            }
            objective(&trial, &mut trial_gradient)
        }) else {
            if pairs.is_empty() {
                break;
            }
            pairs.clear();
            continue;
        };
        let pair = Pair::between(x, &trial, &gradient, &trial_gradient);
        // skipped if the curvature is not positive, because the model of the inverse Hessian would become indefinite
        if pair.curvature > 1e-10 * dot(&pair.gradient, &pair.gradient).sqrt() * dot(&pair.step, &pair.step).sqrt() {
            if pairs.len() == options.memory {
                pairs.pop_front();
            }
            pairs.push_back(pair);
        }
        x.copy_from_slice(&trial);
        gradient.copy_from_slice(&trial_gradient);
        let decrease = value - found;
        value = found;
        if decrease <= options.relative_decrease * value.abs() {
            break;
        }
    }
    value
}

struct Pair {
    step: Vec<f64>,
    gradient: Vec<f64>,
    curvature: f64,
}

impl Pair {
    fn between(x0: &[f64], x1: &[f64], g0: &[f64], g1: &[f64]) -> Self {
        let difference = |a: &[f64], b: &[f64]| b.iter().zip(a).map(|(b, a)| b - a).collect::<Vec<f64>>();
        let (step, gradient) = (difference(x0, x1), difference(g0, g1));
        let curvature = dot(&step, &gradient);
        Self { step, gradient, curvature }
    }
}

/// The two-loop recursion on the variables that are not held.
fn descent_direction(pairs: &VecDeque<Pair>, gradient: &[f64], held: &[bool]) -> Vec<f64> {
    let mut q: Vec<f64> = gradient.iter().zip(held).map(|(g, held)| if *held { 0.0 } else { *g }).collect();
    let mut shares = Vec::with_capacity(pairs.len());
    for pair in pairs.iter().rev() {
        let share = dot(&pair.step, &q) / pair.curvature;
        add_scaled(&mut q, -share, &pair.gradient);
        shares.push(share);
    }
    if let Some(last) = pairs.back() {
        let scale = last.curvature / dot(&last.gradient, &last.gradient);
        q.iter_mut().for_each(|value| *value *= scale);
    }
    for (pair, share) in pairs.iter().zip(shares.into_iter().rev()) {
        let correction = share - dot(&pair.gradient, &q) / pair.curvature;
        add_scaled(&mut q, correction, &pair.step);
    }
    q.iter().zip(held).map(|(value, held)| if *held { 0.0 } else { -value }).collect()
}

/// Armijo backtracking by quadratic interpolation: the first step that lowers the value enough, or `None`.
fn backtrack(first: f64, value: f64, slope: f64, mut at: impl FnMut(f64) -> f64) -> Option<f64> {
    let mut step = first;
    for _ in 0..30 {
        let reached = at(step);
        if reached <= value + 1e-4 * step * slope {
            return Some(reached);
        }
        let interpolated = -0.5 * slope * step * step / (reached - value - slope * step);
        step = if interpolated.is_finite() { interpolated.clamp(0.1 * step, 0.5 * step) } else { 0.1 * step };
    }
    None
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

fn add_scaled(target: &mut [f64], scale: f64, other: &[f64]) {
    target.iter_mut().zip(other).for_each(|(t, o)| *t += scale * o);
}

#[cfg(test)]
mod tests {
    use super::*;

    const OPTIONS: LbfgsOptions = LbfgsOptions { memory: 10, iterations: 500, relative_decrease: 0.0 };

    fn rosenbrock(x: &[f64], gradient: &mut [f64]) -> f64 {
        let (a, b) = (1.0 - x[0], x[1] - x[0] * x[0]);
        gradient[0] = -2.0 * a - 400.0 * x[0] * b;
        gradient[1] = 200.0 * b;
        a * a + 100.0 * b * b
    }

    #[test]
    fn the_rosenbrock_valley_is_followed_to_its_end_or_to_a_bound_that_cuts_it_off() {
        for (bound, end) in [(5.0, [1.0, 1.0]), (0.5, [0.5, 0.25])] {
            let mut x = [-1.2, 1.0];
            minimise(rosenbrock, &mut x, &[-5.0; 2], &[bound, 5.0], &OPTIONS);
            assert!((x[0] - end[0]).abs() < 1e-6 && (x[1] - end[1]).abs() < 1e-6, "{x:?}");
        }
    }

    #[test]
    fn an_infinite_value_causes_backtracking() {
        // ln barrier: infinite for x <= 0, least at x = 1
        let barrier = |x: &[f64], g: &mut [f64]| {
            if x[0] <= 0.0 {
                return f64::INFINITY;
            }
            g[0] = 1.0 - 1.0 / x[0];
            x[0] - x[0].ln()
        };
        let mut x = [30.0];
        minimise(barrier, &mut x, &[-1e9], &[1e9], &OPTIONS);
        assert!((x[0] - 1.0).abs() < 1e-5, "{x:?}");
    }
}
