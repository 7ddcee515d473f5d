//! Real recordings: counts, rates, heights and speeds as in the test data's manifest, and the oddities of the files.

use std::path::{Path, PathBuf};

use nalgebra::{Point3, Vector3};
use sha2::{Digest, Sha256};
use skiagraph_truth::mocap::{Clip, ReadOptions, parse_bvh, read};

fn recordings() -> Option<PathBuf> {
    crate::support::test_data("mocap")
}

fn load(path: &Path) -> Clip {
    read(path, &ReadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

fn shipped() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("scenarios/motions")
}

fn joint(clip: &Clip, name: &str) -> usize {
    clip.skeleton.find(name).unwrap_or_else(|| panic!("{} has no joint {name}", clip.name))
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Height of a joint, or of its tip if it has one: median over frames, metres.
fn median_height(clip: &Clip, name: &str) -> f64 {
    let index = joint(clip, name);
    let tip = clip.skeleton.joints[index].tip.unwrap_or_else(Vector3::zeros);
    median((0..clip.frames.len()).map(|frame| (clip.joint_frames(frame)[index] * Point3::from(tip)).z))
}

/// Mean speed of the root over the ground from frame `first` to `last`, m/s.
fn ground_speed(clip: &Clip, first: usize, last: usize) -> f64 {
    let step = |i: usize| (clip.frames[i + 1][0].translation.vector - clip.frames[i][0].translation.vector).xy().norm();
    (first..last).map(step).sum::<f64>() * clip.frames_per_second / (last - first) as f64
}

/// One row of the manifest: file, frames, mean speed, speed in the first and last sixth, pelvis and head height.
type Row = (&'static str, usize, [f64; 3], [f64; 2]);

const CMU: [Row; 20] = [
    ("49_01", 652, [0.87, 0.79, 0.85], [0.97, 1.60]),
    ("14_14_f0401-1100", 700, [0.15, 0.12, 0.15], [1.02, 1.63]),
    ("14_24", 3702, [0.18, 0.11, 0.28], [1.00, 1.62]),
    ("16_15", 471, [1.10, 1.08, 1.09], [0.98, 1.62]),
    ("16_17", 518, [0.90, 1.08, 0.92], [0.99, 1.63]),
    ("16_22", 307, [1.64, 1.66, 1.63], [0.96, 1.61]),
    ("16_35", 162, [2.78, 2.54, 2.77], [0.99, 1.62]),
    ("16_36", 189, [2.67, 2.73, 2.57], [0.98, 1.62]),
    ("16_45", 135, [3.98, 3.97, 3.99], [0.98, 1.62]),
    ("16_08", 239, [1.58, 3.45, 0.12], [0.97, 1.61]),
    ("16_57", 268, [1.32, 3.09, 0.05], [0.96, 1.60]),
    ("16_03", 410, [0.17, 0.01, 0.11], [1.00, 1.65]),
    ("02_01", 343, [1.18, 1.13, 1.16], [0.97, 1.59]),
    ("02_03", 173, [2.59, 2.20, 2.61], [0.97, 1.58]),
    ("02_04", 483, [0.18, 0.19, 0.06], [1.00, 1.61]),
    ("35_02", 387, [1.25, 1.25, 1.26], [1.01, 1.64]),
    ("35_08", 445, [1.20, 1.17, 1.22], [1.01, 1.64]),
    ("35_34", 415, [1.26, 1.25, 1.28], [1.01, 1.64]),
    ("14_27_f0001-0900", 900, [0.14, 0.20, 0.01], [0.89, 1.50]),
    ("01_01_f0001-0700", 700, [0.48, 0.08, 0.78], [1.01, 1.63]),
];

#[test]
fn every_cmu_recording_has_the_frames_speeds_and_heights_of_the_manifest() {
    let Some(folder) = recordings() else { return };
    for (name, frames, speeds, heights) in CMU {
        let clip = load(&folder.join(format!("cmu_asf_amc/{name}.amc")));
        assert_eq!(
            (clip.frames.len(), clip.frames_per_second, clip.skeleton.joints.len()),
            (frames, 120.0, 31),
            "{name}"
        );
        let (last, sixth) = (frames - 1, frames / 6);
        let measured =
            [ground_speed(&clip, 0, last), ground_speed(&clip, 0, sixth), ground_speed(&clip, last - sixth, last)];
        for (measured, expected) in measured.iter().zip(speeds) {
            // the manifest does not say how it smooths; 16_17 turns and is noisy at its end, which lengthens its path
            // by 2.4 %
            assert!((measured - expected).abs() < 0.03, "{name}: {measured:.3} m/s against {expected}");
        }
        for (joint, expected) in ["root", "head"].into_iter().zip(heights) {
            let height = median_height(&clip, joint);
            assert!((height - expected).abs() < 0.01, "{name}: {joint} at {height:.3} m against {expected}");
        }
        assert!(clip.notes.iter().all(|note| !note.contains("zero")), "{name}: {:?}", clip.notes);
    }
}

#[test]
fn every_bvh_has_the_frames_joints_and_rate_of_the_manifest_and_the_height_of_a_human() {
    let Some(folder) = recordings() else { return };
    let table = [
        ("cmu_mb_01_01", 2751, 31, 120.0, 0.0254 / 0.45, "Head"),
        ("cmu_3dsmax_131_01", 994, 31, 120.0, 0.0254 / 0.45, "Head"),
        // not life-size: 2.16 m tall in CMU's unit, the only common unit that gives a human height
        ("ad_wave_hello", 839, 27, 1.0 / 0.008342, 0.0254 / 0.45, "Head"),
        ("ad_cmu_jumping_jacks", 125, 31, 30.0, 0.0254 / 0.45, "Head"),
        ("mocapbank_test", 455, 19, 30.0, 0.01, "Head"),
    ];
    for (name, frames, joints, rate, unit, head) in table {
        let path = folder.join(format!("bvh/{name}.bvh"));
        let clip = load(&path);
        assert_eq!((clip.frames.len(), clip.skeleton.joints.len()), (frames, joints), "{name}");
        assert!((clip.frames_per_second - rate).abs() < 1e-9, "{name}: {}", clip.frames_per_second);
        let in_file_units = read(&path, &ReadOptions { metres_per_unit: Some(1.0), ..ReadOptions::default() }).unwrap();
        let guessed = clip.frames[0][0].translation.z / in_file_units.frames[0][0].translation.z;
        assert!((guessed - unit).abs() < 1e-6, "{name}: {guessed}");
        assert!(clip.notes.iter().any(|note| note.contains("unit")), "{name}: the guess is noted");
        let (hips, head) = (clip.frames[0][0].translation.z, clip.joint_positions(0)[joint(&clip, head)].z);
        let oversize = if name == "ad_wave_hello" { 1.27 } else { 1.0 };
        let (hips_m, head_m) = (hips / oversize, head / oversize);
        assert!((0.8..1.15).contains(&hips_m) && (1.2..1.8).contains(&head_m), "{name}: {hips} {head}");
    }
}

#[test]
fn a_z_up_file_with_two_rotation_orders_stands_upright_with_its_feet_level() {
    let Some(folder) = recordings() else { return };
    let clip = load(&folder.join("bvh/ad_wave_hello.bvh"));
    let (left, right, head) = (joint(&clip, "LeftFoot"), joint(&clip, "RightFoot"), joint(&clip, "Head"));
    for frame in (0..clip.frames.len()).step_by(50) {
        let p = clip.joint_positions(frame);
        assert!((p[left].z - p[right].z).abs() < 0.05 && p[head].z - p[left].z > 1.2, "frame {frame}");
    }
}

#[test]
fn mixed_rotation_orders_keep_each_arm_on_its_side() {
    // If all joints were read in one order, the arms of these files would pass through each other.
    let Some(folder) = recordings() else { return };
    let clip = load(&folder.join("bvh/cmu_3dsmax_131_01.bvh"));
    let (left, right) = (joint(&clip, "LeftWrist"), joint(&clip, "RightWrist"));
    let (hip_left, hip_right) = (joint(&clip, "LeftHip"), joint(&clip, "RightHip"));
    for frame in (0..clip.frames.len()).step_by(20) {
        let p = clip.joint_positions(frame);
        let to_left = (p[hip_left] - p[hip_right]).normalize();
        assert!((p[left] - p[right]).dot(&to_left) > 0.1, "frame {frame}: the left hand is not on the left");
    }
}

#[test]
fn deepmimic_clips_have_the_frames_rates_and_speeds_of_the_manifest_and_stand_on_the_ground() {
    for (name, frames, rate, speed) in [("walk", 39, 30.0, 0.98), ("run", 25, 30.0, 3.56), ("jump", 107, 60.0, 0.73)] {
        let clip = load(&shipped().join(format!("humanoid3d_{name}.txt")));
        assert_eq!((clip.frames.len(), clip.frames_per_second, clip.cyclic), (frames, rate, true), "{name}");
        let measured = ground_speed(&clip, 0, frames - 1);
        assert!((measured - speed).abs() < 0.01, "{name}: {measured} m/s");
        let ankles = [joint(&clip, "left_ankle"), joint(&clip, "right_ankle")];
        let lowest = (0..frames)
            .flat_map(|frame| ankles.map(|ankle| clip.joint_positions(frame)[ankle].z))
            .fold(f64::INFINITY, f64::min);
        assert!((-0.01..0.07).contains(&lowest), "{name}: the lower ankle reaches a height of {lowest} m");
    }
}

/// The offsets built into the reader agree with the humanoid of the package with the clips (which is four times as
/// large).
#[test]
fn deepmimic_offsets_and_hinges_equal_those_of_its_humanoid() {
    let Some(path) = crate::support::test_data("robots/pybullet_humanoid/humanoid.urdf") else { return };
    let robot = urdf_rs::read_file(path).unwrap();
    let clip = load(&shipped().join("humanoid3d_walk.txt"));
    for (index, joint) in clip.skeleton.joints.iter().enumerate().skip(1) {
        let urdf = robot.joints.iter().find(|other| other.name == joint.name).unwrap();
        let parent = joint.parent.map(|parent| clip.skeleton.joints[parent].name.as_str());
        assert_eq!(Some(urdf.parent.link.as_str()), parent, "{}", joint.name);
        let offset = Vector3::from(urdf.origin.xyz.0) / 4.0;
        assert!((clip.frames[0][index].translation.vector - offset).norm() < 1e-9, "{}", joint.name);
        if let urdf_rs::JointType::Revolute = urdf.joint_type {
            assert_eq!(urdf.axis.xyz.0, [0.0, 0.0, 1.0]);
            for frame in &clip.frames {
                let angle = frame[index].rotation.scaled_axis().z;
                assert!(
                    (urdf.limit.lower - 1e-9..=urdf.limit.upper + 1e-9).contains(&angle),
                    "{}: {angle}",
                    joint.name
                );
            }
        }
    }
}

#[test]
fn knees_bend_backward_in_every_format() {
    let Some(folder) = recordings() else { return };
    let cases = [
        (shipped().join("humanoid3d_run.txt"), ["right_hip", "right_knee", "right_ankle"]),
        (folder.join("cmu_asf_amc/16_35.amc"), ["rfemur", "rtibia", "rfoot"]),
        (folder.join("bvh/cmu_3dsmax_131_01.bvh"), ["RightHip", "RightKnee", "RightAnkle"]),
    ];
    for (path, [hip, knee, ankle]) in cases {
        let clip = load(&path);
        let last = clip.frames.len() - 1;
        let forward = (clip.frames[last][0].translation.vector - clip.frames[0][0].translation.vector).normalize();
        let (hip, knee, ankle) = (joint(&clip, hip), joint(&clip, knee), joint(&clip, ankle));
        let ahead = median((0..=last).map(|frame| {
            let p = clip.joint_positions(frame);
            (p[knee] - nalgebra::center(&p[hip], &p[ankle])).dot(&forward)
        }));
        assert!(ahead > 0.01, "{}: the knee is {ahead} m ahead of the line from hip to ankle", clip.name);
    }
}

#[test]
fn an_inserted_t_pose_is_removed_unless_it_is_to_be_kept() {
    let path = shipped().join("01_01.bvh");
    let kept = read(&path, &ReadOptions { keep_rest_pose: true, ..ReadOptions::default() }).unwrap();
    assert!(kept.frames.len() == 2752 && kept.has_inserted_rest_pose());
    let clip = load(&path);
    assert_eq!(clip.frames[..], kept.frames[1..]);
    assert!(clip.notes.iter().any(|note| note.contains("rest pose")), "{:?}", clip.notes);
    let Some(folder) = recordings() else { return };
    for name in ["cmu_3dsmax_131_01", "ad_wave_hello", "ad_cmu_jumping_jacks", "mocapbank_test"] {
        assert!(!load(&folder.join(format!("bvh/{name}.bvh"))).notes.iter().any(|n| n.contains("rest pose")), "{name}");
    }
}

/// The same recording in two formats, read by two parsers with two rotation conventions.
#[test]
fn legs_of_the_bvh_and_the_amc_of_cmu_01_01_agree_to_a_fifth_of_a_millimetre() {
    let Some(folder) = recordings() else { return };
    let bvh = load(&folder.join("bvh/cmu_mb_01_01.bvh"));
    let amc = load(&folder.join("cmu_asf_amc/01_01_f0001-0700.amc"));
    let same = [
        ("Hips", "root"),
        ("LeftUpLeg", "lfemur"),
        ("LeftLeg", "ltibia"),
        ("LeftFoot", "lfoot"),
        ("LeftToeBase", "ltoes"),
        ("RightUpLeg", "rfemur"),
        ("RightLeg", "rtibia"),
        ("RightFoot", "rfoot"),
        ("RightToeBase", "rtoes"),
        ("Spine", "upperback"),
        ("Spine1", "thorax"),
    ]
    .map(|(a, b)| (joint(&bvh, a), joint(&amc, b)));
    let (neck, lower_neck) = (joint(&bvh, "Neck"), joint(&amc, "lowerneck"));
    for frame in 0..amc.frames.len() {
        let (a, b) = (bvh.joint_positions(frame), amc.joint_positions(frame));
        for (i, j) in same {
            let distance = (a[i] - b[j]).norm();
            assert!(distance < 2e-4, "frame {frame}: {} is off by {distance} m", amc.skeleton.joints[j].name);
        }
        let gap = (a[neck] - b[lower_neck]).norm();
        assert!((gap - 0.1166).abs() < 2e-4, "frame {frame}: the conversion lacks the thorax, but the gap is {gap} m");
    }
}

#[test]
fn quaternions_never_change_sign_between_frames() {
    let Some(folder) = recordings() else { return };
    for file in ["cmu_asf_amc/14_24.amc", "cmu_asf_amc/16_17.amc", "bvh/cmu_mb_01_01.bvh", "bvh/ad_wave_hello.bvh"] {
        let clip = load(&folder.join(file));
        assert!(clip.frames[0].iter().all(|transform| transform.rotation.w >= 0.0), "{file}");
        for pair in clip.frames.windows(2) {
            for (a, b) in pair[0].iter().zip(&pair[1]) {
                assert!(a.rotation.coords.dot(&b.rotation.coords) >= 0.0, "{file}");
                assert!((b.rotation.norm() - 1.0).abs() < 1e-12, "{file}");
            }
        }
    }
}

#[test]
fn a_header_that_differs_from_the_rows_by_more_than_two_is_rejected() {
    let text = std::fs::read_to_string(shipped().join("01_01.bvh")).unwrap();
    let parse = |text: &str| parse_bvh(text, "01_01.bvh", &ReadOptions::default());
    let with_header = |frames: usize| parse(&text.replace("Frames: 2752", &format!("Frames: {frames}")));
    for frames in [2750, 2751, 2753, 2754] {
        let clip = with_header(frames).unwrap();
        assert_eq!(clip.frames.len(), 2752);
        let note = format!("the header declares {frames} frames, the file has 2752 rows: all rows are used");
        assert!(clip.notes.contains(&note), "{:?}", clip.notes);
    }
    assert_eq!(
        with_header(2755).unwrap_err().to_string(),
        "01_01.bvh:2939: expected 2755 rows, as declared by `Frames: 2755`, found the end of the file after 2752 rows"
    );
    assert!(with_header(2749).is_err());
    let half = &text[..text.len() / 2];
    let error = parse(half).unwrap_err().to_string();
    assert!(error.starts_with("01_01.bvh:"), "a truncated download: {error}");
    let with_dropout: Vec<&str> = text.lines().collect();
    let zeros = ["0"; 96].join(" ");
    let lost = [&with_dropout[..1000], &[zeros.as_str(); 3], &with_dropout[1003..]].concat().join("\n");
    let (whole, repaired) = (parse(&text).unwrap(), parse(&lost).unwrap());
    assert!(repaired.notes.iter().any(|note| note.contains("frames 814-816 of the file")), "{:?}", repaired.notes);
    let distance = |frame: usize| {
        let pairs = whole.joint_positions(frame).into_iter().zip(repaired.joint_positions(frame));
        pairs.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
    };
    assert!(
        (0..whole.frames.len()).all(|frame| distance(frame) < 0.01),
        "three missing frames are not restored to 1 cm"
    );
}

#[test]
fn a_walk_repeats_without_a_seam() {
    for name in ["walk", "run", "jump"] {
        let clip = load(&shipped().join(format!("humanoid3d_{name}.txt")));
        let period = clip.frames.len() - 1;
        let looped = clip.looped(8.0).unwrap();
        assert!(looped.duration() >= 8.0 && looped.duration() < 8.0 + 1.0 / clip.frames_per_second);
        // Greatest change of velocity of any joint, metres per frame: not greater at the seams than within the
        // recording.
        let change_of_velocity = |clip: &Clip, frame: usize| {
            let [a, b, c] = [frame - 1, frame, frame + 1].map(|f| clip.joint_positions(f));
            (0..a.len()).map(|j| ((c[j] - b[j]) - (b[j] - a[j])).norm()).fold(0.0, f64::max)
        };
        let within = (1..period).map(|frame| change_of_velocity(&clip, frame)).fold(0.0, f64::max);
        let seams = (1..looped.frames.len() / period).flat_map(|k| k * period - 8..k * period + 2);
        let at_seams = seams.map(|frame| change_of_velocity(&looped, frame)).fold(0.0, f64::max);
        assert!(at_seams < within, "{name}: {at_seams} m at a seam, {within} m within");
        let travelled = looped.frames[4 * period][0].translation.vector - looped.frames[0][0].translation.vector;
        let step = clip.frames[period][0].translation.vector - clip.frames[0][0].translation.vector;
        assert!((travelled.xy() - 4.0 * step.xy()).norm() < 1e-9 && travelled.z.abs() < 1e-9, "{name}: {travelled:?}");
    }
}

#[test]
fn shipped_recordings_have_the_hashes_of_their_readme() {
    let readme = std::fs::read_to_string(shipped().join("README.md")).unwrap();
    for name in ["humanoid3d_walk.txt", "humanoid3d_run.txt", "humanoid3d_jump.txt", "01_01.bvh"] {
        let bytes = std::fs::read(shipped().join(name)).unwrap();
        let hash: String = Sha256::digest(&bytes).iter().map(|byte| format!("{byte:02x}")).collect();
        assert!(readme.contains(&format!("{hash}  {name}")), "{name}: {hash}");
    }
    if let Some(original) = crate::support::test_data("mocap/bvh/cmu_mb_01_01.bvh") {
        assert_eq!(std::fs::read(original).unwrap(), std::fs::read(shipped().join("01_01.bvh")).unwrap());
    }
}
