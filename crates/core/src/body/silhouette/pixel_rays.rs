//! The ray of every pixel of a camera, and a fast search for pixels that may see a region.

use std::sync::OnceLock;

use nalgebra::{Point2, Vector3};

use super::pixel_cells::PixelCells;
use super::regions::{IdealRectangle, PixelWindow};
use crate::camera::Camera;
use crate::raster::{Mask, RayStrip, STRIP_RAYS, TaperedCapsule, entries_of_rays, rays_that_meet};

/// Side of a tile, pixels: a row of a tile is a strip.
const TILE: u32 = STRIP_RAYS as u32;

/// The ideal image coordinates of every pixel's centre, in tiles.
pub(super) struct PixelRays {
    width: u32,
    height: u32,
    /// Strips per row of the image.
    strips_a_row: usize,
    /// Row by row; NaN where the lens model has no inverse, and beyond the right edge.
    strips: Vec<RayStrip>,
    /// The view of each strip.
    views: Vec<IdealRectangle>,
    tiles: Vec<Tile>,
    /// Size of a pixel in ideal coordinates, in the middle of the image.
    pixel: [f64; 2],
    /// Created on first use: only meshes need it.
    cells: OnceLock<PixelCells>,
}

struct Tile {
    left: u32,
    top: u32,
    view: IdealRectangle,
}

impl PixelRays {
    pub(super) fn new(camera: &Camera) -> Self {
        let (width, height) = (camera.pinhole.width, camera.pinhole.height);
        let strips_a_row = width.div_ceil(TILE) as usize;
        let mut strips = vec![[[f64::NAN; STRIP_RAYS]; 2]; strips_a_row * height as usize];
        let ideal = camera.distortion.is_none();
        for y in 0..height {
            for x in 0..width {
                let (u, v) = camera.pinhole.normalised(&Point2::new(f64::from(x) + 0.5, f64::from(y) + 0.5));
                if let Some((u, v)) = if ideal { Some((u, v)) } else { camera.distortion.undistort(u, v) } {
                    let [us, vs] = &mut strips[y as usize * strips_a_row + (x / TILE) as usize];
                    (us[(x % TILE) as usize], vs[(x % TILE) as usize]) = (u, v);
                }
            }
        }
        let views: Vec<IdealRectangle> = strips.iter().map(IdealRectangle::around).collect();
        let mut tiles = Vec::with_capacity(strips_a_row * height.div_ceil(TILE) as usize);
        for top in (0..height).step_by(TILE as usize) {
            for (column, left) in (0..width).step_by(TILE as usize).enumerate() {
                let rows = top as usize..(top + TILE).min(height) as usize;
                let of_strips = rows.map(|y| &views[y * strips_a_row + column]);
                let view = of_strips.fold(IdealRectangle::NOWHERE, |whole, view| whole.and(view));
                tiles.push(Tile { left, top, view });
            }
        }
        let pixel = camera.pinhole.focal.map(|focal| 1.0 / focal);
        Self { width, height, strips_a_row, strips, views, tiles, pixel, cells: OnceLock::new() }
    }

    pub(super) fn size(&self) -> (u32, u32) {
        (self.width, self.height)
    }

    /// The smallest rectangle around all rays.
    pub(super) fn view(&self) -> IdealRectangle {
        self.views.iter().fold(IdealRectangle::NOWHERE, |whole, view| whole.and(view))
    }

    /// Which pixels may see a small region.
    pub(super) fn cells(&self) -> &PixelCells {
        self.cells
            .get_or_init(|| PixelCells::new((self.width, self.height), self.view(), self.pixel, |x, y| self.ray(x, y)))
    }

    /// Whether a ray of the left or right border of the image is in `view`.
    pub(super) fn borders_meet(&self, view: &IdealRectangle) -> bool {
        let mut borders = (0..self.height).flat_map(|y| [(0, y), (self.width - 1, y)]);
        borders.any(|(x, y)| view.contains(self.ray(x, y)))
    }

    /// The ray of one pixel, NaN where the lens model has no inverse.
    pub(super) fn ray(&self, x: u32, y: u32) -> [f64; 2] {
        let [us, vs] = &self.strips[y as usize * self.strips_a_row + (x / TILE) as usize];
        [us[(x % TILE) as usize], vs[(x % TILE) as usize]]
    }

