//! Background subtraction: silhouettes from images of a static camera.
//!
//! [`BackgroundMixture`] is HumanEva's (`[Sigal 2010]`): one Gaussian per pixel for each period in which the background
//! was recorded, learned once. [`Cleaning`] and [`ShadowRule`] post-process its masks for tracking.

mod bounds;
mod cleaning;
mod lanes;
mod mixture;
mod segmenter;
mod shadow;
mod texture;

pub use cleaning::Cleaning;
pub use mixture::{BackgroundMixture, LEAST_BACKGROUND, Risk};
pub use segmenter::{BackgroundSettings, Segmenter};
pub use shadow::ShadowRule;

/// Errors of background models.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum BackgroundError {
    /// Too few images of the background.
    #[error(
        "{frames} background frame(s) for {components} component(s) of the mixture, expected at least one per component; \
         record about 20 per component"
    )]
    TooFew {
        /// Number of background images.
        frames: usize,
        /// Number of components of the mixture.
        components: usize,
    },
    /// An image differs from the first in size or number of channels.
    #[error(
        "{} x {} pixels with {} channel(s), expected {} x {} with {}, as in the first background frame",
        found.0, found.1, found.2, expected.0, expected.1, expected.2
    )]
    Shape {
        /// Width, height and channels of the image.
        found: (u32, u32, usize),
        /// Those of the first image.
        expected: (u32, u32, usize),
    },
}
