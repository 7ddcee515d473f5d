//! Motion in the latent spaces of a GPDM, a switching GPDM or a GPDM graph: the same particles with different
//! transitions.
//!
//! Per frame and particle, in the order of `[GPDM graph]` (section 3.3): inter-transition, intra-transition, mapping
//! to a pose. Weighting and resampling are the filter's. In addition to its latent point, a particle has the position
//! and heading of its body: `[GPDM graph]` does not define the motion of the root; here it follows from the footholds
//! that the particle remembers and from the velocities predicted by the model.

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
