//! Tests: what no body can do is refused, and the remedy of the message mends it; what people really do passes.

use std::path::{Path, PathBuf};

use nalgebra::{UnitQuaternion, Vector3};

use super::*;
use crate::mocap::{ReadOptions, UpAxis, parse_deepmimic, read};
use crate::test_data;

fn walk() -> Clip {
    let text = include_str!("../../../../../scenarios/motions/humanoid3d_walk.txt");
    parse_deepmimic(text, "walk.txt", &ReadOptions::default()).unwrap().looped(3.0).unwrap()
}

fn judged(clip: &Clip) -> Judgement {
    judge(clip, 0..clip.frames.len(), &BTreeMap::new(), None).unwrap()
}

fn refusal(clip: &Clip) -> String {
    judged(clip).refusal().unwrap_or_default().to_owned()
}

/// The clip with other axes as the file's; the head is no longer up.
fn misread(true_up: UpAxis) -> Clip {
    Clip { up: (true_up, UpSource::File), ..walk() }.with_up(UpAxis::Y, UpSource::File)
}

fn places_differ_by(a: &Clip, b: &Clip) -> f64 {
    let of = |clip: &Clip| clip.joint_positions(20);
    of(a).iter().zip(of(b)).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
}

// A recording with Y or Z down, or X up, was the truth as it was.
#[test]
fn a_body_upside_down_is_turned_or_refused_with_the_axis() {
    for (true_up, name) in [(UpAxis::MinusY, "-y"), (UpAxis::X, "x"), (UpAxis::MinusZ, "-z"), (UpAxis::MinusX, "-x")] {
        let wrong = misread(true_up);
        let message = refusal(&wrong);
        assert!(message.contains(&format!("set `up = \"{name}\"`")), "{name}: {message}");
        let followed = wrong.clone().with_up(true_up, UpSource::User);
        assert_eq!(judged(&followed).findings, [], "{name}");
        assert!(places_differ_by(&followed, &walk()) < 1e-9, "{name}");
        let guessed = upright(Clip { up: (UpAxis::Y, UpSource::Guess), ..wrong }, &BTreeMap::new());
        assert!(places_differ_by(&guessed, &walk()) < 1e-9, "{name}");
        let note = guessed.notes.last().unwrap();
        assert!(note.starts_with(&format!("up axis: {name} after all, not y, because")), "{note}");
    }
    // a dog, with short legs, was stood on its tail
    let mut dog = misread(UpAxis::MinusY);
    dog.up.1 = UpSource::Guess;
    for joint in ["left_knee", "left_ankle", "right_knee", "right_ankle"].map(|name| dog.skeleton.find(name).unwrap()) {
        dog.frames.iter_mut().for_each(|frame| frame[joint].translation.vector *= 0.6);
    }
    let message = refusal(&upright(dog, &BTreeMap::new()));
    assert!(message.contains("turned upside down, and it has") && message.contains("an animal?"), "{message}");
}

// Rotations in radians made a statue that glides, and nothing was said.
#[test]
fn rotations_in_radians_are_refused() {
    let mut clip = walk();
    for frame in &mut clip.frames {
        frame.iter_mut().skip(1).for_each(|joint| joint.rotation = joint.rotation.powf(1_f64.to_radians()));
    }
    let message = refusal(&clip);
    assert!(message.contains("glides") && message.contains("in radians"), "{message}");
}

// An animated figure with raised arms, upside down for 48 s, stood on its hands.
#[test]
fn nobody_stands_on_the_hands_for_half_a_minute() {
    let mut clip = misread(UpAxis::MinusY);
    for name in ["right", "left"] {
        let joint = |part: &str| clip.skeleton.find(&format!("{name}_{part}")).unwrap();
        let (shoulder, elbow) = (joint("shoulder"), joint("elbow"));
        for frame in &mut clip.frames {
            frame[shoulder].rotation = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
            frame[elbow].rotation = UnitQuaternion::identity();
        }
    }
    assert!(!refusal(&clip).contains("the head is below the feet"), "a short handstand");
    clip.frames_per_second = 1.0;
    let message = refusal(&clip);
    assert!(message.contains("longer than anybody stands on the hands"), "{message}");
}

