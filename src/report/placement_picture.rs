//! Placed cameras from above.

use super::ReportError;
use super::drawing::{BLUE, FAINT, GRID, INK, LINE, MARGIN, ORANGE, WIDTH, dot, draw_head, encoded, new_sheet, stroke};
use super::lettering::draw_text;

/// Top of the map, and its side, pixels.
const TOP: f32 = 110.0;
const SIDE: f32 = WIDTH as f32 - 2.0 * MARGIN;
/// Length of the line along which a camera looks, pixels.
const RAY: f32 = 60.0;
const LETTERS: f32 = 15.0;

/// A camera on the map.
#[derive(Clone, Debug, PartialEq)]
pub struct PlacedCamera {
    /// Its name.
    pub name: String,
    /// Its centre in the world, metres.
    pub centre: [f64; 3],
    /// The horizontal part of its viewing direction.
    pub view: [f64; 2],
}

/// A map of cameras.
#[derive(Clone, Debug)]
pub struct PlacementPicture<'a> {
    /// Name of the scenario.
    pub title: &'a str,
    /// One line below it.
    pub about: String,
    /// The body's path, metres.
    pub path: &'a [[f64; 2]],
    /// All places.
    pub candidates: Vec<PlacedCamera>,
    /// The scenario's cameras.
    pub own: Vec<PlacedCamera>,
    /// The chosen cameras.
    pub chosen: Vec<PlacedCamera>,
}

impl PlacementPicture<'_> {
    /// A PNG, X to the right and Y upwards; a grid line every metre.
    ///
    /// # Errors
    /// [`ReportError`] if drawing fails.
    pub fn png(&self) -> Result<Vec<u8>, ReportError> {
        let mut picture = new_sheet(WIDTH, (TOP + SIDE + MARGIN) as u32)?;
        draw_head(&mut picture, self.title, &self.about, &[], LETTERS);
        let cameras = || [&self.candidates, &self.own, &self.chosen].into_iter().flatten();
        let points = || cameras().map(|camera| [camera.centre[0], camera.centre[1]]).chain(self.path.iter().copied());
        let ends = |axis: usize| {
            points().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], p| [low.min(p[axis]), high.max(p[axis])])
        };
        let [x, y] = [ends(0), ends(1)];
        let span = (x[1] - x[0]).max(y[1] - y[0]).max(1.0) * 1.15;
        let scale = f64::from(SIDE) / span;
        let middle = [0.5 * (x[0] + x[1]), 0.5 * (y[0] + y[1])];
        let at = |p: [f64; 2]| {
            let [right, up] = [0, 1].map(|axis| (scale * (p[axis] - middle[axis])) as f32);
            [MARGIN + 0.5 * SIDE + right, TOP + 0.5 * SIDE - up]
        };
        let metres = (0.5 * span).ceil().min(200.0) as i32;
        for metre in -metres..=metres {
            let [column, row] = [middle[0].round(), middle[1].round()].map(|m| m + f64::from(metre));
            let half = 0.5 * span;
            stroke(&mut picture, &[at([column, middle[1] - half]), at([column, middle[1] + half])], GRID, 1.0, false);
            stroke(&mut picture, &[at([middle[0] - half, row]), at([middle[0] + half, row])], GRID, 1.0, false);
        }
        let path: Vec<[f32; 2]> = self.path.iter().map(|point| at(*point)).collect();
        stroke(&mut picture, &path, LINE, 3.0, false);
        path.iter().take(1).for_each(|start| dot(&mut picture, *start, 5.0, LINE));
        for camera in &self.candidates {
            dot(&mut picture, at([camera.centre[0], camera.centre[1]]), 3.0, FAINT);
        }
        for (cameras, colour, radius) in [(&self.own, BLUE, 6.0), (&self.chosen, ORANGE, 9.0)] {
            for camera in cameras {
                let place = at([camera.centre[0], camera.centre[1]]);
                let length = camera.view[0].hypot(camera.view[1]).max(1e-9);
                let ahead = [
                    place[0] + RAY * (camera.view[0] / length) as f32,
                    place[1] - RAY * (camera.view[1] / length) as f32,
                ];
                stroke(&mut picture, &[place, ahead], colour, 2.0, false);
                dot(&mut picture, place, radius, colour);
            }
        }
        for (number, camera) in (1..).zip(&self.chosen) {
            let [left, top] = at([camera.centre[0], camera.centre[1]]);
            let text = format!("{number}: {}, {:.1} m high", camera.name, camera.centre[2]);
            let left = left.min(MARGIN + SIDE - 190.0);
            draw_text(&mut picture, &text, [left + 12.0, top + 12.0], LETTERS, INK);
        }
        encoded(&picture)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_map_is_a_picture_of_the_usual_width_for_any_number_of_cameras() {
        let camera = |x: f64| PlacedCamera { name: "a".to_owned(), centre: [x, 1.0, 1.6], view: [-1.0, 0.0] };
        for chosen in [vec![], vec![camera(4.0), camera(-900.0)]] {
            let path = [[0.0, 0.0], [1.0, 0.5]];
            let picture = PlacementPicture {
                title: "walk",
                about: String::new(),
                path: &path,
                candidates: vec![camera(2.0)],
                own: vec![],
                chosen,
            };
            let decoded = tiny_skia::Pixmap::decode_png(&picture.png().unwrap()).unwrap();
            assert_eq!(decoded.width(), WIDTH);
        }
    }
}
