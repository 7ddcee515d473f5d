//! Which folders referenced files may be in.
//!
//! Scenarios, sweeps, robots and skins may come from untrusted sources and can reference any path. Referenced files
//! must be below the folder of the referencing file or below its project (the nearest parent folder that contains
//! `.git` or [`PROJECT_FILE`]), or be allowed on the command line, either directly or through a folder. Symbolic links
//! are resolved first.

use std::ffi::OsStr;
use std::fs;
use std::io::{self, ErrorKind};
use std::path::{Component, Path, PathBuf};

/// A folder that contains a file of this name is a project.
const PROJECT_FILE: &str = "skiagraph.project";

/// The files and folders that references in a file may lead to; initially none.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct AllowedFolders {
    anywhere: bool,
    /// Allowed files, and folders with everything below them, with links resolved.
    places: Vec<PathBuf>,
    /// Folders whose subfolders are allowed, but not the files directly in them.
    around: Vec<PathBuf>,
}

impl AllowedFolders {
    /// For references in files of this folder: allows the folder itself, or its project.
    pub fn of_folder(folder: &Path) -> Self {
        let Ok(folder) = fs::canonicalize(or_current(folder)) else { return Self::default() };
        let projects = folder.ancestors().take_while(|above| !is_home_or_root(above));
        let project =
            projects.into_iter().find(|above| above.join(".git").exists() || above.join(PROJECT_FILE).is_file());
        Self { places: vec![project.unwrap_or(&folder).to_owned()], ..Self::default() }
    }

    /// Also allows the sibling folders of this one, as in robot packages: `urdf/` and `meshes/`.
    pub fn and_beside(mut self, folder: &Path) -> Self {
        if let Ok(folder) = fs::canonicalize(or_current(folder))
            && let Some(above) = folder.parent().filter(|above| !is_home_or_root(above) && !is_home_or_root(&folder))
        {
            self.around.push(above.to_owned());
        }
        self
    }

    /// Also allows this file or folder. A missing one is allowed too, so that its reader reports that it is missing.
    pub fn allow(&mut self, place: &Path) {
        let place = or_current(place);
        self.places.push(fs::canonicalize(place).unwrap_or_else(|_| without_links(place)));
    }

    /// Also allows everything that `other` allows.
    pub fn allow_all_of(&mut self, other: &Self) {
        self.anywhere |= other.anywhere;
        self.places.extend(other.places.iter().cloned());
        self.around.extend(other.around.iter().cloned());
    }

    /// Allows all paths.
    pub fn allow_anywhere(&mut self) {
        self.anywhere = true;
    }

    /// Fails unless the path, which need not exist, leads to an allowed file.
    ///
    /// # Errors
    /// [`ErrorKind::PermissionDenied`], with a message that continues after the path.
    pub fn check(&self, path: &Path) -> io::Result<()> {
        if self.anywhere {
            return Ok(());
        }
        let real = without_links(path);
        let is_around = |above: &PathBuf| real.strip_prefix(above).is_ok_and(|rest| rest.components().nth(1).is_some());
        if self.places.iter().any(|place| real.starts_with(place)) || self.around.iter().any(is_around) {
            return Ok(());
        }
        let below =
            self.places.first().map_or_else(|| "its own folder".to_owned(), |place| place.display().to_string());
        Err(io::Error::new(
            ErrorKind::PermissionDenied,
            format!(
                "leads out of {below}, and is not looked for there: a file may name files below its own folder or project (the nearest folder above it \
                with .git or {PROJECT_FILE}) and below folders given on the command line; --allow-outside lifts this"
            ),
        ))
    }
}

/// The path with links and `..` resolved, as far as it exists.
fn without_links(path: &Path) -> PathBuf {
    let whole = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let mut real = PathBuf::new();
    for part in whole.components() {
        match part {
            Component::ParentDir => drop(real.pop()),
            Component::CurDir => {}
            part => {
                real.push(part);
                // a link is resolved first, so `..` goes up from its target
                if let Ok(target) = fs::canonicalize(&real) {
                    real = target;
                }
            }
        }
    }
    real
}

