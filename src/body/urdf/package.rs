//! Where the files that a URDF names are.

use std::io;
use std::path::{Path, PathBuf};

/// Greatest size of a mesh file, bytes.
const MAX_MESH: u64 = 1 << 28;

/// Reads the file that `uri` names in a URDF that lies in `directory`.
///
/// `package://` and `model://` paths are sought upwards from `directory`: of all trailing parts of the path the longest
/// that exists below an ancestor is taken, below the nearest ancestor.
pub(super) fn read(directory: &Path, uri: &str) -> io::Result<Vec<u8>> {
    let path = resolve(directory, uri).ok_or_else(|| {
        io::Error::new(io::ErrorKind::NotFound, format!("no such file at or above {}", directory.display()))
    })?;
    let length = std::fs::metadata(&path)?.len();
    if length > MAX_MESH {
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, format!("longer than {MAX_MESH} bytes")));
    }
    std::fs::read(path)
}

fn resolve(directory: &Path, uri: &str) -> Option<PathBuf> {
    if let Some(path) = uri.strip_prefix("file://") {
        return Some(PathBuf::from(path)).filter(|p| p.is_file());
    }
    let Some(path) = uri.strip_prefix("package://").or_else(|| uri.strip_prefix("model://")) else {
        return Some(directory.join(uri)).filter(|p| p.is_file());
    };
    let directory = directory.canonicalize().ok()?;
    let parts: Vec<&str> = path.split('/').collect();
    (0..parts.len()).find_map(|skip| {
        let tail = parts[skip..].join("/");
        directory.ancestors().map(|above| above.join(&tail)).find(|p| p.is_file())
    })
}
