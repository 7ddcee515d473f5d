//! Pixels in groups of eight, row by row, as vector instructions want them.

use crate::raster::Mask;

/// Pixels of a group.
pub(super) const LANES: usize = 8;

/// A value for every pixel of a group.
pub(super) type PixelLane = [f32; LANES];

/// Groups that a row of `width` pixels takes; the last is filled up with pixels that are not there.
pub(super) fn groups_per_row(width: u32) -> usize {
    (width as usize).div_ceil(LANES)
}

/// The values of group `group` of a row; 0 beyond its end.
#[inline(always)]
pub(super) fn lane_of(row: &[u8], group: usize) -> PixelLane {
    match row.get(group * LANES..(group + 1) * LANES) {
        Some(values) => std::array::from_fn(|i| f32::from(values[i])),
        None => std::array::from_fn(|i| row.get(group * LANES + i).map_or(0.0, |value| f32::from(*value))),
    }
}

/// Writes the eight bits of a group into a row of a mask; those beyond the image are left out.
#[inline(always)]
pub(super) fn put(mask: &mut Mask, y: u32, group: usize, bits: u8) {
    let left = (mask.width() as usize).saturating_sub(group * LANES);
    let bits = if left < LANES { bits & ((1_u16 << left) - 1) as u8 } else { bits };
    let row = mask.row_mut(y);
    row[group / 8] |= u64::from(bits) << (LANES * (group % 8));
}
