//! Reads camera images (PNG, PPM, PGM, JPEG).

use std::fs;
use std::path::{Path, PathBuf};

use crate::common::{ExperimentError, read_file, sort_by_numbers};
use skiagraph_core::input::limits;
use skiagraph_truth::observing::Image;

const ENDINGS: [&str; 6] = ["png", "ppm", "pgm", "pnm", "jpg", "jpeg"];
/// Greatest number of images in a directory: four and a half hours at 60 Hz.
const MOST_IMAGES: usize = 1_000_000;

/// The images of a directory, in the order of their names, in which numbers count as such; other files are ignored.
pub(crate) fn images_in(directory: &Path) -> Result<Vec<PathBuf>, ExperimentError> {
    let unreadable = |source| ExperimentError::Unreadable { path: directory.to_owned(), source };
    let mut images = Vec::new();
    for entry in fs::read_dir(directory).map_err(unreadable)? {
        let path = entry.map_err(unreadable)?.path();
        let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or_default().to_ascii_lowercase();
        let hidden = path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'));
        if ENDINGS.contains(&ending.as_str()) && !hidden && path.is_file() {
            images.push(path);
        }
    }
    let malformed = |detail: String| ExperimentError::Malformed { path: directory.to_owned(), detail };
    if images.is_empty() {
        return Err(malformed(format!("expected images (.{}), found none", ENDINGS.join(", ."))));
    }
    if images.len() > MOST_IMAGES {
        return Err(malformed(format!("expected at most {MOST_IMAGES} images, found {}", images.len())));
    }
    sort_by_numbers(&mut images);
    Ok(images)
}

/// Reads an image as [`Image::decode`] does.
pub(crate) fn read_image(path: &Path) -> Result<Image, ExperimentError> {
    let malformed = |detail: String| ExperimentError::Malformed { path: path.to_owned(), detail };
    let bytes = read_file(path, limits::PICTURE)?;
    Image::decode(&bytes).map_err(malformed)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn put(folder: &Path, name: &str, bytes: &[u8]) -> PathBuf {
        fs::write(folder.join(name), bytes).unwrap();
        folder.join(name)
    }

    #[test]
    fn other_files_are_refused_and_huge_claimed_sizes_take_no_memory() {
        let room = tempfile::tempdir().unwrap();
        for (name, bytes) in [
            ("text.png", b"not a picture".as_slice()),
            ("short.ppm", b"P6 20 10 255\n123"),
            ("huge.ppm", b"P6 60000 60000 255\n1"),
            ("empty.ppm", b""),
        ] {
            let refused = read_image(&put(room.path(), name, bytes)).unwrap_err().to_string();
            assert!(refused.contains(name), "{refused}");
        }
        let names: Vec<_> = images_in(room.path()).unwrap().iter().map(|p| p.file_name().unwrap().to_owned()).collect();
        assert_eq!(names, ["empty.ppm", "huge.ppm", "short.ppm", "text.png"]);
        let nothing = tempfile::tempdir().unwrap();
        assert!(images_in(nothing.path()).unwrap_err().to_string().contains("expected images (.png"));
        assert!(images_in(&nothing.path().join("nowhere")).is_err());
    }
}
