//! Reads a file into a [`Clip`].

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use super::{
    Clip, MocapError, ReadOptions, parse_amass, parse_amc, parse_asf, parse_bvh, parse_deepmimic, parse_gltf,
    parse_markers, points::malformed, repeats,
};
use skiagraph_core::body::{FBX_TO_GLB, SkinError};
use skiagraph_core::input;
use skiagraph_core::input::limits;

/// Reads a recording. The format is chosen by extension (upper or lower case): `.bvh`, `.amc` with its `.asf`, markers
/// in `.c3d` or `.trc`, DeepMimic's `.txt` or `.json`, AMASS's or SMPL's `.npz`, animations in `.glb`, `.gltf`, `.vrm`
/// or `.vrma`.
///
/// An inserted rest pose is removed unless [`ReadOptions::keep_rest_pose`] is set.
pub fn read(path: &Path, options: &ReadOptions) -> Result<Clip, MocapError> {
    let file = path.display().to_string();
    let mut clip = match extension(path).as_str() {
        "bvh" => parse_bvh(&text(path, limits::RECORDING)?, &file, options),
        "amc" => {
            let skeleton_path = match &options.skeleton {
                Some(path) => path.clone(),
                None => find_skeleton(path)?,
            };
            let skeleton = parse_asf(&text(&skeleton_path, limits::SKELETON)?, &skeleton_path.display().to_string())?;
            parse_amc(&text(path, limits::RECORDING)?, &file, &skeleton, options)
        }
        "c3d" | "trc" => parse_markers(&bytes(path, limits::RECORDING)?, &file, options),
        "txt" | "json" => parse_deepmimic(&text(path, limits::RECORDING)?, &file, options),
        "npz" => {
            let model = options.skeleton.as_deref().map(|path| bytes(path, limits::RECORDING)).transpose()?;
            parse_amass(&bytes(path, limits::RECORDING)?, model.as_deref(), &file, options)
        }
        "glb" | "gltf" | "vrm" | "vrma" => {
            let read = |uri: &str| {
                let path = path.with_file_name(uri);
                input::read(&path, limits::RECORDING).map_err(|source| SkinError::Unreadable { path, source })
            };
            parse_gltf(&bytes(path, limits::RECORDING)?, &file, options, &read)
        }
        "fbx" => Err(malformed(&file, format!("FBX is not read; convert it: {FBX_TO_GLB}"))),
        _ => Err(malformed(
            &file,
            "expected a recording ending in .bvh, .amc (with its .asf), .c3d, .trc, DeepMimic's .txt or .json, AMASS's .npz, or \
             an animation in .glb, .gltf, .vrm or .vrma",
        )),
    }?;
    clip.notes.extend(repeats::note(&clip));
    Ok(if options.keep_rest_pose { clip } else { clip.without_inserted_rest_pose() })
}

fn extension(path: &Path) -> String {
    path.extension().and_then(OsStr::to_str).unwrap_or_default().to_ascii_lowercase()
}

fn bytes(path: &Path, limit: u64) -> Result<Vec<u8>, MocapError> {
    input::read(path, limit).map_err(|source| MocapError::Unreadable { path: path.to_owned(), source })
}

/// The file as text; bytes that are not UTF-8 (joint names in old code pages) become U+FFFD.
fn text(path: &Path, limit: u64) -> Result<String, MocapError> {
    Ok(match String::from_utf8(bytes(path, limit)?) {
        Ok(text) => text,
        Err(error) => String::from_utf8_lossy(error.as_bytes()).into_owned(),
    })
}

