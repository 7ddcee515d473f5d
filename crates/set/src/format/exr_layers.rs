//! Optional ground-truth images as OpenEXR: for every camera and frame a file with the geometry, and one with the
//! brightness. No other file uses the crate `exr`.
//!
//! | channels | type | meaning, at the centre of each pixel |
//! |---|---|---|
//! | `depth.Z` | float | metres along the camera's z axis, +inf without geometry |
//! | `id.part` | unsigned | index of the link in `truth.npz`'s `link_names` plus 1, 0 without geometry |
//! | `normal.X`, `.Y`, `.Z` | float | outward unit normal in the world, 0 without geometry |
//! | `forward.u`, `.v` | float | displacement of the surface point in the next frame, pixels, NaN without geometry |
//! | `A` | float | share of 4 x 4 samples of the pixel that see the body |
//! | `R`, `G`, `B`; `Y` if grey | half | brightness of the scene before the sensor, 0 to 1 |
//!
//! Brightness has 16 bits, which resolve a sixteenth of a grey value; all other channels have 32. The data window of
//! geometry is the bounding box of the body, outside of which there is none; that of brightness is the whole image. The
//! display window is the image. Brightness has a file of its own, because beside it the geometry would fill the whole
//! image too, and because textures are not worth compressing. Older sets have both in one file.

use std::io::Cursor;

use exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Image, ImageAttributes, IntegerBounds,
    LayerAttributes, LineOrder, Vec2, WritableImage, f16,
};
use half::slice::HalfFloatSliceExt as _;
use serde::{Deserialize, Serialize};

use super::listing::LAYERS;
use super::shown_rows::{ShownRow, ends, shown_rows};
use crate::SetError;
use crate::files::SetFiles;
use skiagraph_core::input::foreign;
use skiagraph_truth::observing::TruthImages;

/// A kind of truth image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum TruthImage {
    /// Depth along the camera's axis, metres; also a 16-bit PNG in millimetres.
    Depth,
    /// Index of the visible link.
    Parts,
    /// Surface normals.
    Normals,
    /// Optical flow to the next frame.
    Flow,
    /// Anti-aliased coverage.
    Coverage,
    /// The scene of `[observation.images]` before the sensor.
    Colour,
}

/// Path of the geometry of a camera and frame; in older sets also of its brightness.
pub(crate) fn path(camera: usize, frame: usize) -> String {
    format!("{LAYERS}cam{camera:02}/{frame:06}.exr")
}

/// Path of the brightness of a camera and frame.
pub(crate) fn colour_path(camera: usize, frame: usize) -> String {
    format!("{LAYERS}cam{camera:02}/{frame:06}{COLOUR_END}")
}

const COLOUR_END: &str = "-colour.exr";

/// The files with these layers of the image of a camera and frame.
pub(crate) fn files(
    camera: usize,
    frame: usize,
    images: &TruthImages,
    layers: &[TruthImage],
) -> Result<Vec<(String, Vec<u8>)>, SetError> {
    let file = |path: String, layers: &[TruthImage]| encode(&path, images, layers).map(|bytes| (path, bytes));
    let (colour, geometry): (Vec<TruthImage>, Vec<TruthImage>) =
        layers.iter().partition(|layer| **layer == TruthImage::Colour);
    let geometry = (!geometry.is_empty()).then(|| file(path(camera, frame), &geometry));
    let colour = (!colour.is_empty()).then(|| file(colour_path(camera, frame), &colour));
    geometry.into_iter().chain(colour).collect()
}

/// The EXR file with these layers of an image: brightness alone, or no brightness.
fn encode(file: &str, images: &TruthImages, layers: &[TruthImage]) -> Result<Vec<u8>, SetError> {
    let image = &images.depth;
    let window = DataWindow::new(images, layers);
    let mut chosen = layers.to_vec();
    chosen.dedup();
    let is_geometry = !layers.contains(&TruthImage::Colour);
    let compression = if is_geometry { Compression::RLE } else { Compression::Uncompressed };
    let encoding = Encoding { compression, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };
    let attributes =
        LayerAttributes { layer_position: Vec2(window.left as i32, window.top as i32), ..Default::default() };
    let channels = AnyChannels::sort(chosen.iter().flat_map(|layer| channels(*layer, images, &window)).collect());
    let layer = exr::prelude::Layer::new((window.width, window.height), attributes, encoding, channels);
    let whole = IntegerBounds::from_dimensions((image.width as usize, image.height as usize));
    let mut bytes = Cursor::new(Vec::new());
    let picture = Image { attributes: ImageAttributes::new(whole), layer_data: layer };
    let written = picture.write().non_parallel().to_buffered(&mut bytes);
    written.map_err(|e| SetError::malformed(file, e.to_string()))?;
    Ok(bytes.into_inner())
}

