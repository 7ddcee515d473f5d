//! What the mutator starts from: files of this repository, files of the shared recordings and robots if there are any,
//! and a set and a model that are made here. Recordings are cut to a few frames.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use skiagraph::artefacts::Destination;
use skiagraph::common::NoProgress;
use skiagraph::rendering::{RenderOptions, render};
use skiagraph::runs::{TrackOptions, track_set};
use skiagraph::scenario::{ScenarioFile, TrackerSettings};
use skiagraph::train::{LearnedFrom, LearnedModel, ModelFacts};
use skiagraph_core::body::{Humanoid, Motion};
use skiagraph_core::npz::{Array, Npz};
use skiagraph_track::motion_model::gpdm_graph::{GpdmGraph, GraphSettings};

use super::support::test_data;
use super::targets::DIVIDER;
use super::{c3d, glb};

const SKELETON: &str = ":version 1.10\n:units\n mass 1.0\n length 0.45\n angle deg\n:root\n order TX TY TZ RX RY RZ\n axis XYZ\n \
    position 0 0 0\n orientation 0 0 0\n:bonedata\n begin\n id 1\n name femur\n direction 0 -1 0\n length 7.1\n \
    axis 0 0 20 XYZ\n dof rx ry rz\n end\n:hierarchy\n begin\n root femur\n end\n";
const MOTION: &str =
    ":DEGREES\n1\nroot 9.3 17.8 -17.3 -2 -7.5 -3.2\nfemur 1 2 3\n2\nroot 9 17 -17 -2 -7 -3\nfemur 1 2 4\n";
const OBJ: &str = "# a quad\nv 0 0 0\nv 1 0 0\nv 1 1 0.5\nvn 0 0 1\nv 0 1 0.5\nf 1/1/1 2//1 3 -1\n";
const STL: &str = "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 .5\nendloop\nendfacet\nendsolid s\n";
const COLLADA: &str = "<COLLADA><asset><unit meter=\"0.01\"/></asset><library_geometries><geometry id=\"g\"><mesh><source id=\"s\">\
    <float_array id=\"a\" count=\"12\">0 0 0 1 0 0 1 1 0 0 1 0</float_array><technique_common><accessor count=\"4\" stride=\"3\"/>\
    </technique_common></source><vertices id=\"v\"><input semantic=\"POSITION\" source=\"#s\"/></vertices><polylist count=\"1\">\
    <input semantic=\"VERTEX\" source=\"#v\" offset=\"0\"/><vcount>4</vcount><p>0 1 2 3</p></polylist></mesh></geometry>\
    </library_geometries><library_visual_scenes><visual_scene id=\"o\"><node><rotate>0 0 1 90</rotate><scale>2 1 1</scale>\
    <instance_geometry url=\"#g\"/></node></visual_scene></library_visual_scenes></COLLADA>";

/// Camera files of other programs, each with the other half of its format.
const CAMERA_FILES: [[&str; 2]; 6] = [
    [
        "[cam_0]\nname = \"a\"\nsize = [640.0, 480.0]\nmatrix = [[600.0, 0, 320], [0, 600, 240], [0, 0, 1]]\ndistortions = [0, 0, 0, 0, 0]\n\
         rotation = [1.2, 0, 0]\ntranslation = [0, 1, 4.5]\nfisheye = false\n[metadata]\ncharuco_square_size = 39\n",
        "",
    ],
    [
        "# lenses\n1 OPENCV 640 480 600 600 320 240 0.1 0 0 0\n2 SIMPLE_RADIAL 640 480 600 320 240 0.1\n",
        "1 0.7 -0.7 0 0 0 1 4 1 a/1.png\n1 2 -1\n2 0.7 -0.7 0 0 0 1 5 2 b/1.png\n\n",
    ],
    [
        "names: [\"01\"]\nK_01: !!opencv-matrix\n  rows: 3\n  cols: 3\n  data: [600, 0, 320, 0, 600, 240, 0, 0, 1]\nH_01: 480\nW_01: 640\n",
        "R_01: [1.2, 0, 0]\nT_01: [0, 1, 4.5]\n",
    ],
    [
        "intrinsicMatrix: [[600, 0, 0], [0, 600, 0], [320, 240, 1]]\nR: [[1, 0, 0], [0, 0, 1], [0, -1, 0]]\nT: [0, 1, 4]\n",
        "",
    ],
    [
        "{\"intrinsics\": {\"1\": {\"calibration_matrix\": [[600, 0, 320], [0, 600, 240], [0, 0, 1]], \"distortion\": [0, 0, 0, 0, 0]}}, \
         \"extrinsics\": {\"S1\": {\"1\": {\"R\": [[1, 0, 0], [0, 0, -1], [0, 1, 0]], \"t\": [[0], [1000], [4500]]}}}}",
        "",
    ],
    [
        "{\"1\": {\"R\": [[1, 0, 0], [0, 0, -1], [0, 1, 0]], \"t\": [0, 1, 4], \"f\": [600, 600], \"c\": [320, 240]}}",
        "",
    ],
];

