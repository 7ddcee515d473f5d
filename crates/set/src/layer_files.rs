//! Reads single truth images of a set on disk.

use std::path::Path;

use super::exr_layers::{self, LayerImage, layer_channels};
use super::files::SetFiles;
use super::{Layer, SetError};

/// The truth images of a set in a directory, in shards or as separate files.
#[derive(Debug)]
pub struct LayerFiles {
    files: SetFiles,
    layers: Vec<Layer>,
}

/// The values of one layer at every pixel, row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub enum LayerValues {
    /// Metres along the camera's z axis; infinite without a body.
    Depth(Vec<f32>),
    /// Index of the link plus 1; 0 without a body.
    Parts(Vec<u32>),
    /// Unit normals in the world; 0 without a body.
    Normals([Vec<f32>; 3]),
    /// Displacement in the next frame, pixels; NaN without a body.
    Flow([Vec<f32>; 2]),
    /// Share of the pixel that sees the body.
    Coverage(Vec<f32>),
    /// Red, green and blue, 0 to 1; three equal planes for a grey image.
    Colour([Vec<f32>; 3]),
}

impl LayerFiles {
    /// Opens the set in `directory`.
    ///
    /// # Errors
    /// [`SetError`] if it is not a set, or its first truth image cannot be read.
    pub fn open(directory: &Path) -> Result<Self, SetError> {
        let channels = layer_channels(directory)?;
        let has = |name: &str| channels.iter().any(|channel| channel == name);
        let known = [
            (Layer::Depth, "depth.Z"),
            (Layer::Parts, "id.part"),
            (Layer::Normals, "normal.X"),
            (Layer::Flow, "forward.u"),
            (Layer::Coverage, "A"),
            (Layer::Colour, if has("Y") { "Y" } else { "R" }),
        ];
        let layers = known.into_iter().filter(|(_, channel)| has(channel)).map(|(layer, _)| layer).collect();
        Ok(Self { files: SetFiles::open(directory)?, layers })
    }

    /// The layers of the set.
    pub fn layers(&self) -> &[Layer] {
        &self.layers
    }

    /// All layers of a camera's image in a frame, in the order of [`Self::layers`]; `None` if there is no image.
    ///
    /// # Errors
    /// [`SetError`] if the image cannot be read or does not have this `size` (width, height).
    pub fn read(&self, camera: usize, frame: usize, size: [u32; 2]) -> Result<Option<Vec<LayerValues>>, SetError> {
        self.parse(camera, frame, size).map_err(|error| self.files.locate(error))
    }

    fn parse(&self, camera: usize, frame: usize, size: [u32; 2]) -> Result<Option<Vec<LayerValues>>, SetError> {
        let Some(image) = exr_layers::read_layers(&self.files, camera, frame)? else { return Ok(None) };
        let path = exr_layers::path(camera, frame);
        if [image.width, image.height] != size {
            let detail = format!(
                "the image has {} x {} pixels, its camera {} x {}",
                image.width, image.height, size[0], size[1]
            );
            return Err(SetError::malformed(&path, detail));
        }
        let lacks = |layer: &Layer| SetError::malformed(&path, format!("the file lacks the channels of {layer:?}"));
        self.layers
            .iter()
            .map(|layer| values(&image, *layer).ok_or_else(|| lacks(layer)))
            .collect::<Result<_, _>>()
            .map(Some)
    }
}

fn values(image: &LayerImage, layer: Layer) -> Option<LayerValues> {
    let three = |names: [&str; 3]| image.floats(names).map(|planes| planes.map(<[f32]>::to_vec));
    match layer {
        Layer::Depth => image.depth.clone().map(LayerValues::Depth),
        Layer::Parts => image.part.clone().map(LayerValues::Parts),
        Layer::Normals => three(["normal.X", "normal.Y", "normal.Z"]).map(LayerValues::Normals),
        Layer::Flow => {
            let planes = image.floats(["forward.u", "forward.v"])?;
            Some(LayerValues::Flow(planes.map(<[f32]>::to_vec)))
        }
        Layer::Coverage => image.floats(["A"]).map(|[share]| LayerValues::Coverage(share.to_vec())),
        Layer::Colour => three(["R", "G", "B"]).or_else(|| three(["Y", "Y", "Y"])).map(LayerValues::Colour),
    }
}
