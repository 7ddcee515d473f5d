//! The Gaussian process dynamical model (GPDM): poses are a smooth function of a point in a low-dimensional latent
//! space that moves by a smooth, noisy first- or second-order dynamics (`[GPDM graph]` Eqs. 1 to 6, after `[Wang
//! 2008]`).
//!
//! | paper | here |
//! |---|---|
//! | `X`, N x D observations | [`Gpdm::observation`], one row per frame |
//! | `Z`, N x d latents | [`Gpdm::latents`] |
//! | `k_X` with beta | [`MapKernel`] |
//! | `k_Z` with alpha | [`DynamicsKernel`] |
//! | `W` | [`Gpdm::scales`] |
//!
//! Eqs. 3 to 6 of `[GPDM graph]` are only partly legible; the kernels are Wang's. Learning minimises the negative log
//! posterior by alternating the closed form of `W` with L-BFGS on the latents and the kernels' logarithms
//! ([`train()`]).

mod kernel;
mod layout;
mod model;
mod objective;
mod parts;
mod positive_definite;
mod predictor;
mod radial;
mod train;

pub use kernel::{DynamicsKernel, MapKernel};
pub use layout::{DynamicsOrder, SequenceLayout};
pub use model::{Gpdm, Moments};
pub use objective::{Objective, Parameters};
pub use parts::{GpdmParts, PartsError};
pub use train::{GpdmError, Round, TrainingOptions, train, train_watched};
