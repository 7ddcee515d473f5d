//! A body in one picture: from several sides, in several poses, and with the limits of its joints.

use nalgebra::{Point3, Vector3};
use tiny_skia::Pixmap;

use super::ReportError;
use super::drawing::{BLUE, GRID, INK, ORANGE, encoded, fill, new_sheet, pixel};
use super::lettering::draw_text;
use skiagraph_core::body::{Humanoid, LinkFrames, Motion, Pose, SilhouettePainter};
use skiagraph_core::camera::{Camera, FieldOfView};

/// Number of views around the body, and maximum number of poses.
const ACROSS: usize = 8;
/// Size of one view, pixels.
const CELL: [u32; 2] = [150, 230];
const MARGIN: u32 = 14;
const ROW: u32 = 18;
const NAMES: u32 = 250;

/// Colours of the links, in rotation.
const LINKS: [[f64; 3]; 5] =
    [[0.80, 0.84, 0.88], [0.56, 0.74, 0.62], [0.62, 0.68, 0.84], [0.86, 0.72, 0.56], [0.76, 0.62, 0.76]];

/// Distance of the camera, in multiples of half the height of a view.
const DISTANCE: f64 = 7.0;
/// Margin of a view beyond the links' origins and markers, as a factor, for the body's surface.
const FLESH: f64 = 1.15;

/// A body to show.
#[derive(Clone, Debug)]
pub struct BodySheet<'a> {
    /// Its title.
    pub title: String,
    /// The body.
    pub body: &'a Humanoid,
    /// Up to eight poses with their names.
    pub poses: Vec<(String, Pose)>,
    /// A motion whose range of every joint angle is marked within the limits.
    pub motion: Option<&'a Motion>,
}

impl BodySheet<'_> {
    /// Four poses of any body: standing, at the middle of its joints' ranges, and at 10 % and 90 % of the ranges.
    /// Ranges are clamped to 1.5 rad.
    pub fn four_poses(body: &Humanoid) -> Vec<(String, Pose)> {
        vec![
            ("Zero pose".to_owned(), body.standing_pose()),
            ("Middle of all limits".to_owned(), between_limits(body, 0.5)),
            ("Near lower limits".to_owned(), between_limits(body, 0.1)),
            ("Near upper limits".to_owned(), between_limits(body, 0.9)),
        ]
    }

    /// The picture as PNG.
    ///
    /// # Errors
    /// [`ReportError`] if there is nothing to draw.
    pub fn png(&self) -> Result<Vec<u8>, ReportError> {
        let degrees = self.body.degrees_of_freedom.len() as u32;
        let columns = 2_u32;
        let rows = degrees.div_ceil(columns);
        let width = 2 * MARGIN + ACROSS as u32 * CELL[0];
        let charts = 40 + 2 * (CELL[1] + 26);
        let mut picture = new_sheet(width, charts + 24 + rows * ROW + 24 + MARGIN)?;
        draw_text(&mut picture, &self.title, [MARGIN as f32, 14.0], 13.0, INK);
        for index in 0..ACROSS {
            let azimuth = 360.0 * index as f64 / ACROSS as f64;
            let at = [MARGIN + index as u32 * CELL[0], 40];
            self.view(&mut picture, &self.body.standing_pose(), azimuth, at)?;
            caption(&mut picture, &format!("{azimuth:.0}°"), at);
        }
        for (index, (name, pose)) in self.poses.iter().take(ACROSS).enumerate() {
            let at = [MARGIN + index as u32 * CELL[0], 40 + CELL[1] + 26];
            self.view(&mut picture, pose, 45.0, at)?;
            caption(&mut picture, name, at);
        }
        self.limits(&mut picture, charts, rows, (width - 2 * MARGIN) / columns);
        encoded(&picture)
    }

    /// Draws the shaded body from `azimuth` degrees about the vertical; 0 is the front.
    fn view(&self, picture: &mut Pixmap, pose: &Pose, azimuth: f64, [left, top]: [u32; 2]) -> Result<(), ReportError> {
        let frames = self.body.link_frames(pose);
        let middle = middle_of(&frames);
        let ahead = pose.world_from_root.rotation * self.body.root_from_body() * Vector3::x();
        let heading = libm::atan2(ahead.y, ahead.x) + azimuth.to_radians();
        let target = Point3::from(middle);
        let distance = DISTANCE * self.half_height();
        let away = Vector3::new(libm::cos(heading), libm::sin(heading), 0.15) * distance;
        let view = FieldOfView::Vertical(2.0 * libm::atan(1.0 / DISTANCE));
        let camera = Camera::look_at("view", target + away, target, Vector3::z(), view, CELL[0], CELL[1])
            .map_err(|error| ReportError::Plot(error.to_string()))?;
        let light = (away.normalize() + Vector3::z() * 0.6).normalize();
        let width = picture.width();
        let pixels = picture.pixels_mut();
        for seen in SilhouettePainter::new(&camera).surface(self.body, &frames) {
            let shade = 0.35 + 0.65 * seen.normal_in_world.dot(&light).max(0.0);
            let tone = LINKS[seen.part % LINKS.len()].map(|channel| (255.0 * channel * shade) as u8);
            if let Some(place) = pixels.get_mut(((top + seen.y) * width + left + seen.x) as usize) {
                *place = pixel(tone);
            }
        }
        Ok(())
    }

    /// Half the height of every view, m, such that all links and markers of all poses are inside.
    fn half_height(&self) -> f64 {
        let aspect = f64::from(CELL[1]) / f64::from(CELL[0]);
        let standing = self.body.standing_pose();
        let poses = self.poses.iter().map(|(_, pose)| pose).chain([&standing]);
        let reach = |pose: &Pose| {
            let frames = self.body.link_frames(pose);
            let middle = middle_of(&frames);
            let origins = frames.0.iter().map(|frame| frame.translation.vector);
            let markers = self.body.markers(&frames).into_iter().flatten().map(|marker| marker.coords);
            let off = origins.chain(markers).map(|place| place - middle);
            off.map(|off| off.z.abs().max(aspect * off.x.hypot(off.y))).fold(0.1, f64::max)
        };
        FLESH * poses.map(reach).fold(0.1, f64::max)
    }

    /// Draws a bar for every angle from its lower to its upper limit, and the range that the motion uses.
    fn limits(&self, picture: &mut Pixmap, top: u32, rows: u32, length: u32) {
        let heading = match self.motion {
            Some(_) => "Limits of joint angles: blue; used by the motion: orange; -180° to 180°",
            None => "Limits of joint angles, -180° to 180°",
        };
        draw_text(picture, heading, [MARGIN as f32, top as f32], 9.0, INK);
        let span = (length - NAMES - MARGIN) as f64;
        for (index, limits) in self.body.degrees_of_freedom.iter().enumerate() {
            let (column, row) = (index as u32 / rows.max(1), index as u32 % rows.max(1));
            let left = MARGIN + column * length;
            let y = (top + 22 + row * ROW) as f32;
            let name: String = limits.name.chars().take(34).collect();
            draw_text(picture, &name, [left as f32, y + 2.0], 8.0, INK);
            let start = f64::from(left + NAMES);
            let across = |angle: f64| start + span * (angle.to_degrees().clamp(-180.0, 180.0) + 180.0) / 360.0;
            let mut bar = |from: f64, to: f64, height: f32, tone: [u8; 3]| {
                let inset = (12.0 - height) / 2.0;
                let width = (across(to) - across(from)).max(1.0) as f32;
                fill(picture, [across(from) as f32, y + inset, width, height], tone, 255);
            };
            bar(-4.0, 4.0, 12.0, GRID);
            bar(limits.lower, limits.upper, 8.0, BLUE);
            let used = self.motion.into_iter().flat_map(|motion| &motion.poses).map(|pose| pose.joint_angles[index]);
            let used = used.fold(None, |range: Option<(f64, f64)>, angle| {
                Some(range.map_or((angle, angle), |(low, high)| (low.min(angle), high.max(angle))))
            });
            if let Some((low, high)) = used {
                bar(low, high, 4.0, ORANGE);
            }
            bar(0.0, 0.0, 12.0, INK);
        }
    }
}

