//! The files of `[[rig.file]]`.

use std::fs;
use std::path::{Path, PathBuf};

use crate::scenario::KeyError;
use skiagraph_core::camera::{Camera, CameraFile, CameraFileFormat, read_cameras, with_first_camera};
use skiagraph_core::input::{self, limits};

/// The files at a path, each with the other half of its format if that is there: one, or all of a folder.
pub(super) fn files_at(path: &Path) -> Vec<Vec<PathBuf>> {
    let mut names: Vec<PathBuf> = vec![path.to_owned()];
    if let Ok(entries) = fs::read_dir(path) {
        names = entries.flatten().map(|entry| entry.path()).collect();
        // `.json` is of every program's settings
        let is_camera_file = |path: &PathBuf| {
            CameraFileFormat::from_name(&name_of(path)).is_some_and(|format| format != CameraFileFormat::Human36M)
        };
        names.retain(is_camera_file);
        names.sort();
    }
    let mut files: Vec<Vec<PathBuf>> = Vec::new();
    for name in names {
        if files.iter().flatten().any(|known| *known == name) {
            continue;
        }
        let other = CameraFileFormat::other_file(&name_of(&name)).map(|other| name.with_file_name(other));
        files.push([Some(name), other.filter(|other| other.is_file())].into_iter().flatten().collect());
    }
    files
}

fn name_of(path: &Path) -> String {
    path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default()
}

pub(super) fn cameras_of(settings: &CameraFile, folder: &Path, index: usize) -> Result<Vec<Camera>, KeyError> {
    let table = format!("rig.file[{index}]");
    let path = folder.join(&settings.path);
    let mut cameras = Vec::new();
    let all = files_at(&path);
    // of a folder the first camera of all is meant, not that of each file
    let first = settings.first_camera.filter(|_| all.len() > 1);
    for files in all {
        let mut texts = Vec::new();
        for file in &files {
            texts.push(input::read_to_string(file, limits::CAMERAS).map_err(|e| {
                KeyError::new("path", format!("{}: cannot be read: {e}", file.display())).within(&table)
            })?);
        }
        let texts: Vec<&str> = texts.iter().map(String::as_str).collect();
        let name = name_of(&files[0]);
        let by_name = CameraFileFormat::from_name(&name);
        // a file without a sign of its format is read as what its name says, for the message about what it lacks
        let format = settings.format.or_else(|| CameraFileFormat::from_texts(&texts)).or(by_name);
        let format = format.ok_or_else(|| {
            let expected = "expected the program that wrote the file, which neither its content nor its name tells";
            KeyError::new("format", expected).within(&table)
        })?;
        let mut options = settings.clone();
        options.first_camera = options.first_camera.filter(|_| first.is_none());
        let mut found = read_cameras(&texts, format, &options);
        for camera in found.iter_mut().flatten().filter(|camera| camera.name.is_empty()) {
            camera.name = files[0].file_stem().map_or("camera".into(), |stem| stem.to_string_lossy().into_owned());
        }
        cameras.extend(found.map_err(|e| KeyError::new(&table, format!("{}: {e}", files[0].display())))?);
    }
    if cameras.is_empty() {
        return Err(KeyError::new("path", format!("{}: found no camera file there", path.display())).within(&table));
    }
    with_first_camera(cameras, first.as_ref()).map_err(|e| KeyError::new(&table, e))
}

#[cfg(test)]
mod tests {
    use super::*;
    use skiagraph_core::camera::FirstCamera;

    /// Each file of a folder was moved by itself, so that all cameras were at one place.
    #[test]
    fn cameras_of_a_folder_keep_their_places() {
        let folder = tempfile::tempdir().unwrap();
        for (name, x) in [("a", 0.0), ("b", -1.0)] {
            let text = format!(
                "image_width: 64\nimage_height: 48\nK: [50, 0, 31.5, 0, 50, 23.5, 0, 0, 1]\nrvec: [0, 0, 0]\nT: [{x}, 0, 0]\n"
            );
            fs::write(folder.path().join(format!("{name}.yml")), text).unwrap();
        }
        let first_camera = Some(FirstCamera { position_m: [3.0, -4.0, 1.5], look_at_m: [3.0, 0.0, 1.5] });
        let settings = CameraFile { path: ".".to_owned(), first_camera, ..CameraFile::default() };
        let [a, b] = &cameras_of(&settings, folder.path(), 0).unwrap()[..] else { panic!("two cameras") };
        assert!((a.centre().coords - nalgebra::Vector3::new(3.0, -4.0, 1.5)).norm() < 1e-12);
        // 1 m to the right of a camera that looks along Y
        assert!((b.centre().coords - nalgebra::Vector3::new(4.0, -4.0, 1.5)).norm() < 1e-12, "{:?}", b.centre());
    }
}