// Left-handed axes, and exchanged names, gave a body whose knees bend to the front.
#[test]
fn sides_that_do_not_fit_are_refused_and_both_remedies_work() {
    let (mut mirrored, mut exchanged) = (walk(), walk());
    mirrored.reflect();
    exchanged.exchange_names().unwrap();
    for wrong in [&mirrored, &exchanged] {
        let message = refusal(wrong);
        assert!(message.contains("`sides = \"mirrored\"`") && message.contains("`sides = \"exchanged\"`"), "{message}");
        // a sprinter's R.Hip at mid-thigh was a mirror image, whose remedies led into another refusal
        let mut low_hips = wrong.clone();
        for side in ["left", "right"] {
            let [hip, knee] = ["hip", "knee"].map(|part| wrong.skeleton.find(&format!("{side}_{part}")).unwrap());
            for frame in &mut low_hips.frames {
                frame[knee].translation.vector *= 0.5;
                let down = frame[hip].rotation * frame[knee].translation.vector;
                frame[hip].translation.vector += down;
            }
        }
        let message = refusal(&low_hips);
        assert!(message.starts_with("the thighs are 0.5") && message.contains("left_hip and right_hip"), "{message}");
    }
    mirrored.reflect();
    exchanged.exchange_names().unwrap();
    for mended in [mirrored, exchanged] {
        assert_eq!(judged(&mended).findings, []);
        assert!(places_differ_by(&mended, &walk()) < 1e-9);
    }
}

// The map in the message is to be pasted; and elbows and wrists were exchanged where only the shoulders were.
#[test]
fn arms_with_exchanged_names_are_refused_with_the_map_that_mends_them() {
    let clip = walk();
    let mut map = BTreeMap::new();
    let mut refused_after = |parts: &[&str], is_exchanged: bool| {
        for (part, [own, other]) in parts.iter().flat_map(|part| [(part, ["left", "right"]), (part, ["right", "left"])])
        {
            let side = if is_exchanged { other } else { own };
            map.insert(format!("{own}_{part}"), format!("{side}_{part}"));
        }
        let judgement = judge(&clip, 0..clip.frames.len(), &map, None).unwrap();
        judgement.refusal().unwrap_or_default().to_owned()
    };
    let message = refused_after(&["shoulder", "elbow", "wrist"], true);
    assert!(message.contains("left_shoulder = \"left_shoulder\""), "{message}");
    let message = refused_after(&["elbow", "wrist"], false);
    assert!(message.contains("exchanged at left_shoulder, right_shoulder:"), "{message}");
    assert_eq!(refused_after(&["shoulder"], false), "");
}

// Every fourth row at the rate of all: four times as fast.
#[test]
fn time_that_runs_too_fast_is_refused() {
    let fast = walk().at_speed(4.0);
    assert!(refusal(&fast).contains("strides a second"), "{}", refusal(&fast));
    // one kick changes the places of the legs twice
    let parts = (2..fast.frames.len()).map(|end| judged(&fast.clone().crop(0..end).unwrap()));
    assert!(parts.flat_map(|part| part.findings).all(|found| found.is_refusal || !found.text.contains("strides")));
    assert!(refusal(&walk().at_speed(0.001)).contains("as with times in milliseconds"));
    assert!(judged(&walk().at_speed(60.0)).findings.iter().any(|finding| finding.text.contains("13 m/s")));
    // every third row is missing
    let mut gappy = walk();
    let mut row = 0;
    gappy.frames.retain(|_| {
        row += 1;
        row % 3 != 0
    });
    assert!(refusal(&gappy).contains("the body moves twice as far as before and after in"), "{}", refusal(&gappy));
    // a second person in every other row
    let mut two = walk();
    for frame in two.frames.iter_mut().step_by(2) {
        frame[0].translation.vector += Vector3::new(1.0, 2.0, 0.0);
    }
    assert!(refusal(&two).contains("rows be of several people"), "{}", refusal(&two));
}

// Ankles that change places in single frames made ten strides a second.
#[test]
fn noisy_ankles_are_no_strides() {
    let mut clip = walk();
    let hips = ["right", "left"].map(|side| clip.skeleton.find(&format!("{side}_hip")).unwrap());
    for (index, frame) in clip.frames.iter_mut().enumerate().skip(40).take(7) {
        let angle = if index % 2 == 0 { 0.7 } else { -0.7 };
        for (hip, angle) in hips.into_iter().zip([angle, -angle]) {
            frame[hip].rotation = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle);
        }
    }
    let found = judged(&clip).findings;
    assert!(!found.iter().any(|finding| finding.text.contains("strides a second")), "{found:?}");
}

