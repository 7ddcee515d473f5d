//! Reads single truth images of a set on disk.

use std::path::Path;

use super::files::SetFiles;
use super::format::exr_layers::{self, LayerImage, layers_of};
use super::{SetError, TruthImage};

/// The truth images of a set in a directory, in shards or as separate files.
#[derive(Debug)]
pub struct TruthImageFiles {
    files: SetFiles,
    truth_images: Vec<TruthImage>,
}

/// The values of one layer at every pixel, row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub enum TruthImageValues {
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

impl TruthImageFiles {
    /// Opens the set in `directory`.
    ///
    /// # Errors
    /// [`SetError`] if it is not a set, or its first truth image cannot be read.
    pub fn open(directory: &Path) -> Result<Self, SetError> {
        let files = SetFiles::open(directory)?;
        let truth_images = layers_of(&files).map_err(|error| files.locate(error))?;
        Ok(Self { files, truth_images })
    }

    /// The truth images of the set.
    pub fn truth_images(&self) -> &[TruthImage] {
        &self.truth_images
    }

    /// All truth images of a camera and frame, in the order of [`Self::truth_images`]; `None` if there is no image.
    ///
    /// # Errors
    /// [`SetError`] if the image cannot be read or does not have this `size` (width, height).
    pub fn read(&self, camera: usize, frame: usize, size: [u32; 2]) -> Result<Option<Vec<TruthImageValues>>, SetError> {
        self.parse(camera, frame, size).map_err(|error| self.files.locate(error))
    }

    fn parse(&self, camera: usize, frame: usize, size: [u32; 2]) -> Result<Option<Vec<TruthImageValues>>, SetError> {
        let Some(image) = exr_layers::read_layers(&self.files, camera, frame)? else { return Ok(None) };
        let path = exr_layers::path(camera, frame);
        if [image.width, image.height] != size {
            let detail = format!(
                "the image has {} x {} pixels, its camera {} x {}",
                image.width, image.height, size[0], size[1]
            );
            return Err(SetError::malformed(&path, detail));
        }
        let lacks =
            |layer: &TruthImage| SetError::malformed(&path, format!("the file lacks the channels of {layer:?}"));
        self.truth_images
            .iter()
            .map(|layer| values(&image, *layer).ok_or_else(|| lacks(layer)))
            .collect::<Result<_, _>>()
            .map(Some)
    }
}

fn values(image: &LayerImage, layer: TruthImage) -> Option<TruthImageValues> {
    let three = |names: [&str; 3]| image.floats(names).map(|planes| planes.map(<[f32]>::to_vec));
    match layer {
        TruthImage::Depth => image.depth.clone().map(TruthImageValues::Depth),
        TruthImage::Parts => image.part.clone().map(TruthImageValues::Parts),
        TruthImage::Normals => three(["normal.X", "normal.Y", "normal.Z"]).map(TruthImageValues::Normals),
        TruthImage::Flow => {
            let planes = image.floats(["forward.u", "forward.v"])?;
            Some(TruthImageValues::Flow(planes.map(<[f32]>::to_vec)))
        }
        TruthImage::Coverage => image.floats(["A"]).map(|[share]| TruthImageValues::Coverage(share.to_vec())),
        TruthImage::Colour => three(["R", "G", "B"]).or_else(|| three(["Y", "Y", "Y"])).map(TruthImageValues::Colour),
    }
}
