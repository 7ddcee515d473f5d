//! A motion as a strip of silhouettes over time, with the stances of both feet and the seams between takes.

use std::ops::Range;

use nalgebra::{Point3, Vector3};
use tiny_skia::Pixmap;

use super::ReportError;
use super::drawing::{BLUE, FIGURE, GRID, INK, ORANGE, encoded, fill, new_sheet, pixel};
use super::lettering::draw_text;
use crate::body::{Humanoid, Motion, SilhouettePainter};
use crate::camera::{Camera, FieldOfView};

/// Number of silhouettes in a row.
const ACROSS: usize = 16;
/// Maximum number of rows of silhouettes.
const MOST_ROWS: usize = 3;
/// Size of one silhouette's cell, pixels.
const CELL: [u32; 2] = [96, 150];
const MARGIN: u32 = 12;
const LEFT: u32 = 64;
const BAR: u32 = 14;
const LETTERS: f32 = 11.0;

const SEAM: [u8; 3] = [0xd0, 0x4f, 0x6e];
/// Takes alternate between these.
const TAKES: [[u8; 3]; 2] = [FIGURE, [0x86, 0xc4, 0x9a]];

/// Height of the camera's target and distance of the camera, m.
const LOOK_AT_HEIGHT: f64 = 0.9;
const DISTANCE: f64 = 8.0;

/// A motion to show.
#[derive(Clone, Debug)]
pub struct MotionStrip<'a> {
    /// Its title.
    pub title: String,
    /// The body.
    pub body: &'a Humanoid,
    /// Its motion, of at least one frame.
    pub motion: &'a Motion,
    /// Frames in which the left and the right foot are on the ground.
    pub stances: [Vec<Range<usize>>; 2],
    /// Blended frames between takes.
    pub seams: Vec<Range<usize>>,
}

