//! Values on a grid as colours.

use super::drawing::{encoded, new_picture, pixel};
use super::{ReportError, base64};

/// Colours from the lowest to the highest value: blue is low, red is high.
const RAMP: [[f32; 3]; 5] =
    [[10.0, 42.0, 110.0], [47.0, 134.0, 196.0], [238.0, 232.0, 205.0], [222.0, 120.0, 60.0], [134.0, 14.0, 32.0]];

/// A square grid of `points` times `points` values, row by row from below, as PNG in Base64.
///
/// # Errors
/// [`ReportError`] without points.
pub fn heat_map(values: &[f64], points: usize) -> Result<String, ReportError> {
    let mut picture = new_picture(points as u32, points as u32)?;
    let low = values.iter().copied().fold(f64::INFINITY, f64::min);
    let high = values.iter().copied().filter(|value| value.is_finite()).fold(low, f64::max);
    let rows = values.chunks(points.max(1)).rev().flatten();
    for (place, value) in picture.pixels_mut().iter_mut().zip(rows) {
        *place = pixel(colour(((value - low) / (high - low).max(f64::MIN_POSITIVE)) as f32));
    }
    Ok(base64::encode(&encoded(&picture)?))
}

/// The colour of the ramp at a share in [0, 1].
fn colour(share: f32) -> [u8; 3] {
    let along = share.clamp(0.0, 1.0) * (RAMP.len() - 1) as f32;
    let index = (along as usize).min(RAMP.len() - 2);
    let rest = along - index as f32;
    [0, 1, 2].map(|c| (RAMP[index][c] + rest * (RAMP[index + 1][c] - RAMP[index][c])).round() as u8)
}
