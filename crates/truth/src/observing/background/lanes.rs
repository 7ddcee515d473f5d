//! Pixels in groups of eight, row by row, for vector instructions.

use skiagraph_core::raster::Mask;

/// Pixels per group.
pub(super) const LANES: usize = 8;

/// A value for every pixel of a group.
pub(super) type PixelLane = [f32; LANES];

/// Number of groups in a row of `width` pixels; the last one is padded.
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

/// Writes the eight bits of a group into a row of a mask, except those beyond the image.
#[inline(always)]
pub(super) fn put(mask: &mut Mask, y: u32, group: usize, bits: u8) {
    let left = (mask.width() as usize).saturating_sub(group * LANES);
    let bits = if left < LANES { bits & ((1_u16 << left) - 1) as u8 } else { bits };
    let row = mask.row_mut(y);
    row[group / 8] |= u64::from(bits) << (LANES * (group % 8));
}
