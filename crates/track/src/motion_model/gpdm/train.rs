//! Learning a GPDM: initial latents from whitened principal components, then the closed form of `W` and L-BFGS in
//! turn.

use faer::{Mat, MatRef};
use nalgebra::{DMatrix, SymmetricEigen};

use super::kernel::{DynamicsKernel, MapKernel};
use super::layout::{DynamicsOrder, SequenceLayout};
use super::model::Gpdm;
use super::objective::{Objective, Parameters, SCALE_PRIOR_VARIANCE};
use super::positive_definite::PositiveDefinite;
use crate::motion_model::lbfgs::{LbfgsOptions, minimise};

/// Bounds on every kernel parameter: with the 1/theta prior alone, an amplitude could approach zero indefinitely.
const KERNEL_BOUNDS: [f64; 2] = [1e-6, 1e6];

/// Greatest number of frames of one model: two kernel matrices of this size are held, half a gigabyte each.
pub(super) const MOST_FRAMES: usize = 8192;

/// Settings for learning a GPDM.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct TrainingOptions {
    /// Dimensions of the latent space, d; 3 in all of the literature followed here.
    pub latent_dimensions: usize,
    /// Order of the dynamics. `[GPDM graph]` assumes the first.
    pub order: DynamicsOrder,
    /// Whether the dynamics predicts steps instead of points.
    pub delta: bool,
    /// Weight of the dynamics in the loss: 1 is the plain GPDM; `None` is the balanced GPDM's D/d.
    pub balance: Option<f64>,
    /// Number of rounds of closed-form scales followed by L-BFGS.
    pub rounds: usize,
    /// L-BFGS iterations per round.
    pub iterations: usize,
}

impl Default for TrainingOptions {
    fn default() -> Self {
        Self {
            latent_dimensions: 3,
            order: DynamicsOrder::First,
            delta: false,
            balance: Some(1.0),
            rounds: 10,
            iterations: 20,
        }
    }
}

/// Why a GPDM could not be learned.
#[derive(Debug, PartialEq, thiserror::Error)]
pub enum GpdmError {
    /// The observations cannot be learned.
    #[error("{0}")]
    Unsuitable(String),
    /// A kernel matrix could not be factored even with the greatest jitter.
    #[error("the kernel matrix of the training motion is singular: check for repeated frames")]
    Singular,
    /// The progress callback stopped the work.
    #[error("learning was interrupted")]
    Interrupted,
}

/// Progress of learning one model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Round {
    pub number: usize,
    /// Negative log posterior after it, up to a constant.
    pub loss: f64,
}

/// Learns a GPDM of `observations` (N x D, the rows of all sequences one after another).
///
/// # Errors
/// [`GpdmError`] if the sequences are too short, not finite or hardly vary.
pub fn train(observations: MatRef<'_, f64>, lengths: &[usize], options: &TrainingOptions) -> Result<Gpdm, GpdmError> {
    train_watched(observations, lengths, options, &mut |_| true)
}

/// As [`train`]; `should_continue` is called after every round and ends the work by returning `false`.
///
/// # Errors
/// As [`train`], and [`GpdmError::Interrupted`].
pub fn train_watched(
    observations: MatRef<'_, f64>,
    lengths: &[usize],
    options: &TrainingOptions,
    should_continue: &mut dyn FnMut(Round) -> bool,
) -> Result<Gpdm, GpdmError> {
    let layout = SequenceLayout { order: options.order, delta: options.delta, lengths: lengths.to_vec() };
    let mean = checked_mean(observations, &layout, options.latent_dimensions)?;
    let centred = Mat::from_fn(observations.nrows(), observations.ncols(), |i, j| observations[(i, j)] - mean[j]);
    let start = Parameters {
        latents: whitened_components(&centred, options.latent_dimensions)?,
        map: MapKernel { inverse_width: 1.0, noise_precision: std::f64::consts::E },
        dynamics: DynamicsKernel {
            amplitude: 0.1,
            inverse_width: 1.0,
            linear: 0.9,
            noise_precision: std::f64::consts::E,
        },
    };
    let (parameters, scales) = descend(centred.as_ref(), &layout, start, options, should_continue)?;
    Gpdm::assemble(mean, centred, scales, parameters, layout).ok_or(GpdmError::Singular)
}

