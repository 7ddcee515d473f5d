use nalgebra::{Isometry3, Point3};

use super::super::super::gpdm_graph::GraphSettings;
use super::*;
use skiagraph_core::body::Motion;
use skiagraph_core::rng::{Purpose, normal, stream};

/// Feet that stand firmly below 0.2 m and are loose above 0.3 m.
fn rock() -> Option<Footing> {
    Footing::with_knots(&Humanoid::tracker25().unwrap(), &[(0.0, 0.0), (0.2, 0.0), (0.3, 1e6)])
}

/// A body that swings all its joints over a left foot whose middle stays at (0.4, -0.2, 0.05) without rotation, with
/// its right foot in the air.
fn on_one_leg(body: &Humanoid, footing: &Footing, frames: usize) -> Motion {
    let knee = body.find_degree_of_freedom("right_knee_flexion").unwrap();
    let left = |pose: &Pose| footing.feet(body, pose).places()[0];
    let mut poses: Vec<Pose> = Vec::new();
    for t in 0..frames {
        let mut pose = body.zero_pose();
        let angles = pose.joint_angles.iter_mut().enumerate();
        angles.for_each(|(i, angle)| *angle = 0.1 + 0.08 * (0.15 * t as f64 + 0.7 * i as f64).sin());
        pose.joint_angles[knee] = 1.6 + 0.1 * (0.15 * t as f64).sin();
        let turned = poses
            .last()
            .map_or(0.0, |before| footing.feet(body, before).steps_to(&footing.feet(body, &pose))[0].turned);
        pose.world_from_root = Isometry3::rotation(Vector3::z() * -turned) * pose.world_from_root;
        pose.world_from_root.translation.vector += Vector3::new(0.4, -0.2, 0.05) - left(&pose).translation.vector;
        poses.push(pose);
    }
    Motion { frames_per_second: 60.0, poses }
}

fn dynamics(footing: Option<Footing>) -> RootDynamics {
    RootDynamics { footing, noise: PlanarStep { forward: 0.05, left: 0.05, turn: 0.5 }, scale: 0.0 }
}

/// Root and pose of every later frame of a motion, predicted with firm feet and without noise from its first pose on.
/// `change` may change the map's mean of a frame, and returns the offset from it.
fn followed(
    body: &Humanoid,
    motion: &Motion,
    change: impl Fn(usize, &mut Vec<f64>) -> Vec<f64>,
) -> Vec<(PlanarRoot, Pose)> {
    let chart = PoseChart::learn(body, std::slice::from_ref(motion));
    let roots = dynamics(rock());
    let mut rng = stream(1, Purpose::MotionModel, 0, 0, 0);
    let observations = chart.observe(motion);
    let mut pose = motion.poses[0].clone();
    let mut place = roots.place(body, PlanarRoot::from_pose(&pose), &pose);
    let next = |t: usize| {
        let mut mean: Vec<f64> = observations.row(t).iter().copied().collect();
        let offset = change(t, &mut mean);
        let at = Stand { body, chart: &chart, mean: &mean, offset: &offset };
        (place, pose) = roots.next(&pose, &place, &at, [(); 3].map(|()| normal(&mut rng)));
        (place.root, pose.clone())
    };
    (1..motion.poses.len()).map(next).collect()
}

#[test]
fn a_firm_foot_stays_where_it_is_for_any_pose_above_it() {
    let body = Humanoid::tracker25().unwrap();
    let footing = rock().unwrap();
    let motion = on_one_leg(&body, &footing, 60);
    let foot = |pose: &Pose| footing.feet(&body, pose).places()[0].translation.vector;
    let way = followed(&body, &motion, |t, mean| {
        // off the manifold by a different offset in each frame, except for the height, which is the foot's
        let mut offset: Vec<f64> = (0..mean.len() - 3).map(|i| 0.05 * ((t * (i + 3)) as f64).sin()).collect();
        *offset.last_mut().unwrap() = 0.0;
        offset
    });
    for (t, (root, pose)) in (1..).zip(&way) {
        assert!((foot(pose) - foot(&motion.poses[0])).norm() < 1e-9, "frame {t}: {:?}", foot(pose));
        let found = PlanarRoot::from_pose(pose);
        assert!((found.x - root.x).abs() + (found.y - root.y).abs() + (found.yaw - root.yaw).abs() < 1e-9);
    }
}

