//! One camera's view of one frame: silhouettes and both skeletons.

use nalgebra::Point2;
use tiny_skia::{Color, FilterQuality, Pixmap, PixmapPaint, Transform};

use crate::body::Markers;
use crate::camera::Camera;
use crate::raster::Mask;

use super::ReportError;
use super::overlay::{Whose, Window, draw_bones, marker_bones};

/// Width of a view's picture, pixels.
pub const CELL_WIDTH: u32 = 360;
/// Height of a view's picture, pixels.
pub const CELL_HEIGHT: u32 = 480;

/// Neither silhouette.
pub(super) const GROUND: [u8; 3] = [0x1b, 0x26, 0x31];
/// Beyond the camera's image.
const OUTSIDE: [u8; 3] = [0x0d, 0x13, 0x19];
/// Both silhouettes.
pub(super) const BOTH: [u8; 3] = [0xa9, 0xb8, 0xc6];
/// Observed, but not covered by the model.
pub(super) const ONLY_OBSERVED: [u8; 3] = [0xf2, 0xc1, 0x4e];
/// Covered by the model, but not observed.
pub(super) const ONLY_ESTIMATED: [u8; 3] = [0x4f, 0x7f, 0xe0];

/// What one camera saw in one frame, and what the estimate would show there.
#[derive(Clone, Copy)]
pub(super) struct View<'a> {
    pub(super) camera: &'a Camera,
    pub(super) observed: &'a Mask,
    pub(super) estimated: &'a Mask,
    pub(super) truth: &'a Markers,
    pub(super) estimate: &'a Markers,
}

/// A rectangle of pixels: first and one past the last, x then y.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Extent {
    x: [f64; 2],
    y: [f64; 2],
}

impl View<'_> {
    /// Where the two silhouettes are; the whole image if nowhere.
    pub(super) fn extent(&self) -> Extent {
        let (width, height) = (self.observed.width(), self.observed.height());
        let mut found: Option<Extent> = None;
        for mask in [self.observed, self.estimated] {
            for y in 0..height.min(mask.height()) {
                let Some([left, right]) = row_extent(mask, y) else { continue };
                let row = Extent { x: [left, right], y: [f64::from(y), f64::from(y + 1)] };
                found = Some(found.map_or(row, |so_far| so_far.union(&row)));
            }
        }
        found.unwrap_or(Extent { x: [0.0, f64::from(width)], y: [0.0, f64::from(height)] })
    }

    /// The picture of the part of the image around `extent`, `span` camera pixels wide.
    pub(super) fn draw(&self, extent: &Extent, span: f64) -> Result<Pixmap, ReportError> {
        let scale = f64::from(CELL_WIDTH) / span;
        let half = Point2::new(0.5 * span, 0.5 * f64::from(CELL_HEIGHT) / scale);
        let window = Window { corner: extent.centre() - half.coords, scale };
        let mut picture = new_picture(CELL_WIDTH, CELL_HEIGHT)?;
        picture.fill(colour(OUTSIDE));
        let paint = PixmapPaint { quality: FilterQuality::Bilinear, ..PixmapPaint::default() };
        let place = Transform::from_row(
            scale as f32,
            0.0,
            0.0,
            scale as f32,
            (-scale * window.corner.x) as f32,
            (-scale * window.corner.y) as f32,
        );
        picture.draw_pixmap(0, 0, self.silhouettes()?.as_ref(), &paint, place, None);
        for (markers, whose) in [(self.truth, Whose::Truth), (self.estimate, Whose::Estimate)] {
            draw_bones(&mut picture, self.camera, &window, &marker_bones(markers), whose, 3.2);
        }
        Ok(picture)
    }

    /// Both silhouettes at the camera's own size.
    fn silhouettes(&self) -> Result<Pixmap, ReportError> {
        let (width, height) = (self.observed.width(), self.observed.height());
        let mut picture = new_picture(width, height)?;
        let positions = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        for (pixel, (x, y)) in picture.pixels_mut().iter_mut().zip(positions) {
            let tone = match (self.observed.get(x, y), self.estimated.get(x, y)) {
                (true, true) => BOTH,
                (true, false) => ONLY_OBSERVED,
                (false, true) => ONLY_ESTIMATED,
                (false, false) => GROUND,
            };
            *pixel = colour(tone).premultiply().to_color_u8();
        }
        Ok(picture)
    }
}

