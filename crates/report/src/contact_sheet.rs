//! All views of selected frames in one picture.

use tiny_skia::{Pixmap, PixmapPaint, Transform};

use skiagraph_core::raster::PixelBounds;

use super::cell::{CELL_HEIGHT, CELL_WIDTH, OverlaidView, span};
use super::drawing::{INK, draw_text_to, encoded, encoded_fast, fitting, new_sheet};
use super::lettering::draw_text;
use super::{ReportError, Sheet, SheetFrame};

const GAP: u32 = 8;
const HEAD: u32 = 44;
const LETTER_HEIGHT: f32 = 18.0;

/// One rendered view of one frame.
struct SheetPicture {
    /// The picture.
    picture: Pixmap,
    /// Overlap of the two silhouettes.
    overlap: Option<f64>,
    /// Whether it shows the camera's image.
    has_image: bool,
}

/// A PNG of the sheet, with one row per camera and one column per frame. Colours: observed silhouette light; where the
/// model silhouette differs, amber (missed) and blue (excess); truth green; estimate red and dashed.
///
/// # Errors
/// [`ReportError`] if a frame lacks a view or there is nothing to draw.
pub fn contact_sheet(sheet: &Sheet<'_>) -> Result<Vec<u8>, ReportError> {
    let columns = cells(sheet)?;
    let (across, down) = (sheet.frames.len() as u32, sheet.rig.cameras.len() as u32);
    let width = GAP + across * (CELL_WIDTH + GAP);
    let mut picture = new_sheet(width, HEAD + down * (CELL_HEIGHT + GAP))?;
    for ((column, frame), left) in columns.iter().zip(&sheet.frames).zip((GAP..).step_by((CELL_WIDTH + GAP) as usize)) {
        let head = format!(
            "seed {}, set frame {}, {:.2} s{}",
            frame.seed,
            frame.frame,
            seconds(sheet, frame),
            describe_error(frame)
        );
        draw_text(
            &mut picture,
            &head,
            [left as f32 + 4.0, 13.0],
            fitting(&head, LETTER_HEIGHT, CELL_WIDTH as f32 - 8.0),
            INK,
        );
        for ((cell, camera), top) in
            column.iter().zip(&sheet.rig.cameras).zip((HEAD..).step_by((CELL_HEIGHT + GAP) as usize))
        {
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

/// The pictures, `[frame][camera]`. Every camera follows the body, with the same scale in all frames.
fn cells(sheet: &Sheet<'_>) -> Result<Vec<Vec<SheetPicture>>, ReportError> {
    let views: Vec<Vec<OverlaidView<'_>>> =
        sheet.frames.iter().map(|frame| views(sheet, frame)).collect::<Result<_, _>>()?;
    let bounds: Vec<Vec<PixelBounds>> =
        views.iter().map(|frame| frame.iter().map(OverlaidView::bounds).collect()).collect();
    let span_of = |camera: usize| bounds.iter().map(|frame| span(&frame[camera])).fold(1.0, f64::max);
    let spans: Vec<f64> = (0..sheet.rig.cameras.len()).map(span_of).collect();
    let cell = |((view, bounds), span): ((&OverlaidView<'_>, &PixelBounds), &f64)| {
        let picture = view.draw(bounds, *span)?;
        Ok(SheetPicture { picture, overlap: view.overlap(), has_image: view.image.is_some() })
    };
    let column = |(frame, bounds): (&Vec<OverlaidView<'_>>, &Vec<PixelBounds>)| {
        frame.iter().zip(bounds).zip(&spans).map(cell).collect()
    };
    views.iter().zip(&bounds).map(column).collect()
}

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
    Ok(masks.map(view).collect())
}

/// Time of the frame.
fn seconds(sheet: &Sheet<'_>, frame: &SheetFrame) -> f64 {
    frame.frame as f64 / sheet.frames_per_second
}

fn describe_error(frame: &SheetFrame) -> String {
    frame.error_mm().map_or(String::new(), |error| format!(", {error:.0} mm"))
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

    #[test]
    fn the_sheet_has_one_row_per_camera_and_one_column_per_frame() {
        let rig = crate::fixture::rig(2);
        let sheet = walking_sheet(&rig, &[1, 20, 40]);
        let picture = Pixmap::decode_png(&contact_sheet(&sheet).unwrap()).unwrap();
        assert_eq!(picture.width(), GAP + 3 * (CELL_WIDTH + GAP));
        assert_eq!(picture.height(), HEAD + 2 * (CELL_HEIGHT + GAP));
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