#[test]
fn the_legs_alone_determine_the_path_of_the_recording() {
    let body = Humanoid::tracker25().unwrap();
    let motion = on_one_leg(&body, &rock().unwrap(), 60);
    let way = followed(&body, &motion, |_, mean| {
        // uninformative velocities: only the legs determine the path
        let velocities = mean.len() - 3;
        mean[velocities..].fill(0.0);
        Vec::new()
    });
    let start = motion.poses[0].world_from_root.translation.vector;
    let mut farthest: f64 = 0.0;
    for (t, (_, pose)) in (1..).zip(&way) {
        let (found, truth) = (pose.world_from_root, motion.poses[t].world_from_root);
        assert!((found.translation.vector - truth.translation.vector).norm() < 1e-6, "frame {t}");
        assert!(found.rotation.angle_to(&truth.rotation) < 1e-6, "frame {t}");
        farthest = farthest.max((truth.translation.vector - start).norm());
    }
    assert!(farthest > 0.02, "the root hardly moved: {farthest} m");
}

#[test]
fn a_foot_in_the_air_does_not_affect_the_velocities() {
    let body = Humanoid::tracker25().unwrap();
    let mut motion = on_one_leg(&body, &rock().unwrap(), 30);
    motion.poses.iter_mut().enumerate().for_each(|(t, pose)| {
        let flight = Vector3::new(0.03 * t as f64, 0.01 * t as f64, 0.5);
        pose.world_from_root.translation.vector += flight;
    });
    for (t, (_, pose)) in (1..).zip(followed(&body, &motion, |_, _| Vec::new())) {
        let off = pose.world_from_root.translation.vector - motion.poses[t].world_from_root.translation.vector;
        assert!(off.norm() < 1e-5, "frame {t}: {off:?}");
    }
}

#[test]
fn training_on_a_standing_foot_makes_low_feet_firm() {
    let body = Humanoid::tracker25().unwrap();
    let footing = rock().unwrap();
    let motion = on_one_leg(&body, &footing, 60);
    let mut settings = GraphSettings::default();
    settings.training.rounds = 1;
    let graph = GpdmGraph::learn(&body, &[motion], &settings).unwrap();
    let learned = Footing::learn(&body, &graph).unwrap();
    let at = |height: f64| {
        let place = Point3::new(0.0, 0.0, height);
        learned.looseness(&FootStep { before: place, after: place, turned: 0.0 })
    };
    assert!(at(0.05).slide < 1e-12 && at(0.05).turn < 1e-12, "{:?}", at(0.05));
    assert!(at(0.4).slide > 1e-6, "{:?}", at(0.4));
}

#[test]
fn estimates_are_weighted_by_their_inverse_variances() {
    // by hand: 0, 3 and 6 with variances 1, 1/2 and 1/3 have precisions 1, 2, 3: mean 24/6, deviation 1/sqrt(6)
    let fused = FusedEstimate::new(0.0, 1.0, [(3.0, 0.5), (6.0, 1.0 / 3.0)].into_iter());
    assert!((fused.mean() - 4.0).abs() < 1e-12);
    assert!((fused.deviation(0.0) - 1.0 / 6.0_f64.sqrt()).abs() < 1e-12);
    assert_eq!(fused.deviation(0.5), 0.5);
}