/// The skeleton of `01_07.amc`: `01.asf` in the same folder, else the only `.asf` there.
fn find_skeleton(amc: &Path) -> Result<PathBuf, MocapError> {
    let folder = match amc.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    // names may not be UTF-8, so they are compared as bytes
    let stem = amc.file_stem().unwrap_or_default().as_encoded_bytes();
    let subject = stem.split(|byte| *byte == b'_').next().unwrap_or_default();
    let unreadable = |source| MocapError::Unreadable { path: folder.to_owned(), source };
    let mut skeletons = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(unreadable)? {
        let path = entry.map_err(unreadable)?.path();
        if extension(&path) == "asf" {
            skeletons.push(path);
        }
    }
    let is_subjects = |path: &&PathBuf| path.file_stem().is_some_and(|stem| stem.as_encoded_bytes() == subject);
    match (skeletons.iter().find(is_subjects), skeletons.as_slice()) {
        (Some(path), _) => Ok(path.clone()),
        (None, [only]) => Ok(only.clone()),
        (None, others) => Err(MocapError::at(
            amc.display(),
            format!("its skeleton {}.asf in the same folder", String::from_utf8_lossy(subject)),
            format!("{} other .asf files; set `skeleton`", others.len()),
        )),
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    const SKELETON: &str = ":units\nlength 0.45\n:root\norder TX TY TZ RX RY RZ\n:bonedata\n:hierarchy\n";
    const MOTION: &str = ":DEGREES\n1\nroot 0 18 0 0 0 0\n2\nroot 0 18 0 0 0 1\n";

    fn folder(files: &[(&str, &str)]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        for (name, text) in files {
            fs::write(folder.path().join(name), text).unwrap();
        }
        folder
    }

    #[test]
    fn an_amc_uses_its_subjects_skeleton_or_else_the_only_one() {
        let broken = "not a skeleton";
        let cases: [(&[(&str, &str)], bool); 4] = [
            (&[("07.asf", SKELETON), ("08.asf", broken)], true),
            (&[("07.ASF", SKELETON), ("08.asf", broken)], true),
            (&[("someone.asf", SKELETON)], true),
            (&[("07_01.asf", SKELETON), ("08.asf", SKELETON)], false),
        ];
        for (skeletons, is_found) in cases {
            let folder = folder(skeletons);
            let path = folder.path().join("07_01.amc");
            fs::write(&path, MOTION).unwrap();
            let clip = read(&path, &ReadOptions::default());
            assert_eq!(clip.is_ok(), is_found, "{skeletons:?}: {clip:?}");
        }
    }

    #[test]
    fn a_missing_skeleton_is_named_with_the_setting_that_replaces_it() {
        let folder = folder(&[("07_01.amc", MOTION)]);
        let path = folder.path().join("07_01.amc");
        let error = read(&path, &ReadOptions::default()).unwrap_err().to_string();
        let expected = "expected its skeleton 07.asf in the same folder, found 0 other .asf files; set `skeleton`";
        assert!(error.ends_with(expected), "{error}");
        let elsewhere = tempfile::NamedTempFile::new().unwrap();
        fs::write(elsewhere.path(), SKELETON).unwrap();
        let options = ReadOptions { skeleton: Some(elsewhere.path().to_owned()), ..ReadOptions::default() };
        assert_eq!(read(&path, &options).unwrap().name, "07_01");
    }

    #[test]
    fn missing_files_and_unknown_formats_are_refused() {
        let folder = folder(&[("a.fbx", ""), ("a.mp4", ""), ("empty.bvh", ""), ("empty.json", "")]);
        let message = |name: &str| read(&folder.path().join(name), &ReadOptions::default()).unwrap_err().to_string();
        assert!(message("a.mp4").contains("a.mp4: expected a recording ending in .bvh"));
        assert!(message("a.fbx").contains("convert it: blender --background"));
        assert!(message("none.bvh").contains("none.bvh: cannot be read: "));
        assert!(message("empty.bvh").contains("empty.bvh:1: expected `HIERARCHY`, found the end of the file"));
        assert!(message("empty.json").contains("empty.json:1: expected a DeepMimic clip"));
    }

    #[test]
    fn invalid_utf_8_is_replaced() {
        let folder = folder(&[]);
        let path = folder.path().join("latin1.bvh");
        let mut text = b"HIERARCHY\nROOT H\xfcfte\n{\nOFFSET 0 0 0\nCHANNELS 1 Zposition\n}\n".to_vec();
        text.extend(b"MOTION\nFrames: 2\nFrame Time: 0.1\n1\n2\n");
        fs::write(&path, text).unwrap();
        let options = ReadOptions { metres_per_unit: Some(1.0), ..ReadOptions::default() };
        assert_eq!(read(&path, &options).unwrap().skeleton.joints[0].name, "H\u{fffd}fte");
    }
}