fn descend(
    centred: MatRef<'_, f64>,
    layout: &SequenceLayout,
    start: Parameters,
    options: &TrainingOptions,
    should_continue: &mut dyn FnMut(Round) -> bool,
) -> Result<(Parameters, Vec<f64>), GpdmError> {
    let d = options.latent_dimensions;
    let balance = options.balance.unwrap_or(centred.ncols() as f64 / d as f64);
    let lbfgs = LbfgsOptions { memory: 20, iterations: options.iterations, relative_decrease: 1e-6 };
    let mut parameters = start;
    let mut theta = parameters.pack();
    let (mut lower, mut upper) = (vec![f64::NEG_INFINITY; theta.len()], vec![f64::INFINITY; theta.len()]);
    let kernels = theta.len() - Parameters::KERNEL_PARAMETERS;
    lower[kernels..].fill(KERNEL_BOUNDS[0].ln());
    upper[kernels..].fill(KERNEL_BOUNDS[1].ln());
    let mut previous = f64::INFINITY;
    for number in 1..=options.rounds {
        let scales = closed_form_scales(centred, &parameters)?;
        let mut objective = Objective::new(centred, &scales, layout, balance);
        let value = minimise(
            |theta, gradient| objective.value_and_gradient(theta, d, gradient),
            &mut theta,
            &lower,
            &upper,
            &lbfgs,
        );
        parameters = Parameters::unpack(&theta, d);
        if !should_continue(Round { number, loss: value }) {
            return Err(GpdmError::Interrupted);
        }
        if (previous - value).abs() < 1e-4 * value.abs() {
            break;
        }
        previous = value;
    }
    let scales = closed_form_scales(centred, &parameters)?;
    Ok((parameters, scales))
}

/// `w_d^2 = N / (x_d^T K_X^-1 x_d + kappa^-2)`: minimises the loss for given latents.
fn closed_form_scales(centred: MatRef<'_, f64>, parameters: &Parameters) -> Result<Vec<f64>, GpdmError> {
    let z = &parameters.latents;
    let mut covariance = Mat::zeros(z.nrows(), z.nrows());
    parameters.map.cross(z, z.as_ref(), &mut covariance);
    let ridge = 1.0 / parameters.map.noise_precision;
    let factor = PositiveDefinite::factor(covariance.as_ref(), ridge).ok_or(GpdmError::Singular)?;
    let frames = centred.nrows() as f64;
    let forms = factor.quadratic_forms(centred);
    Ok(forms.into_iter().map(|form| (frames / (form + 1.0 / SCALE_PRIOR_VARIANCE)).sqrt()).collect())
}

fn unsuitable<T>(message: String) -> Result<T, GpdmError> {
    Err(GpdmError::Unsuitable(message))
}

fn too_constant<T>(varying: usize, latent: usize) -> Result<T, GpdmError> {
    unsuitable(format!(
        "the training motion varies in {varying} independent directions, fewer than the {latent} latent dimensions: use \
         a motion with more variation"
    ))
}

fn checked_mean(observations: MatRef<'_, f64>, layout: &SequenceLayout, latent: usize) -> Result<Vec<f64>, GpdmError> {
    let needed = (layout.order.lag() + 2).max(latent + 1);
    if let Some(&frames) = layout.lengths.iter().find(|frames| **frames < needed) {
        return unsuitable(format!("a training sequence of {frames} frames is too short: use at least {needed}"));
    }
    let (rows, frames) = (observations.nrows(), layout.frames());
    if rows != frames || frames == 0 {
        return unsuitable(format!("{rows} observation rows do not match sequences of {frames} frames in total"));
    }
    if frames > MOST_FRAMES {
        return unsuitable(format!(
            "{frames} training frames are too many for one model; expected at most {MOST_FRAMES}: train a graph, or use \
             fewer frames"
        ));
    }
    for dimension in 0..observations.ncols() {
        if let Some(frame) = observations.col(dimension).iter().position(|x| !x.is_finite()) {
            return unsuitable(format!("training frame {frame}, dimension {dimension}: the observation is not finite"));
        }
    }
    let mean: Vec<f64> =
        (0..observations.ncols()).map(|j| observations.col(j).iter().sum::<f64>() / rows as f64).collect();
    let varies = |j: usize| observations.col(j).iter().any(|x| (x - mean[j]).abs() > 1e-9);
    let varying = (0..mean.len()).filter(|j| varies(*j)).count();
    if varying < latent {
        return too_constant(varying, latent);
    }
    Ok(mean)
}

