//! A set of a few made-up frames of the built-in actor, for tests of files of sets.

use nalgebra::{Isometry3, Point3, Vector3};
use skiagraph_core::body::{Humanoid, Motion, Prop, shipped};
use skiagraph_core::camera::{Camera, CameraRig, Distortion, FieldOfView, TimedRig};
use skiagraph_set::{BenchmarkSet, SetParts, Start, Training, TruthFacts};
use skiagraph_truth::observing::{ObservationSettings, SilhouetteObserver, tracker_start};
use skiagraph_truth::scene::{Distractor, GroundTruth};

/// A camera of the given size in pixels that looks at the actor's belly.
pub fn camera(name: &str, eye: [f64; 3], distortion: [f64; 5], [width, height]: [u32; 2]) -> Camera {
    let (eye, view) = (Point3::from(eye), FieldOfView::Vertical(0.75));
    let camera = Camera::look_at(name, eye, Point3::new(0.1, 0.0, 1.0), Vector3::z(), view, width, height).unwrap();
    Camera { distortion: Distortion::from_coefficients(distortion), ..camera }
}

/// A motion from the root's place in each frame, and the angle of each frame and degree of freedom.
pub fn motion(
    body: &Humanoid,
    frames: usize,
    frames_per_second: f64,
    root: impl Fn(usize) -> Isometry3<f64>,
    angle: impl Fn(usize, usize) -> f64,
) -> Motion {
    let poses = (0..frames).map(|frame| {
        let mut pose = body.zero_pose();
        pose.world_from_root = root(frame);
        pose.joint_angles.iter_mut().enumerate().for_each(|(i, value)| *value = angle(frame, i));
        pose
    });
    Motion { frames_per_second, poses: poses.collect() }
}

/// The set of this motion of the actor, observed exactly by these cameras; the tracker has the actor's body.
pub fn assemble(name: &str, cameras: Vec<Camera>, motion: &Motion) -> BenchmarkSet {
    assemble_observed(name, cameras, motion, &ObservationSettings::default())
}

/// As [`assemble`], with silhouettes observed by these settings.
pub fn assemble_observed(
    name: &str,
    cameras: Vec<Camera>,
    motion: &Motion,
    settings: &ObservationSettings,
) -> BenchmarkSet {
    assemble_filmed(name, &TimedRig::from(&CameraRig { cameras }), motion, settings)
}

/// As [`assemble_observed`], with cameras that may move and have their own exposure times. Trackers get start and
/// cameras with the errors of the settings.
pub fn assemble_filmed(
    name: &str,
    filming: &TimedRig,
    motion: &Motion,
    settings: &ObservationSettings,
) -> BenchmarkSet {
    assemble_among(name, shipped("actor").unwrap(), filming, motion, settings, Vec::new(), Vec::new())
}

/// As [`assemble_filmed`], of any actor, with these props and people besides it.
pub fn assemble_among(
    name: &str,
    actor: Humanoid,
    filming: &TimedRig,
    motion: &Motion,
    settings: &ObservationSettings,
    props: Vec<Prop>,
    others: Vec<Distractor>,
) -> BenchmarkSet {
    let seed = settings.keyed_seed();
    let (exact, people) = (settings.is_exact() && others.is_empty(), others.len());
    let truth = GroundTruth::among(actor.clone(), motion, filming, props, others).unwrap();
    let training = Training::none(&actor);
    let pose = tracker_start(&actor, &motion.poses[0], &settings.corruption, seed);
    let start = Start { body: actor, pose, training, calibrate: false.into(), has_known_stature: false };
    let facts = TruthFacts {
        motion: "made up".into(),
        matched: true,
        observation_seed: (!exact).then_some(settings.seed),
        ..TruthFacts::default()
    };
    let mut observed = settings.facts();
    observed.distractors = people;
    let parts = SetParts {
        name,
        rig: filming,
        start: &start,
        ground_truth: &truth,
        refitted: Some(motion),
        facts: &facts,
        recordings: &[],
        observation: (!exact).then_some(&observed),
        key: seed.key,
    };
    let observer = SilhouetteObserver::new(&truth, filming, &observed, seed).unwrap();
    BenchmarkSet::assemble(&parts, |frame| observer.observe(frame)).unwrap()
}