fn or_current(folder: &Path) -> &Path {
    if folder.as_os_str().is_empty() { Path::new(".") } else { folder }
}

/// Whether the folder contains all of a user's files, so that it cannot be a project.
fn is_home_or_root(folder: &Path) -> bool {
    let home = std::env::var_os("HOME").filter(|home| home != OsStr::new(""));
    folder.parent().is_none() || home.is_some_and(|home| fs::canonicalize(home).is_ok_and(|home| home == folder))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tree(names: &[&str]) -> tempfile::TempDir {
        let root = tempfile::tempdir().unwrap();
        for name in names {
            let path = root.path().join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, "x").unwrap();
        }
        root
    }

    #[test]
    fn only_files_below_the_folder_of_the_referencing_file_are_allowed() {
        let root = tree(&["mine/a.toml", "mine/motions/walk.bvh", "secret"]);
        let mine = root.path().join("mine");
        let allowed = AllowedFolders::of_folder(&mine);
        for inside in ["a.toml", "motions/walk.bvh", "motions/../a.toml", "./not/there", "gone/../a.toml"] {
            allowed.check(&mine.join(inside)).unwrap();
        }
        for outside in
            ["../secret", "../gone", "motions/../../secret", "gone/../../secret", "/etc/passwd", "/proc/self/environ"]
        {
            let error = allowed.check(&mine.join(outside)).unwrap_err();
            assert_eq!(error.kind(), ErrorKind::PermissionDenied, "{outside}");
            assert!(error.to_string().contains("--allow-outside"), "{error}");
        }
        let mut more = allowed.clone();
        more.allow(root.path());
        more.check(&mine.join("../secret")).unwrap();
        more.check(Path::new("/etc/passwd")).unwrap_err();
        more.allow_anywhere();
        more.check(Path::new("/etc/passwd")).unwrap();
    }

    #[cfg(unix)]
    #[test]
    fn links_are_resolved_before_the_check() {
        let root = tree(&["mine/a.toml", "other/secret", "other/deep/b"]);
        let mine = root.path().join("mine");
        std::os::unix::fs::symlink("../other", mine.join("link")).unwrap();
        std::os::unix::fs::symlink("../other/secret", mine.join("walk.bvh")).unwrap();
        std::os::unix::fs::symlink("../other/deep", mine.join("deep")).unwrap();
        let mut allowed = AllowedFolders::of_folder(&mine);
        for outside in ["link/secret", "walk.bvh", "link/gone", "deep/../secret"] {
            allowed.check(&mine.join(outside)).unwrap_err();
        }
        allowed.allow(&root.path().join("other/secret"));
        allowed.check(&mine.join("walk.bvh")).unwrap();
        allowed.check(&mine.join("deep/b")).unwrap_err();
    }

    #[test]
    fn the_project_is_the_nearest_parent_folder_with_a_marker() {
        let root = tree(&["work/.git/HEAD", "work/scenarios/sub/a.toml", "work/robots/r.urdf", "secret"]);
        let folder = root.path().join("work/scenarios/sub");
        let allowed = AllowedFolders::of_folder(&folder);
        allowed.check(&folder.join("../../robots/r.urdf")).unwrap();
        allowed.check(&folder.join("../../../secret")).unwrap_err();
        fs::write(root.path().join("work/scenarios").join(PROJECT_FILE), "").unwrap();
        let allowed = AllowedFolders::of_folder(&folder);
        allowed.check(&folder.join("../b.toml")).unwrap();
        allowed.check(&folder.join("../../robots/r.urdf")).unwrap_err();
    }

    #[test]
    fn sibling_folders_of_a_robots_folder_are_allowed_but_not_files_beside_it() {
        let root = tree(&["package/urdf/r.urdf", "package/meshes/a.stl", "package/secret", "secret"]);
        let folder = root.path().join("package/urdf");
        let allowed = AllowedFolders::of_folder(&folder).and_beside(&folder);
        allowed.check(&folder.join("../meshes/a.stl")).unwrap();
        for outside in ["../secret", "../../secret", "/etc/passwd"] {
            allowed.check(&folder.join(outside)).unwrap_err();
        }
    }
}
