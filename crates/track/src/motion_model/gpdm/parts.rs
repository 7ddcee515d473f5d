//! A learned model as plain numbers, for storage.
//!
//! Derived quantities (kernel matrices, their factors and solutions) are recomputed when a model is assembled: this
//! takes milliseconds and, on the same type of CPU, gives the same bits.

use faer::{Mat, MatRef};

use super::kernel::{DynamicsKernel, MapKernel};
use super::layout::SequenceLayout;
use super::model::Gpdm;
use super::objective::Parameters;
use super::train::MOST_FRAMES;

/// Greatest number of latent dimensions of a model.
const MOST_LATENT_DIMENSIONS: usize = 64;

/// All learned parameters; matrices are in row-major order.
#[derive(Clone, Debug, PartialEq)]
pub struct GpdmParts {
    /// Mean of the training observations, D values.
    pub mean: Vec<f64>,
    /// Training observations minus their mean, N x D.
    pub centred: Vec<f64>,
    /// Scales W, D values.
    pub scales: Vec<f64>,
    /// Latents Z, N x d.
    pub latents: Vec<f64>,
    pub map: MapKernel,
    pub dynamics: DynamicsKernel,
    /// Order of the dynamics and lengths of the sequences, N in total.
    pub layout: SequenceLayout,
}

/// Why numbers do not form a model.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{part}: {detail}")]
pub struct PartsError {
    pub part: &'static str,
    /// What was expected and what was found.
    pub detail: String,
}

impl PartsError {
    pub(crate) fn new(part: &'static str, detail: impl Into<String>) -> Self {
        Self { part, detail: detail.into() }
    }
}

impl Gpdm {
    /// The model as plain numbers.
    pub fn to_parts(&self) -> GpdmParts {
        GpdmParts {
            mean: self.mean.clone(),
            centred: row_by_row(self.centred.as_ref()),
            scales: self.scales.clone(),
            latents: row_by_row(self.latents.as_ref()),
            map: self.map,
            dynamics: self.dynamics,
            layout: self.layout.clone(),
        }
    }

    /// Assembles the model stored by [`Self::to_parts`]: its predictions are identical to the last bit.
    ///
    /// # Errors
    /// [`PartsError`] if lengths are inconsistent, a number is not finite, a kernel parameter or scale is not
    /// positive, or a kernel matrix is singular.
    pub fn from_parts(parts: GpdmParts) -> Result<Self, PartsError> {
        let frames = checked_frames(&parts.layout)?;
        let dimensions = parts.mean.len();
        finite("mean", &parts.mean, dimensions.max(1))?;
        finite("scales", &parts.scales, dimensions)?;
        finite("centred", &parts.centred, frames.saturating_mul(dimensions))?;
        let d = parts.latents.len() / frames;
        if d == 0 || d > MOST_LATENT_DIMENSIONS {
            let detail = format!("expected 1 to {MOST_LATENT_DIMENSIONS} dimensions, found {d}");
            return Err(PartsError::new("latents", detail));
        }
        finite("latents", &parts.latents, frames * d)?;
        positive("scales", &parts.scales)?;
        positive("map kernel", &[parts.map.inverse_width, parts.map.noise_precision])?;
        let dynamics = &parts.dynamics;
        let numbers = [dynamics.amplitude, dynamics.inverse_width, dynamics.linear, dynamics.noise_precision];
        positive("dynamics kernel", &numbers)?;
        let centred = from_rows(&parts.centred, frames, dimensions);
        let latents = from_rows(&parts.latents, frames, d);
        let parameters = Parameters { latents, map: parts.map, dynamics: parts.dynamics };
        Self::assemble(parts.mean, centred, parts.scales, parameters, parts.layout)
            .ok_or_else(|| PartsError::new("latents", "their kernel matrix is singular"))
    }
}

fn checked_frames(layout: &SequenceLayout) -> Result<usize, PartsError> {
    let least = layout.order.lag() + 1;
    let sum = layout.lengths.iter().try_fold(0_usize, |sum, length| sum.checked_add(*length));
    match sum {
        Some(frames) if (1..=MOST_FRAMES).contains(&frames) && layout.lengths.iter().all(|length| *length >= least) => {
            Ok(frames)
        }
        _ => {
            Err(PartsError::new("sequences", format!("expected at least {least} frames each, {MOST_FRAMES} in total")))
        }
    }
}

