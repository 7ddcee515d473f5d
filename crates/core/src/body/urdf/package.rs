//! Lookup of files referenced by a URDF.

use std::io;
use std::path::{Path, PathBuf};

use crate::input::{self, limits};

/// Reads the file with this `uri` from a URDF in `directory`.
///
/// `package://` and `model://` paths are searched upwards from `directory`: the longest trailing part of the path that
/// exists below an ancestor is used, below the nearest ancestor.
pub(super) fn read(directory: &Path, uri: &str) -> io::Result<Vec<u8>> {
    let path = resolve(directory, uri).ok_or_else(|| {
        io::Error::new(io::ErrorKind::NotFound, format!("no such file at or above {}", directory.display()))
    })?;
    input::read(&path, limits::MESH)
}

fn resolve(directory: &Path, uri: &str) -> Option<PathBuf> {
    let Some(path) = uri.strip_prefix("package://").or_else(|| uri.strip_prefix("model://")) else {
        let path = uri.strip_prefix("file://").map_or_else(|| directory.join(uri), PathBuf::from);
        return Some(path).filter(|path| path.exists());
    };
    let directory = directory.canonicalize().ok()?;
    let parts: Vec<&str> = path.split('/').collect();
    (0..parts.len()).find_map(|skip| {
        let tail = parts[skip..].join("/");
        directory.ancestors().map(|above| above.join(&tail)).find(|path| path.is_file())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn package_paths_are_found_upwards_by_their_longest_suffix() {
        let home = tempfile::tempdir().unwrap();
        let robots = home.path().join("checkout/arm_description/robots");
        let meshes = home.path().join("checkout/arm_description/meshes");
        for directory in [&robots, &meshes] {
            std::fs::create_dir_all(directory).unwrap();
        }
        std::fs::write(meshes.join("hand.stl"), "long tail").unwrap();
        std::fs::write(robots.join("hand.stl"), "beside").unwrap();
        let text = |uri: &str| read(&robots, uri).map(|bytes| String::from_utf8(bytes).unwrap());
        assert_eq!(text("package://big_package/arm_description/meshes/hand.stl").unwrap(), "long tail");
        assert_eq!(text("model://arm_description/meshes/hand.stl").unwrap(), "long tail");
        assert_eq!(text("../meshes/hand.stl").unwrap(), "long tail");
        assert_eq!(text("hand.stl").unwrap(), "beside");
        assert_eq!(text("package://gone/hand.stl").unwrap(), "beside");
        assert_eq!(text(&format!("file://{}", meshes.join("hand.stl").display())).unwrap(), "long tail");
        let missing = text("package://arm_description/meshes/foot.stl").unwrap_err();
        assert_eq!(missing.kind(), io::ErrorKind::NotFound);
    }
}
