//! Depth and link index of every pixel.

use nalgebra::Isometry3;

use super::{SilhouettePainter, solid};
use crate::body::{Humanoid, LinkFrames, Prop, Skin, Solid};
use crate::raster::Mask;

/// Depth and link at the centre of every pixel, row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthImage {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Depth along the camera's z axis of the nearest solid at or beyond the near plane, metres; infinite where there
    /// is none.
    pub depth: Vec<f32>,
    /// Index of the link whose solid it is, plus 1; 0 where there is none.
    pub part: Vec<u32>,
}

impl SilhouettePainter {
    /// Depth and link by the rays of all pixels, lens included. Equals the silhouette, except for pixels whose centre
    /// lies on an outline up to rounding.
    pub fn depth(&mut self, humanoid: &Humanoid, frames: &LinkFrames) -> DepthImage {
        if let Some(skin) = &humanoid.skin {
            return self.depth_of_skin(skin, frames);
        }
        self.depth_of(humanoid.links.iter().map(|link| link.solids.as_slice()).zip(frames.0.iter().copied()))
    }

    /// As [`Self::depth`], of the props; the part is the prop's index plus 1.
    pub fn depth_of_props(&mut self, props: &[Prop]) -> DepthImage {
        self.depth_of(props.iter().map(|prop| (std::slice::from_ref(&prop.solid), Isometry3::identity())))
    }

    /// The part is the link that carries most of the triangle.
    fn depth_of_skin(&mut self, skin: &Skin, frames: &LinkFrames) -> DepthImage {
        let (width, height, near) = (self.camera.pinhole.width, self.camera.pinhole.height, self.camera.pinhole.near);
        skin.deform_with(&self.camera.camera_from_world, frames, &mut self.skin);
        let rays = self.rays();
        let pixels = width as usize * height as usize;
        let mut image = DepthImage { width, height, depth: vec![f32::INFINITY; pixels], part: vec![0; pixels] };
        solid::each_depth_of_mesh(&self.skin, skin.triangles(), rays, near, &mut |x, y, depth, triangle| {
            let pixel = y as usize * width as usize + x as usize;
            if (depth as f32) < image.depth[pixel] {
                image.depth[pixel] = depth as f32;
                image.part[pixel] = skin.part_of(triangle as usize) + 1;
            }
        });
        image
    }

    fn depth_of<'a>(&mut self, parts: impl Iterator<Item = (&'a [Solid], Isometry3<f64>)>) -> DepthImage {
        let (width, height, near) = (self.camera.pinhole.width, self.camera.pinhole.height, self.camera.pinhole.near);
        let rays = self.rays();
        let pixels = width as usize * height as usize;
        let mut image = DepthImage { width, height, depth: vec![f32::INFINITY; pixels], part: vec![0; pixels] };
        for ((solids, world_from_link), part) in parts.zip(1..) {
            let camera_from_link = self.camera.camera_from_world * world_from_link;
            for solid in solids {
                solid::each_depth(solid, &camera_from_link, rays, near, &mut |x, y, depth, _| {
                    let pixel = y as usize * width as usize + x as usize;
                    if (depth as f32) < image.depth[pixel] {
                        image.depth[pixel] = depth as f32;
                        image.part[pixel] = part;
                    }
                });
            }
        }
        image
    }
}

impl DepthImage {
    /// The pixels that show geometry.
    pub fn mask(&self) -> Mask {
        let mut mask = Mask::new(self.width, self.height);
        for (index, _) in self.part.iter().enumerate().filter(|(_, part)| **part != 0) {
            self.set(&mut mask, index, true);
        }
        mask
    }

    /// Clears the pixels that are farther than `screen` at the same pixel; both images are of the same camera.
    pub fn hide_behind(&mut self, screen: &DepthImage) {
        for (index, screen) in screen.depth.iter().enumerate() {
            if *screen < self.depth[index] {
                (self.depth[index], self.part[index]) = (f32::INFINITY, 0);
            }
        }
    }

