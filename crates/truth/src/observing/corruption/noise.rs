//! Salt-and-pepper noise.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use skiagraph_core::raster::Mask;

/// Flips every pixel with a probability. Gaps between flipped pixels are geometrically distributed, so only one random
/// number per flipped pixel is drawn.
pub(super) fn flip_pixels(mask: &mut Mask, probability: f64, random: &mut ChaCha8Rng) {
    let (width, height) = (u64::from(mask.width()), u64::from(mask.height()));
    let log_unchanged = libm::log1p(-probability.clamp(0.0, 1.0));
    let mut gap = || match log_unchanged {
        0.0 => u64::MAX,
        // 1 - u is never zero
        slope => (libm::log(1.0 - random.random::<f64>()) / slope).floor().min(1e18) as u64,
    };
    let mut pixel = gap();
    while pixel < width * height {
        let (x, y) = ((pixel % width) as u32, (pixel / width) as u32);
        mask.set(x, y, !mask.get(x, y));
        pixel = pixel.saturating_add(gap()).saturating_add(1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use skiagraph_core::rng::{Purpose, stream};

    #[test]
    fn pixels_are_flipped_with_the_given_probability() {
        for probability in [0.0, 1e-3, 0.1, 0.7, 1.0] {
            let mut mask = Mask::new(640, 480);
            flip_pixels(&mut mask, probability, &mut stream(9, Purpose::Corruption, 0, 0, 0));
            let pixels = 640.0 * 480.0;
            let deviation = (pixels * probability * (1.0 - probability)).sqrt();
            let off = mask.count() as f64 - pixels * probability;
            assert!(off.abs() <= 4.0 * deviation, "{probability}: {off} with a deviation of {deviation}");
        }
    }

    #[test]
    fn all_rows_are_equally_likely() {
        let mut rows = [0_u32; 10];
        for seed in 0..2000 {
            let mut mask = Mask::new(7, 10);
            flip_pixels(&mut mask, 0.1, &mut stream(seed, Purpose::Corruption, 0, 0, 0));
            mask.pixels().for_each(|(_, y)| rows[y as usize] += 1);
        }
        // 1400 expected in each row, deviation 35
        assert!(rows.iter().all(|count| count.abs_diff(1400) < 160), "{rows:?}");
    }
}
