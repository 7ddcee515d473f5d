//! Rendering through a camera, with a global or a rolling shutter.

use nalgebra::Isometry3;

use skiagraph_core::body::{DepthImage, Humanoid, LinkFrames, Prop, SilhouettePainter, SurfacePixel};
use skiagraph_core::camera::Camera;
use skiagraph_core::raster::Mask;

/// Renderer of a camera. With a rolling shutter every row has its own painter, with the camera and the links at the
/// time that row is exposed.
pub(super) struct Eye {
    /// One painter, or one per row.
    rows: Vec<SilhouettePainter>,
}

impl Eye {
    /// A renderer of `camera`; `rolling` if its rows are exposed one after another.
    pub(super) fn new(camera: &Camera, rolling: bool) -> Self {
        let rows = if rolling { rows_of(camera) } else { vec![camera.clone()] };
        Self { rows: rows.iter().map(SilhouettePainter::new).collect() }
    }

    /// A copy for another thread; large buffers are shared.
    pub(super) fn sharing(&self) -> Self {
        Self { rows: self.rows.iter().map(SilhouettePainter::sharing).collect() }
    }

    /// Moves the camera; one pose, or one per row.
    pub(super) fn place(&mut self, placements: impl Iterator<Item = Isometry3<f64>>) {
        self.rows.iter_mut().zip(placements).for_each(|(row, placement)| row.place(&placement));
    }

    /// The silhouette of a body, with link frames for each exposure.
    pub(super) fn silhouette(&mut self, body: &Humanoid, links: &[LinkFrames]) -> Mask {
        join_rows(self.each(links, |painter, links| painter.silhouette(body, links)))
    }

    /// Depth and link of every pixel.
    pub(super) fn depth(&mut self, body: &Humanoid, links: &[LinkFrames]) -> DepthImage {
        join_depths(self.each(links, |painter, links| painter.depth(body, links)))
    }

    /// The visible surface of a body, pixel by pixel.
    pub(super) fn surface(&mut self, body: &Humanoid, links: &[LinkFrames]) -> Vec<SurfacePixel> {
        join_surfaces(self.each(links, |painter, links| painter.surface(body, links)))
    }

    pub(super) fn depth_of_props(&mut self, props: &[Prop]) -> DepthImage {
        join_depths(self.rows.iter_mut().map(|painter| painter.depth_of_props(props)).collect())
    }

    /// The visible surface of props, pixel by pixel.
    pub(super) fn surface_of_props(&mut self, props: &[Prop]) -> Vec<SurfacePixel> {
        join_surfaces(self.rows.iter_mut().map(|painter| painter.surface_of_props(props)).collect())
    }

    fn each<T>(
        &mut self,
        links: &[LinkFrames],
        mut look: impl FnMut(&mut SilhouettePainter, &LinkFrames) -> T,
    ) -> Vec<T> {
        self.rows.iter_mut().zip(links).map(|(painter, links)| look(painter, links)).collect()
    }
}

/// One camera per row of an image.
fn rows_of(camera: &Camera) -> Vec<Camera> {
    let row = |y: u32| {
        let mut row = camera.clone();
        row.pinhole.principal_point[1] -= f64::from(y);
        row.pinhole.height = 1;
        row
    };
    (0..camera.pinhole.height).map(row).collect()
}

/// Joins rows to an image; a single image is returned unchanged.
fn join_rows(mut rows: Vec<Mask>) -> Mask {
    if rows.len() == 1 {
        return rows.remove(0);
    }
    let mut image = Mask::new(rows.first().map_or(0, Mask::width), rows.len() as u32);
    for (y, row) in (0..).zip(&rows) {
        row.runs(0).flatten().for_each(|x| image.set(x, y, true));
    }
    image
}

fn join_depths(mut rows: Vec<DepthImage>) -> DepthImage {
    if rows.len() == 1 {
        return rows.remove(0);
    }
    let (width, height) = (rows.first().map_or(0, |row| row.width), rows.len() as u32);
    let depth = rows.iter().flat_map(|row| row.depth.iter().copied()).collect();
    DepthImage { width, height, depth, part: rows.iter().flat_map(|row| row.part.iter().copied()).collect() }
}

fn join_surfaces(rows: Vec<Vec<SurfacePixel>>) -> Vec<SurfacePixel> {
    let shifted =
        |(y, row): (u32, Vec<SurfacePixel>)| row.into_iter().map(move |pixel| SurfacePixel { y: pixel.y + y, ..pixel });
    (0..).zip(rows).flat_map(shifted).collect()
}
