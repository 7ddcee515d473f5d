//! Holes in a silhouette, and blobs outside it.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use skiagraph_core::raster::Mask;

/// Radii, as shares of the image height.
const MIN_RADIUS: f64 = 1.0 / 480.0;
const MAX_HOLE_RADIUS: f64 = 6.0 / 480.0;
const MAX_BLOB_RADIUS: f64 = 12.0 / 480.0;

/// Maximum number of discs tried per pixel to change; even a nearly full image needs few.
const TRIES_PER_PIXEL: u64 = 20;

/// Clears discs of `mask` until `share` of its pixels are cleared.
pub(super) fn cut_holes(mask: &mut Mask, share: f64, random: &mut ChaCha8Rng) {
    let inside: Vec<(u32, u32)> = mask.pixels().collect();
    if inside.is_empty() {
        return;
    }
    let count = (share * inside.len() as f64).round() as u64;
    let max_radius = MAX_HOLE_RADIUS * f64::from(mask.height());
    stamp_until(mask, count, max_radius, false, random, |random| inside[random.random_range(0..inside.len())]);
}

/// Sets discs anywhere until the number of added pixels is `share` times that of set ones.
pub(super) fn add_blobs(mask: &mut Mask, share: f64, random: &mut ChaCha8Rng) {
    let room = u64::from(mask.width()) * u64::from(mask.height()) - mask.count();
    let count = ((share * mask.count() as f64).round() as u64).min(room);
    let max_radius = MAX_BLOB_RADIUS * f64::from(mask.height());
    let (width, height) = (mask.width().max(1), mask.height().max(1));
    stamp_until(mask, count, max_radius, true, random, |random| {
        (random.random_range(0..width), random.random_range(0..height))
    });
}

fn stamp_until(
    mask: &mut Mask,
    count: u64,
    max_radius: f64,
    value: bool,
    random: &mut ChaCha8Rng,
    mut centre: impl FnMut(&mut ChaCha8Rng) -> (u32, u32),
) {
    let min_radius = MIN_RADIUS * f64::from(mask.height());
    let mut left = count;
    for _ in 0..count.saturating_mul(TRIES_PER_PIXEL) {
        if left == 0 {
            return;
        }
        let at = centre(random);
        let radius = min_radius + (max_radius - min_radius) * random.random::<f64>();
        left -= stamp(mask, at, radius, value, left);
    }
}

/// Sets the pixels of a disc to `value`, row by row, changing at most `most`. Returns the number of changed pixels.
fn stamp(mask: &mut Mask, (x, y): (u32, u32), radius: f64, value: bool, most: u64) -> u64 {
    let reach = radius.floor() as i64;
    let mut changed = 0;
    for (dy, dx) in (-reach..=reach).flat_map(|dy| (-reach..=reach).map(move |dx| (dy, dx))) {
        let (u, v) = (i64::from(x) + dx, i64::from(y) + dy);
        let inside = u >= 0 && v >= 0 && u < i64::from(mask.width()) && v < i64::from(mask.height());
        if inside && ((dx * dx + dy * dy) as f64) <= radius * radius && mask.get(u as u32, v as u32) != value {
            if changed == most {
                return changed;
            }
            mask.set(u as u32, v as u32, value);
            changed += 1;
        }
    }
    changed
}

#[cfg(test)]
mod tests {
    use super::*;
    use skiagraph_core::rng::{Purpose, stream};

    #[test]
    fn holes_and_blobs_change_exactly_the_given_share_of_pixels() {
        let figure = Mask::from_fn(320, 240, |x, y| (100..180).contains(&x) && (30..210).contains(&y));
        let area = figure.count();
        for share in [0.01, 0.2, 1.0] {
            let mut random = stream(5, Purpose::Corruption, 0, 0, 0);
            let (mut with_holes, mut with_blobs) = (figure.clone(), figure.clone());
            cut_holes(&mut with_holes, share, &mut random);
            assert_eq!(with_holes.count(), area - (share * area as f64).round() as u64);
            assert_eq!(with_holes.count_common(&figure), with_holes.count(), "nothing is added");
            add_blobs(&mut with_blobs, share, &mut random);
            assert_eq!(with_blobs.count(), area + (share * area as f64).round() as u64);
            assert_eq!(with_blobs.count_common(&figure), area, "nothing is lost");
        }
    }

    #[test]
    fn an_empty_mask_stays_empty_and_a_full_one_full() {
        let mut random = stream(5, Purpose::Corruption, 0, 0, 0);
        let (mut empty, mut full) = (Mask::new(30, 20), Mask::from_fn(30, 20, |_, _| true));
        cut_holes(&mut empty, 0.5, &mut random);
        add_blobs(&mut empty, 0.5, &mut random);
        add_blobs(&mut full, 5.0, &mut random);
        assert!(empty.is_empty() && full.count() == 600);
    }
}