impl Extent {
    pub(super) fn union(&self, other: &Self) -> Self {
        let join = |a: [f64; 2], b: [f64; 2]| [a[0].min(b[0]), a[1].max(b[1])];
        Self { x: join(self.x, other.x), y: join(self.y, other.y) }
    }

    fn centre(&self) -> Point2<f64> {
        Point2::new(0.5 * (self.x[0] + self.x[1]), 0.5 * (self.y[0] + self.y[1]))
    }

    /// How wide a picture must be, in camera pixels, to hold this with a margin.
    pub(super) fn span(&self) -> f64 {
        let aspect = f64::from(CELL_WIDTH) / f64::from(CELL_HEIGHT);
        1.16 * (self.x[1] - self.x[0]).max(aspect * (self.y[1] - self.y[0]))
    }
}

/// First and one past the last set pixel of a row.
fn row_extent(mask: &Mask, y: u32) -> Option<[f64; 2]> {
    let words = mask.row(y);
    let first = words.iter().position(|word| *word != 0)?;
    let last = words.iter().rposition(|word| *word != 0)?;
    let left = 64 * first as u32 + words[first].trailing_zeros();
    let right = 64 * (last as u32 + 1) - words[last].leading_zeros();
    Some([f64::from(left), f64::from(right)])
}

pub(super) fn colour([red, green, blue]: [u8; 3]) -> Color {
    Color::from_rgba8(red, green, blue, 255)
}

pub(super) fn new_picture(width: u32, height: u32) -> Result<Pixmap, ReportError> {
    Pixmap::new(width, height).ok_or(ReportError::Size { width, height })
}

pub(super) fn png(picture: &Pixmap) -> Result<Vec<u8>, ReportError> {
    picture.encode_png().map_err(|error| ReportError::Png(error.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluation::fixture::standing;
    use crate::report::fixture::camera_in_front;

    fn block(x: [u32; 2], y: [u32; 2]) -> Mask {
        let mut mask = Mask::new(320, 240);
        (y[0]..y[1]).for_each(|y| (x[0]..x[1]).for_each(|x| mask.set(x, y, true)));
        mask
    }

    #[test]
    fn the_extent_holds_both_silhouettes_to_the_pixel() {
        let (observed, estimated) = (block([63, 65], [10, 20]), block([128, 192], [15, 30]));
        let (camera, markers) = (camera_in_front(), standing());
        let view =
            View { camera: &camera, observed: &observed, estimated: &estimated, truth: &markers, estimate: &markers };
        assert_eq!(view.extent(), Extent { x: [63.0, 192.0], y: [10.0, 30.0] });
        let empty = Mask::new(320, 240);
        let nothing = View { observed: &empty, estimated: &empty, ..view };
        assert_eq!(nothing.extent(), Extent { x: [0.0, 320.0], y: [0.0, 240.0] });
    }

    #[test]
    fn agreement_and_both_kinds_of_disagreement_have_their_own_tone() {
        let (observed, estimated) = (block([40, 160], [40, 200]), block([80, 200], [40, 200]));
        let (camera, nobody) = (camera_in_front(), [None; 15]);
        let view =
            View { camera: &camera, observed: &observed, estimated: &estimated, truth: &nobody, estimate: &nobody };
        let picture = view.draw(&view.extent(), view.extent().span()).unwrap();
        let tone_at = |x: u32| {
            let pixel = picture.pixel(x, CELL_HEIGHT / 2).unwrap();
            [pixel.red(), pixel.green(), pixel.blue()]
        };
        assert_eq!([55, 180, 305].map(tone_at), [ONLY_OBSERVED, BOTH, ONLY_ESTIMATED]);
        assert_eq!(tone_at(4), GROUND);
    }
}
