//! Motion in the latent spaces of a GPDM, a switching GPDM or a GPDM graph: the same particles, other transitions.
//!
//! Per frame and particle, in `[GPDM graph]`'s order (section 3.3): inter-transition, intra-transition, mapping to a
//! pose. Weighting and resampling are the filter's. A particle carries, beside its latent point, where the body stands
//! and heads to: `[GPDM graph]` does not say how the root moves, here it follows from the footholds that the particle
//! remembers and from the velocities that the model maps to.

mod descent;
mod footing;
mod initialisation;
mod model;
mod residual;
mod root;
mod settings;
mod transition;

pub use model::{LatentModel, LatentParticle};
pub use settings::{Initialisation, InterTransition, JumpRule, LatentSettings, RootMotion};
