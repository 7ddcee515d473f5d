//! `observations/colour/` and `observations/background/`: what the cameras saw, as images. Only in sets with
//! `observation.colour_images`.

use std::path::Path;

use super::grey_png;
use crate::SetError;
use skiagraph_core::camera::TimedRig;
use skiagraph_core::input::foreign;
use skiagraph_core::rng::KeyedSeed;
use skiagraph_truth::observing::{ColourCamera, ColourFormat, Image, ObservationFacts, image_from_jpeg};
use skiagraph_truth::scene::GroundTruth;

/// Path prefixes of images of frames and of backgrounds.
pub(crate) const COLOUR: &str = "observations/colour/";
pub(crate) const BACKGROUND: &str = "observations/background/";

/// Addition to `README.txt` in sets with images.
pub(crate) const OF_COLOUR: &str = "
Images. observations/colour/camNN/NNNNNN.png (or .jpg) is what camera NN saw in frame NNNNNN, 8 bits, RGB or grey;
observations/background/camNN has images of the same scene without people, equally many before, during and after the frames, in this
order. They are drawn: textured ground and walls, one colour for each garment, light from the sun and the sky. They are not
photorealistic.
";

pub(crate) fn path(format: ColourFormat, camera: usize, frame: usize) -> String {
    format!("{COLOUR}cam{camera:02}/{frame:06}.{}", format.extension())
}

pub(crate) fn background_path(format: ColourFormat, camera: usize, number: usize) -> String {
    format!("{BACKGROUND}cam{camera:02}/{number:06}.{}", format.extension())
}

pub(crate) struct ColourDrawing<'a> {
    camera: ColourCamera<'a>,
    cameras: usize,
}

type NewFile = (String, Vec<u8>);

impl<'a> ColourDrawing<'a> {
    /// The images of the true cameras; `None` for a set without images.
    ///
    /// # Errors
    /// [`SetError::Inconsistent`] if cameras move.
    pub(crate) fn new(
        truth: &'a GroundTruth,
        rig: &TimedRig,
        observation: Option<&ObservationFacts>,
        seed: KeyedSeed,
    ) -> Result<Option<Self>, SetError> {
        let Some(facts) = observation.filter(|facts| facts.colour_images.is_some()) else { return Ok(None) };
        let cameras = rig.cameras();
        if (0..cameras).any(|camera| rig.path(camera).is_some()) {
            return Err(SetError::inconsistent("observation.colour_images: expected cameras that do not move"));
        }
        Ok(ColourCamera::new(truth, rig, facts, seed).map(|camera| Self { camera, cameras }))
    }

    pub(crate) fn background_places(&self) -> impl Iterator<Item = (usize, usize, String)> {
        let (format, numbers) = (self.camera.format(), self.camera.backgrounds());
        let places = (0..self.cameras).flat_map(move |camera| (0..numbers).map(move |number| (camera, number)));
        places.map(move |(camera, number)| (camera, number, background_path(format, camera, number)))
    }

    /// The file of a background image.
    pub(crate) fn background(&self, camera: usize, number: usize) -> Result<Vec<u8>, SetError> {
        let path = background_path(self.camera.format(), camera, number);
        self.encode(&path, &self.camera.background(camera, number))
    }

    pub(crate) fn path(&self, camera: usize, frame: usize) -> String {
        path(self.camera.format(), camera, frame)
    }

