//! Regions of an image: a rectangle of rays, a box in space that is seen in it, a rectangle of pixels.

use std::ops::Range;

use nalgebra::{Point3, Vector3};

use crate::raster::RayStrip;

/// A rectangle in ideal image coordinates (x / z, y / z).
#[derive(Clone, Copy, Debug)]
pub(super) struct IdealRectangle {
    pub(super) low: [f64; 2],
    pub(super) high: [f64; 2],
}

/// A box in the camera's frame around a solid.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reach {
    pub(super) low: Point3<f64>,
    pub(super) high: Point3<f64>,
}

impl Reach {
    pub(super) fn around(points: impl IntoIterator<Item = Point3<f64>>) -> Self {
        let nowhere = Self { low: Vector3::repeat(f64::INFINITY).into(), high: Vector3::repeat(-f64::INFINITY).into() };
        points.into_iter().fold(nowhere, |reach, p| Self { low: reach.low.inf(&p), high: reach.high.sup(&p) })
    }

    /// The image region of the part of the box beyond the plane z = `near`; `None` if there is none.
    pub(super) fn view(&self, near: f64) -> Option<IdealRectangle> {
        if self.high.z.is_nan() || self.high.z < near {
            return None;
        }
        let (nearest, farthest) = (self.low.z.max(near), self.high.z);
        let least = |i: usize| self.low[i] / if self.low[i] < 0.0 { nearest } else { farthest };
        let most = |i: usize| self.high[i] / if self.high[i] > 0.0 { nearest } else { farthest };
        Some(IdealRectangle { low: [least(0), least(1)], high: [most(0), most(1)] })
    }
}

impl IdealRectangle {
    pub(super) fn meets(&self, other: &Self) -> bool {
        (0..2).all(|i| self.low[i] <= other.high[i] && self.high[i] >= other.low[i])
    }

    pub(super) fn contains(&self, ray: [f64; 2]) -> bool {
        self.meets(&Self { low: ray, high: ray })
    }

    pub(super) const NOWHERE: Self = Self { low: [f64::INFINITY; 2], high: [f64::NEG_INFINITY; 2] };

    /// The smallest rectangle around the rays of a strip; rays without a direction (NaN) are ignored.
    pub(super) fn around(strip: &RayStrip) -> Self {
        let [low, high] = [Self::NOWHERE.low, Self::NOWHERE.high];
        let least = |i: usize| strip[i].iter().fold(low[i], |least, v| if *v < least { *v } else { least });
        let most = |i: usize| strip[i].iter().fold(high[i], |most, v| if *v > most { *v } else { most });
        Self { low: [least(0), least(1)], high: [most(0), most(1)] }
    }

    /// The smallest rectangle around both.
    pub(super) fn and(&self, other: &Self) -> Self {
        Self {
            low: [self.low[0].min(other.low[0]), self.low[1].min(other.low[1])],
            high: [self.high[0].max(other.high[0]), self.high[1].max(other.high[1])],
        }
    }
}

#[derive(Clone, Copy, Debug)]
pub(super) struct PixelWindow {
    pub(super) left: u32,
    pub(super) top: u32,
    pub(super) width: u32,
    pub(super) height: u32,
}

impl PixelWindow {
    /// The pixels from `low` to `high`, ends included; none if `low` is above `high`.
    pub(super) fn between(low: [u32; 2], high: [u32; 2]) -> Self {
        let [width, height] = std::array::from_fn(|i| (high[i] + 1).saturating_sub(low[i]));
        Self { left: low[0], top: low[1], width, height }
    }

    pub(super) fn rows(&self) -> Range<u32> {
        self.top..self.top + self.height
    }

    pub(super) fn columns(&self) -> Range<u32> {
        self.left..self.left + self.width
    }

    pub(super) fn pixels(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// The index of a pixel in it, row by row.
    #[inline]
    pub(super) fn place(&self, x: u32, y: u32) -> usize {
        (y - self.top) as usize * self.width as usize + (x - self.left) as usize
    }

    pub(super) fn pixel(&self, place: usize) -> (u32, u32) {
        let width = self.width as usize;
        (self.left + (place % width) as u32, self.top + (place / width) as u32)
    }
}
