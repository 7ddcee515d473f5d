//! Reads camera images (PNG, PPM, PGM, JPEG); the only use of the crate `image`.

use std::fs;
use std::io::Cursor;
use std::path::{Path, PathBuf};

use image::{DynamicImage, ImageDecoder, ImageReader, ImageResult, Limits};

use crate::common::{ExperimentError, read_file, sort_by_numbers};
use skiagraph_core::camera::MAX_IMAGE_SIZE;
use skiagraph_core::input::{foreign, limits};
use skiagraph_truth::observing::Image;

const ENDINGS: [&str; 6] = ["png", "ppm", "pgm", "pnm", "jpg", "jpeg"];
/// Memory limit for decoding an image, bytes: a colour image of the greatest size.
const MOST_MEMORY: u64 = 3 * (MAX_IMAGE_SIZE as u64) * (MAX_IMAGE_SIZE as u64);
/// Greatest number of images in a directory: four and a half hours at 60 Hz.
const MOST_IMAGES: usize = 1_000_000;

/// The images of a directory, in the order of their names, in which numbers count as such; other files are ignored.
pub(crate) fn images_in(directory: &Path) -> Result<Vec<PathBuf>, ExperimentError> {
    let unreadable = |source| ExperimentError::Unreadable { path: directory.to_owned(), source };
    let mut images = Vec::new();
    for entry in fs::read_dir(directory).map_err(unreadable)? {
        let path = entry.map_err(unreadable)?.path();
        let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or_default().to_ascii_lowercase();
        let hidden = path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'));
        if ENDINGS.contains(&ending.as_str()) && !hidden && path.is_file() {
            images.push(path);
        }
    }
    let malformed = |detail: String| ExperimentError::Malformed { path: directory.to_owned(), detail };
    if images.is_empty() {
        return Err(malformed(format!("expected images (.{}), found none", ENDINGS.join(", ."))));
    }
    if images.len() > MOST_IMAGES {
        return Err(malformed(format!("expected at most {MOST_IMAGES} images, found {}", images.len())));
    }
    sort_by_numbers(&mut images);
    Ok(images)
}

/// Reads an image, in colour or grey as in the file, without an alpha channel, with 8 bits per channel, and turned as
/// EXIF says, which OpenCV and ffmpeg do too.
pub(crate) fn read_image(path: &Path) -> Result<Image, ExperimentError> {
    let malformed = |detail: String| ExperimentError::Malformed { path: path.to_owned(), detail };
    let bytes = read_file(path, limits::PICTURE)?;
    let mut reader = ImageReader::new(Cursor::new(bytes.as_slice()));
    reader = reader.with_guessed_format().map_err(|e| malformed(e.to_string()))?;
    let mut bounds = Limits::default();
    bounds.max_image_width = Some(MAX_IMAGE_SIZE);
    bounds.max_image_height = Some(MAX_IMAGE_SIZE);
    bounds.max_alloc = Some(MOST_MEMORY);
    reader.limits(bounds.clone());
    let decoded = reader
        .into_decoder()
        .and_then(|decoder| upright(decoder, bounds))
        .map_err(|e| malformed(format!("{}; expected a complete PNG, PPM, PGM or JPEG image", foreign(e))))?;
    let (width, height) = (decoded.width(), decoded.height());
    let grey = matches!(
        decoded,
        DynamicImage::ImageLuma8(_)
            | DynamicImage::ImageLumaA8(_)
            | DynamicImage::ImageLuma16(_)
            | DynamicImage::ImageLumaA16(_)
    );
    let (channels, values) =
        if grey { (1, decoded.into_luma8().into_raw()) } else { (3, decoded.into_rgb8().into_raw()) };
    let image = Image::from_interleaved(width, height, channels, &values).filter(|_| width > 0 && height > 0);
    image.ok_or_else(|| malformed("expected an image with pixels, found none".to_owned()))
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

    fn put(folder: &Path, name: &str, bytes: &[u8]) -> PathBuf {
        fs::write(folder.join(name), bytes).unwrap();
        folder.join(name)
    }

    #[test]
    fn the_same_pixels_come_from_ppm_pgm_and_png() {
        let room = tempfile::tempdir().unwrap();
        let values = [9, 8, 7, 6, 5, 4];
        let colour = read_image(&put(room.path(), "a.ppm", &[b"P6 2 1 255\n".as_slice(), &values].concat())).unwrap();
        assert_eq!((colour.shape(), colour.interleaved()), ((2, 1, 3), values.to_vec()));
        let grey = read_image(&put(room.path(), "a.pgm", &[b"P5 3 2 255\n".as_slice(), &values].concat())).unwrap();
        assert_eq!((grey.shape(), grey.interleaved()), ((3, 2, 1), values.to_vec()));
        let mut png = Vec::new();
        let mut encoder = png::Encoder::new(&mut png, 2, 1);
        encoder.set_color(png::ColorType::Rgb);
        encoder.write_header().unwrap().write_image_data(&values).unwrap();
        assert_eq!(read_image(&put(room.path(), "a.png", &png)).unwrap(), colour);
        let cut = read_image(&put(room.path(), "cut.png", &png[..png.len() - 20])).unwrap_err().to_string();
        assert!(cut.contains("cut.png") && cut.contains("expected a complete PNG"), "{cut}");
    }

    // an image of a camera on its side was segmented as its sensor had it, against the background's other orientation
    #[test]
    fn pictures_are_turned_as_exif_says() {
        let room = tempfile::tempdir().unwrap();
        let mut png = Vec::new();
        let mut info = png::Info::with_size(3, 1);
        info.color_type = png::ColorType::Grayscale;
        // big-endian TIFF with one entry: tag 0x112, a short: 6, turn by 90 degrees clockwise
        info.exif_metadata = Some(b"MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0".into());
        let encoder = png::Encoder::with_info(&mut png, info).unwrap();
        encoder.write_header().unwrap().write_image_data(&[1, 2, 3]).unwrap();
        let turned = read_image(&put(room.path(), "a.png", &png)).unwrap();
        assert_eq!((turned.shape(), turned.interleaved()), ((1, 3, 1), vec![1, 2, 3]));
        let mut jpeg = Vec::new();
        image::codecs::jpeg::JpegEncoder::new(&mut jpeg)
            .encode(&[90; 128], 16, 8, image::ColorType::L8.into())
            .unwrap();
        let exif = b"\xff\xe1\0\x22Exif\0\0MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0";
        jpeg.splice(2..2, *exif);
        assert_eq!(read_image(&put(room.path(), "a.jpg", &jpeg)).unwrap().shape(), (8, 16, 1));
    }

    #[test]
    fn other_files_are_refused_and_huge_claimed_sizes_take_no_memory() {
        let room = tempfile::tempdir().unwrap();
        for (name, bytes) in [
            ("text.png", b"not a picture".as_slice()),
            ("short.ppm", b"P6 20 10 255\n123"),
            ("huge.ppm", b"P6 60000 60000 255\n1"),
            ("empty.ppm", b""),
        ] {
            let refused = read_image(&put(room.path(), name, bytes)).unwrap_err().to_string();
            assert!(refused.contains(name), "{refused}");
        }
        let names: Vec<_> = images_in(room.path()).unwrap().iter().map(|p| p.file_name().unwrap().to_owned()).collect();
        assert_eq!(names, ["empty.ppm", "huge.ppm", "short.ppm", "text.png"]);
        let nothing = tempfile::tempdir().unwrap();
        assert!(images_in(nothing.path()).unwrap_err().to_string().contains("expected images (.png"));
        assert!(images_in(&nothing.path().join("nowhere")).is_err());
    }
}
