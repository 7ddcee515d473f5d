//! All views of selected frames in one picture.

use tiny_skia::{Pixmap, PixmapPaint, Transform};

use skiagraph_core::camera::Camera;
use skiagraph_core::raster::PixelBounds;

use super::cell::{CELL_HEIGHT, CELL_WIDTH, OverlaidView, span};
use super::drawing::{INK, draw_text_to, encoded, encoded_fast, fitting, new_sheet};
use super::lettering::draw_text;
use super::{ReportError, Sheet, SheetFrame};

const GAP: u32 = 8;
const HEAD: u32 = 44;
const LETTER_HEIGHT: f32 = 18.0;
/// Most cameras that are shown: of 64, the picture took half of the time of measuring a run.
const MOST_CAMERAS: usize = 16;

struct SheetPicture {
    picture: Pixmap,
    overlap: Option<f64>,
    has_image: bool,
}

/// Of every how many cameras one is shown.
pub(super) fn camera_step(cameras: usize) -> usize {
    cameras.div_ceil(MOST_CAMERAS).max(1)
}

/// A PNG of the sheet, with one row per camera (of more than 16 cameras, of every second, third ...) and one column per
/// frame. Colours: observed silhouette light; where the
/// model silhouette differs, amber (missed) and blue (excess); truth green; estimate red and dashed.
///
/// # Errors
/// [`ReportError`] if a frame lacks a view or there is nothing to draw.
pub fn contact_sheet(sheet: &Sheet<'_>) -> Result<Vec<u8>, ReportError> {
    let columns = cells(sheet)?;
    let cameras: Vec<&Camera> = sheet.rig.cameras.iter().step_by(camera_step(sheet.rig.cameras.len())).collect();
    let (across, down) = (sheet.frames.len() as u32, cameras.len() as u32);
    let width = GAP + across * (CELL_WIDTH + GAP);
    let mut picture = new_sheet(width, HEAD + down * (CELL_HEIGHT + GAP))?;
    for ((column, frame), left) in columns.iter().zip(&sheet.frames).zip((GAP..).step_by((CELL_WIDTH + GAP) as usize)) {
        let error = frame.error_mm().map_or(String::new(), |error| format!(", {error:.0} mm"));
        let seconds = frame.frame as f64 / sheet.frames_per_second;
        let head = format!("seed {}, set frame {}, {seconds:.2} s{error}", frame.seed, frame.frame);
        let height = fitting(&head, LETTER_HEIGHT, CELL_WIDTH as f32 - 8.0);
        draw_text(&mut picture, &head, [left as f32 + 4.0, 13.0], height, INK);
        for ((cell, camera), top) in column.iter().zip(&cameras).zip((HEAD..).step_by((CELL_HEIGHT + GAP) as usize)) {
            let paint = PixmapPaint::default();
            picture.draw_pixmap(left as i32, top as i32, cell.picture.as_ref(), &paint, Transform::identity(), None);
            let (x, y) = (left as f32 + 10.0, top as f32 + 10.0);
            draw_text(&mut picture, &camera.name, [x, y], LETTER_HEIGHT, INK);
            let overlap = cell.overlap.map_or("IoU -".into(), |overlap| format!("IoU {overlap:.2}"));
            let right = left as f32 + CELL_WIDTH as f32 - 10.0;
            draw_text_to(&mut picture, &overlap, [right, y], LETTER_HEIGHT, INK);
        }
    }
    if columns.iter().flatten().any(|cell| cell.has_image) { encoded_fast(&picture) } else { encoded(&picture) }
}

