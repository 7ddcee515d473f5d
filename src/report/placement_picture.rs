//! Placed cameras from above.

use super::ReportError;
use super::drawing::{
    BLUE, FAINT, GRID, INK, LINE, MARGIN, ORANGE, WIDTH, dot, draw_head, encoded, fitting, new_sheet, stroke,
};
use super::lettering::{draw_text, text_width};

/// Top of the map, and its side, pixels.
const TOP: f32 = 110.0;
const SIDE: f32 = WIDTH as f32 - 2.0 * MARGIN;
/// Length of the line along which a camera looks, pixels.
const RAY: f32 = 60.0;
const LETTERS: f32 = 15.0;
/// Distance of a label from the centre of its camera, pixels.
const GAP: f32 = 15.0;

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
        let half = 0.5 * span;
        let on_map = |axis: usize| {
            let lines = (-metres..=metres).map(move |metre| middle[axis].round() + f64::from(metre));
            lines.filter(move |line| (line - middle[axis]).abs() <= half)
        };
        for column in on_map(0) {
            stroke(&mut picture, &[at([column, middle[1] - half]), at([column, middle[1] + half])], GRID, 1.0, false);
        }
        for row in on_map(1) {
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
            let [x, y] = at([camera.centre[0], camera.centre[1]]);
            let text = format!("{number}: {}, {:.1} m high", camera.name, camera.centre[2]);
            let letters = fitting(&text, LETTERS, SIDE);
            let width = text_width(&text, letters);
            let left = (x - 0.5 * width).min(MARGIN + SIDE - width).max(MARGIN);
            // not where the camera looks
            let top = if camera.view[1] > 0.0 { y + GAP } else { y - GAP - letters };
            draw_text(&mut picture, &text, [left, top], letters, INK);
        }
        encoded(&picture)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::drawing::{PAPER, pixel};

    #[test]
    fn labels_of_cameras_at_the_edge_and_grid_lines_stay_on_the_map() {
        let name = "a camera with a name that is far longer than the usual cam00 and place017".to_owned();
        let camera = |x: f64, view| PlacedCamera { name: name.clone(), centre: [x, 1.3, 1.6], view };
        let picture = PlacementPicture {
            title: "walk",
            about: "two of two".to_owned(),
            path: &[[0.0, 0.0], [1.0, 0.5]],
            candidates: vec![],
            own: vec![],
            chosen: vec![camera(4.0, [-1.0, -0.5]), camera(-3.0, [1.0, 0.5])],
        };
        let decoded = tiny_skia::Pixmap::decode_png(&picture.png().unwrap()).unwrap();
        let is_map = |x: u32, y: u32| decoded.pixel(x, y).unwrap() != pixel(PAPER);
        assert!((0..decoded.height()).all(|y| (0..20).all(|x| !is_map(x, y) && !is_map(WIDTH - 1 - x, y))));
        assert!((0..WIDTH).all(|x| (96..TOP as u32).all(|y| !is_map(x, y))), "no line below the heading");
        assert!((0..WIDTH).any(|x| is_map(x, TOP as u32 + 30)), "the grid");
    }

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
