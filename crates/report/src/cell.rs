//! A camera's view of one frame: silhouettes and both skeletons.

use nalgebra::Point2;
use tiny_skia::{FilterQuality, Pixmap, PixmapPaint, Transform};

use skiagraph_core::body::Markers;
use skiagraph_core::camera::Camera;
use skiagraph_core::raster::{Mask, PixelBounds};
use skiagraph_eval::intersection_over_union;
use skiagraph_truth::observing::Image;

use super::ReportError;
use super::drawing::{BLUE, FIGURE, new_picture, new_sheet, pixel};
use super::overlay::{PictureWindow, Whose, draw_bones, marker_bones};

/// Width of a view's picture, pixels.
pub const CELL_WIDTH: u32 = 360;
/// Height of a view's picture, pixels.
pub const CELL_HEIGHT: u32 = 480;

/// In neither silhouette.
pub(super) const GROUND: [u8; 3] = [0x1b, 0x26, 0x31];
pub(super) const PROP: [u8; 3] = [0x4a, 0x41, 0x54];
pub(super) const BOTH: [u8; 3] = FIGURE;
pub(super) const ONLY_OBSERVED: [u8; 3] = [0xf2, 0xc1, 0x4e];
pub(super) const ONLY_ESTIMATED: [u8; 3] = BLUE;

/// The observed and the estimated silhouette of one camera and frame.
#[derive(Clone, Copy)]
pub(super) struct OverlaidView<'a> {
    pub(super) camera: &'a Camera,
    pub(super) observed: &'a Mask,
    /// The image that the tracker was given, if any.
    pub(super) image: Option<&'a Image>,
    /// `None` without a pose to draw.
    pub(super) estimated: Option<&'a Mask>,
    pub(super) props: Option<&'a Mask>,
    pub(super) truth: &'a Markers,
    pub(super) estimate: &'a Markers,
}

impl OverlaidView<'_> {
    /// Intersection over union of the estimated and the observed silhouette; `None` without an estimate, and if both
    /// are empty.
    pub(super) fn overlap(&self) -> Option<f64> {
        intersection_over_union(self.estimated?, self.observed)
    }

    /// Bounds of the two silhouettes; the whole image if both are empty.
    pub(super) fn bounds(&self) -> PixelBounds {
        let observed = self.observed.bounds();
        let found = self.estimated.map_or(observed, |estimated| observed.union(&estimated.bounds()));
        if !found.is_empty() {
            return found;
        }
        PixelBounds { left: 0, top: 0, right: self.observed.width(), bottom: self.observed.height() }
    }

    /// Draws the part of the image around `bounds`, `span` camera pixels wide.
    pub(super) fn draw(&self, bounds: &PixelBounds, span: f64) -> Result<Pixmap, ReportError> {
        let window = window(bounds, span);
        let scale = window.scale;
        let mut picture = new_sheet(CELL_WIDTH, CELL_HEIGHT)?;
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

    /// Both silhouettes at the camera's resolution.
    fn silhouettes(&self) -> Result<Pixmap, ReportError> {
        let (width, height) = (self.observed.width(), self.observed.height());
        let mut picture = new_picture(width, height)?;
        let positions = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        for (place, (x, y)) in picture.pixels_mut().iter_mut().zip(positions) {
            let observed = self.observed.get(x, y);
            // without an estimated silhouette, no pixel counts as missed
            let estimated = self.estimated.map_or(observed, |mask| mask.get(x, y));
            let tone = match (observed, estimated) {
                (true, true) => BOTH,
                (true, false) => ONLY_OBSERVED,
                (false, true) => ONLY_ESTIMATED,
                (false, false) if self.props.is_some_and(|props| props.get(x, y)) => PROP,
                (false, false) => GROUND,
            };
            let seen = self.image.and_then(|image| pixel_of(image, y as usize * width as usize + x as usize));
            *place = pixel(seen.map_or(tone, |seen| if observed == estimated { seen } else { between(seen, tone) }));
        }
        Ok(picture)
    }
}

/// Red, green and blue of a pixel of an image of the same size.
fn pixel_of(image: &Image, index: usize) -> Option<[u8; 3]> {
    match image.planes() {
        [grey] => grey.get(index).map(|value| [*value; 3]),
        [red, green, blue] => Some([*red.get(index)?, *green.get(index)?, *blue.get(index)?]),
        _ => None,
    }
}