/// The channels of a layer, cropped to the data window.
fn channels(layer: TruthImage, images: &TruthImages, window: &DataWindow) -> Vec<AnyChannel<FlatSamples>> {
    let floats = |name: &str, values: Vec<f32>| AnyChannel::new(name, FlatSamples::F32(values));
    match layer {
        TruthImage::Depth => vec![floats("depth.Z", window.crop(&images.depth.depth, |v| v))],
        TruthImage::Parts => vec![AnyChannel::new("id.part", FlatSamples::U32(window.crop(&images.depth.part, |v| v)))],
        TruthImage::Normals => {
            let names = ["normal.X", "normal.Y", "normal.Z"].into_iter().enumerate();
            names.map(|(axis, name)| floats(name, window.crop(&images.normals, |v| v[axis]))).collect()
        }
        TruthImage::Flow => {
            let names = ["forward.u", "forward.v"].into_iter().enumerate();
            names.map(|(axis, name)| floats(name, window.crop(&images.flow, |v| v[axis]))).collect()
        }
        TruthImage::Coverage => vec![floats("A", window.crop(&images.coverage, |v| v))],
        TruthImage::Colour => {
            let names = if images.colour.len() == 1 { &["Y"][..] } else { &["R", "G", "B"] };
            // the data window is the whole image
            let halves = |plane: &Vec<f32>| {
                let mut halves = vec![f16::ZERO; plane.len()];
                halves.convert_from_f32_slice(plane);
                FlatSamples::F16(halves)
            };
            names.iter().zip(&images.colour).map(|(name, plane)| AnyChannel::new(*name, halves(plane))).collect()
        }
    }
}

/// Whether this is the path of the geometry of an image.
pub(crate) fn is_layer(path: &str) -> bool {
    path.starts_with(LAYERS) && path.ends_with(".exr") && !is_colour(path)
}

/// Whether this is the path of the brightness of an image.
pub(crate) fn is_colour(path: &str) -> bool {
    path.starts_with(LAYERS) && path.ends_with(COLOUR_END)
}

/// Names of the channels of the first truth image; none if the set has no truth images.
///
/// # Errors
/// [`SetError`] if that image cannot be read or is not an OpenEXR file.
pub fn layer_channels(directory: &std::path::Path) -> Result<Vec<String>, SetError> {
    let files = SetFiles::open(directory)?;
    channels_of(&files).map_err(|error| files.locate(error))
}

/// The channels of the first image of a set.
fn channels_of(files: &SetFiles) -> Result<Vec<String>, SetError> {
    let first = [files.paths().find(|path| is_layer(path)), files.paths().find(|path| is_colour(path))];
    let mut names = Vec::new();
    for file in first.into_iter().flatten() {
        let bytes = files.read(file)?;
        let meta = exr::meta::MetaData::read_from_buffered(&*bytes, false);
        let meta = meta.map_err(|e| SetError::malformed(file, foreign(e)))?;
        let channels = meta.headers.iter().flat_map(|header| &header.channels.list);
        names.extend(channels.map(|channel| channel.name.to_string()));
    }
    Ok(names)
}

/// The layers of the first image of a set.
pub(crate) fn layers_of(files: &SetFiles) -> Result<Vec<TruthImage>, SetError> {
    let channels = channels_of(files)?;
    let has = |name: &str| channels.iter().any(|channel| channel == name);
    let known = [
        (TruthImage::Depth, "depth.Z"),
        (TruthImage::Parts, "id.part"),
        (TruthImage::Normals, "normal.X"),
        (TruthImage::Flow, "forward.u"),
        (TruthImage::Coverage, "A"),
        (TruthImage::Colour, if has("Y") { "Y" } else { "R" }),
    ];
    Ok(known.into_iter().filter(|(_, channel)| has(channel)).map(|(layer, _)| layer).collect())
}

/// The bounding box of the body; one pixel without a body, because EXR has no empty window.
struct DataWindow {
    left: usize,
    top: usize,
    width: usize,
    height: usize,
    image_width: usize,
}

impl DataWindow {
    fn new(images: &TruthImages, layers: &[TruthImage]) -> Self {
        let image = &images.depth;
        let (image_width, image_height) = (image.width as usize, image.height as usize);
        if layers.contains(&TruthImage::Colour) {
            return Self { left: 0, top: 0, width: image_width, height: image_height, image_width };
        }
        let coverage = if layers.contains(&TruthImage::Coverage) { &images.coverage[..] } else { &[] };
        let of_shares = coverage.chunks_exact(image_width.max(1)).enumerate().filter_map(|(y, shares)| {
            let (first, end) = ends(shares, |share| *share > 0.0)?;
            Some(ShownRow { y, first, end })
        });
        let (mut left, mut right, mut top, mut bottom) = (image_width, 0, image_height, 0);
        for ShownRow { y, first, end } in shown_rows(image).chain(of_shares) {
            (left, right) = (left.min(first), right.max(end));
            (top, bottom) = (top.min(y), bottom.max(y + 1));
        }
        if left >= right {
            return Self { left: 0, top: 0, width: 1, height: 1, image_width };
        }
        Self { left, top, width: right - left, height: bottom - top, image_width }
    }

