//! Which formats can hold cameras that move, or that take images at times of their own.

use super::ExportFormat;
use crate::{BenchmarkSet, SetError};

/// Refuses a format that would say something else than the set.
pub(super) fn refuse(set: &BenchmarkSet, format: ExportFormat) -> Result<(), SetError> {
    let filming = &set.truth.rig;
    if filming.is_still() {
        return Ok(());
    }
    let moves = (0..filming.cameras()).any(|camera| filming.path(camera).is_some());
    let detail = match format {
        ExportFormat::Npz
        | ExportFormat::Bvh
        | ExportFormat::Trc
        | ExportFormat::C3d
        | ExportFormat::Tum
        | ExportFormat::Croissant => return Ok(()),
        ExportFormat::OpenCv | ExportFormat::HumanEva if moves => {
            "its files hold one place a camera, and cameras of this set move"
        }
        ExportFormat::OpenCv | ExportFormat::HumanEva => return Ok(()),
        ExportFormat::Coco | ExportFormat::WebDataset | ExportFormat::Colmap if filming.leaves_frames() => {
            "its points are those of a frame's own time, and images of this set are exposed at other times"
        }
        ExportFormat::Coco | ExportFormat::WebDataset | ExportFormat::Colmap => return Ok(()),
        ExportFormat::Bodytrack => {
            "it holds cameras that stand still and take an image of every frame at once, and those of this set do not"
        }
    };
    Err(SetError::malformed(format.name(), format!("cannot hold this set: {detail}; export it to npz")))
}