/// The pictures, `[frame][shown camera]`. Every camera follows the body, with the same scale in all frames.
fn cells(sheet: &Sheet<'_>) -> Result<Vec<Vec<SheetPicture>>, ReportError> {
    let views: Vec<Vec<OverlaidView<'_>>> =
        sheet.frames.iter().map(|frame| views(sheet, frame)).collect::<Result<_, _>>()?;
    let bounds: Vec<Vec<PixelBounds>> =
        views.iter().map(|frame| frame.iter().map(OverlaidView::bounds).collect()).collect();
    let span_of = |camera: usize| bounds.iter().map(|frame| span(&frame[camera])).fold(1.0, f64::max);
    let spans: Vec<f64> = (0..bounds.first().map_or(0, Vec::len)).map(span_of).collect();
    let cell = |((view, bounds), span): ((&OverlaidView<'_>, &PixelBounds), &f64)| {
        let picture = view.draw(bounds, *span)?;
        Ok(SheetPicture { picture, overlap: view.overlap(), has_image: view.image.is_some() })
    };
    let column = |(frame, bounds): (&Vec<OverlaidView<'_>>, &Vec<PixelBounds>)| {
        frame.iter().zip(bounds).zip(&spans).map(cell).collect()
    };
    views.iter().zip(&bounds).map(column).collect()
}

/// What the cameras that are shown see of a frame.
fn views<'a>(sheet: &'a Sheet<'_>, frame: &'a SheetFrame) -> Result<Vec<OverlaidView<'a>>, ReportError> {
    let cameras = sheet.rig.cameras.len();
    for found in [Some(frame.observed.len()), frame.estimated.as_ref().map(Vec::len)].into_iter().flatten() {
        if found != cameras {
            return Err(ReportError::Views { frame: frame.frame, found, cameras });
        }
    }
    let (truth, estimate) = (&frame.truth, &frame.estimate);
    let still = (sheet.rig, &sheet.props);
    let (rig, props) = frame.moved.as_ref().map_or(still, |(rig, props)| (rig, props));
    let masks = frame.observed.iter().zip(&rig.cameras).enumerate();
    let view = |(index, (observed, camera))| OverlaidView {
        camera,
        observed,
        image: frame.images.get(index).and_then(Option::as_ref),
        estimated: frame.estimated.as_ref().and_then(|masks| masks.get(index)),
        props: props.get(index),
        truth,
        estimate,
    };
    Ok(masks.map(view).step_by(camera_step(cameras)).collect())
}

impl SheetFrame {
    /// Mean distance of the markers that both truth and estimate have, mm.
    fn error_mm(&self) -> Option<f64> {
        let pairs = self.truth.iter().zip(&self.estimate);
        let distances: Vec<f64> =
            pairs.filter_map(|(truth, estimate)| Some(1000.0 * ((*estimate)? - (*truth)?).norm())).collect();
        skiagraph_eval::mean(&distances)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::walking_sheet;
    use skiagraph_core::camera::CameraRig;

    #[test]
    fn the_sheet_has_one_row_per_camera_and_one_column_per_frame() {
        let rig = crate::fixture::rig(2);
        let sheet = walking_sheet(&rig, &[1, 20, 40]);
        let picture = Pixmap::decode_png(&contact_sheet(&sheet).unwrap()).unwrap();
        assert_eq!(picture.width(), GAP + 3 * (CELL_WIDTH + GAP));
        assert_eq!(picture.height(), HEAD + 2 * (CELL_HEIGHT + GAP));
    }

    // evaluate of a set of 64 cameras drew 19 MB
    #[test]
    fn of_many_cameras_every_second_or_third_is_shown() {
        let rig = CameraRig { cameras: vec![crate::fixture::rig(1).cameras.remove(0); 33] };
        let picture = Pixmap::decode_png(&contact_sheet(&walking_sheet(&rig, &[1])).unwrap()).unwrap();
        assert_eq!(picture.height(), HEAD + 11 * (CELL_HEIGHT + GAP));
    }

    #[test]
    fn a_missing_view_is_an_error_that_names_the_frame() {
        let rig = crate::fixture::rig(2);
        let mut sheet = walking_sheet(&rig, &[1, 20]);
        sheet.frames[1].estimated.as_mut().unwrap().pop();
        let message = contact_sheet(&sheet).unwrap_err().to_string();
        assert_eq!(message, "frame 20: 1 silhouettes for 2 cameras; give one for every camera");
    }
}