/// The seeds of a target: at least one; except for models, at most 64 KiB each.
pub(crate) fn seeds_for(target: &str) -> Vec<Vec<u8>> {
    let shared = |folder: &str, extensions: &[&str]| match test_data(folder) {
        Some(folder) => files_below(&folder, extensions),
        None => Vec::new(),
    };
    let repository = |folder: &str, extensions: &[&str]| {
        files_below(&Path::new(env!("CARGO_MANIFEST_DIR")).join(folder), extensions)
    };
    let seeds: Vec<Vec<u8>> = match target {
        "bvh" => [repository("scenarios/motions", &["bvh"]), shared("mocap/bvh", &["bvh"])]
            .concat()
            .iter()
            .map(|bytes| short_bvh(bytes))
            .collect(),
        "asf" => [vec![SKELETON.into()], shared("mocap/cmu_asf_amc", &["asf"])].concat(),
        "amc" => {
            let skeletons = [vec![SKELETON.into()], shared("mocap/cmu_asf_amc", &["asf"])].concat();
            let motions = shared("mocap/cmu_asf_amc", &["amc"]);
            let motions =
                [vec![MOTION.into()], motions.iter().map(|motion| first_lines(motion, 100)).collect()].concat();
            // every skeleton of the CMU database has the same bones
            motions
                .iter()
                .enumerate()
                .map(|(i, m)| [&skeletons[usize::from(i > 0)], &[DIVIDER][..], m].concat())
                .collect()
        }
        "deepmimic" => repository("scenarios/motions", &["txt"]).iter().map(|bytes| short_deepmimic(bytes)).collect(),
        "amass" => {
            let one = |shape: &[usize], value: f64| Array::new(shape, vec![value; shape.iter().product()]);
            let of_width = |name: &str, width: usize| {
                let mut npz = Npz::from_iter([(name, one(&[3, width], 0.1)), ("trans", one(&[3, 3], 0.5))]);
                npz.push("mocap_framerate", Array::new(&[], vec![60.0]));
                npz.push("gender", Array::names(["male"]));
                npz.push("betas", one(&[4], 0.2));
                npz.push("v_template", one(&[5, 3], 0.3));
                npz.push("shapedirs", one(&[5, 3, 2], 0.1));
                npz.push("J_regressor", one(&[22, 5], 0.2));
                npz.to_bytes("f").unwrap()
            };
            vec![of_width("poses", 156), of_width("poses", 72), of_width("pose", 66)]
        }
        "urdf" => [repository("robots", &["urdf"]), shared("robots", &["urdf"])].concat(),
        "obj" => vec![OBJ.into()],
        "stl" => vec![STL.into(), [&[0_u8; 80][..], &[1, 0, 0, 0], &[7; 50]].concat()],
        "collada" => [vec![COLLADA.into()], shared("robots", &["dae"])].concat(),
        "c3d" => {
            let (labels, frames) = standing_actor();
            vec![
                c3d::bytes(&labels, &frames, 60.0, Some("+Z"), c3d::Numbers::IntelFloats),
                c3d::bytes(&labels, &frames, 60.0, None, c3d::Numbers::IntelWhole),
                c3d::bytes(&labels, &frames, 60.0, None, c3d::Numbers::DecFloats),
                c3d::bytes(&labels, &frames, 60.0, None, c3d::Numbers::SgiFloats),
            ]
        }
        "trc" => {
            let (labels, frames) = standing_actor();
            let names = labels.join("\t\t\t");
            let mut text = format!("PathFileType\t4\nDataRate\tUnits\n60\tmm\nFrame#\tTime\t{names}\n\t\tX1\tY1\tZ1\n");
            for frame in &frames {
                let places = frame.iter().flatten().map(|[x, y, z]| format!("{x}\t{y}\t{z}")).collect::<Vec<_>>();
                text.push_str(&format!("1\t0\t{}\n", places.join("\t")));
            }
            vec![text.into_bytes()]
        }
        "gltf" => {
            let mut small = skiagraph_core::body::shipped_skin("person_coarse").unwrap();
            small.triangles.truncate(300);
            vec![glb::bytes(&small)]
        }
        "scenario" => {
            let overrides = b"\xffseed=3\nrig.ring.count=2\ntracker.frozen={}\nparticles=7\nkernel.min={factor=1.0}\n";
            repository("scenarios", &["toml"]).into_iter().map(|text| [text.as_slice(), overrides].concat()).collect()
        }
        "manifest" => generated(&["set/set.toml"]),
        "cameras" => generated(&["set/cameras.json", "set/truth/props.json"]),
        "camera_files" => {
            let own = CAMERA_FILES.map(|[one, other]| [one.as_bytes(), &[DIVIDER], other.as_bytes()].concat());
            [own.to_vec(), shared("cameras", &["yml", "txt"])].concat()
        }
        "body" => generated(&["set/start/body.json", "set/truth/actor.json"]),
        "npz" => {
            generated(&["set/start/spread.npz", "set/truth/truth.npz", "set/truth/recording.npz", "run/search.npz"])
        }
        "poses" => generated(&["run/poses.npz"]),
        "model" => generated(&["a.model"]),
        other => panic!("no seeds for {other}"),
    };
    assert!(!seeds.is_empty(), "{target}");
    seeds
}

