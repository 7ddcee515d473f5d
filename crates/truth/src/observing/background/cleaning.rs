//! Cleaning of segmented masks.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use skiagraph_core::raster::{Mask, closed, opened, without_specks};

/// Cleaning of masks: small components are cleared and small holes filled, before and after morphological opening and
/// closing. Sizes are for images of 640 x 480 pixels; components and holes scale with the number of pixels. The default
/// does not open, since a square wider than a forearm in the image erases the forearm.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Cleaning {
    /// Radius of the square for opening, pixels: 1 is 3 x 3, 0 disables opening.
    pub open_px: u32,
    /// Radius of the square for closing, pixels: 2 is 5 x 5, 0 disables closing.
    pub close_px: u32,
    /// Components with fewer pixels are cleared, except the largest, and holes with fewer pixels are filled.
    pub least_px: u32,
}

impl Default for Cleaning {
    fn default() -> Self {
        Self { open_px: 0, close_px: 1, least_px: 200 }
    }
}

impl Cleaning {
    /// No cleaning.
    pub const NONE: Self = Self { open_px: 0, close_px: 0, least_px: 0 };

    /// The cleaned mask.
    pub fn clean(&self, mask: &Mask) -> Mask {
        let pixels = f64::from(mask.width()) * f64::from(mask.height());
        let min_px = (f64::from(self.least_px) * pixels / (640.0 * 480.0)).round() as u64;
        let whole = without_specks(mask, min_px);
        without_specks(&closed(&opened(&whole, self.open_px), self.close_px), min_px)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_forearm_of_two_pixels_survives_cleaning() {
        let trunk = |x: u32, y: u32| (140..160).contains(&x) && (60..180).contains(&y);
        let body = Mask::from_fn(320, 240, |x, y| trunk(x, y) || ((160..190).contains(&x) && (100..102).contains(&y)));
        let mut noisy = body.clone();
        (0..320).step_by(9).for_each(|x| noisy.set(x, (x * 7) % 40, true));
        assert_eq!(Cleaning::default().clean(&noisy), body);
    }

    #[test]
    fn cleaning_keeps_a_body_and_removes_noise_cracks_and_specks() {
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
