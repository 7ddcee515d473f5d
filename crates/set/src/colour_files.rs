//! `observations/colour/` and `observations/background/`: what the cameras saw, as images. Only in sets with
//! `observation.colour_images`.

use std::path::Path;

use super::{SetError, SetParts, grey_png};
use crate::input::foreign;
use crate::observing::{ColourCamera, ColourFormat, Image, image_from_jpeg};

/// Path prefixes of images of frames and of backgrounds.
pub(super) const COLOUR: &str = "observations/colour/";
pub(super) const BACKGROUND: &str = "observations/background/";

/// Addition to `README.txt` in sets with images.
pub(super) const OF_COLOUR: &str = "
Images. observations/colour/camNN/NNNNNN.png (or .jpg) is what camera NN saw in frame NNNNNN, 8 bits, RGB or grey;
observations/background/camNN has images of the same scene without people, equally many before, during and after the frames, in this
order. They are drawn: textured ground and walls, one colour for each garment, light from the sun and the sky. They are not
photorealistic.
";

/// Path of the image of a camera and frame.
pub(super) fn path(format: ColourFormat, camera: usize, frame: usize) -> String {
    format!("{COLOUR}cam{camera:02}/{frame:06}.{}", format.extension())
}

/// Path of a background image of a camera.
pub(super) fn background_path(format: ColourFormat, camera: usize, number: usize) -> String {
    format!("{BACKGROUND}cam{camera:02}/{number:06}.{}", format.extension())
}

/// Draws the images of a set.
pub(super) struct ColourDrawing<'a> {
    camera: ColourCamera<'a>,
    cameras: usize,
}

/// A file: its path and its content.
type NewFile = (String, Vec<u8>);

impl<'a> ColourDrawing<'a> {
    /// `None` for a set without images.
    ///
    /// # Errors
    /// [`SetError::Inconsistent`] if cameras move.
    pub(super) fn new(parts: &SetParts<'a>) -> Result<Option<Self>, SetError> {
        let Some(facts) = parts.observation.filter(|facts| facts.colour_images.is_some()) else { return Ok(None) };
        let cameras = parts.rig.cameras();
        if (0..cameras).any(|camera| parts.rig.path(camera).is_some()) {
            return Err(SetError::inconsistent("observation.colour_images: expected cameras that do not move"));
        }
        let camera = ColourCamera::new(parts.ground_truth, parts.rig, facts, parts.facts.keyed_seed(parts.key));
        Ok(camera.map(|camera| Self { camera, cameras }))
    }

    /// Paths of all background images, by camera.
    pub(super) fn background_places(&self) -> impl Iterator<Item = (usize, usize, String)> {
        let (format, numbers) = (self.camera.format(), self.camera.backgrounds());
        let places = (0..self.cameras).flat_map(move |camera| (0..numbers).map(move |number| (camera, number)));
        places.map(move |(camera, number)| (camera, number, background_path(format, camera, number)))
    }

    /// The file of a background image.
    pub(super) fn background(&self, camera: usize, number: usize) -> Result<Vec<u8>, SetError> {
        let path = background_path(self.camera.format(), camera, number);
        self.encode(&path, &self.camera.background(camera, number))
    }

    /// Path of the image of a camera and frame.
    pub(super) fn path(&self, camera: usize, frame: usize) -> String {
        path(self.camera.format(), camera, frame)
    }

    /// The files of a frame, without cameras that took no image.
    pub(super) fn files(&self, frame: usize) -> Result<Vec<NewFile>, SetError> {
        let mut files = Vec::with_capacity(self.cameras);
        self.camera.each_image(frame, |camera, image| {
            let path = self.path(camera, frame);
            files.push(self.encode(&path, &image).map(|bytes| (path, bytes)));
        });
        files.into_iter().collect()
    }

    fn encode(&self, path: &str, image: &Image) -> Result<Vec<u8>, SetError> {
        match self.camera.format() {
            ColourFormat::Png => grey_png::encode_image(path, image),
            ColourFormat::Jpeg => {
                let too_large = || SetError::malformed(path, "JPEG has at most 65,535 pixels a side");
                self.camera.jpeg(image).ok_or_else(too_large)
            }
        }
    }
}

/// The image of a file of a set, which must have this size.
pub(super) fn decode(path: &str, bytes: &[u8], size: [u32; 2]) -> Result<Image, SetError> {
    let is_jpeg = Path::new(path).extension().is_some_and(|extension| extension == "jpg");
    if is_jpeg {
        let detail = || format!("expected a JPEG image of {} x {} pixels", size[0], size[1]);
        image_from_jpeg(bytes, size).ok_or_else(|| SetError::malformed(path, detail()))
    } else {
        decode_png(path, bytes, size)
    }
}

fn decode_png(path: &str, bytes: &[u8], [width, height]: [u32; 2]) -> Result<Image, SetError> {
    let malformed = |e: png::DecodingError| SetError::malformed(path, foreign(e));
    let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().map_err(malformed)?;
    let info = reader.info();
    let channels = match info.color_type {
        png::ColorType::Grayscale => 1,
        png::ColorType::Rgb => 3,
        _ => 0,
    };
    let found = (info.width, info.height, info.bit_depth);
    let detail =
        format!("{} x {} pixels, {:?}; expected {width} x {height}, 8-bit RGB or grey", found.0, found.1, info.color_type);
    if found != (width, height, png::BitDepth::Eight) || channels == 0 {
        return Err(SetError::malformed(path, detail));
    }
    let mut values = vec![0; width as usize * height as usize * channels];
    reader.next_frame(&mut values).map_err(malformed)?;
    Image::from_interleaved(width, height, channels, &values).ok_or_else(|| SetError::malformed(path, detail))
}