impl MotionStrip<'_> {
    /// A PNG: silhouettes at regular times, seen from the body's left side; below them, over the whole duration, bars
    /// for the stances of each foot and for blends between takes. The colour of silhouettes alternates from take to
    /// take, and is red in a blend.
    ///
    /// # Errors
    /// [`ReportError`] if there is nothing to draw.
    pub fn png(&self) -> Result<Vec<u8>, ReportError> {
        let frames = self.motion.poses.len();
        let shown = frames.clamp(1, ACROSS * MOST_ROWS);
        let rows = shown.div_ceil(ACROSS) as u32;
        let width = LEFT + ACROSS as u32 * CELL[0] + MARGIN;
        let timeline = 3 * (BAR + 6) + 24;
        let mut picture = new_sheet(width, 36 + rows * (CELL[1] + 18) + timeline + MARGIN)?;
        let title = format!(
            "{}: {frames} frames at {} Hz, {:.2} s",
            self.title,
            self.motion.frames_per_second,
            self.motion.duration_s()
        );
        draw_text(&mut picture, &title, [MARGIN as f32, 12.0], LETTERS, INK);
        for index in 0..shown {
            let frame = index * (frames - 1) / (shown - 1).max(1);
            let left = LEFT + (index % ACROSS) as u32 * CELL[0];
            let top = 36 + (index / ACROSS) as u32 * (CELL[1] + 18);
            self.silhouette(&mut picture, frame, [left, top])?;
        }
        self.timeline(&mut picture, 36 + rows * (CELL[1] + 18) + 6, width - LEFT - MARGIN);
        encoded(&picture)
    }

    fn silhouette(&self, picture: &mut Pixmap, frame: usize, [left, top]: [u32; 2]) -> Result<(), ReportError> {
        let pose = &self.motion.poses[frame];
        let place = pose.world_from_root.translation.vector;
        let heading = self.body.heading(pose).unwrap_or(0.0);
        let (x, y) = (libm::cos(heading), libm::sin(heading));
        let aside = Vector3::new(-y, x, 0.0) * DISTANCE;
        let target = Point3::new(place.x, place.y, LOOK_AT_HEIGHT.max(place.z - 0.3));
        let view = FieldOfView::Vertical(2.0 * libm::atan(1.12 / DISTANCE));
        let camera = Camera::look_at("side", target + aside, target, Vector3::z(), view, CELL[0], CELL[1])
            .map_err(|error| ReportError::Plot(error.to_string()))?;
        let mask = SilhouettePainter::new(&camera).silhouette(self.body, &self.body.link_frames(pose));
        let tone = if self.seams.iter().any(|seam| seam.contains(&frame)) {
            SEAM
        } else {
            TAKES[self.seams.iter().filter(|seam| seam.end <= frame).count() % TAKES.len()]
        };
        let width = picture.width();
        let pixels = picture.pixels_mut();
        for y in 0..CELL[1] {
            for x in (0..CELL[0]).filter(|&x| mask.get(x, y)) {
                if let Some(place) = pixels.get_mut(((top + y) * width + left + x) as usize) {
                    *place = pixel(tone);
                }
            }
        }
        let head = format!("{frame}");
        draw_text(picture, &head, [left as f32 + 0.4 * CELL[0] as f32, (top + CELL[1]) as f32 + 2.0], 9.0, INK);
        Ok(())
    }

    fn timeline(&self, picture: &mut Pixmap, top: u32, length: u32) {
        let frames = self.motion.poses.len().max(1) as f32;
        let across = |frame: usize| LEFT as f32 + frame as f32 / frames * length as f32;
        let rows = [("left", BLUE, &self.stances[0]), ("right", ORANGE, &self.stances[1])];
        for (row, (name, tone, spans)) in (0..).zip(rows.into_iter().chain([("seams", SEAM, &self.seams)])) {
            let y = (top + row * (BAR + 6)) as f32;
            draw_text(picture, name, [MARGIN as f32, y + 2.0], 9.0, INK);
            fill(picture, [LEFT as f32, y, length as f32, BAR as f32], GRID, 255);
            for span in spans {
                let long = (across(span.end) - across(span.start)).max(1.0);
                fill(picture, [across(span.start), y, long, BAR as f32], tone, 255);
            }
        }
        let (y, seconds) = ((top + 3 * (BAR + 6)) as f32, self.motion.duration_s());
        let step =
            [0.5, 1.0, 2.0, 5.0, 10.0, 30.0, 60.0, 300.0].into_iter().find(|s| seconds / s <= 20.0).unwrap_or(600.0);
        let mut time = 0.0;
        while time <= seconds {
            let x = across((time * self.motion.frames_per_second) as usize);
            fill(picture, [x, y - 4.0, 1.0, 4.0], INK, 255);
            draw_text(picture, &format!("{time:.1}"), [x, y + 2.0], 8.0, INK);
            time += step;
        }
        draw_text(picture, "s", [MARGIN as f32, y + 2.0], 8.0, INK);
    }
}

#[cfg(test)]
mod tests {
    use std::iter::once;

    use super::*;
    use crate::body::shipped;
    use nalgebra::Isometry3;

    #[test]
    fn silhouettes_in_a_seam_are_red_and_bars_are_where_feet_stand() {
        let body = shipped("actor").unwrap();
        let mut pose = body.zero_pose();
        pose.world_from_root = Isometry3::translation(0.0, 0.0, 0.95);
        let motion = Motion { frames_per_second: 10.0, poses: vec![pose; 16] };
        let strip = MotionStrip {
            title: "two takes".into(),
            body: &body,
            motion: &motion,
            stances: [once(0..8).collect(), once(8..16).collect()],
            seams: once(6..9).collect(),
        };
        let picture = Pixmap::decode_png(&strip.png().unwrap()).unwrap();
        let tone = |x: u32, y: u32| {
            let pixel = picture.pixel(x, y).unwrap();
            [pixel.red(), pixel.green(), pixel.blue()]
        };
        let body_of = |cell: u32| tone(LEFT + cell * CELL[0] + CELL[0] / 2, 36 + CELL[1] * 45 / 100);
        assert_eq!([body_of(0), body_of(7), body_of(12)], [TAKES[0], SEAM, TAKES[1]]);
        let length = ACROSS as u32 * CELL[0];
        let bars = 36 + CELL[1] + 18 + 6 + BAR / 2;
        assert_eq!([tone(LEFT + length / 4, bars), tone(LEFT + 3 * length / 4, bars)], [BLUE, GRID]);
        let right = bars + BAR + 6;
        assert_eq!([tone(LEFT + length / 4, right), tone(LEFT + 3 * length / 4, right)], [GRID, ORANGE]);
    }
}
