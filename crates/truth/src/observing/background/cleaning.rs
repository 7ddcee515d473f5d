//! Cleaning of segmented masks.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::raster::{Mask, closed, opened, without_specks};

/// How a mask is cleaned: opened, closed, then holes filled and small components cleared. Sizes count for images of 640
/// x 480 pixels; components and holes scale with the number of pixels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Cleaning {
    /// Radius of the square that the mask is opened with, pixels: 1 is 3 x 3, 0 leaves it.
    pub open_px: u32,
    /// Radius of the square that the mask is closed with, pixels: 2 is 5 x 5, 0 leaves it.
    pub close_px: u32,
    /// Components of fewer pixels are cleared, but for the largest, and holes of fewer are filled.
    pub least_px: u32,
}

impl Default for Cleaning {
    fn default() -> Self {
        Self { open_px: 1, close_px: 2, least_px: 200 }
    }
}

impl Cleaning {
    /// No cleaning at all.
    pub const NONE: Self = Self { open_px: 0, close_px: 0, least_px: 0 };

    /// The cleaned mask.
    pub fn clean(&self, mask: &Mask) -> Mask {
        let smooth = closed(&opened(mask, self.open_px), self.close_px);
        let pixels = f64::from(mask.width()) * f64::from(mask.height());
        let least = (f64::from(self.least_px) * pixels / (640.0 * 480.0)).round() as u64;
        if least > 0 { without_specks(&smooth, least) } else { smooth }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cleaning_leaves_a_body_and_takes_noise_cracks_and_specks() {
        let body = Mask::from_fn(640, 480, |x, y| (200..300).contains(&x) && (100..400).contains(&y));
        let mut noisy = body.clone();
        (0..640).step_by(7).for_each(|x| noisy.set(x, (x * 5) % 480, (x * 5) % 480 > 450 || x < 190));
        (210..290).for_each(|x| noisy.set(x, 250, false));
        noisy.set(250, 300, false);
        assert_ne!(noisy, body);
        assert_eq!(Cleaning::default().clean(&noisy), body);
        assert_eq!(Cleaning::NONE.clean(&noisy), noisy);
    }
}
