//! A set in the formats of other tools.
//!
//! Each format has one file here, follows the format's own documentation, and is read back by its reference reader in
//! `tests/interop/`. Every exported folder has a `README.txt` with axes, units and omissions. Exports contain the
//! truth: they are for evaluation, not for trackers; only cameras (OpenCV, HumanEva), those for pipelines of keypoints
//! (OpenPose, Pose2Sim, anipose, Caliscope) have nothing but the blind side.

mod anipose;
mod bvh;
mod c3d;
mod caliscope;
mod camera_toml;
mod coco;
mod colmap;
mod croissant;
mod folder;
mod humaneva;
mod keypoints;
mod npz;
mod opencv;
mod openpose;
mod pose2sim;
mod rle;
mod trc;
mod tum;
mod webdataset;

use std::path::Path;

pub use self::bvh::bvh_text;
pub use self::croissant::CroissantTable;
use self::folder::Folder;
use super::{BenchmarkSet, BlindSet, RigMoments, SetError};
use skiagraph_core::camera::Camera;

/// Cameras in the TOML of anipose, Pose2Sim and Caliscope, metres, with their names.
pub fn cameras_to_toml(cameras: &[Camera]) -> String {
    let names: Vec<String> = cameras.iter().map(|camera| camera.name.clone()).collect();
    camera_toml::text(cameras, &names)
}

/// The file of every export that states its format, its set, axes, units and omissions.
pub const EXPORT_README: &str = "README.txt";

/// The text of [`EXPORT_README`]: its first line is the title, its third names the set.
pub fn export_readme(title: &str, set: &BlindSet, words: &str) -> String {
    let BlindSet { name, set_hash, .. } = set;
    format!("{title}\n\nThe benchmark set {name:?} of Skiagraph, hash {set_hash}.\n\n{words}\n")
}

/// An export format for sets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExportFormat {
    /// COCO's instances and keypoints.
    Coco,
    /// OpenCV's `FileStorage` YAML, one file a camera.
    OpenCv,
    /// One NumPy archive of truth and cameras.
    Npz,
    /// Biovision's hierarchy and motion.
    Bvh,
    /// Motion Analysis' marker table, as OpenSim reads it.
    Trc,
    /// C3D, binary marker trajectories.
    C3d,
    /// COLMAP's text model of cameras, images and points.
    Colmap,
    /// Croissant's JSON-LD description of the images.
    Croissant,
    /// Tar shards of samples.
    WebDataset,
    /// The trajectory of the root in TUM's format.
    Tum,
    /// HumanEva's calibration files.
    HumanEva,
    /// Keypoints as OpenPose's JSON.
    OpenPose,
    /// A project of Pose2Sim.
    Pose2Sim,
    /// Cameras and keypoints for anipose.
    Anipose,
    /// Cameras and keypoints for Caliscope.
    Caliscope,
}

/// All formats with their names on the command line and the files they write.
pub const EXPORT_FORMATS: [(ExportFormat, &str, &str); 15] = [
    (ExportFormat::Coco, "coco", "annotations.json (instances as RLE, 15 keypoints), images/: pycocotools"),
    (ExportFormat::OpenCv, "opencv", "NAME.yml of every camera: cv2.FileStorage"),
    (ExportFormat::Npz, "npz", "truth.npz (joints, markers, 2D, links, cameras) and read_truth.py: NumPy"),
    (ExportFormat::Bvh, "bvh", "actor.bvh (cm, Y up): Blender, bvhio"),
    (ExportFormat::Trc, "trc", "markers.trc (mm, Y up): OpenSim"),
    (ExportFormat::C3d, "c3d", "markers.c3d (mm, Z up): ezc3d, Mokka"),
    (
        ExportFormat::Colmap,
        "colmap",
        "cameras.txt, images.txt, points3D.txt of frame 0; images of all frames for moving cameras: COLMAP",
    ),
    (ExportFormat::Croissant, "croissant", "croissant.json, frames.csv, masks/: mlcroissant"),
    (ExportFormat::WebDataset, "webdataset", "NNNNNN.tar shards of masks, cameras, keypoints: webdataset"),
    (ExportFormat::Tum, "tum", "root.txt, trajectory of the root: evo"),
    (ExportFormat::HumanEva, "humaneva", "Calibration_Data/NAME.cal (mm): HumanEva's code"),
    (ExportFormat::OpenPose, "openpose", "CAMERA_json/ of keypoints, without truth: readers of OpenPose's JSON"),
    (ExportFormat::Pose2Sim, "pose2sim", "Config.toml, Calib.toml, pose/ of keypoints, without truth: Pose2Sim"),
    (ExportFormat::Anipose, "anipose", "calibration.toml, points.npz of keypoints, without truth: aniposelib"),
    (
        ExportFormat::Caliscope,
        "caliscope",
        "camera_array.toml, image_points.csv of keypoints, without truth: Caliscope's scripts",
    ),
];