    /// The files of a frame, without cameras that took no image.
    pub(crate) fn files(&self, frame: usize) -> Result<Vec<NewFile>, SetError> {
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
pub(crate) fn decode(path: &str, bytes: &[u8], size: [u32; 2]) -> Result<Image, SetError> {
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
    let detail = format!(
        "{} x {} pixels, {:?}; expected {width} x {height}, 8-bit RGB or grey",
        found.0, found.1, info.color_type
    );
    if found != (width, height, png::BitDepth::Eight) || channels == 0 {
        return Err(SetError::malformed(path, detail));
    }
    let mut values = vec![0; width as usize * height as usize * channels];
    reader.next_frame(&mut values).map_err(malformed)?;
    Image::from_interleaved(width, height, channels, &values).ok_or_else(|| SetError::malformed(path, detail))
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::path::Path;

    use super::*;
    use crate::fixture::with_parts;
    use crate::test_bodies::walk;
    use crate::verify::tests::sign;
    use crate::{BenchmarkSet, BlindSet, SetDrawing, SetParts, VerifyOptions, verify};
    use skiagraph_truth::observing::ImageSettings;

    const FRAMES: usize = 3;

    /// Writes a set with images in both ways; both have the same files.
    fn written(format: ColourFormat, folder: &Path) -> BenchmarkSet {
        let images = ImageSettings { background_frames: 1, ..ImageSettings::default() };
        let facts =
            ObservationFacts { colour_images: Some(format), images: Some(images), ..ObservationFacts::default() };
        with_parts(&walk(FRAMES), |parts, observer| {
            let parts = SetParts { observation: Some(&facts), ..*parts };
            let other = tempfile::tempdir().unwrap();
            BenchmarkSet::draw_into(other.path(), &parts, &SetDrawing::default(), |f| observer.observe(f)).unwrap();
            let set = BenchmarkSet::assemble(&parts, |frame| observer.observe(frame)).unwrap();
            set.write(folder).unwrap();
            let listing = |folder: &Path| fs::read_to_string(folder.join("files.sha256")).unwrap();
            assert_eq!(listing(other.path()), listing(folder));
            set
        })
    }

    fn faults(folder: &Path) -> Vec<String> {
        let found = verify(folder, VerifyOptions::default()).unwrap();
        found.faults().map(|(check, fault)| format!("{check}: {}: {}", fault.file, fault.detail)).collect()
    }

    #[test]
    fn sets_with_images_are_sound_and_trackers_get_the_images() {
        for format in [ColourFormat::Png, ColourFormat::Jpeg] {
            let root = tempfile::tempdir().unwrap();
            let (place, copy, public) = (root.path().join("set"), root.path().join("copy"), root.path().join("public"));
            let set = written(format, &place);
            assert_eq!(faults(&place), [""; 0]);
            let backgrounds = set.blind.background_paths(1);
            assert_eq!(backgrounds.len(), 3);
            let image = set.blind.colour_path(1, 2).unwrap();
            set.blind.copy_to(&copy).unwrap();
            BlindSet::read(&place).unwrap().write_without_truth(&public).unwrap();
            for path in backgrounds.iter().chain([&image]) {
                let bytes = fs::read(copy.join(path)).unwrap();
                assert_eq!(bytes, fs::read(public.join(path)).unwrap());
                let size = set.blind.rig.cameras[1].pinhole;
                assert!(decode(path, &bytes, [size.width, size.height]).is_ok());
                assert!(decode(path, &bytes, [size.width, size.height + 1]).is_err());
            }
            assert!(fs::read_to_string(public.join("README.txt")).unwrap().contains("not\nphotorealistic"));
        }
    }

    #[test]
    fn images_of_another_frame_hidden_data_and_missing_images_are_found() {
        for format in [ColourFormat::Png, ColourFormat::Jpeg] {
            let root = tempfile::tempdir().unwrap();
            let place = root.path().join("set");
            written(format, &place);
            let own = path(format, 0, 1);
            let [first, whole] = [path(format, 0, 0), own.clone()].map(|path| fs::read(place.join(path)).unwrap());
            fs::write(place.join(&own), &first).unwrap();
            sign(&place);
            let found = faults(&place);
            assert!(found.len() == 1 && found[0].starts_with(&format!("observations: {own}: ")), "{found:?}");
            fs::write(place.join(&own), [&whole[..], b"pose"].concat()).unwrap();
            sign(&place);
            let found = faults(&place);
            assert!(found.iter().any(|fault| fault.contains(&format!("observations: {own}: "))), "{found:?}");
            fs::remove_file(place.join(&own)).unwrap();
            sign(&place);
            let found = faults(&place);
            assert!(found.iter().any(|fault| fault.contains(&own) && fault.contains("is missing")), "{found:?}");
        }
    }
}
