//! Opening and closing of masks with squares and dilation with discs, word by word.

use super::Mask;

/// Opening of `mask` by a square of `2 radius + 1` pixels: erosion, then dilation. Pixels outside the image count as
/// set for erosion, so that parts cut by the border remain.
pub fn opened(mask: &Mask, radius: u32) -> Mask {
    dilated(&eroded(mask, radius), radius)
}

/// Closing of `mask` by a square of `2 radius + 1` pixels: dilation, then erosion.
pub fn closed(mask: &Mask, radius: u32) -> Mask {
    eroded(&dilated(mask, radius), radius)
}

/// Every pixel whose centre is at most `radius` from the centre of a set pixel.
pub fn grown_by_disc(mask: &Mask, radius: u32) -> Mask {
    let (width, height) = (mask.width(), mask.height());
    let inside = last_word(width);
    let mut grown = Mask::new(width, height);
    // further words are out of a pixel's reach
    let margin = radius as usize / 64 + 1;
    let mut spread = Vec::new();
    for y in 0..height {
        let row = mask.row(y);
        let Some(first) = row.iter().position(|word| *word != 0) else { continue };
        let last = row.iter().rposition(|word| *word != 0).unwrap_or(first);
        let near = first.saturating_sub(margin)..(last + margin + 1).min(row.len());
        for away in 0..=radius {
            let reach = f64::from(radius * radius - away * away).sqrt() as u32;
            spread.clear();
            spread.extend_from_slice(&row[near.clone()]);
            (0..reach).for_each(|_| spread_by_one(&mut spread));
            for target in [y.checked_sub(away), Some(y + away).filter(|y| *y < height)].into_iter().flatten() {
                grown.row_mut(target)[near.clone()].iter_mut().zip(&spread).for_each(|(word, more)| *word |= more);
            }
        }
    }
    (0..height).for_each(|y| grown.row_mut(y).last_mut().into_iter().for_each(|word| *word &= inside));
    grown
}

/// The bits of a row's last word that are pixels.
fn last_word(width: u32) -> u64 {
    u64::MAX >> (width.next_multiple_of(64) - width)
}

/// Spreads every bit to its left and right neighbours.
fn spread_by_one(row: &mut [u64]) {
    let mut before = 0;
    for index in 0..row.len() {
        let (word, after) = (row[index], row.get(index + 1).map_or(0, |next| next << 63));
        row[index] = word | word << 1 | before | word >> 1 | after;
        before = word >> 63;
    }
}

fn dilated(mask: &Mask, radius: u32) -> Mask {
    (0..radius).fold(mask.clone(), |mask, _| with_neighbours(&mask, false))
}

fn eroded(mask: &Mask, radius: u32) -> Mask {
    (0..radius).fold(mask.clone(), |mask, _| with_neighbours(&mask, true))
}

/// Every pixel combined with its eight neighbours by "or" or, for erosion, by "and". Complementing the words turns one
/// into the other.
fn with_neighbours(mask: &Mask, erode: bool) -> Mask {
    let flip = if erode { u64::MAX } else { 0 };
    let inside = last_word(mask.width());
    let last = (mask.width() as usize).div_ceil(64).saturating_sub(1);
    let word = |y: u32, index: usize| {
        let whole = if index == last { inside } else { u64::MAX };
        (mask.row(y)[index] ^ flip) & whole
    };
    let mut joined = Mask::new(mask.width(), mask.height());
    let mut rows: Vec<u64> = vec![0; last + 1];
    for y in 0..mask.height() {
        for (index, joined) in rows.iter_mut().enumerate().take(mask.row(y).len()) {
            let above = if y > 0 { word(y - 1, index) } else { 0 };
            let below = if y + 1 < mask.height() { word(y + 1, index) } else { 0 };
            *joined = above | word(y, index) | below;
        }
        spread_by_one(&mut rows);
        for (index, (word, spread)) in joined.row_mut(y).iter_mut().zip(&rows).enumerate() {
            *word = (spread ^ flip) & if index == last { inside } else { u64::MAX };
        }
    }
    joined
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::mask::tests::noise;
    use proptest::prelude::*;

    fn by_pixel(mask: &Mask, erode: bool) -> Mask {
        Mask::from_fn(mask.width(), mask.height(), |x, y| {
            let around = (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (i64::from(x) + dx, i64::from(y) + dy)));
            let inside = |(u, v): &(i64, i64)| {
                (0..i64::from(mask.width())).contains(u) && (0..i64::from(mask.height())).contains(v)
            };
            let mut values = around.filter(inside).map(|(u, v)| mask.get(u as u32, v as u32));
            if erode { values.all(|set| set) } else { values.any(|set| set) }
        })
    }

    proptest! {
        #[test]
        fn a_step_agrees_with_the_neighbours_of_every_pixel(
            width in 1..150_u32, height in 1..9_u32, seed in any::<u64>(), share in 1..10_u64,
        ) {
            let mask = noise(width, height, seed, |number| number % 10 < share);
            prop_assert_eq!(dilated(&mask, 1), by_pixel(&mask, false));
            prop_assert_eq!(eroded(&mask, 1), by_pixel(&mask, true));
            let opened = opened(&mask, 2);
            prop_assert_eq!(opened.count_common(&mask), opened.count(), "opening adds nothing");
            prop_assert_eq!(closed(&mask, 2).count_common(&mask), mask.count(), "closing removes nothing");
        }

        #[test]
        fn dilation_by_a_disc_sets_the_pixels_within_its_radius(
            width in 1_u32..140, height in 1_u32..12, radius in 0_u32..5, seed in prop::collection::vec((0_u32..140, 0_u32..12), 1..6)
        ) {
            let mut mask = Mask::new(width, height);
            seed.iter().for_each(|(x, y)| mask.set(x % width, y % height, true));
            let near = |x: u32, y: u32| mask.pixels().any(|(i, j)| i.abs_diff(x).pow(2) + j.abs_diff(y).pow(2) <= radius * radius);
            let expected = Mask::from_fn(width, height, near);
            prop_assert!(grown_by_disc(&mask, radius) == expected);
        }
    }
}
