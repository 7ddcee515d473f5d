//! Draws skeletons onto a camera's picture.

use nalgebra::{Point2, Point3};
use tiny_skia::{FillRule, LineCap, LineJoin, Path, PathBuilder, Pixmap, Stroke, StrokeDash, Transform};

use skiagraph_core::body::{Landmark, Markers};
use skiagraph_core::camera::Camera;

use super::drawing::paint;

/// A bone of a skeleton: its end points in world coordinates, m.
pub type BoneLine = [Point3<f64>; 2];

/// Whose skeleton: colour and line style, distinguishable without colour vision.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Whose {
    /// The truth: green, unbroken, round joints.
    Truth,
    /// The estimate: red, dashed, square joints.
    Estimate,
}

/// The part of a camera's image that a picture shows: `picture = scale * (pixel - corner)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PictureWindow {
    /// The camera pixel at the picture's top left.
    pub corner: Point2<f64>,
    /// Picture pixels per camera pixel, > 0.
    pub scale: f64,
}

impl PictureWindow {
    /// The whole image of a camera at its resolution.
    pub fn whole() -> Self {
        Self { corner: Point2::origin(), scale: 1.0 }
    }

    /// The place in the picture of a point that `camera` sees.
    pub(super) fn projection(self, camera: &Camera) -> impl Fn(&Point3<f64>) -> Option<(f32, f32)> {
        move |point| {
            let pixel = camera.project(point)?;
            let at = (pixel - self.corner) * self.scale;
            (at.norm() < 1e6).then_some((at.x as f32, at.y as f32))
        }
    }
}

/// The pairs of landmarks between which a bone is drawn.
pub(super) const MARKER_BONES: [[Landmark; 2]; 14] = [
    [Landmark::HeadTop, Landmark::Thorax],
    [Landmark::Thorax, Landmark::Pelvis],
    [Landmark::Thorax, Landmark::LeftShoulder],
    [Landmark::LeftShoulder, Landmark::LeftElbow],
    [Landmark::LeftElbow, Landmark::LeftWrist],
    [Landmark::Thorax, Landmark::RightShoulder],
    [Landmark::RightShoulder, Landmark::RightElbow],
    [Landmark::RightElbow, Landmark::RightWrist],
    [Landmark::Pelvis, Landmark::LeftHip],
    [Landmark::LeftHip, Landmark::LeftKnee],
    [Landmark::LeftKnee, Landmark::LeftAnkle],
    [Landmark::Pelvis, Landmark::RightHip],
    [Landmark::RightHip, Landmark::RightKnee],
    [Landmark::RightKnee, Landmark::RightAnkle],
];

/// The bones between HumanEva's markers; bones with a missing end are left out.
pub fn marker_bones(markers: &Markers) -> Vec<BoneLine> {
    let at = |landmark: Landmark| markers[landmark as usize];
    MARKER_BONES.iter().filter_map(|[from, to]| Some([at(*from)?, at(*to)?])).collect()
}

/// Draws bones as seen by `camera` in `window`, with lens distortion; bones behind the camera are left out. Lines are
/// `width` picture pixels wide and have a dark edge, so that they are visible on any background.
pub fn draw_bones(
    picture: &mut Pixmap,
    camera: &Camera,
    window: &PictureWindow,
    bones: &[BoneLine],
    whose: Whose,
    width: f32,
) {
    let to_picture = window.projection(camera);
    let Some(lines) = bones_path(bones, &to_picture) else { return };
    let dash = match whose {
        Whose::Truth => None,
        // the truth below is visible through the gaps
        Whose::Estimate => StrokeDash::new(vec![3.4 * width, 2.6 * width], 0.0),
    };
    let cap = if dash.is_some() { LineCap::Butt } else { LineCap::Round };
    for (width, colour) in [(1.9 * width, EDGE), (width, whose.colour())] {
        let stroke =
            Stroke { width, line_cap: cap, line_join: LineJoin::Round, dash: dash.clone(), ..Stroke::default() };
        picture.stroke_path(&lines, &paint(colour, 255), &stroke, Transform::identity(), None);
    }
    for (size, colour) in [(1.7 * width, EDGE), (1.2 * width, whose.colour())] {
        if let Some(joints) = joints_path(bones, &to_picture, whose, size) {
            picture.fill_path(&joints, &paint(colour, 255), FillRule::Winding, Transform::identity(), None);
        }
    }
}

