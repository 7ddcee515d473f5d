//! The silhouette of a body as seen by a camera, lens distortion included.
//!
//! A pixel is set iff the ray through its centre meets the part of any solid at or beyond the near plane. Tapered
//! capsules in a camera with an ideal lens are filled by their outlines ([`CapsulePainter`], thousands per second).
//! For everything else the rays of all pixels near the solid are tested, which is exact for any lens. A body with a
//! skin is drawn as that skin.

mod depth;
mod mesh_through_lens;
mod pixel_cells;
mod pixel_rays;
mod regions;
mod solid;
mod surface;

use std::sync::{Arc, OnceLock};

use nalgebra::{Isometry3, Point3};

use super::{Humanoid, LinkFrames, Skin, Solid};
use crate::camera::Camera;
use crate::raster::{CapsulePainter, Mask, MeshScratch, TaperedCapsule};
pub use depth::DepthImage;
use mesh_through_lens::LensScratch;
use pixel_rays::PixelRays;
pub use surface::{SkinPoint, SurfacePixel};

/// Writes every tapered capsule of the body into `capsules` (cleared first), in the camera's frame, metres: the input
/// of [`CapsulePainter`] and of trackers' energies. Other solids are ignored.
pub fn capsules_in_camera(
    humanoid: &Humanoid,
    frames: &LinkFrames,
    camera: &Camera,
    capsules: &mut Vec<TaperedCapsule>,
) {
    capsules.clear();
    for (link, world_from_link) in humanoid.links.iter().zip(&frames.0).filter(|(link, _)| !link.solids.is_empty()) {
        let camera_from_link = camera.camera_from_world * world_from_link;
        for solid in &link.solids {
            if let Solid::TaperedCapsule(capsule) = solid {
                capsules.push(capsule.transformed(&camera_from_link));
            }
        }
    }
}

/// Adds the silhouette of a body to `mask`, which has the camera's size. Use a [`SilhouettePainter`] to draw many.
pub fn draw_silhouette(humanoid: &Humanoid, frames: &LinkFrames, camera: &Camera, mask: &mut Mask) {
    SilhouettePainter::new(camera).paint(humanoid, frames, mask);
}

/// Draws silhouettes of bodies for one camera.
pub struct SilhouettePainter {
    camera: Camera,
    outlines: CapsulePainter,
    capsules: Vec<TaperedCapsule>,
    /// Vertices of a skin in the camera's frame.
    skin: Vec<Point3<f64>>,
    mesh: MeshScratch,
    lens: LensScratch,
    /// Created on first use: undistorting every pixel takes tens of milliseconds, and 16 bytes per pixel.
    rays: Arc<OnceLock<PixelRays>>,
}

impl SilhouettePainter {
    /// A painter for `camera`.
    pub fn new(camera: &Camera) -> Self {
        Self {
            camera: camera.clone(),
            outlines: CapsulePainter::new(&camera.pinhole),
            capsules: Vec::new(),
            skin: Vec::new(),
            mesh: MeshScratch::default(),
            lens: LensScratch::default(),
            rays: Arc::default(),
        }
    }

    /// Another painter for the same camera, for another thread; large buffers are shared.
    pub fn sharing(&self) -> Self {
        Self { rays: self.rays.clone(), ..Self::new(&self.camera) }
    }

    /// Moves the camera to this world-to-camera transform, metres.
    pub fn place(&mut self, camera_from_world: &Isometry3<f64>) {
        self.camera.camera_from_world = *camera_from_world;
    }

    /// Adds the silhouette of a body with its links at `frames` to `mask`, which has the camera's size.
    pub fn paint(&mut self, humanoid: &Humanoid, frames: &LinkFrames, mask: &mut Mask) {
        if let Some(skin) = &humanoid.skin {
            return self.paint_skin(skin, frames, mask);
        }
        let ideal = self.camera.distortion.is_none();
        if ideal {
            capsules_in_camera(humanoid, frames, &self.camera, &mut self.capsules);
            self.outlines.paint(&self.capsules, mask);
        }
        for (link, world_from_link) in humanoid.links.iter().zip(&frames.0) {
            let camera_from_link = self.camera.camera_from_world * world_from_link;
            for solid in link.solids.iter().filter(|f| !(ideal && matches!(f, Solid::TaperedCapsule(_)))) {
                solid::paint(solid, &camera_from_link, self.rays(), self.camera.pinhole.near, mask);
            }
        }
    }

    /// The silhouette of a body with its links at `frames`, on a new mask of the camera's size.
    pub fn silhouette(&mut self, humanoid: &Humanoid, frames: &LinkFrames) -> Mask {
        let mut mask = Mask::new(self.camera.pinhole.width, self.camera.pinhole.height);
        self.paint(humanoid, frames, &mut mask);
        mask
    }

    fn paint_skin(&mut self, skin: &Skin, frames: &LinkFrames, mask: &mut Mask) {
        skin.deform_with(&self.camera.camera_from_world, frames, &mut self.skin);
        if self.camera.distortion.is_none() {
            return skin.topology().paint(&self.camera.pinhole, &self.skin, &mut self.mesh, mask);
        }
        let (rays, near) = (self.rays.get_or_init(|| PixelRays::new(&self.camera)), self.camera.pinhole.near);
        if !mesh_through_lens::paint(skin.topology(), &self.skin, rays, near, &mut self.lens, mask) {
            solid::each_depth_of_mesh(&self.skin, skin.triangles(), rays, near, &mut |x, y, _, _| mask.set(x, y, true));
        }
    }

    /// The rays of all pixels, computed on first use.
    fn rays(&self) -> &PixelRays {
        self.rays.get_or_init(|| PixelRays::new(&self.camera))
    }
}

#[cfg(test)]
mod tests;
