//! The outermost pixels of a silhouette.

use super::Mask;

/// The set pixels that have an unset neighbour above, below, left or right *inside the image*: a silhouette has no
/// contour at the image border, because its edge is not visible there.
pub fn contour(mask: &Mask) -> Mask {
    let (width, height) = (mask.width(), mask.height());
    let mut contour = Mask::new(width, height);
    let outside = vec![u64::MAX; (width as usize).div_ceil(64)];
    for y in 0..height {
        let row = mask.row(y);
        let above = if y > 0 { mask.row(y - 1) } else { &outside };
        let below = if y + 1 < height { mask.row(y + 1) } else { &outside };
        // most words have no set pixel
        for (index, word) in contour.row_mut(y).iter_mut().enumerate().filter(|(index, _)| row[*index] != 0) {
            let before = if index > 0 { row[index - 1] } else { u64::MAX };
            let after = row.get(index + 1).copied().unwrap_or(u64::MAX);
            let left = row[index] << 1 | before >> 63;
            let mut right = row[index] >> 1 | after << 63;
            if index + 1 == row.len() {
                right |= 1 << ((width - 1) % 64);
            }
            *word = row[index] & !(left & right & above[index] & below[index]);
        }
    }
    contour
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::mask::tests::noise;
    use proptest::prelude::*;

    fn by_pixel(mask: &Mask) -> Mask {
        Mask::from_fn(mask.width(), mask.height(), |x, y| {
            let ends = |x: i64, y: i64| {
                let inside = (0..i64::from(mask.width())).contains(&x) && (0..i64::from(mask.height())).contains(&y);
                inside && !mask.get(x as u32, y as u32)
            };
            let (i, j) = (i64::from(x), i64::from(y));
            mask.get(x, y) && (ends(i - 1, j) || ends(i + 1, j) || ends(i, j - 1) || ends(i, j + 1))
        })
    }

    proptest! {
        #[test]
        fn contours_agree_with_their_definition(
            width in 1..150_u32, height in 1..6_u32, seed in any::<u64>(),
        ) {
            let mask = noise(width, height, seed, |number| !number.is_multiple_of(6));
            prop_assert_eq!(contour(&mask), by_pixel(&mask));
        }
    }
}
