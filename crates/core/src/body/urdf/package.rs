//! Lookup of files referenced by a URDF.

use std::io;
use std::path::{Path, PathBuf};

use crate::input::{self, AllowedFolders, limits};

/// Reads the file with this `uri` from a URDF in `directory`. It must be allowed by `also`, or be below the directory
/// or its project, or in a sibling folder of the directory.
///
/// `package://` and `model://` paths are searched upwards from `directory`: the longest trailing part of the path that
/// exists below an ancestor is used, below the nearest ancestor.
pub(super) fn read(directory: &Path, uri: &str, also: &AllowedFolders) -> io::Result<Vec<u8>> {
    let mut allowed = AllowedFolders::of_folder(directory).and_beside(directory);
    allowed.allow_all_of(also);
    let path = resolve(directory, uri, &allowed)?.ok_or_else(|| {
        io::Error::new(io::ErrorKind::NotFound, format!("no such file at or above {}", directory.display()))
    })?;
    input::read(&path, limits::MESH)
}

fn resolve(directory: &Path, uri: &str, allowed: &AllowedFolders) -> io::Result<Option<PathBuf>> {
    let Some(path) = uri.strip_prefix("package://").or_else(|| uri.strip_prefix("model://")) else {
        let path = uri.strip_prefix("file://").map_or_else(|| directory.join(uri), PathBuf::from);
        allowed.check(&path)?;
        return Ok(Some(path).filter(|path| path.exists()));
    };
    let Ok(directory) = directory.canonicalize() else { return Ok(None) };
    let parts: Vec<&str> = path.split('/').collect();
    Ok((0..parts.len()).find_map(|skip| {
        let tail = parts[skip..].join("/");
        let found = directory.ancestors().map(|above| above.join(&tail));
        found.into_iter().find(|path| path.is_file() && allowed.check(path).is_ok())
    }))
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
        let text =
            |uri: &str| read(&robots, uri, &AllowedFolders::default()).map(|bytes| String::from_utf8(bytes).unwrap());
        assert_eq!(text("package://big_package/arm_description/meshes/hand.stl").unwrap(), "long tail");
        assert_eq!(text("model://arm_description/meshes/hand.stl").unwrap(), "long tail");
        assert_eq!(text("../meshes/hand.stl").unwrap(), "long tail");
        assert_eq!(text("hand.stl").unwrap(), "beside");
        assert_eq!(text("package://gone/hand.stl").unwrap(), "beside");
        assert_eq!(text(&format!("file://{}", meshes.join("hand.stl").display())).unwrap(), "long tail");
        let missing = text("package://arm_description/meshes/foot.stl").unwrap_err();
        assert_eq!(missing.kind(), io::ErrorKind::NotFound);
    }

    #[test]
    fn a_mesh_outside_the_package_is_not_read_under_any_name() {
        let home = tempfile::tempdir().unwrap();
        let robots = home.path().join("downloads/arm/urdf");
        std::fs::create_dir_all(&robots).unwrap();
        std::fs::write(home.path().join("secret.stl"), "secret").unwrap();
        std::fs::write(home.path().join("downloads/secret.stl"), "secret").unwrap();
        let secret = home.path().join("secret.stl");
        let mut names = vec![
            "../../../secret.stl".to_owned(),
            "../../secret.stl".to_owned(),
            secret.display().to_string(),
            format!("file://{}", secret.display()),
            "package://x/secret.stl".to_owned(),
            "package://x/../../../secret.stl".to_owned(),
        ];
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink(&secret, robots.join("link.stl")).unwrap();
            names.push("link.stl".to_owned());
        }
        for name in names {
            let error = read(&robots, &name, &AllowedFolders::default()).unwrap_err();
            assert!(!error.to_string().contains("No such file"), "{name}: {error}");
            let mut anywhere = AllowedFolders::default();
            anywhere.allow_anywhere();
            assert_eq!(read(&robots, &name, &anywhere).unwrap(), b"secret", "{name}");
        }
    }
}