/// The first 64 KiB of all files below a folder with one of these extensions, in order of their paths.
fn files_below(folder: &Path, extensions: &[&str]) -> Vec<Vec<u8>> {
    let is_seed = |file: &String| {
        let extension = Path::new(file).extension().and_then(|e| e.to_str()).unwrap_or_default();
        extensions.contains(&extension.to_ascii_lowercase().as_str())
    };
    let found = skiagraph_core::input::files_below(folder).unwrap().into_iter().filter(is_seed);
    found.map(|file| fs::read(folder.join(file)).unwrap().into_iter().take(1 << 16).collect()).collect()
}

type Frame = Vec<Option<[f64; 3]>>;

/// Three frames of the standing actor's landmarks, millimetres.
fn standing_actor() -> (Vec<String>, Vec<Frame>) {
    let body = skiagraph_core::body::shipped("actor").unwrap();
    let markers = body.markers(&body.link_frames(&body.zero_pose()));
    let labels = skiagraph_core::body::LANDMARKS.map(|landmark| landmark.name().to_owned()).to_vec();
    let frame = markers.iter().map(|place| place.map(|p| [1000.0 * p.x, 1000.0 * p.y, 1000.0 * p.z + 900.0])).collect();
    (labels, vec![frame; 3])
}

fn first_lines(text: &[u8], count: usize) -> Vec<u8> {
    text.split_inclusive(|byte| *byte == b'\n').take(count).flatten().copied().collect()
}

/// The skeleton and three frames of a BVH file, with the header changed to match.
fn short_bvh(bytes: &[u8]) -> Vec<u8> {
    let text = String::from_utf8_lossy(bytes);
    let lines: Vec<&str> = text.lines().collect();
    let Some(motion) = lines.iter().position(|line| line.trim() == "MOTION") else { return bytes.to_vec() };
    let kept = lines.iter().take(motion + 6).map(|line| if line.starts_with("Frames:") { "Frames: 3" } else { line });
    kept.collect::<Vec<_>>().join("\n").into_bytes()
}

/// Five frames of a DeepMimic clip.
fn short_deepmimic(bytes: &[u8]) -> Vec<u8> {
    let text = String::from_utf8_lossy(bytes);
    let rows: Vec<&str> = text.lines().take(9).collect();
    format!("{}\n]}}", rows.join("\n").trim_end_matches(',')).into_bytes()
}

/// Files of a set, a run and a model, which are made once.
fn generated(files: &[&str]) -> Vec<Vec<u8>> {
    static FOLDER: OnceLock<tempfile::TempDir> = OnceLock::new();
    let folder = FOLDER.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        let text = "schema = \"skiagraph.scenario/1\"\nname = \"a\"\n[motion]\nclip = \"embedded:walk\"\nlast_frame = 3\n[[prop]]\n\
                    name = \"p\"\nshape = { sphere = { radius_m = 0.1 } }\nplace_m = [2, 2, 0.1]\n[rig.ring]\ncount = 2\nsize_px = [80, 60]\n";
        let scenario = ScenarioFile::parse(text, "a.toml", PathBuf::new(), &[]).unwrap();
        let to = |name: &str| folder.path().join(name);
        let (set, run) = (to("set"), to("run"));
        let to_set = Destination { path: &set, force: false };
        render(&scenario, None, to_set, &RenderOptions::default(), &NoProgress).unwrap();
        let tracker =
            TrackerSettings::default().overridden(&["particles=4".to_owned(), "layers=2".to_owned()]).unwrap();
        let to_run = Destination { path: &run, force: false };
        track_set(&set, &tracker, &[0, 1], TrackOptions::default(), to_run, &NoProgress).unwrap();
        fs::write(to("a.model"), small_model()).unwrap();
        folder
    });
    files.iter().map(|file| fs::read(folder.path().join(file)).unwrap()).collect()
}

/// A model of two short motions, trained for a single round.
fn small_model() -> Vec<u8> {
    let body = Humanoid::tracker25().unwrap();
    let pose = |t: usize, phase: f64| {
        let mut pose = body.zero_pose();
        let angles = pose.joint_angles.iter_mut().enumerate();
        angles.for_each(|(i, a)| *a = 0.2 * (0.3 * t as f64 + i as f64 + phase).sin());
        pose
    };
    let motion = |phase| Motion { frames_per_second: 60.0, poses: (0..36).map(|t| pose(t, phase)).collect() };
    let mut settings = GraphSettings { clip_s: 0.2, threshold_per_joint: 1e-9, ..GraphSettings::default() };
    settings.training.rounds = 1;
    let graph = GpdmGraph::learn(&body, &[motion(0.0), motion(1.0)], &settings).unwrap();
    let from = |clip: &str| LearnedFrom {
        clip: clip.to_owned(),
        sha256: None,
        first_frame: Some(3),
        last_frame: None,
        frames: 36,
        poses_sha256: String::new(),
    };
    let facts = ModelFacts::new(&body, 60.0, vec![from("one"), from("two")], settings);
    LearnedModel { facts, body, graph, fingerprints: vec![] }.to_bytes().unwrap()
}