    /// Clears the pixels of this image's silhouette that `screen` hides; all are of the same camera. A pixel on an
    /// outline that is in the silhouette but not in this image (see [`SilhouettePainter::depth`]) counts as the
    /// farthest.
    pub fn clear_hidden(&self, screen: &DepthImage, silhouette: &mut Mask) {
        for (index, (screen, own)) in screen.depth.iter().zip(&self.depth).enumerate() {
            if screen < own {
                self.set(silhouette, index, false);
            }
        }
    }

    /// Sets a pixel of a mask of the same size by its place in row order.
    fn set(&self, mask: &mut Mask, index: usize, value: bool) {
        mask.set(index as u32 % self.width, index as u32 / self.width, value);
    }
}

#[cfg(test)]
mod tests {
    use crate::body::{SilhouettePainter, Solid};
    use crate::camera::{Camera, Distortion, FieldOfView};
    use crate::test_bodies::{person, walk};
    use nalgebra::{Isometry3, Point3, Vector3};

    fn camera() -> Camera {
        let eye = Point3::new(2.5, 1.5, 1.2);
        let view = FieldOfView::Vertical(0.9);
        Camera::look_at("c", eye, Point3::new(0.0, 0.0, 1.0), Vector3::z(), view, 160, 120).unwrap()
    }

    #[test]
    fn depth_is_finite_where_the_silhouette_is_and_every_part_is_seen() {
        let mut body = person();
        let frame = Isometry3::translation(0.1, 0.0, 0.2);
        body.links[0].solids.push(Solid::Box { link_from_box: frame, half_extents: [0.1, 0.2, 0.1] });
        let frames = body.link_frames(&walk(8).poses[7]);
        for distortion in [Distortion::default(), Distortion { k1: -0.15, p1: 0.002, ..Distortion::default() }] {
            let mut painter = SilhouettePainter::new(&Camera { distortion, ..camera() });
            let (mask, image) = (painter.silhouette(&body, &frames), painter.depth(&body, &frames));
            let differing = (0..160 * 120_u32)
                .filter(|i| mask.get(i % 160, i / 160) != image.depth[*i as usize].is_finite())
                .count();
            assert!(differing <= 2, "{differing} of {}", mask.count());
            for part in 1..=body.links.len() as u32 {
                assert!(image.part.contains(&part), "part {part}");
            }
            assert!(image.part.iter().zip(&image.depth).all(|(part, depth)| (*part > 0) == depth.is_finite()));
        }
    }

    #[test]
    fn a_pixel_lifted_by_its_depth_lies_on_the_surface_of_its_part() {
        let body = person();
        let frames = body.link_frames(&walk(1).poses[0]);
        let camera = camera();
        let image = SilhouettePainter::new(&camera).depth(&body, &frames);
        let mut checked = 0;
        for (i, (part, depth)) in image.part.iter().zip(&image.depth).enumerate().filter(|(_, (part, _))| **part > 0) {
            let pixel = nalgebra::Point2::new((i % 160) as f64 + 0.5, (i / 160) as f64 + 0.5);
            let (u, v) = camera.pinhole.normalised(&pixel);
            let in_camera = Point3::from(Vector3::new(u, v, 1.0) * f64::from(*depth));
            let in_link = frames[*part as usize - 1].inverse() * (camera.camera_from_world.inverse() * in_camera);
            let [Solid::TaperedCapsule(capsule)] = &body.links[*part as usize - 1].solids[..] else { panic!() };
            // the nearest of many balls of which the solid is the union touches the point
            let gap = (0..=1000).map(|t| {
                let t = f64::from(t) / 1000.0;
                let centre = capsule.a + (capsule.b - capsule.a) * t;
                (in_link - centre).norm() - (capsule.radius_a + t * (capsule.radius_b - capsule.radius_a))
            });
            let gap = gap.fold(f64::INFINITY, f64::min);
            assert!(gap.abs() < 1e-5, "pixel {pixel}: {gap}");
            checked += 1;
        }
        assert!(checked > 500, "{checked}");
    }
}