/// The colour halfway between two.
fn between(one: [u8; 3], other: [u8; 3]) -> [u8; 3] {
    std::array::from_fn(|channel| one[channel].midpoint(other[channel]))
}

/// The part of a camera's image around `bounds`, `span` camera pixels wide, that a picture of a view shows.
pub(super) fn window(bounds: &PixelBounds, span: f64) -> PictureWindow {
    let scale = f64::from(CELL_WIDTH) / span;
    let half = Point2::new(0.5 * span, 0.5 * f64::from(CELL_HEIGHT) / scale);
    let middle = |from: u32, to: u32| 0.5 * (f64::from(from) + f64::from(to));
    let centre = Point2::new(middle(bounds.left, bounds.right), middle(bounds.top, bounds.bottom));
    PictureWindow { corner: centre - half.coords, scale }
}

/// The width of a picture that contains `bounds` with a margin, camera pixels.
pub(super) fn span(bounds: &PixelBounds) -> f64 {
    let aspect = f64::from(CELL_WIDTH) / f64::from(CELL_HEIGHT);
    let (width, height) = (bounds.right - bounds.left, bounds.bottom - bounds.top);
    1.16 * f64::from(width).max(aspect * f64::from(height))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::camera_in_front;
    use skiagraph_core::body::LANDMARKS;

    fn block(x: [u32; 2], y: [u32; 2]) -> Mask {
        Mask::from_fn(320, 240, |column, row| (x[0]..x[1]).contains(&column) && (y[0]..y[1]).contains(&row))
    }

    /// A view of two silhouettes without skeletons or an image.
    fn view<'a>(camera: &'a Camera, observed: &'a Mask, estimated: &'a Mask) -> OverlaidView<'a> {
        let (truth, estimate) = (&[None; LANDMARKS.len()], &[None; LANDMARKS.len()]);
        OverlaidView { camera, observed, image: None, estimated: Some(estimated), props: None, truth, estimate }
    }

    #[test]
    fn bounds_hold_both_silhouettes() {
        let (observed, estimated) = (block([63, 65], [10, 20]), block([128, 192], [15, 30]));
        let camera = camera_in_front();
        let bounds = view(&camera, &observed, &estimated).bounds();
        assert_eq!(bounds, PixelBounds { left: 63, top: 10, right: 192, bottom: 30 });
        let empty = Mask::new(320, 240);
        let whole = PixelBounds { left: 0, top: 0, right: 320, bottom: 240 };
        assert_eq!(view(&camera, &empty, &empty).bounds(), whole);
    }

    /// Where they do not agree, the image is tinted; without an image, the colours stand alone.
    #[test]
    fn disagreement_has_colours_of_its_own() {
        let (observed, estimated) = (block([40, 160], [40, 200]), block([80, 200], [40, 200]));
        let camera = camera_in_front();
        let plain = view(&camera, &observed, &estimated);
        let picture = plain.draw(&plain.bounds(), span(&plain.bounds())).unwrap();
        let tone_at = |picture: &Pixmap, x: u32, y: u32| picture.pixel(x, y).map(|p| [p.red(), p.green(), p.blue()]);
        let tones = [4, 55, 180, 305].map(|x| tone_at(&picture, x, CELL_HEIGHT / 2).unwrap());
        assert_eq!(tones, [GROUND, ONLY_OBSERVED, BOTH, ONLY_ESTIMATED]);
        let image = Image::from_planes(320, 240, vec![vec![100; 320 * 240], vec![150; 320 * 240], vec![50; 320 * 240]]);
        let picture = OverlaidView { image: image.as_ref(), ..plain }.silhouettes().unwrap();
        let seen = [100, 150, 50];
        assert_eq!([(0, 0), (100, 100)].map(|(x, y)| tone_at(&picture, x, y).unwrap()), [seen; 2]);
        assert_eq!(tone_at(&picture, 50, 100), Some(between(seen, ONLY_OBSERVED)));
        assert_eq!(tone_at(&picture, 190, 100), Some(between(seen, ONLY_ESTIMATED)));
    }
}
