//! Removes lens distortion from observed masks, so that comparison uses ideal pinhole images.

use nalgebra::Point2;

use skiagraph_core::camera::Camera;
use skiagraph_core::raster::Mask;

/// Marks a pinhole pixel that no pixel of the camera shows.
const UNSEEN: (u32, u32) = (u32::MAX, u32::MAX);

/// For every pixel of a camera's ideal pinhole, the pixel of the distorted image on the same ray (nearest neighbour).
/// Computed once per camera and used in every frame.
///
/// The rectified image has the camera's size and pinhole: what a barrel lens shows beyond its edges is cropped, and
/// what a pincushion lens does not show inside them counts as background.
#[derive(Clone, Debug)]
pub(super) struct Rectification {
    width: u32,
    height: u32,
    sources: Vec<(u32, u32)>,
}

impl Rectification {
    /// `None` for a camera with an ideal lens, whose masks need no rectification.
    pub(super) fn new(camera: &Camera) -> Option<Self> {
        if camera.distortion.is_none() {
            return None;
        }
        let (width, height) = (camera.pinhole.width, camera.pinhole.height);
        let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        let sources = pixels.map(|pixel| source(camera, pixel)).collect();
        Some(Self { width, height, sources })
    }

    /// The pixels of the rectified image that the camera shows; `None` if it shows all.
    pub(super) fn shown(&self) -> Option<Mask> {
        let row = self.width.max(1) as usize;
        let is_shown = |x: u32, y: u32| self.sources[y as usize * row + x as usize] != UNSEEN;
        self.sources.contains(&UNSEEN).then(|| Mask::from_fn(self.width, self.height, is_shown))
    }

    /// The mask as seen through an ideal lens.
    pub(super) fn rectify(&self, observed: &Mask) -> Mask {
        let mut rectified = Mask::new(self.width, self.height);
        let rows = self.sources.chunks_exact(self.width.max(1) as usize);
        for (y, row) in (0..).zip(rows) {
            for (x, (source_x, source_y)) in (0..).zip(row) {
                if observed.get(*source_x, *source_y) {
                    rectified.set(x, y, true);
                }
            }
        }
        rectified
    }
}

/// The pixel of the distorted image on the ray through the centre of pinhole pixel `(x, y)`.
fn source(camera: &Camera, (x, y): (u32, u32)) -> (u32, u32) {
    let (u, v) = camera.pinhole.normalised(&Point2::new(f64::from(x) + 0.5, f64::from(y) + 0.5));
    // Far from the centre, a polynomial lens folds back over its own image.
    if !camera.distortion.is_before_fold(u, v) {
        return UNSEEN;
    }
    let (u, v) = camera.distortion.apply(u, v);
    let pixel = camera.pinhole.pixel(u, v);
    if camera.pinhole.contains(&pixel) { (pixel.x as u32, pixel.y as u32) } else { UNSEEN }
}
