//! Visibility of the background's texture: through a shadow it stays visible, and clothing hides it.

use nalgebra::SVector;

use super::mixture::ChannelMean;

/// Half the width of the square in which texture is compared, pixels.
pub(super) const REACH_PX: u32 = 12;
/// Texture is hidden if its contrast is below this share of the contrast that a shadow leaves. 0 is expected of
/// clothing; more than 0 of clothing with a texture of its own.
const HIDDEN: f64 = 1.0 / 3.0;
/// Standard errors by which the contrast must be below that of a shadow. They are those of independent differences; as
/// neighbouring differences share a pixel, they are somewhat too small.
const SIGNIFICANCE: f64 = 3.0;

/// A pixel of an image, and the background there.
pub(super) struct Brightness {
    /// Of the image, by channel, grey values.
    pub(super) image: Vec<f32>,
    /// Component of the background.
    pub(super) component: usize,
    /// Of that component, by channel.
    pub(super) means: Vec<ChannelMean>,
}

/// Sums over pixels: brightness of image and background; then over pairs of neighbours and channels: number of
/// differences; products of differences, namely background with itself, background with image, and image with itself;
/// and variance of the errors of the background's differences.
type Sums = SVector<f64, 7>;

/// The differences between neighbouring pixels of the image and of the background, summed over rectangles
/// (`[Sanin 2010]` compares the same gradients, over whole regions).
pub(super) struct Texture {
    width: usize,
    height: usize,
    /// Sums over all pixels above and to the left, in rows of `width` + 1.
    sums: Vec<Sums>,
}

impl Texture {
    /// `pixels` in rows of `width`; those without brightness are not compared.
    pub(super) fn new(pixels: &[Option<Brightness>], width: usize) -> Self {
        let height = pixels.len() / width.max(1);
        let at = |x: usize, y: usize| (x < width && y < height).then(|| pixels[y * width + x].as_ref()).flatten();
        let mut sums = vec![Sums::zeros(); (width + 1) * (height + 1)];
        for y in 0..height {
            let mut row = Sums::zeros();
            for x in 0..width {
                if let Some(here) = at(x, y) {
                    row += of_pixel(here);
                    [at(x + 1, y), at(x, y + 1)].into_iter().flatten().for_each(|next| row += of_pair(here, next));
                }
                sums[(y + 1) * (width + 1) + x + 1] = sums[y * (width + 1) + x + 1] + row;
            }
        }
        Self { width, height, sums }
    }

    /// Whether the background's texture is hidden around a pixel. Where the background has too little texture to tell,
    /// it is not.
    pub(super) fn is_hidden(&self, x: usize, y: usize) -> bool {
        let reach = REACH_PX as usize;
        let (left, top) = (x.saturating_sub(reach), y.saturating_sub(reach));
        let (right, bottom) = ((x + reach + 1).min(self.width), (y + reach + 1).min(self.height));
        let before = |x: usize, y: usize| self.sums[y * (self.width + 1) + x];
        let sums = before(right, bottom) - before(left, bottom) - before(right, top) + before(left, top);
        let [image, background, differences, squared, product, image_squared, errors] = sums.into();
        // of the true background, whose differences the errors of the means have increased
        let texture = squared - errors;
        if texture <= errors || background <= 0.0 {
            return false;
        }
        // the regression of the image's differences on the background's
        let contrast = product / texture;
        let rest = (image_squared - product * product / squared).max(0.0) / differences;
        let error = (rest * squared).sqrt() / texture;
        let of_shadow = image / background;
        contrast < HIDDEN * of_shadow && contrast + SIGNIFICANCE * error < of_shadow
    }
}

fn of_pixel(brightness: &Brightness) -> Sums {
    let image = brightness.image.iter().map(|value| f64::from(*value)).sum();
    let background = brightness.means.iter().map(|channel| f64::from(channel.mean)).sum();
    Sums::from([image, background, 0.0, 0.0, 0.0, 0.0, 0.0])
}

fn of_pair(here: &Brightness, next: &Brightness) -> Sums {
    // components differ in brightness
    if here.component != next.component {
        return Sums::zeros();
    }
    let of_channel = |channel: usize| {
        let image = f64::from(next.image[channel] - here.image[channel]);
        let (one, other) = (here.means[channel], next.means[channel]);
        let background = f64::from(other.mean - one.mean);
        let error = f64::from(one.error_variance + other.error_variance);
        Sums::from([0.0, 0.0, 1.0, background * background, background * image, image * image, error])
    };
    (0..here.image.len()).map(of_channel).sum()
}
