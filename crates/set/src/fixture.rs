//! Parts of sets for tests.

use nalgebra::{Isometry3, Matrix3, Point3, Unit, UnitQuaternion, Vector3};

use super::{BenchmarkSet, SetError, SetParts, Start, Training, TruthFacts};
use crate::test_bodies::{person, walk};
use crate::test_cameras::rig;
use skiagraph_core::body::{
    Calibrated, DegreeOfFreedom, Drive, Humanoid, Inertia, Joint, JointKind, LANDMARKS, Link, LinkPoint, Motion, Solid,
};
use skiagraph_core::camera::TimedRig;
use skiagraph_core::raster::TaperedCapsule;
use skiagraph_core::rng::ObservationKey;
use skiagraph_truth::observing::{ObservationFacts, Observer};
use skiagraph_truth::scene::GroundTruth;

/// A set of a few frames of the test person's walk.
pub(super) fn small_set(frames: usize) -> Result<BenchmarkSet, SetError> {
    set_of(&walk(frames))
}

/// A set of a motion of the test person.
pub(super) fn set_of(motion: &Motion) -> Result<BenchmarkSet, SetError> {
    with_parts(motion, |parts, observer| BenchmarkSet::assemble(parts, |frame| observer.observe(frame)))
}

/// A set of a few frames of that walk with these observations.
pub(super) fn observed_set(frames: usize, facts: &ObservationFacts) -> BenchmarkSet {
    with_parts(&walk(frames), |parts, observer| {
        let parts = SetParts { observation: Some(facts), ..*parts };
        BenchmarkSet::assemble(&parts, |frame| observer.observe(frame)).unwrap()
    })
}

/// Calls `make` with the parts of a set of a motion of the test person.
pub(super) fn with_parts<T>(motion: &Motion, make: impl FnOnce(&SetParts<'_>, &Observer<'_>) -> T) -> T {
    let truth = GroundTruth::from_motion(person(), motion, &rig()).unwrap();
    let start = Start {
        body: person(),
        pose: motion.poses[0].clone(),
        training: Training::none(&person()),
        calibrate: Calibrated::Nothing,
        has_known_stature: false,
    };
    let facts = TruthFacts { motion: "made up".into(), matched: true, ..TruthFacts::default() };
    let parts = SetParts {
        name: "small",
        rig: &TimedRig::from(&rig()),
        start: &start,
        ground_truth: &truth,
        refitted: Some(motion),
        facts: &facts,
        recordings: &[],
        observation: None,
        key: ObservationKey::from_bytes([7; 16]),
    };
    make(&parts, &Observer::new(&truth, &rig()))
}

/// One joint and one solid of every kind, with numbers that have no short decimal form.
pub(super) fn every_kind_of_body() -> Humanoid {
    let third = 1.0 / 3.0;
    let frame = Isometry3::from_parts(
        Vector3::new(0.1, -third, 1e-17).into(),
        UnitQuaternion::from_euler_angles(0.3, -0.2, third),
    );
    let axis = Unit::new_normalize(Vector3::new(1.0, 2.0, -3.0));
    let solids = vec![
        Solid::TaperedCapsule(TaperedCapsule {
            a: Point3::new(third, 0.0, -0.0),
            b: Point3::new(0.1, 0.2, 0.3),
            radius_a: 0.1 + 0.2,
            radius_b: 0.05,
        }),
        Solid::Box { link_from_box: frame, half_extents: [0.1, 0.2, third] },
        Solid::Cylinder { link_from_cylinder: frame, radius: third, half_length: 0.7 },
        Solid::Mesh {
            vertices: vec![Point3::origin(), Point3::new(1.0, 0.0, third), Point3::new(0.0, 1.0, 0.0)],
            triangles: vec![[0, 1, 2], [2, 1, 0]],
        },
    ];
    let tensor = Matrix3::new(1.0, 0.1, 0.2, 0.1, 2.0, third, 0.2, third, 3.0);
    let inertia = Some(Inertia { mass: 70.1, centre_of_mass: Point3::new(0.0, third, 0.0), tensor });
    let link = |name: &str| Link { name: name.to_string(), solids: Vec::new(), inertia: None };
    let kinds = [
        (
            "turn",
            0,
            JointKind::Revolute { axis, drive: Drive { degree_of_freedom: 0, multiplier: -2.0, offset: third } },
        ),
        ("slide", 1, JointKind::Prismatic { axis, drive: Drive::direct(1) }),
        ("ball", 0, JointKind::Spherical { first: 2 }),
        ("float", 3, JointKind::Floating { first: 5 }),
        ("weld", 1, JointKind::Fixed),
    ];
    let joint = |(name, parent, kind): (&str, usize, JointKind)| Joint {
        name: name.to_string(),
        parent,
        parent_from_joint: frame,
        kind,
    };
    let degree = |i: usize| DegreeOfFreedom {
        name: format!("q{i}"),
        lower: if i == 3 { f64::NEG_INFINITY } else { -third },
        upper: if i == 4 { f64::INFINITY } else { third },
        max_velocity: 7.1,
        max_effort: f64::INFINITY,
    };
    let mut markers = [None; LANDMARKS.len()];
    markers[1] = Some(LinkPoint { link: 2, point_in_link: Point3::new(third, 0.1, 0.0) });
    let mut links: Vec<Link> = ["a", "b", "c", "d", "e", "f"].map(link).into();
    links[0] = Link { name: "a".to_string(), solids, inertia };
    Humanoid {
        name: "everything".to_string(),
        links,
        joints: kinds.map(joint).into(),
        degrees_of_freedom: (0..11).map(degree).collect(),
        markers,
        skin: None,
        notes: vec!["a limit was assumed".to_string()],
    }
}
