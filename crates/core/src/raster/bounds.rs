//! A rectangle of whole pixels.

/// Pixels `left..right` by `top..bottom`; empty if either range is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PixelBounds {
    /// First column.
    pub left: u32,
    /// First row.
    pub top: u32,
    /// One past the last column.
    pub right: u32,
    /// One past the last row.
    pub bottom: u32,
}

impl PixelBounds {
    /// Whether it contains no pixel.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.left >= self.right || self.top >= self.bottom
    }

    /// The smallest rectangle that contains both; an empty one adds nothing.
    #[inline]
    pub fn union(&self, other: &Self) -> Self {
        match (self.is_empty(), other.is_empty()) {
            (true, true) => Self::default(),
            (true, false) => *other,
            (false, true) => *self,
            (false, false) => Self {
                left: self.left.min(other.left),
                top: self.top.min(other.top),
                right: self.right.max(other.right),
                bottom: self.bottom.max(other.bottom),
            },
        }
    }

    /// The rectangle grown by `margin` on every side, clipped to an image of `width` x `height`.
    pub fn grown(&self, margin: u32, width: u32, height: u32) -> Self {
        if self.is_empty() {
            return Self::default();
        }
        Self {
            left: self.left.saturating_sub(margin),
            top: self.top.saturating_sub(margin),
            right: self.right.saturating_add(margin).min(width),
            bottom: self.bottom.saturating_add(margin).min(height),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_empty_rectangle_adds_nothing_to_a_union() {
        let a = PixelBounds { left: 3, top: 4, right: 10, bottom: 6 };
        let empty = PixelBounds { left: 90, top: 90, right: 90, bottom: 99 };
        assert_eq!(a.union(&empty), a);
        assert_eq!(empty.union(&a), a);
        assert!(empty.union(&empty).is_empty());
        let b = PixelBounds { left: 0, top: 5, right: 4, bottom: 20 };
        assert_eq!(a.union(&b), PixelBounds { left: 0, top: 4, right: 10, bottom: 20 });
    }
}
