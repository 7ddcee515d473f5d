//! Camera images: eight bits per channel, grey or colour.

/// A planar image: one plane of grey values, or red, green and blue.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    width: u32,
    height: u32,
    planes: Vec<Vec<u8>>,
}

impl Image {
    /// An image of planes with `width * height` values each, row by row; `None` unless there are one or three such
    /// planes.
    pub fn from_planes(width: u32, height: u32, planes: Vec<Vec<u8>>) -> Option<Self> {
        let pixels = width as usize * height as usize;
        let fits = matches!(planes.len(), 1 | 3) && planes.iter().all(|plane| plane.len() == pixels);
        fits.then_some(Self { width, height, planes })
    }

    /// Like [`Self::from_planes`], for planes that are valid by construction.
    pub(super) fn from_valid_planes(width: u32, height: u32, planes: Vec<Vec<u8>>) -> Self {
        debug_assert!(planes.iter().all(|plane| plane.len() == width as usize * height as usize));
        Self { width, height, planes }
    }

    /// An image of interleaved values, one or three per pixel; `None` if their number does not fit.
    pub fn from_interleaved(width: u32, height: u32, channels: usize, values: &[u8]) -> Option<Self> {
        let planes = match channels {
            1 => vec![values.to_vec()],
            3 => {
                let mut planes: Vec<Vec<u8>> = (0..3).map(|_| Vec::with_capacity(values.len() / 3)).collect();
                for pixel in values.as_chunks::<3>().0 {
                    planes.iter_mut().zip(pixel).for_each(|(plane, value)| plane.push(*value));
                }
                planes
            }
            _ => return None,
        };
        (values.len() == width as usize * height as usize * channels).then_some(())?;
        Self::from_planes(width, height, planes)
    }

    /// Width in pixels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height in pixels.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// One plane of grey values, or three: red, green and blue.
    pub fn planes(&self) -> &[Vec<u8>] {
        &self.planes
    }

    /// Width, height and number of channels.
    pub fn shape(&self) -> (u32, u32, usize) {
        (self.width, self.height, self.planes.len())
    }

    /// Interleaved values, row by row.
    pub fn interleaved(&self) -> Vec<u8> {
        match self.planes.as_slice() {
            [red, green, blue] => {
                let mut values = Vec::with_capacity(3 * red.len());
                for ((red, green), blue) in red.iter().zip(green).zip(blue) {
                    values.extend_from_slice(&[*red, *green, *blue]);
                }
                values
            }
            planes => planes.concat(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_are_read_back_in_order_and_wrong_sizes_are_refused() {
        let values: Vec<u8> = (0..24).collect();
        let image = Image::from_interleaved(4, 2, 3, &values).unwrap();
        assert_eq!(image.planes()[1], [1, 4, 7, 10, 13, 16, 19, 22]);
        assert_eq!(image.interleaved(), values);
        assert_eq!(Image::from_interleaved(4, 2, 1, &values[..8]).unwrap().interleaved(), values[..8]);
        assert!(Image::from_interleaved(4, 2, 3, &values[..23]).is_none());
        assert!(Image::from_interleaved(4, 2, 2, &values[..16]).is_none());
        assert!(Image::from_planes(2, 2, vec![vec![0; 4]; 2]).is_none());
    }
}
