//! Truth images as pictures over the silhouettes.

use png::ColorType;
use serde::Serialize;

use crate::report::drawing::to_png;
use crate::report::{PlaybackPlan, ReportError, base64};

/// Truth images of some of a page's stored frames.
#[derive(Clone, Debug, PartialEq)]
pub struct SetLayers {
    /// Names of the layers.
    pub names: Vec<String>,
    /// Meanings of their colours.
    pub meanings: Vec<String>,
    /// Step between stored frames with pictures, from the first.
    pub stride: usize,
    /// `[sampled frame][camera][layer]`; `None` without an image.
    pub pictures: Vec<Vec<Vec<Option<LayerPicture>>>>,
}

/// A part of a camera's image in colour.
#[derive(Clone, Debug, PartialEq)]
pub struct LayerPicture {
    /// Left and top of the part, pixels of the image.
    pub corner: [u32; 2],
    /// Width and height of the part, pixels of the image.
    pub extent: [u32; 2],
    /// Width and height of the picture, at most those of the part.
    pub size: [u32; 2],
    /// Red, green, blue and opacity, row by row.
    pub rgba: Vec<u8>,
}

#[derive(Serialize)]
pub(super) struct LayersData<'a> {
    stride: usize,
    /// Frame numbers of the samples.
    frames: Vec<usize>,
    meanings: &'a [String],
    pictures: Vec<Vec<Vec<Option<PictureData>>>>,
}

#[derive(Serialize)]
struct PictureData {
    x: u32,
    y: u32,
    width: u32,
    height: u32,
    png: String,
}

impl SetLayers {
    pub(super) fn data(&self, plan: &PlaybackPlan) -> Result<LayersData<'_>, ReportError> {
        let of_view = |view: &Vec<Option<LayerPicture>>| {
            view.iter().map(|picture| picture.as_ref().map(LayerPicture::data).transpose()).collect()
        };
        let of_frame = |frame: &Vec<Vec<Option<LayerPicture>>>| frame.iter().map(of_view).collect();
        let pictures = self.pictures.iter().map(of_frame).collect::<Result<_, ReportError>>()?;
        let frames = plan.kept().step_by(self.stride.max(1)).take(self.pictures.len()).collect();
        Ok(LayersData { stride: self.stride.max(1), frames, meanings: &self.meanings, pictures })
    }
}

impl LayerPicture {
    /// Encodes the picture as PNG.
    ///
    /// # Errors
    /// [`ReportError::Png`] if the colours do not fit the size.
    pub fn png(&self) -> Result<Vec<u8>, ReportError> {
        to_png(self.size, ColorType::Rgba, &self.rgba)
    }

    fn data(&self) -> Result<PictureData, ReportError> {
        let ([x, y], [width, height]) = (self.corner, self.extent);
        Ok(PictureData { x, y, width, height, png: base64::encode(&self.png()?) })
    }
}
