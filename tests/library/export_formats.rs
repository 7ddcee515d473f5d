//! Every export is read back by the usual reader of its format (`tests/interop/read_exports.py`) and compared with the
//! set.

use std::fs;
use std::path::Path;
use std::process::Command;
use std::sync::LazyLock;

use nalgebra::{Isometry3, Translation3, UnitQuaternion};
use skiagraph::artefacts::Destination;
use skiagraph::common::NoProgress;
use skiagraph::rendering::{RenderOptions, render};
use skiagraph::scenario::ScenarioFile;
use skiagraph_core::body::{KeypointLayout, shipped};
use skiagraph_core::camera::{Camera, CameraFile, CameraFileFormat, read_cameras};
use skiagraph_set::{BenchmarkSet, EXPORT_FORMATS, ExportFormat, ExportWatch, export};
use skiagraph_truth::observing::{KeypointSettings, ObservationSettings};

const FRAMES: usize = 4;
const WATCH: ExportWatch<'_> = ExportWatch { tick: &|| (), stop: &|| false };

static SET: LazyLock<(BenchmarkSet, tempfile::TempDir)> = LazyLock::new(|| {
    let directory = tempfile::tempdir().unwrap();
    (write_set(directory.path()), directory)
});

fn write_set(directory: &Path) -> BenchmarkSet {
    let camera = |name, eye, distortion| crate::made_up_set::camera(name, eye, distortion, [90, 70]);
    // names that pandas takes for nothing and for a number
    let ideal = camera("NA", [3.0, 0.4, 1.3], [0.0; 5]);
    let lens = camera("lens", [-1.0, 2.8, 1.6], [-0.18, 0.06, 0.002, -0.001, -0.01]);
    let near = camera("007", [1.0, -1.1, 0.7], [0.1, -0.02, 0.0, 0.0, 0.0]);
    let root = |frame: usize| {
        let turn = UnitQuaternion::from_euler_angles(0.1, 0.05 * frame as f64, 0.7 * frame as f64);
        Isometry3::from_parts(Translation3::new(0.05 * frame as f64, 0.0, 1.0), turn)
    };
    let angle = |frame: usize, i: usize| 0.2 * f64::from(i as u32 * 7 + frame as u32 * 3).sin();
    let motion = crate::made_up_set::motion(&shipped("actor").unwrap(), FRAMES, 60.0, root, angle);
    let exact = KeypointSettings::exact(KeypointLayout::Coco17);
    let found = KeypointSettings { white_percent: 1.0, missing: 0.3, confidence_noise: 0.2, ..exact };
    let observation = ObservationSettings { keypoints: Some(found), ..ObservationSettings::default() };
    let cameras = vec![ideal, lens, near];
    let set = crate::made_up_set::assemble_observed("to be exported", cameras, &motion, &observation);
    set.write(directory).unwrap();
    BenchmarkSet::read(directory).unwrap()
}

fn exported(format: ExportFormat) -> tempfile::TempDir {
    let out = tempfile::tempdir().unwrap();
    export(&SET.0, format, out.path(), WATCH).unwrap();
    let readme = fs::read_to_string(out.path().join("README.txt")).unwrap();
    assert!(readme.contains("to be exported") && readme.contains(&SET.0.blind.set_hash));
    out
}

/// Exports, and reads with the format's usual reader; skipped and counted if that is not installed.
fn read_back(format: ExportFormat) {
    let out = exported(format);
    read_back_from(format, out.path(), SET.1.path());
}

fn read_back_from(format: ExportFormat, out: &Path, set: &Path) {
    let Some(python) = crate::support::python_with_numpy() else { return };
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/interop/read_exports.py");
    let answer = Command::new(python).arg(script).arg(format.name()).args([out, set]).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    if answer.status.code() == Some(77) {
        return crate::support::skip(&format!(
            "no reader of {} is installed: {}",
            format.name(),
            text(&answer.stdout).trim()
        ));
    }
    assert!(answer.status.success(), "{}{}", text(&answer.stdout), text(&answer.stderr));
}

