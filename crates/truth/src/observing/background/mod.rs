//! Background subtraction: silhouettes from images of a camera that stands still.
//!
//! [`BackgroundMixture`] is HumanEva's (`[Sigal 2010]`): one Gaussian a pixel for each period in which the background
//! was recorded, learned once. [`OnlineBackground`] learns while it goes on (`[Stauffer 1999]`). [`Cleaning`] and
//! [`ShadowRule`] make masks of either fit for a tracker.

mod bounds;
mod cleaning;
mod lanes;
mod mixture;
mod online;
mod segmenter;
mod shadow;

pub use cleaning::Cleaning;
pub use mixture::{BackgroundMixture, Risk};
pub use online::{OnlineBackground, OnlineSettings};
pub use segmenter::{BackgroundSettings, Segmenter};
pub use shadow::ShadowRule;

/// Errors of background models.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum BackgroundError {
    /// There are too few images of the background.
    #[error(
        "{frames} background frame(s) for {components} component(s) of the mixture; give at least one frame per component, \
        better 20"
    )]
    TooFew {
        /// Images of the background.
        frames: usize,
        /// Components of the mixture.
        components: usize,
    },
    /// An image does not have the size or the channels of the first.
    #[error(
        "{} x {} pixels with {} channel(s), expected {} x {} with {} as the first background frame has",
        found.0, found.1, found.2, expected.0, expected.1, expected.2
    )]
    Shape {
        /// Width, height and channels of the image.
        found: (u32, u32, usize),
        /// Those of the first image.
        expected: (u32, u32, usize),
    },
}