    /// A rectangle that contains every pixel whose ray is in one of these views.
    pub(super) fn window(&self, views: impl Iterator<Item = IdealRectangle>) -> PixelWindow {
        let (mut low, mut high) = ([self.width, self.height], [0, 0]);
        for view in views {
            for tile in self.tiles.iter().filter(|tile| tile.view.meets(&view)) {
                low = [low[0].min(tile.left), low[1].min(tile.top)];
                high =
                    [high[0].max((tile.left + TILE).min(self.width)), high[1].max((tile.top + TILE).min(self.height))];
            }
        }
        let [left, top] = low;
        PixelWindow { left, top, width: high[0].saturating_sub(left), height: high[1].saturating_sub(top) }
    }

    /// Calls `visit` with every pixel whose ray is in `view`, and its ray (z = 1).
    pub(super) fn each_pixel(&self, view: &IdealRectangle, mut visit: impl FnMut(u32, u32, &Vector3<f64>)) {
        for tile in self.tiles.iter().filter(|t| t.view.meets(view)) {
            for (x, y, [u, v]) in self.pixels(tile.left, tile.top) {
                if view.contains([u, v]) {
                    visit(x, y, &Vector3::new(u, v, 1.0));
                }
            }
        }
    }

    /// Sets the pixels of a mask of the camera's size that see `capsule`, which is in `view`, at or beyond z = `near`.
    pub(super) fn paint_capsule(&self, capsule: &TaperedCapsule, view: &IdealRectangle, near: f64, mask: &mut Mask) {
        let is_full = |mask: &Mask, x: u32, y: u32| mask.row(y)[x as usize / 64] >> (x % 64) & 0xffff == 0xffff;
        let (places, chosen) = self.strips_in(view, |x, y| !is_full(mask, x, y));
        let mut found = Vec::new();
        rays_that_meet(capsule, near, &self.strips, &chosen, &mut found);
        for ((x, y), bits) in places.into_iter().zip(found) {
            mask.row_mut(y)[x as usize / 64] |= u64::from(bits) << (x % 64);
        }
    }

    /// Calls `visit` with every pixel that sees `capsule`, which is in `view`, at or beyond z = `near`, and the least
    /// depth of it there.
    pub(super) fn each_entry(
        &self,
        capsule: &TaperedCapsule,
        view: &IdealRectangle,
        near: f64,
        mut visit: impl FnMut(u32, u32, f64),
    ) {
        let (places, chosen) = self.strips_in(view, |_, _| true);
        let mut found = Vec::new();
        entries_of_rays(capsule, near, &self.strips, &chosen, &mut found);
        for ((left, y), depths) in places.into_iter().zip(found) {
            for (x, depth) in (left..).zip(depths).filter(|(_, depth)| *depth < f64::INFINITY) {
                visit(x, y, depth);
            }
        }
    }

    /// The strips that overlap `view` and are `wanted`: their first pixels, and their indices among all strips.
    fn strips_in(&self, view: &IdealRectangle, wanted: impl Fn(u32, u32) -> bool) -> (Vec<(u32, u32)>, Vec<u32>) {
        let tiles = self.tiles.iter().filter(|tile| tile.view.meets(view));
        let strips = tiles.flat_map(|tile| {
            let strip = move |y: u32| ((tile.left, y), y as usize * self.strips_a_row + (tile.left / TILE) as usize);
            (tile.top..(tile.top + TILE).min(self.height)).map(strip)
        });
        let seen = strips.filter(|((x, y), index)| self.views[*index].meets(view) && wanted(*x, *y));
        seen.map(|(place, index)| (place, index as u32)).unzip()
    }

    fn pixels(&self, left: u32, top: u32) -> impl Iterator<Item = (u32, u32, [f64; 2])> {
        (top..(top + TILE).min(self.height)).flat_map(move |y| {
            let [us, vs] = &self.strips[y as usize * self.strips_a_row + (left / TILE) as usize];
            let columns = left..(left + TILE).min(self.width);
            columns.zip(us.iter().zip(vs)).map(move |(x, (u, v))| (x, y, [*u, *v]))
        })
    }
}
