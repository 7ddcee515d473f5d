//! A fast search for the pixels that may see a small region: a grid over the ideal image.

use super::regions::{IdealRectangle, PixelWindow};

/// Side of a cell, in pixels of the same camera with an ideal lens.
const SIDE: f64 = 2.0;

/// A grid that covers at most this many times the distance between the image's middle and its borders without the lens.
/// Its outermost cells also stand for whatever is beyond.
const REACH: f64 = 3.0;

/// For each cell of a grid over the ideal image, the pixels of which the ray, or the line from their ray to that of the
/// next pixel to the right, may touch the cell.
pub(super) struct PixelCells {
    low: [f64; 2],
    /// Cells per unit of ideal coordinates.
    density: [f64; 2],
    /// Number of columns and of rows.
    size: [usize; 2],
    /// Row by row.
    windows: Vec<PixelSpan>,
    is_complete: bool,
}

/// A rectangle of pixels, ends included; empty if `low` is above `high`.
#[derive(Clone, Copy)]
struct PixelSpan {
    low: [u16; 2],
    high: [u16; 2],
}

impl PixelSpan {
    const NONE: Self = Self { low: [u16::MAX; 2], high: [0; 2] };

    fn and(self, other: Self) -> Self {
        Self {
            low: [self.low[0].min(other.low[0]), self.low[1].min(other.low[1])],
            high: [self.high[0].max(other.high[0]), self.high[1].max(other.high[1])],
        }
    }
}

impl PixelCells {
    /// The grid for an image of this width and height with these rays, all of which are in `whole`. `pixel` is the size
    /// of a pixel in ideal coordinates, in the middle of the image.
    pub(super) fn new(
        (width, height): (u32, u32),
        whole: IdealRectangle,
        pixel: [f64; 2],
        ray: impl Fn(u32, u32) -> [f64; 2],
    ) -> Self {
        let most = [f64::from(width) * pixel[0] * REACH, f64::from(height) * pixel[1] * REACH];
        let low: [f64; 2] = std::array::from_fn(|i| whole.low[i].max(-most[i]));
        let high: [f64; 2] = std::array::from_fn(|i| whole.high[i].min(most[i]));
        let density = pixel.map(|side| 1.0 / (SIDE * side));
        // at most 3 cells per pixel, even if no pixel has a ray and the range is empty
        let size = std::array::from_fn(|i| ((high[i] - low[i]).max(0.0) * density[i]) as usize + 1);
        let mut cells =
            Self { low, density, size, windows: vec![PixelSpan::NONE; size[0] * size[1]], is_complete: true };
        for y in 0..height {
            for x in 0..width {
                let here = ray(x, y);
                cells.is_complete &= !here[0].is_nan();
                let next = if x + 1 < width { ray(x + 1, y) } else { here };
                cells.add([x as u16, y as u16], [here, if next[0].is_nan() { here } else { next }]);
            }
        }
        cells
    }

    /// Adds a pixel to all cells that the line between two rays may touch.
    fn add(&mut self, pixel: [u16; 2], [a, b]: [[f64; 2]; 2]) {
        if a[0].is_nan() {
            return;
        }
        let view = IdealRectangle { low: [a[0].min(b[0]), a[1].min(b[1])], high: [a[0].max(b[0]), a[1].max(b[1])] };
        let ([left, top], [right, bottom]) = self.range(&view);
        for row in top..=bottom {
            for window in &mut self.windows[row * self.size[0] + left..=row * self.size[0] + right] {
                *window = window.and(PixelSpan { low: pixel, high: pixel });
            }
        }
    }

    /// The first and last column and row of the cells that overlap `view`.
    fn range(&self, view: &IdealRectangle) -> ([usize; 2], [usize; 2]) {
        let cell = |at: [f64; 2]| {
            // a cast saturates, so everything left of the grid is in its first column
            let place = |i: usize| ((at[i] - self.low[i]) * self.density[i]) as usize;
            [place(0).min(self.size[0] - 1), place(1).min(self.size[1] - 1)]
        };
        (cell(view.low), cell(view.high))
    }

    /// A rectangle around every pixel whose ray is in `view`, or for which the line to the next ray in its row touches
    /// it.
    pub(super) fn window(&self, view: &IdealRectangle) -> PixelWindow {
        let ([left, top], [right, bottom]) = self.range(view);
        let mut found = PixelSpan::NONE;
        for row in top..=bottom {
            for window in &self.windows[row * self.size[0] + left..=row * self.size[0] + right] {
                found = found.and(*window);
            }
        }
        PixelWindow::between(found.low.map(u32::from), found.high.map(u32::from))
    }

    pub(super) fn is_complete(&self) -> bool {
        self.is_complete
    }
}