impl ExportFormat {
    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        EXPORT_FORMATS.iter().find(|(format, ..)| *format == self).map_or("", |(_, name, _)| name)
    }

    /// The title of its `README.txt`.
    pub fn title(self) -> &'static str {
        match self {
            Self::Coco => "COCO instances and keypoints",
            Self::OpenCv => "Cameras as OpenCV's FileStorage",
            Self::Npz => "Truth and cameras for NumPy",
            Self::Bvh => "The actor's motion as BVH",
            Self::Trc => "Markers as TRC",
            Self::C3d => "Markers as C3D",
            Self::Colmap => "A COLMAP model",
            Self::Croissant => "A Croissant description",
            Self::WebDataset => "WebDataset shards",
            Self::Tum => "The root's trajectory in TUM's format",
            Self::HumanEva => "Cameras as HumanEva's calibration files",
            Self::OpenPose => "Keypoints as OpenPose writes them",
            Self::Pose2Sim => "A project of Pose2Sim",
            Self::Anipose => "Cameras and keypoints for anipose",
            Self::Caliscope => "Cameras and keypoints for Caliscope",
        }
    }

    /// What programs that read its files do to them and hurts most, for its `README.txt`. `docs/other-programs.md` has
    /// more.
    fn caveat(self) -> &'static str {
        match self {
            Self::Coco => "pycocotools has 17 sigmas and needs 15; SLEAP reads hidden points as visible",
            Self::OpenCv => "undistortPoints stops after five iterations: give it criteria",
            Self::Npz => {
                "cv2.imread turns depth PNGs into 8 bits without IMREAD_UNCHANGED; EXR readers give the data window only"
            }
            Self::Bvh => "bvhTools stretches time when it resamples; viewers with left-handed axes mirror the motion",
            Self::Trc => "Pose2Sim's filters drop decimals of their frequencies, and halve the amplitude there",
            Self::C3d => "ezc3d and c3d name only the first 255 markers, and lose frames from 65,535 on",
            Self::Colmap => "pycolmap cuts names of images at spaces",
            Self::Croissant => "tables read with pandas take names such as NA for nothing",
            Self::WebDataset => "webdataset's own decoders clip depth at 255: put a decoder of your own first",
            Self::Tum => "evo refuses to align a straight path, and leaves its turn free near one",
            Self::HumanEva => "undistortPoints of OpenCV stops after five iterations: give it criteria",
            Self::OpenPose => "points that were not found are 0, 0 with the confidence 0, and no estimates",
            Self::Pose2Sim => {
                "gaps of up to 20 frames are filled and count as estimates; decimals of cut-off frequencies are dropped"
            }
            Self::Anipose => "bundle_adjust changes lenses; triangulate_ransac is worse on plain noise",
            Self::Caliscope => "fill_gaps also fills the beginnings of long gaps; confidences are ignored",
        }
    }

    /// Whether its files contain the truth; the others contain only what trackers are given.
    pub fn has_truth(self) -> bool {
        !matches!(
            self,
            Self::OpenCv | Self::HumanEva | Self::OpenPose | Self::Pose2Sim | Self::Anipose | Self::Caliscope
        )
    }

    /// The format of that name.
    pub fn named(name: &str) -> Option<Self> {
        EXPORT_FORMATS.iter().find(|(_, known, _)| *known == name).map(|(format, ..)| *format)
    }
}