fn finite(part: &'static str, values: &[f64], count: usize) -> Result<(), PartsError> {
    if values.len() != count {
        return Err(PartsError::new(part, format!("expected {count} numbers, found {}", values.len())));
    }
    match values.iter().position(|value| !value.is_finite()) {
        None => Ok(()),
        Some(index) => Err(PartsError::new(part, format!("number {index} is not finite"))),
    }
}

fn positive(part: &'static str, values: &[f64]) -> Result<(), PartsError> {
    match values.iter().find(|value| !(**value > 0.0 && value.is_finite())) {
        None => Ok(()),
        Some(value) => Err(PartsError::new(part, format!("expected numbers above zero, found {value}"))),
    }
}

fn row_by_row(matrix: MatRef<'_, f64>) -> Vec<f64> {
    (0..matrix.nrows()).flat_map(|i| (0..matrix.ncols()).map(move |j| matrix[(i, j)])).collect()
}

fn from_rows(values: &[f64], rows: usize, columns: usize) -> Mat<f64> {
    Mat::from_fn(rows, columns, |i, j| values[i * columns + j])
}

#[cfg(test)]
mod tests {
    use super::super::layout::DynamicsOrder;
    use super::super::train::{TrainingOptions, train};
    use super::*;

    fn model(order: DynamicsOrder) -> Gpdm {
        let wave =
            |i: usize, j: usize| (i as f64 * 0.21 + 0.9 * j as f64).sin() + 0.2 * ((i * (j + 1)) as f64 * 0.31).sin();
        let x = Mat::from_fn(40, 7, wave);
        let options = TrainingOptions { rounds: 1, order, delta: true, ..TrainingOptions::default() };
        train(x.as_ref(), &[22, 18], &options).unwrap()
    }

    #[test]
    fn a_reassembled_model_predicts_the_same_bits() {
        for order in [DynamicsOrder::First, DynamicsOrder::Second] {
            let model = model(order);
            let again = Gpdm::from_parts(model.to_parts()).unwrap();
            assert_eq!(again, model);
            let points = Mat::from_fn(5, 3, |i, c| 0.3 * i as f64 - 0.2 * c as f64);
            let inputs = Mat::from_fn(5, 3 * order.lag(), |i, c| 0.2 * i as f64 - 0.1 * c as f64);
            let both = [&model, &again].map(|m| (m.map_moments(points.as_ref()), m.dynamics_moments(inputs.as_ref())));
            let bits = |m: &super::super::Moments| {
                let mean = row_by_row(m.mean.as_ref());
                mean.iter().chain(&m.variance).map(|x| x.to_bits()).collect::<Vec<_>>()
            };
            assert_eq!(bits(&both[0].0), bits(&both[1].0));
            assert_eq!(bits(&both[0].1), bits(&both[1].1));
            let [one, other] = [&model, &again].map(|model| row_by_row(model.simulate(1).unwrap().as_ref()));
            assert_eq!(one, other);
        }
    }

    #[test]
    fn invalid_numbers_are_refused_by_name() {
        let parts = model(DynamicsOrder::First).to_parts();
        type PartsFault<'a> = (&'a str, &'a dyn Fn(&mut GpdmParts));
        let broken: [PartsFault<'_>; 9] = [
            ("mean", &|p| p.mean[2] = f64::NAN),
            ("mean", &|p| p.mean.clear()),
            ("scales", &|p| p.scales[0] = -1.0),
            ("centred", &|p| p.centred.truncate(9)),
            ("latents", &|p| p.latents[3] = f64::INFINITY),
            ("latents", &|p| p.latents.clear()),
            ("map kernel", &|p| p.map.noise_precision = 0.0),
            ("dynamics kernel", &|p| p.dynamics.amplitude = f64::NAN),
            ("sequences", &|p| p.layout.lengths = vec![usize::MAX, 2]),
        ];
        for (name, break_it) in broken {
            let mut parts = parts.clone();
            break_it(&mut parts);
            assert_eq!(Gpdm::from_parts(parts).unwrap_err().part, name);
        }
    }
}
