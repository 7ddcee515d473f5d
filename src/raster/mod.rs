//! Bit-packed silhouettes and what is measured on them.

mod mask;
mod tapered_capsule;

pub use mask::Mask;
pub use tapered_capsule::TaperedCapsule;
