//! Camera images: eight bits per channel, grey or colour.

use std::io::Cursor;

use image::{DynamicImage, ImageDecoder, ImageReader, ImageResult, Limits};

use skiagraph_core::camera::MAX_IMAGE_SIZE;
use skiagraph_core::input::foreign;
use skiagraph_core::raster::Mask;

/// Memory limit for decoding an image, bytes: a colour image of the greatest size.
const MOST_MEMORY: u64 = 3 * (MAX_IMAGE_SIZE as u64) * (MAX_IMAGE_SIZE as u64);

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

    /// Reads PNG, PPM, PGM or JPEG, in colour or grey as in the file, without an alpha channel, with 8 bits per
    /// channel, and turned as EXIF says, which OpenCV and ffmpeg do too.
    ///
    /// # Errors
    /// What is wrong with the file.
    pub fn decode(bytes: &[u8]) -> Result<Self, String> {
        let mut reader = ImageReader::new(Cursor::new(bytes));
        reader = reader.with_guessed_format().map_err(|e| e.to_string())?;
        let mut bounds = Limits::default();
        bounds.max_image_width = Some(MAX_IMAGE_SIZE);
        bounds.max_image_height = Some(MAX_IMAGE_SIZE);
        bounds.max_alloc = Some(MOST_MEMORY);
        reader.limits(bounds.clone());
        let decoded = reader
            .into_decoder()
            .and_then(|decoder| upright(decoder, bounds))
            .map_err(|e| format!("{}; expected a complete PNG, PPM, PGM or JPEG image", foreign(e)))?;
        let (width, height) = (decoded.width(), decoded.height());
        let (channels, values) = match decoded.color().has_color() {
            true => (3, decoded.into_rgb8().into_raw()),
            false => (1, decoded.into_luma8().into_raw()),
        };
        let image = Self::from_interleaved(width, height, channels, &values).filter(|_| width > 0 && height > 0);
        image.ok_or_else(|| "expected an image with pixels, found none".to_owned())
    }

    /// The greatest value of any channel.
    pub fn brightest(&self) -> u8 {
        self.planes.iter().flatten().copied().max().unwrap_or_default()
    }

    /// The pixels whose brightest channel has at least the value `least`; with `inverted`, 255 minus that channel. A
    /// pixel of the mask is `reduce` pixels wide and high, and set if at least half of them are.
    pub fn mask(&self, least: f64, inverted: bool, reduce: u32) -> Mask {
        let width = self.width as usize;
        let is_set = |x: usize, y: usize| {
            let brightest = self.planes.iter().filter_map(|plane| plane.get(y * width + x)).copied().max();
            let value = brightest.unwrap_or_default();
            f64::from(if inverted { 255 - value } else { value }) >= least
        };
        let is_mostly_set = |x: u32, y: u32| {
            let [columns, rows] = [x, y].map(|first| (first * reduce) as usize..((first + 1) * reduce) as usize);
            let count: usize = rows.map(|y| columns.clone().filter(|x| is_set(*x, y)).count()).sum();
            2 * count >= (reduce * reduce) as usize
        };
        Mask::from_fn((self.width / reduce).max(1), (self.height / reduce).max(1), is_mostly_set)
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

/// The decoded image, turned as its EXIF data say.
fn upright(mut decoder: impl ImageDecoder, mut bounds: Limits) -> ImageResult<DynamicImage> {
    bounds.reserve(decoder.total_bytes())?;
    let orientation = decoder.orientation()?;
    let mut decoded = DynamicImage::from_decoder(decoder)?;
    decoded.apply_orientation(orientation);
    Ok(decoded)
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::codecs::{jpeg::JpegEncoder, png::PngEncoder};
    use image::{ExtendedColorType, ImageEncoder};

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

    fn png(colours: ExtendedColorType, [width, height]: [u32; 2], values: &[u8], exif: &[u8]) -> Vec<u8> {
        let mut png = Vec::new();
        let mut encoder = PngEncoder::new(&mut png);
        encoder.set_exif_metadata(exif.to_vec()).unwrap();
        encoder.write_image(values, width, height, colours).unwrap();
        png
    }

    #[test]
    fn the_same_pixels_come_from_ppm_pgm_and_png() {
        let values = [9, 8, 7, 6, 5, 4];
        let colour = Image::decode(&[b"P6 2 1 255\n".as_slice(), &values].concat()).unwrap();
        assert_eq!((colour.shape(), colour.interleaved()), ((2, 1, 3), values.to_vec()));
        let grey = Image::decode(&[b"P5 3 2 255\n".as_slice(), &values].concat()).unwrap();
        assert_eq!((grey.shape(), grey.interleaved()), ((3, 2, 1), values.to_vec()));
        let png = png(ExtendedColorType::Rgb8, [2, 1], &values, &[]);
        assert_eq!(Image::decode(&png).unwrap(), colour);
        let cut = Image::decode(&png[..png.len() - 20]).unwrap_err();
        assert!(cut.contains("expected a complete PNG"), "{cut}");
    }

    // an image of a camera on its side was segmented as its sensor had it, against the background's other orientation
    #[test]
    fn pictures_are_turned_as_exif_says() {
        // big-endian TIFF with one entry: tag 0x112, a short: 6, turn by 90 degrees clockwise
        let exif = b"MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0";
        let turned = Image::decode(&png(ExtendedColorType::L8, [3, 1], &[1, 2, 3], exif)).unwrap();
        assert_eq!((turned.shape(), turned.interleaved()), ((1, 3, 1), vec![1, 2, 3]));
        let mut jpeg = Vec::new();
        JpegEncoder::new(&mut jpeg).encode(&[90; 128], 16, 8, ExtendedColorType::L8).unwrap();
        jpeg.splice(2..2, [b"\xff\xe1\0\x22Exif\0\0".as_slice(), exif].concat());
        assert_eq!(Image::decode(&jpeg).unwrap().shape(), (8, 16, 1));
    }

    #[test]
    fn a_pixel_of_a_mask_is_set_if_half_of_its_pixels_are_bright() {
        let image = Image::from_interleaved(5, 2, 1, &[200, 100, 0, 0, 255, 0, 200, 0, 200, 255]).unwrap();
        let pixels = |mask: Mask| mask.pixels().collect::<Vec<_>>();
        assert_eq!(pixels(image.mask(150.0, false, 1)), [(0, 0), (4, 0), (1, 1), (3, 1), (4, 1)]);
        assert_eq!(pixels(image.mask(150.0, false, 2)), [(0, 0)], "the fifth column is cut off");
        assert_eq!(pixels(image.mask(150.0, true, 2)), [(0, 0), (1, 0)]);
        let colour = Image::from_interleaved(1, 1, 3, &[0, 0, 255]).unwrap();
        assert_eq!((colour.mask(255.0, false, 1).count(), colour.brightest()), (1, 255));
    }
}
