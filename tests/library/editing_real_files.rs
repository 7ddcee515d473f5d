//! Takes joined by transitions in the shipped scenarios: planted feet in the seams, and how fast joints turn.

use std::path::Path;

use skiagraph::prepare::PreparedScene;
use skiagraph::scenario::ScenarioFile;
use skiagraph_core::body::Motion;
use skiagraph_core::contact::{ContactRule, GroundContacts, GroundQuality};

fn scenario(name: &str) -> ScenarioFile {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/editing").join(name);
    ScenarioFile::open(&path, &[]).unwrap()
}

/// Greatest speed of every angle, rad/s.
fn greatest_speeds(motion: &Motion) -> Vec<f64> {
    let mut greatest = vec![0.0_f64; motion.poses[0].joint_angles.len()];
    for pair in motion.poses.windows(2) {
        let step = (&pair[1].joint_angles - &pair[0].joint_angles).abs() * motion.frames_per_second;
        greatest.iter_mut().zip(&step).for_each(|(max, speed)| *max = max.max(*speed));
    }
    greatest
}

#[test]
fn a_walk_of_529_frames_from_four_takes_has_planted_feet_and_no_joint_faster_than_in_its_sources() {
    let Some(folder) = crate::support::test_data("mocap") else { return };
    let file = scenario("long_walk.toml");
    let scene = PreparedScene::new(&file, Some(&folder)).unwrap();
    assert_eq!((scene.frames(), scene.seams.len()), (529, 3));
    assert!(scene.seams.iter().all(|seam| seam.distance_m < 0.06), "{:?}", scene.seams);
    let (body, motion) = (&scene.ground_truth.actor, scene.ground_truth.motion());
    let contacts = GroundContacts::from_motion(body, &motion, &ContactRule::default()).unwrap();
    let quality = GroundQuality::from_contacts(&contacts);
    assert!(quality.skate_mm_per_s < 20.0 && quality.penetration_mm < 0.5, "{quality}");
    for foot in &contacts.feet {
        for stance in foot.stances() {
            // the slip of single frames may be greater, when the lowest point passes from one solid of the foot to the
            // next
            let slips = foot.frames[stance.clone()].iter().map(|frame| 1000.0 * frame.slip_m_per_s());
            let skate = slips.sum::<f64>() / stance.len() as f64;
            assert!(skate < 20.0, "{} skates {skate:.1} mm/s in frames {stance:?}", foot.name);
        }
    }
    let mut sources = vec![0.0_f64; body.degrees_of_freedom.len()];
    for (_, take) in file.scenario.motion.takes("motion") {
        let mut alone = file.clone();
        alone.scenario.motion = take;
        let source = PreparedScene::new(&alone, Some(&folder)).unwrap().ground_truth.motion();
        sources.iter_mut().zip(greatest_speeds(&source)).for_each(|(max, speed)| *max = max.max(speed));
    }
    for ((angle, source_max), found) in body.degrees_of_freedom.iter().zip(&sources).zip(greatest_speeds(&motion)) {
        assert!(found <= source_max + 1e-6, "{}: {found:.4} rad/s, {source_max:.4} in the sources", angle.name);
    }
}

#[test]
fn walking_jogging_stopping_and_gesturing_takes_of_two_subjects_become_one_motion() {
    let Some(folder) = crate::support::test_data("mocap") else { return };
    let scene = PreparedScene::new(&scenario("walk_jog_stop_gesture.toml"), Some(&folder)).unwrap();
    assert_eq!((scene.seams.len(), scene.sources.len()), (3, 4));
    let (body, motion) = (&scene.ground_truth.actor, scene.ground_truth.motion());
    let quality =
        GroundQuality::from_contacts(&GroundContacts::from_motion(body, &motion, &ContactRule::default()).unwrap());
    assert!(quality.skate_mm_per_s < 20.0, "{quality}");
    let speed = |frames: std::ops::Range<usize>| {
        let at = |frame: usize| motion.poses[frame].world_from_root.translation.vector.xy();
        (at(frames.end) - at(frames.start)).norm() * motion.frames_per_second / frames.len() as f64
    };
    let [first, second, third] = &scene.seams[..] else { panic!("three seams") };
    assert!((0.8..1.5).contains(&speed(0..first.first)), "it walks");
    assert!(speed(first.end..second.first) > 2.0, "then it jogs");
    assert!(speed(third.end..motion.poses.len() - 1) < 0.05, "then it stands");
}

#[test]
fn the_built_in_walk_along_a_curve_is_529_frames_long_and_differs_between_seeds() {
    let file = scenario("embedded.toml");
    let scene = PreparedScene::new(&file, None).unwrap();
    assert_eq!(scene.frames(), 529);
    let mut other = file.clone();
    if let Some(variation) = &mut other.scenario.motion.variation {
        variation.seed = 2;
    }
    let (one, two) = (scene.ground_truth.motion(), PreparedScene::new(&other, None).unwrap().ground_truth.motion());
    assert_ne!(one.poses[300], two.poses[300]);
    let turned = one.poses[528].heading().unwrap() - one.poses[0].heading().unwrap();
    assert!(turned.abs() > 1.5, "{turned}");
}