/// Callbacks during an export.
#[derive(Clone, Copy)]
pub struct ExportWatch<'a> {
    /// Called after the images of every frame.
    pub tick: &'a (dyn Fn() + Sync),
    /// Returns whether to stop.
    pub stop: &'a (dyn Fn() -> bool + Sync),
}

/// Writes a set into an existing folder that has none of the files yet.
///
/// # Errors
/// [`SetError::Io`] naming the file that cannot be written, [`SetError::Malformed`] with the reason if the format
/// cannot represent the set; errors of reading the set; [`SetError::Stopped`].
pub fn export(
    set: &BenchmarkSet,
    format: ExportFormat,
    folder: &Path,
    progress: ExportWatch<'_>,
) -> Result<(), SetError> {
    if !format.has_truth() {
        return export_blind(&set.blind, format, folder, progress);
    }
    let holds_images = matches!(format, ExportFormat::Coco | ExportFormat::WebDataset | ExportFormat::Colmap);
    if holds_images && set.truth.rig.leaves_frames() {
        let detail = "its points are at the frame's time, but images of this set are exposed at other times";
        return Err(unrepresentable(format, detail));
    }
    let folder = Folder::new(folder, format, progress);
    match format {
        ExportFormat::Coco => coco::write(set, &folder),
        ExportFormat::Npz => npz::write(set, &folder),
        ExportFormat::Bvh => bvh::write(set, &folder),
        ExportFormat::Trc => trc::write(set, &folder),
        ExportFormat::C3d => c3d::write(set, &folder),
        ExportFormat::Colmap => colmap::write(set, &folder),
        ExportFormat::Croissant => croissant::write(set, &folder),
        ExportFormat::WebDataset => webdataset::write(set, &folder),
        ExportFormat::Tum => tum::write(set, &folder),
        other => Err(wrong_side(other)),
    }
}

/// As [`export`], for a set that may lack its truth, in a format without the truth.
///
/// # Errors
/// As [`export`], and [`SetError::Malformed`] for a format with the truth.
pub fn export_blind(
    set: &BlindSet,
    format: ExportFormat,
    folder: &Path,
    progress: ExportWatch<'_>,
) -> Result<(), SetError> {
    check_given(set, format)?;
    let folder = Folder::new(folder, format, progress);
    match format {
        ExportFormat::OpenCv => opencv::write(set, &folder),
        ExportFormat::HumanEva => humaneva::write(set, &folder),
        ExportFormat::OpenPose => openpose::write(set, &folder),
        ExportFormat::Pose2Sim => pose2sim::write(set, &folder),
        ExportFormat::Anipose => anipose::write(set, &folder),
        ExportFormat::Caliscope => caliscope::write(set, &folder),
        other => Err(wrong_side(other)),
    }
}

fn wrong_side(format: ExportFormat) -> SetError {
    SetError::malformed(format.name(), "its files contain the truth, and this set is given without it".to_owned())
}

/// Refuses formats without the truth that cannot represent moving cameras or cameras with their own exposure times.
fn check_given(set: &BlindSet, format: ExportFormat) -> Result<(), SetError> {
    let moves = |moments: &RigMoments| (0..set.rig.cameras.len()).any(|camera| moments.moves(camera));
    let detail = match (&set.moments, format) {
        (None, _) | (_, ExportFormat::OpenPose) => return Ok(()),
        (Some(moments), _) if moves(moments) => "its files hold one pose per camera, but cameras of this set move",
        _ => return Ok(()),
    };
    Err(unrepresentable(format, detail))
}

fn unrepresentable(format: ExportFormat, detail: &str) -> SetError {
    SetError::malformed(format.name(), format!("cannot represent this set: {detail}; export it to npz"))
}