/// The first principal components, each scaled to unit variance, signs fixed so that the largest entry is positive.
///
/// From the eigenvectors of the D x D scatter matrix (nalgebra's: faer's decompositions would double the build time).
fn whitened_components(centred: &Mat<f64>, d: usize) -> Result<Mat<f64>, GpdmError> {
    let (rows, columns) = (centred.nrows(), centred.ncols());
    let scatter = DMatrix::from_fn(columns, columns, |a, b| {
        centred.col_as_slice(a).iter().zip(centred.col_as_slice(b)).map(|(x, y)| x * y).sum::<f64>()
    });
    let eigen = SymmetricEigen::new(scatter);
    let mut order: Vec<usize> = (0..columns).collect();
    order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
    let value = |rank: usize| eigen.eigenvalues[order[rank]];
    let varying = (0..columns.min(rows)).filter(|rank| value(*rank) > 1e-12 * value(0)).count();
    if varying < d {
        return too_constant(varying, d);
    }
    let mut components = Mat::zeros(rows, d);
    for (c, component) in order.iter().enumerate().take(d) {
        let axis = eigen.eigenvectors.column(*component);
        let along = |i: usize| (0..columns).map(|j| centred[(i, j)] * axis[j]).sum::<f64>();
        let coordinates: Vec<f64> = (0..rows).map(along).collect();
        let largest = coordinates.iter().copied().fold(0.0_f64, |a, b| if b.abs() > a.abs() { b } else { a });
        let unit = (rows as f64 / value(c)).sqrt() * largest.signum();
        components.col_as_slice_mut(c).iter_mut().zip(coordinates).for_each(|(z, x)| *z = x * unit);
    }
    Ok(components)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two cycles of a motion with twelve channels along a loop.
    fn cycles(frames: usize) -> Mat<f64> {
        Mat::from_fn(frames, 12, |i, j| {
            let phase = i as f64 * std::f64::consts::TAU / 30.0;
            (phase + 0.6 * j as f64).sin() * (0.2 + 0.03 * j as f64) + 0.05 * (2.0 * phase + j as f64).cos()
        })
    }

    #[test]
    fn a_cyclic_motion_is_reconstructed_from_its_latents() {
        let x = cycles(60);
        let model = train(x.as_ref(), &[60], &TrainingOptions::default()).unwrap();
        let mapped = model.map_mean(model.latents());
        let worst = (0..60)
            .flat_map(|i| (0..12).map(move |j| (i, j)))
            .map(|(i, j)| (mapped[(i, j)] - x[(i, j)]).abs())
            .fold(0.0, f64::max);
        assert!(worst < 0.02, "worst error {worst}");
    }

    #[test]
    fn closed_form_scales_minimise_the_loss() {
        let x = cycles(20);
        let parameters = Parameters {
            latents: whitened_components(&x, 3).unwrap(),
            map: MapKernel { inverse_width: 1.0, noise_precision: 30.0 },
            dynamics: DynamicsKernel { amplitude: 0.1, inverse_width: 1.0, linear: 0.9, noise_precision: 3.0 },
        };
        let layout = SequenceLayout { order: DynamicsOrder::First, delta: false, lengths: vec![20] };
        let scales = closed_form_scales(x.as_ref(), &parameters).unwrap();
        let theta = parameters.pack();
        let mut gradient = vec![0.0; theta.len()];
        let mut loss = |scales: &[f64]| {
            Objective::new(x.as_ref(), scales, &layout, 1.0).value_and_gradient(&theta, 3, &mut gradient)
        };
        let least = loss(&scales);
        for j in 0..scales.len() {
            for factor in [0.99, 1.01] {
                let mut moved = scales.clone();
                moved[j] *= factor;
                assert!(loss(&moved) > least);
            }
        }
    }

    #[test]
    fn unsuitable_motions_are_refused_with_the_reason() {
        let x = cycles(40);
        let refused = |x: MatRef<'_, f64>, length: usize| {
            train(x, &[length], &TrainingOptions::default()).unwrap_err().to_string()
        };
        let still = Mat::from_fn(40, 12, |i, j| if j == 0 { i as f64 } else { 1.0 });
        let mut broken = x.clone();
        broken[(7, 3)] = f64::NAN;
        let long = Mat::zeros(MOST_FRAMES + 1, 1);
        for (refused, words) in [
            (refused(x.as_ref().subrows(0, 2), 2), "a training sequence of 2 frames is too short: use at least 4"),
            (refused(x.as_ref(), 39), "40 observation rows do not match sequences of 39 frames"),
            (refused(long.as_ref(), MOST_FRAMES + 1), "8193 training frames are too many for one model"),
            (refused(still.as_ref(), 40), "varies in 1 independent directions, fewer than the 3 latent dimensions"),
            (refused(broken.as_ref(), 40), "training frame 7, dimension 3: the observation is not finite"),
        ] {
            assert!(refused.contains(words), "{refused}");
        }
    }

    #[test]
    fn learning_stops_after_the_round_in_which_it_is_interrupted() {
        let x = cycles(30);
        let mut heard = Vec::new();
        let mut twice = |round: Round| {
            heard.push(round);
            round.number < 2
        };
        let stopped = train_watched(x.as_ref(), &[30], &TrainingOptions::default(), &mut twice);
        assert_eq!(stopped.unwrap_err(), GpdmError::Interrupted);
        assert!(heard.len() == 2 && heard[1].loss < heard[0].loss, "{heard:?}");
    }

    #[test]
    fn duplicate_frames_can_be_learned() {
        let x = cycles(30);
        let doubled = Mat::from_fn(60, 12, |i, j| x[(i / 2, j)]);
        train(doubled.as_ref(), &[60], &TrainingOptions { rounds: 2, ..TrainingOptions::default() }).unwrap();
    }
}
