//! A bit-packed binary image.

/// A binary image, one bit a pixel, rows padded to whole 64-bit words; padding bits are always zero.
///
/// Pixel `(x, y)` has its centre at `(x + 0.5, y + 0.5)`; bit `x % 64` (least significant first) of word `x / 64` of row `y`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mask {
    width: u32,
    height: u32,
    words_per_row: usize,
    words: Vec<u64>,
}

impl Mask {
    /// An empty mask of `width` x `height` pixels.
    pub fn new(width: u32, height: u32) -> Self {
        let words_per_row = (width as usize).div_ceil(64);
        Self { width, height, words_per_row, words: vec![0; words_per_row * height as usize] }
    }

    /// Width in pixels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height in pixels.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Whether pixel `(x, y)` is set; outside the image nothing is.
    pub fn get(&self, x: u32, y: u32) -> bool {
        x < self.width
            && y < self.height
            && self.words[y as usize * self.words_per_row + (x / 64) as usize] >> (x % 64) & 1 == 1
    }

    /// Sets or clears pixel `(x, y)`; outside the image nothing happens.
    pub fn set(&mut self, x: u32, y: u32, value: bool) {
        if x >= self.width || y >= self.height {
            return;
        }
        let word = &mut self.words[y as usize * self.words_per_row + (x / 64) as usize];
        let bit = 1_u64 << (x % 64);
        if value { *word |= bit } else { *word &= !bit }
    }

    /// Number of set pixels.
    pub fn count(&self) -> u64 {
        self.words.iter().map(|w| u64::from(w.count_ones())).sum()
    }

    /// The words of row `y`.
    pub fn row(&self, y: u32) -> &[u64] {
        let start = y as usize * self.words_per_row;
        &self.words[start..start + self.words_per_row]
    }

    /// The words of row `y`, for drawing; bits at or beyond the width must stay zero.
    pub fn row_mut(&mut self, y: u32) -> &mut [u64] {
        let start = y as usize * self.words_per_row;
        &mut self.words[start..start + self.words_per_row]
    }

    /// Clears every pixel.
    pub fn clear(&mut self) {
        self.words.fill(0);
    }
}