#[test]
fn a_change_within_a_frame_leaves_a_firm_foot_in_place_except_for_its_own_step() {
    let body = Humanoid::tracker25().unwrap();
    let footing = rock().unwrap();
    let motion = on_one_leg(&body, &footing, 20);
    let chart = PoseChart::learn(&body, std::slice::from_ref(&motion));
    let observations = chart.observe(&motion);
    let roots = dynamics(rock());
    for t in 1..20 {
        let before = &motion.poses[t];
        let root = PlanarRoot::from_pose(before);
        let mean: Vec<f64> = observations.row(t).iter().copied().collect();
        let mut offset: Vec<f64> = (0..mean.len() - 3).map(|i| 0.1 * ((t * (i + 3)) as f64).sin()).collect();
        *offset.last_mut().unwrap() = 0.0;
        let at = Stand { body: &body, chart: &chart, mean: &mean, offset: &offset };
        let foot = |pose: &Pose| footing.feet(&body, pose).places()[0];
        let (still, pose) = roots.stepped(before, &root, &at, &PlanarStep { forward: 0.0, left: 0.0, turn: 0.0 });
        assert!((foot(&pose).translation.vector - foot(before).translation.vector).norm() < 1e-9, "frame {t}");
        // the same step from the same position; computed independently from the pose with the offset at that position
        let (gone, moved) = roots.stepped(before, &root, &at, &PlanarStep { forward: 0.1, left: -0.05, turn: 0.2 });
        let step = still.step_to(&gone);
        assert!((step.forward - 0.1).abs() + (step.left + 0.05).abs() + (step.turn - 0.2).abs() < 1e-12);
        let stands = roots.stand(&at, &gone).world_from_root;
        assert!((stands.translation.vector - moved.world_from_root.translation.vector).norm() < 1e-9);
        assert!(stands.rotation.angle_to(&moved.world_from_root.rotation) < 1e-7);
    }
}

#[test]
fn noise_about_a_foothold_does_not_accumulate() {
    // A body at rest on feet with slide q, with root noise of standard deviation s per frame. Only the noise moves it:
    // the middle of both feet is that of the footholds plus the noise, and the footholds follow by g s in each frame.
    // So its variance along an axis is s^2 (1 + (t - 1) g^2); if the feet were held to those of the previous frame, it
    // would be t s^2.
    let body = Humanoid::tracker25().unwrap();
    let (slide, deviation, frames, particles) = (0.002_f64, 0.01_f64, 100, 400_u64);
    let footing = Footing::with_knots(&body, &[(0.0, slide * slide), (1.0, slide * slide)]).unwrap();
    let still = on_one_leg(&body, &footing, 2);
    let chart = PoseChart::learn(&body, std::slice::from_ref(&still));
    let mut mean: Vec<f64> = chart.observe(&still).row(0).iter().copied().collect();
    let velocities = mean.len() - 3;
    mean[velocities..].fill(0.0);
    let middle = |pose: &Pose| {
        let places = footing.feet(&body, pose).places().map(|place| place.translation.vector.xy());
        0.5 * (places[0] + places[1])
    };
    // two feet with slide q leave a variance of q / 2, less than the floor
    let roots = RootDynamics { scale: deviation / LEAST_NOISE.forward, ..dynamics(Some(footing.clone())) };
    let last = |particle: u64| {
        let mut rng = stream(3, Purpose::MotionModel, 0, 0, particle);
        let mut pose = still.poses[0].clone();
        let mut place = roots.place(&body, PlanarRoot::from_pose(&pose), &pose);
        for _ in 0..frames {
            let at = Stand { body: &body, chart: &chart, mean: &mean, offset: &[] };
            (place, pose) = roots.next(&pose, &place, &at, [(); 3].map(|()| normal(&mut rng)));
        }
        (middle(&pose) - middle(&still.poses[0])).norm_squared()
    };
    let variance = 0.5 * (0..particles).map(last).sum::<f64>() / particles as f64;
    let gain = slide * slide / (slide * slide + 1e-4);
    let expected = deviation * deviation * (1.0 + f64::from(frames - 1) * gain * gain);
    // a variance of 800 draws is known to 5 %
    assert!((variance / expected - 1.0).abs() < 0.2, "{variance} for {expected}");
}