const EDGE: [u8; 3] = [0x10, 0x18, 0x20];

impl Whose {
    /// Red, green, blue.
    pub fn colour(self) -> [u8; 3] {
        match self {
            Self::Truth => [0x1f, 0xd6, 0x8a],
            Self::Estimate => [0xff, 0x3b, 0x4e],
        }
    }
}

/// All bones as one path, each in pieces short enough to follow the lens distortion.
pub(super) fn bones_path(bones: &[BoneLine], to_picture: impl Fn(&Point3<f64>) -> Option<(f32, f32)>) -> Option<Path> {
    const PIECES: usize = 8;
    let mut path = PathBuilder::new();
    for [from, to] in bones {
        let mut drawing = false;
        for piece in 0..=PIECES {
            let along = from + (to - from) * (piece as f64 / PIECES as f64);
            match to_picture(&along) {
                Some((x, y)) if drawing => path.line_to(x, y),
                Some((x, y)) => path.move_to(x, y),
                None => {}
            }
            drawing = to_picture(&along).is_some();
        }
    }
    path.finish()
}

fn joints_path(
    bones: &[BoneLine],
    to_picture: impl Fn(&Point3<f64>) -> Option<(f32, f32)>,
    whose: Whose,
    size: f32,
) -> Option<Path> {
    let mut path = PathBuilder::new();
    for (x, y) in bones.iter().flatten().filter_map(to_picture) {
        match whose {
            Whose::Truth => path.push_circle(x, y, size),
            Whose::Estimate => {
                path.push_rect(tiny_skia::Rect::from_xywh(x - size, y - size, 2.0 * size, 2.0 * size)?);
            }
        }
    }
    path.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::camera_in_front;
    use crate::test_figure::standing;

    fn colour_at(picture: &Pixmap, x: u32, y: u32) -> [u8; 3] {
        let pixel = picture.pixel(x, y).unwrap();
        [pixel.red(), pixel.green(), pixel.blue()]
    }

    #[test]
    fn every_marker_takes_part_in_a_bone() {
        assert_eq!(marker_bones(&standing()).len(), 14);
        let mut no_head = standing();
        no_head[Landmark::HeadTop as usize] = None;
        assert_eq!(marker_bones(&no_head).len(), 13);
        for landmark in skiagraph_core::body::LANDMARKS {
            assert!(MARKER_BONES.iter().flatten().any(|l| *l == landmark), "{landmark:?}");
        }
    }

    #[test]
    fn a_bone_is_drawn_where_the_camera_sees_its_ends() {
        let camera = camera_in_front();
        let markers = standing();
        for (whose, width) in [(Whose::Truth, 3.0), (Whose::Estimate, 3.0)] {
            let mut picture = Pixmap::new(camera.pinhole.width, camera.pinhole.height).unwrap();
            draw_bones(&mut picture, &camera, &PictureWindow::whole(), &marker_bones(&markers), whose, width);
            for point in markers.iter().flatten() {
                let pixel = camera.project(point).unwrap();
                assert_eq!(colour_at(&picture, pixel.x as u32, pixel.y as u32), whose.colour());
            }
        }
    }

    #[test]
    fn bones_behind_the_camera_are_not_drawn() {
        let camera = camera_in_front();
        let mut picture = Pixmap::new(camera.pinhole.width, camera.pinhole.height).unwrap();
        let behind = [[Point3::new(50.0, 0.0, 1.0), Point3::new(60.0, 0.0, 1.0)]];
        draw_bones(&mut picture, &camera, &PictureWindow::whole(), &behind, Whose::Truth, 3.0);
        assert!(picture.pixels().iter().all(|pixel| pixel.alpha() == 0));
    }
}
