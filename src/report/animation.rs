//! A camera's view over time as an animated PNG: the observed silhouettes with the true skeleton.

use std::io::Write;

use png::{BitDepth, ColorType, Compression, Encoder};
use tiny_skia::Pixmap;

use super::ReportError;
use super::drawing::{FIGURE, PAPER, pixel, rgb};
use super::overlay::{BoneLine, PictureWindow, Whose, draw_bones};
use crate::camera::Camera;
use crate::raster::Mask;

/// Maximum denominator of a frame's duration.
const FINEST: f64 = 60_000.0;

/// Writes an animation of `frames` frames at `frames_per_second` that loops for ever. `frame(i)` is called once per
/// frame, in order; one picture is in memory at a time.
///
/// # Errors
/// [`ReportError`] if a picture cannot be drawn or `to` cannot be written; errors of `frame`.
pub fn write_animation<E: From<ReportError>>(
    to: impl Write,
    camera: &Camera,
    frames: usize,
    frames_per_second: f64,
    mut frame: impl FnMut(usize) -> Result<(Mask, Vec<BoneLine>), E>,
) -> Result<(), E> {
    let (width, height) = (camera.pinhole.width, camera.pinhole.height);
    let encoding = |e: png::EncodingError| E::from(ReportError::Animation { detail: e.to_string() });
    let mut encoder = Encoder::new(to, width, height);
    encoder.set_color(ColorType::Rgb);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_compression(Compression::Fast);
    encoder.set_animated(u32::try_from(frames).unwrap_or(u32::MAX), 0).map_err(encoding)?;
    // a frame's duration as a fraction of a second, with the largest terms that the format allows
    let parts = (FINEST / frames_per_second.max(1.0)).floor().clamp(1.0, FINEST);
    encoder
        .set_frame_delay(parts as u16, (parts * frames_per_second).round().clamp(1.0, 65_535.0) as u16)
        .map_err(encoding)?;
    let mut writer = encoder.write_header().map_err(encoding)?;
    for index in 0..frames {
        let (mask, bones) = frame(index)?;
        let picture = picture(camera, &mask, &bones).map_err(E::from)?;
        writer.write_image_data(&rgb(&picture)).map_err(encoding)?;
    }
    writer.finish().map_err(encoding)
}

fn picture(camera: &Camera, mask: &Mask, bones: &[BoneLine]) -> Result<Pixmap, ReportError> {
    let (width, height) = (camera.pinhole.width, camera.pinhole.height);
    let too_large = || ReportError::Animation { detail: format!("no memory for {width} x {height} pixels") };
    let mut picture = Pixmap::new(width, height).ok_or_else(too_large)?;
    for (index, place) in picture.pixels_mut().iter_mut().enumerate() {
        let (x, y) = (index as u32 % width, index as u32 / width);
        *place = pixel(if mask.get(x, y) { FIGURE } else { PAPER });
    }
    let line = (width as f32 / 220.0).max(1.2);
    draw_bones(&mut picture, camera, &PictureWindow::whole(), bones, Whose::Truth, line);
    Ok(picture)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::FieldOfView;
    use nalgebra::{Point3, Vector3};

    #[test]
    fn every_frame_has_its_duration_and_its_skeleton() {
        let eye = Point3::new(3.0, 0.0, 1.0);
        let view = FieldOfView::Vertical(0.8);
        let camera = Camera::look_at("c", eye, Point3::new(0.0, 0.0, 1.0), Vector3::z(), view, 64, 48).unwrap();
        let mut bytes = Vec::new();
        let frame = |index: usize| {
            let mask = Mask::from_fn(64, 48, |x, _| x < 20 + index as u32);
            Ok::<_, ReportError>((mask, vec![[Point3::new(0.0, 0.0, 0.6), Point3::new(0.0, 0.0, 1.4)]]))
        };
        write_animation(&mut bytes, &camera, 3, 30.0, frame).unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(&bytes)).read_info().unwrap();
        assert_eq!(reader.info().animation_control().unwrap().num_frames, 3);
        let mut pixels = vec![0; 64 * 48 * 3];
        for index in 0..3 {
            reader.next_frame(&mut pixels).unwrap();
            let control = reader.info().frame_control().unwrap();
            let seconds = f64::from(control.delay_num) / f64::from(control.delay_den);
            assert!((seconds - 1.0 / 30.0).abs() < 1e-6, "{seconds}");
            let at = |x: usize, y: usize| [0, 1, 2].map(|i| pixels[3 * (64 * y + x) + i]);
            assert_eq!((at(19 + index, 2), at(20 + index, 2)), (FIGURE, PAPER));
            let [red, green, blue] = at(32, 24).map(i32::from);
            assert!(green > red + 50 && green > blue, "the skeleton is green: {red} {green} {blue}");
        }
    }
}