// A dive on the ground of its soles was to be put on the ground of its soles.
#[test]
fn sunken_feet_name_the_other_ground() {
    let template = skiagraph_core::body::shipped("actor").unwrap();
    let mut report = crate::retarget::retarget(&walk(), &template, &Default::default()).unwrap().report;
    report.out_of_reach = 0.0;
    report.foot_height.as_mut().unwrap().mean_mm = -900.0;
    for (ground, other) in [(Ground::Feet, "file"), (Ground::Recorded, "feet")] {
        let text = judge_fit(&report, ground, true).unwrap().text;
        assert!(text.contains(&format!("set `ground = \"{other}\"`")) && text.contains("`first_frame`"), "{text}");
    }
}

/// The walk, raised and moved by `rise` metres in each frame.
fn raised(rise: impl Fn(usize) -> f64) -> Clip {
    let mut clip = walk();
    for (index, frame) in clip.frames.iter_mut().enumerate() {
        frame[0].translation.z += rise(index);
    }
    clip
}

// A fall was pushed into the ground, stairs were too, and a flight was.
#[test]
fn the_ground_is_where_feet_rest_or_the_files_own() {
    assert_eq!(judged(&walk()).ground, Ground::Feet);
    assert_eq!(judged(&raised(|_| 0.4)).ground, Ground::Feet);
    let frames = walk().frames.len();
    let stairs = raised(|frame| 0.51 + 0.17 * (frame / 16) as f64);
    assert_eq!(judged(&stairs).ground, Ground::Recorded);
    let deep = raised(|frame| -2.0 + 0.17 * (frame / 16) as f64);
    assert!(matches!(judged(&deep).ground, Ground::BelowAnkles(height) if height < -1.8));
    let fall = |frame: usize| 5.0 - 4.9 * (frame as f64 / frames as f64).powi(2);
    assert_eq!(judged(&raised(fall)).ground, Ground::Recorded);
    let forced = judge(&stairs, 0..frames, &BTreeMap::new(), Some(GroundChoice::Feet)).unwrap();
    assert_eq!(forced.ground, Ground::Feet);
}

/// Walks, runs, jumps, gestures, sitting down, crouching to the floor.
const TAKES: &str = "bvh/ad_cmu_jumping_jacks.bvh bvh/ad_wave_hello.bvh bvh/cmu_3dsmax_131_01.bvh bvh/cmu_mb_01_01.bvh
    bvh/mocapbank_test.bvh cmu_asf_amc/01_01_f0001-0700.amc cmu_asf_amc/02_01.amc cmu_asf_amc/02_03.amc
    cmu_asf_amc/02_04.amc cmu_asf_amc/14_14_f0401-1100.amc cmu_asf_amc/14_24.amc cmu_asf_amc/14_27_f0001-0900.amc
    cmu_asf_amc/16_03.amc cmu_asf_amc/16_08.amc cmu_asf_amc/16_15.amc cmu_asf_amc/16_17.amc cmu_asf_amc/16_22.amc
    cmu_asf_amc/16_35.amc cmu_asf_amc/16_36.amc cmu_asf_amc/16_45.amc cmu_asf_amc/16_57.amc
    cmu_asf_amc/29_02_f1201-2340.amc cmu_asf_amc/29_07_f0061-1200.amc cmu_asf_amc/29_22_f1801-2940.amc
    cmu_asf_amc/35_02.amc cmu_asf_amc/35_08.amc cmu_asf_amc/35_34.amc cmu_asf_amc/49_01.amc
    deepmimic/humanoid3d_jump.txt deepmimic/humanoid3d_run.txt deepmimic/humanoid3d_walk.txt";

fn assert_plausible(files: &[PathBuf]) {
    for path in files {
        let clip = upright(read(path, &ReadOptions::default()).unwrap(), &BTreeMap::new());
        let judgement = judged(&clip);
        // this figure is 2.16 m tall, which is noted
        let is_tall = path.ends_with("ad_wave_hello.bvh");
        assert_eq!(judgement.findings.len(), usize::from(is_tall), "{}", path.display());
        assert!(judgement.findings.iter().all(|found| !found.is_refusal), "{}", path.display());
        assert_eq!(judgement.ground, Ground::Feet, "{}", path.display());
    }
}

#[test]
fn recordings_that_ship_are_plausible() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios/motions");
    let names = ["01_01.bvh", "humanoid3d_walk.txt", "humanoid3d_run.txt", "humanoid3d_jump.txt"];
    assert_plausible(&names.map(|name| folder.join(name)));
}

#[test]
fn real_recordings_are_plausible() {
    let files: Vec<PathBuf> =
        TAKES.split_whitespace().filter_map(|name| test_data::path(&format!("mocap/{name}"))).collect();
    assert_plausible(&files);
}
