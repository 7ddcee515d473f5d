//! The folder of an export.

use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use super::{EXPORT_README, ExportFormat, ExportWatch, export_readme};
use crate::format::listing::stop_if_requested;
use crate::format::silhouette_png;
use crate::{BlindSet, SetError};
use skiagraph_core::raster::Mask;

/// Addition to `README.txt` of sets whose cameras have times of their own or move.
const OWN_TIMES: &str = "
Cameras of this set have times of their own, or move: an image or a keypoint of frame f is of the time that cameras.npz of
the set states (time_s), not of f / fps, and frames without an image are missing. These files cannot state such times.
";

pub(super) struct Folder<'a> {
    root: PathBuf,
    format: ExportFormat,
    progress: ExportWatch<'a>,
}

pub(super) struct SetSilhouette {
    pub(super) camera: usize,
    pub(super) frame: usize,
    pub(super) png: Vec<u8>,
    pub(super) mask: Mask,
}

pub(super) struct SetImage {
    /// `png` or `jpg`.
    pub(super) extension: String,
    pub(super) bytes: Vec<u8>,
}

impl SetSilhouette {
    /// The camera's image at the time of the silhouette; `None` in a set without images.
    pub(super) fn image(&self, set: &BlindSet) -> Result<Option<SetImage>, SetError> {
        let Some(path) = set.colour_path(self.camera, self.frame) else { return Ok(None) };
        let extension = path.rsplit('.').next().unwrap_or_default().to_owned();
        Ok(Some(SetImage { extension, bytes: set.file(&path)? }))
    }
}

impl<'a> Folder<'a> {
    pub(super) fn new(root: &Path, format: ExportFormat, progress: ExportWatch<'a>) -> Self {
        Self { root: root.to_owned(), format, progress }
    }

    pub(super) fn write(&self, name: &str, bytes: &[u8]) -> Result<(), SetError> {
        self.create(name, |file| file.write_all(bytes))
    }

    /// Writes a new file in pieces.
    pub(super) fn create(
        &self,
        name: &str,
        write: impl FnOnce(&mut BufWriter<File>) -> std::io::Result<()>,
    ) -> Result<(), SetError> {
        let path = self.root.join(name);
        let parent = path.parent().unwrap_or(&self.root);
        fs::create_dir_all(parent).map_err(SetError::io(parent, "create the directory"))?;
        let written = File::create_new(&path).and_then(|file| {
            let mut file = BufWriter::new(file);
            write(&mut file)?;
            file.into_inner().map_err(std::io::IntoInnerError::into_error)?.sync_all()
        });
        written.map_err(SetError::io(&path, "write"))
    }

    /// Writes `README.txt`: the title and description of the format, whether cameras have times of their own, and what
    /// other programs do to the files.
    pub(super) fn readme(&self, set: &BlindSet, words: &str) -> Result<(), SetError> {
        let timed = if set.moments.is_some() { OWN_TIMES } else { "" };
        let caveat = self.format.caveat();
        let others =
            format!("\nBeware: {caveat}.\nMore of what other programs do: docs/other-programs.md of Skiagraph.\n");
        self.write(EXPORT_README, (export_readme(self.format.title(), set, words) + timed + &others).as_bytes())
    }

    /// Every silhouette, in order of frames, then cameras. Only one is in memory at a time.
    pub(super) fn for_each_picture(
        &self,
        set: &BlindSet,
        mut take: impl FnMut(&SetSilhouette) -> Result<(), SetError>,
    ) -> Result<(), SetError> {
        self.for_each_frame(set, |frame| {
            for (camera, known) in set.rig.cameras.iter().enumerate() {
                if !set.has_image(camera, frame) {
                    continue;
                }
                let path = BlindSet::silhouette_path(camera, frame);
                let png = set.files().read(&path).map_err(|e| set.files().locate(e))?.into_owned();
                let mask = silhouette_png::decode(&path, &png, known.pinhole.width, known.pinhole.height)?;
                take(&SetSilhouette { camera, frame, png, mask })?;
            }
            Ok(())
        })
    }

    /// Every frame in order, until the export is to stop.
    pub(super) fn for_each_frame(
        &self,
        set: &BlindSet,
        mut take: impl FnMut(usize) -> Result<(), SetError>,
    ) -> Result<(), SetError> {
        for frame in 0..set.frame_count {
            stop_if_requested(self.progress.stop)?;
            take(frame)?;
            (self.progress.tick)();
        }
        Ok(())
    }
}

/// A camera's name as a file name: letters, digits, `-`, `_` and `.`; other characters become `_`.
fn file_name(name: &str) -> String {
    let harmless = |c: char| if c.is_ascii_alphanumeric() || "-_.".contains(c) { c } else { '_' };
    let name: String = name.chars().map(harmless).collect();
    name.trim_start_matches('.').to_owned()
}

pub(super) fn camera_files(set: &BlindSet) -> Vec<String> {
    unique_file_names(set.rig.cameras.iter().map(|camera| &camera.name), "cam")
}

/// The names as file names. One that is empty, or that an earlier one has, gets `_KINDnn` with its index at the end.
pub(super) fn unique_file_names<'a>(names: impl Iterator<Item = &'a String>, kind: &str) -> Vec<String> {
    let mut unique: Vec<String> = Vec::new();
    for (index, name) in names.enumerate() {
        let mut name = file_name(name);
        while name.is_empty() || unique.contains(&name) {
            name += &format!("_{kind}{index:02}");
        }
        unique.push(name);
    }
    unique
}

/// Metres to millimetres, rounded to four decimals.
pub(super) fn millimetres(metres: f64) -> f64 {
    (metres * 1e7).round() / 1e4
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Regression test: `left hip` and `left_hip` became two joints of one name in BVH.
    #[test]
    fn names_equal_after_cleaning_become_unique() {
        let names = ["left hip", "left_hip", "", "...", "left/hip", "left_hip_link01"].map(str::to_owned);
        let expected =
            ["left_hip", "left_hip_link01", "_link02", "_link03", "left_hip_link04", "left_hip_link01_link05"];
        assert_eq!(unique_file_names(names.iter(), "link"), expected);
    }
}
