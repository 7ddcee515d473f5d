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
    /// Depth along the camera's z axis of the nearest solid at or beyond the near plane, metres; infinite if there is
    /// none.
    pub depth: Vec<f32>,
    /// Index of that solid's link, plus 1; 0 if there is none.
    pub part: Vec<u32>,
}

impl SilhouettePainter {
    /// Depth and link by the rays of all pixels, lens included. Agrees with the silhouette, except for pixels whose
    /// centre is on an outline up to rounding.
    pub fn depth(&mut self, humanoid: &Humanoid, frames: &LinkFrames) -> DepthImage {
        if let Some(skin) = &humanoid.skin {
            return self.depth_of_skin(skin, frames);
        }
        self.depth_of(humanoid.links.iter().map(|link| link.solids.as_slice()).zip(frames.0.iter().copied()))
    }

    /// As [`Self::depth`], for props; the part is the prop's index plus 1.
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

    /// Clears the pixels of this image's silhouette that are hidden by `screen`; all are of the same camera. A pixel
    /// on an outline that is in the silhouette but not in this image (see [`SilhouettePainter::depth`]) is treated as
    /// infinitely far.
    pub fn clear_hidden(&self, screen: &DepthImage, silhouette: &mut Mask) {
        for (index, (screen, own)) in screen.depth.iter().zip(&self.depth).enumerate() {
            if screen < own {
                self.set(silhouette, index, false);
            }
        }
    }

    /// Sets a pixel of a mask of the same size by its index in row order.
    fn set(&self, mask: &mut Mask, index: usize, value: bool) {
        mask.set(index as u32 % self.width, index as u32 / self.width, value);
    }
}