/// The pose with every joint at this share of its range.
fn between_limits(body: &Humanoid, share: f64) -> Pose {
    let mut pose = body.standing_pose();
    for (angle, limits) in pose.joint_angles.iter_mut().zip(&body.degrees_of_freedom) {
        let (lower, upper) = (limits.lower.max(-1.5), limits.upper.min(1.5));
        *angle = lower + share * (upper - lower);
    }
    pose
}

/// Mean of the links' origins.
fn middle_of(frames: &LinkFrames) -> Vector3<f64> {
    frames.0.iter().map(|frame| frame.translation.vector).sum::<Vector3<f64>>() / frames.0.len() as f64
}

fn caption(picture: &mut Pixmap, text: &str, [left, top]: [u32; 2]) {
    let height = if text.len() > 14 { 7.5 } else { 9.0 };
    draw_text(picture, text, [left as f32 + 6.0, (top + CELL[1]) as f32 + 3.0], height, INK);
}

#[cfg(test)]
mod tests {
    use super::*;
    use skiagraph_core::body::shipped;

    #[test]
    fn every_view_and_pose_shows_the_body_and_every_angle_has_a_bar() {
        let body = shipped("tracker25").unwrap();
        let poses = BodySheet::four_poses(&body);
        let sheet = BodySheet { title: "TRACKER25".into(), body: &body, poses, motion: None };
        let picture = Pixmap::decode_png(&sheet.png().unwrap()).unwrap();
        let paper = pixel(crate::drawing::PAPER);
        let share = |left: u32, top: u32| {
            let all = (0..CELL[0] * CELL[1]).map(|i| picture.pixel(left + i % CELL[0], top + i / CELL[0]).unwrap());
            all.filter(|pixel| *pixel != paper).count() as f64 / f64::from(CELL[0] * CELL[1])
        };
        for column in 0..8 {
            let drawn = share(MARGIN + column * CELL[0], 40);
            assert!((0.04..0.6).contains(&drawn), "view {column}: {drawn}");
        }
        for column in 0..4 {
            assert!(share(MARGIN + column * CELL[0], 40 + CELL[1] + 26) > 0.04, "pose {column}");
        }
        let bars = picture.pixels().iter().filter(|p| [p.red(), p.green(), p.blue()] == BLUE).count();
        assert!(bars > 19 * 8 * 10, "{bars}");
    }
}