macro_rules! read_back_by {
    ($($test:ident: $format:ident,)*) => {
        $(#[test] fn $test() { read_back(ExportFormat::$format); })*

        #[test]
        fn every_format_is_read_back() {
            let tested = [$(ExportFormat::$format),*];
            assert_eq!(EXPORT_FORMATS.map(|(format, ..)| format).to_vec(), tested);
        }
    };
}

read_back_by! {
    pycocotools_reads_coco: Coco,
    opencv_reads_its_yaml: OpenCv,
    numpy_reads_npz: Npz,
    bvhio_reads_bvh: Bvh,
    opensim_reads_trc: Trc,
    ezc3d_and_c3d_read_c3d: C3d,
    pycolmap_reads_colmap: Colmap,
    mlcroissant_reads_croissant: Croissant,
    webdataset_reads_webdataset: WebDataset,
    evo_reads_tum: Tum,
    numpy_reads_humaneva: HumanEva,
    python_reads_openpose: OpenPose,
    opencv_reads_pose2sim: Pose2Sim,
    numpy_reads_anipose: Anipose,
    opencv_reads_caliscope: Caliscope,
}

#[test]
fn pipelines_of_keypoints_need_a_set_with_keypoints() {
    let body = shipped("actor").unwrap();
    let motion = crate::made_up_set::motion(&body, FRAMES, 60.0, |_| Isometry3::identity(), |_, _| 0.0);
    let cameras = vec![crate::made_up_set::camera("one", [3.0, 0.4, 1.3], [0.0; 5], [90, 70])];
    let set = crate::made_up_set::assemble("without keypoints", cameras, &motion);
    for format in [ExportFormat::OpenPose, ExportFormat::Pose2Sim, ExportFormat::Anipose, ExportFormat::Caliscope] {
        let message = export(&set, format, tempfile::tempdir().unwrap().path(), WATCH).unwrap_err().to_string();
        assert!(message.contains(format.name()) && message.contains("[observation.keypoints]"), "{message}");
    }
}

#[test]
fn webdataset_reads_the_truth_images_of_a_set() {
    let folder = tempfile::tempdir().unwrap();
    let [set, shards] = ["set", "shards"].map(|name| folder.path().join(name));
    let small = [
        "motion.loop_to_s=0.1",
        "rig.ring.count=3",
        "rig.ring.size_px=[80, 60]",
        "truth_images=[\"depth\", \"parts\"]",
    ];
    let file = ScenarioFile::built_in(&small.map(str::to_owned)).unwrap();
    let to = Destination { path: &set, force: false };
    let (drawn, _) = render(&file, None, to, &RenderOptions::default(), &NoProgress).unwrap();
    std::fs::create_dir(&shards).unwrap();
    export(&drawn, ExportFormat::WebDataset, &shards, WATCH).unwrap();
    read_back_from(ExportFormat::WebDataset, &shards, &set);
}

#[test]
fn exported_cameras_are_imported_unchanged() {
    let set = &SET.0;
    // NAME: a file a camera; the tolerance of HumanEva's is that of its decimals
    for (format, file_format, names, tolerance) in [
        (ExportFormat::OpenCv, CameraFileFormat::OpenCv, ["NAME.yml", ""], 1e-9),
        (ExportFormat::HumanEva, CameraFileFormat::HumanEva, ["Calibration_Data/NAME.cal", ""], 1e-6),
        (ExportFormat::Anipose, CameraFileFormat::Anipose, ["calibration.toml", ""], 1e-9),
        (ExportFormat::Pose2Sim, CameraFileFormat::Anipose, ["calibration/Calib.toml", ""], 1e-9),
        (ExportFormat::Caliscope, CameraFileFormat::Caliscope, ["camera_array.toml", ""], 1e-9),
        (ExportFormat::Colmap, CameraFileFormat::Colmap, ["cameras.txt", "images.txt"], 1e-9),
    ] {
        let out = exported(format);
        let read = |camera: &str, options: &CameraFile| {
            let paths = names.iter().filter(|name| !name.is_empty()).map(|name| name.replace("NAME", camera));
            let texts: Vec<String> = paths.map(|path| fs::read_to_string(out.path().join(path)).unwrap()).collect();
            let texts: Vec<&str> = texts.iter().map(String::as_str).collect();
            assert_eq!(CameraFileFormat::from_texts(&texts), Some(file_format));
            read_cameras(&texts, file_format, options).unwrap()
        };
        let single = names[0].contains("NAME");
        let whole = if single { Vec::new() } else { read("", &CameraFile::default()) };
        for (index, camera) in set.blind.rig.cameras.iter().enumerate() {
            let size_px = Some([camera.pinhole.width, camera.pinhole.height]);
            let options = CameraFile { name: Some(camera.name.clone()), size_px, ..CameraFile::default() };
            let found = if single { read(&camera.name, &options).remove(0) } else { whole[index].clone() };
            // lenses are taken out of Pose2Sim's keypoints
            let is_ideal = format == ExportFormat::Pose2Sim;
            let camera =
                Camera { distortion: if is_ideal { found.distortion } else { camera.distortion }, ..camera.clone() };
            assert!(
                (is_ideal || found.name == camera.name) && found.distortion == camera.distortion,
                "{format:?}: {found:?}"
            );
            let pose = |camera: &Camera| camera.camera_from_world.to_homogeneous();
            let off = (pose(&camera) - pose(&found)).amax();
            let matrix = |camera: &Camera| nalgebra::Matrix3::from_row_slice(camera.opencv_matrix().as_flattened());
            let off = (matrix(&camera) - matrix(&found)).amax().max(off);
            assert!(off < tolerance, "{format:?} {}: {off:e}", camera.name);
            for marker in set.truth.ground_truth.frames.iter().flat_map(|frame| frame.markers.iter().flatten()) {
                let (a, b) = (camera.project(marker).unwrap(), found.project(marker).unwrap());
                assert!((a - b).norm() < 1e-3, "{file_format:?} {}: {a} {b}", camera.name);
            }
        }
    }
}

#[test]
fn an_existing_file_is_not_overwritten_and_an_export_can_be_stopped() {
    let out = tempfile::tempdir().unwrap();
    let stopped = export(&SET.0, ExportFormat::Coco, out.path(), ExportWatch { tick: &|| (), stop: &|| true });
    assert!(stopped.unwrap_err().to_string().contains("stopped"));
    fs::write(out.path().join("root.txt"), "mine").unwrap();
    fs::remove_file(out.path().join("README.txt")).unwrap();
    let refused = export(&SET.0, ExportFormat::Tum, out.path(), WATCH).unwrap_err().to_string();
    assert!(refused.contains("root.txt: cannot write"), "{refused}");
    assert_eq!(fs::read(out.path().join("root.txt")).unwrap(), b"mine");
}