    /// The part of an image inside the window.
    fn crop<T: Copy, S>(&self, pixels: &[T], sample: impl Fn(T) -> S) -> Vec<S> {
        let mut cropped = Vec::with_capacity(self.width * self.height);
        for row in pixels.chunks(self.image_width).skip(self.top).take(self.height) {
            cropped.extend(row[self.left..self.left + self.width].iter().map(|value| sample(*value)));
        }
        cropped
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use exr::prelude::*;

    use skiagraph_core::body::DepthImage;

    fn image() -> TruthImages {
        depth_image().into()
    }

    fn depth_image() -> DepthImage {
        let mut image = DepthImage { width: 9, height: 7, depth: vec![f32::INFINITY; 63], part: vec![0; 63] };
        for (x, y, depth, part) in [(3, 2, 1.5, 4), (6, 4, 2.25, 1), (5, 3, 0.1, 70_000)] {
            image.depth[y * 9 + x] = depth;
            image.part[y * 9 + x] = part;
        }
        image
    }

    fn read_back(bytes: Vec<u8>) -> FlatImage {
        read()
            .no_deep_data()
            .largest_resolution_level()
            .all_channels()
            .all_layers()
            .all_attributes()
            .from_buffered(Cursor::new(bytes))
            .unwrap()
    }

    #[test]
    fn the_data_window_is_the_bounding_box_of_the_body_and_the_display_window_the_image() {
        let file = read_back(encode("x", &image(), &[crate::TruthImage::Parts, crate::TruthImage::Depth]).unwrap());
        assert_eq!(file.attributes.display_window, IntegerBounds::from_dimensions((9, 7)));
        let layer = &file.layer_data[0];
        assert_eq!((layer.attributes.layer_position, layer.size), (Vec2(3, 2), Vec2(4, 3)));
        let [depth, part] = &layer.channel_data.list[..] else { panic!() };
        assert_eq!((depth.name.to_string(), part.name.to_string()), ("depth.Z".into(), "id.part".into()));
        let inf = f32::INFINITY;
        let expected = vec![1.5, inf, inf, inf, inf, inf, 0.1, inf, inf, inf, inf, 2.25];
        assert_eq!(depth.sample_data, FlatSamples::F32(expected));
        assert_eq!(part.sample_data, FlatSamples::U32(vec![4, 0, 0, 0, 0, 0, 70_000, 0, 0, 0, 0, 1]));
    }

    #[test]
    fn an_image_without_a_body_is_one_empty_pixel_and_bytes_are_reproducible() {
        let empty = DepthImage { depth: vec![f32::INFINITY; 63], part: vec![0; 63], ..depth_image() };
        let file = read_back(encode("x", &empty.into(), &[crate::TruthImage::Depth]).unwrap());
        assert_eq!(file.layer_data[0].size, Vec2(1, 1));
        assert_eq!(file.layer_data[0].channel_data.list[0].sample_data, FlatSamples::F32(vec![f32::INFINITY]));
        let layers = [crate::TruthImage::Depth, crate::TruthImage::Parts];
        assert_eq!(encode("x", &image(), &layers).unwrap(), encode("x", &image(), &layers).unwrap());
    }

    #[test]
    fn channels_have_their_usual_names_and_coverage_and_colour_widen_the_window() {
        let mut images = image();
        images.normals = (0..63).map(|i| [i as f32, 0.5, -1.0]).collect();
        images.flow = vec![[1.0, -2.0]; 63];
        images.coverage = vec![0.0; 63];
        images.coverage[9 + 7] = 0.25;
        images.colour = vec![vec![0.1; 63], vec![0.2; 63], vec![0.3; 63]];
        let layers =
            |layers: &[crate::TruthImage]| read_back(encode("x", &images, layers).unwrap()).layer_data[0].clone();
        let names = |layer: &exr::prelude::Layer<AnyChannels<FlatSamples>>| -> Vec<String> {
            layer.channel_data.list.iter().map(|channel| channel.name.to_string()).collect()
        };
        let vectors = layers(&[crate::TruthImage::Normals, crate::TruthImage::Flow]);
        assert_eq!(names(&vectors), ["forward.u", "forward.v", "normal.X", "normal.Y", "normal.Z"]);
        assert_eq!(vectors.size, Vec2(4, 3));
        let FlatSamples::F32(x) = &vectors.channel_data.list[2].sample_data else { panic!() };
        assert_eq!(x[..5], [21.0, 22.0, 23.0, 24.0, 30.0], "cropped row by row");
        let covered = layers(&[crate::TruthImage::Coverage]);
        assert_eq!(
            (names(&covered), covered.size, covered.attributes.layer_position),
            (vec!["A".to_owned()], Vec2(5, 4), Vec2(3, 1))
        );
        let coloured = layers(&[crate::TruthImage::Colour, crate::TruthImage::Depth]);
        assert_eq!(coloured.channel_data.list[2].sample_data, FlatSamples::F16(vec![f16::from_f32(0.1); 63]));
        assert_eq!(
            (names(&coloured), coloured.size),
            (["B", "G", "R", "depth.Z"].map(str::to_owned).to_vec(), Vec2(9, 7))
        );
    }
}
