//! Skins: linear blending against NumPy, silhouettes and depths against rays, files of sets, ground contact, and glTF
//! files against the skins from which they were made.

use std::fs;
use std::sync::Arc;

use nalgebra::{Isometry3, Point2, Point3, Quaternion, UnitQuaternion, Vector3};
use serde::Deserialize;
use skiagraph_core::body::{
    Blending, Humanoid, LinkFrames, Pose, SilhouettePainter, Skin, SkinParts, read_skin, shipped, shipped_skin,
};
use skiagraph_core::camera::{Camera, Distortion, FieldOfView};
use skiagraph_set::{body_from_json, body_to_json};
use skiagraph_truth::retarget::with_skin;

#[derive(Deserialize)]
struct Blended {
    bind: Vec<[f64; 7]>,
    pose: Vec<[f64; 7]>,
    vertices: Vec<[f64; 3]>,
    influences: Vec<Vec<(u32, f64)>>,
    expected: Vec<[f64; 3]>,
}

fn frames(rows: &[[f64; 7]]) -> Vec<Isometry3<f64>> {
    let of = |[x, y, z, w, i, j, k]: &[f64; 7]| {
        let rotation = UnitQuaternion::new_unchecked(Quaternion::new(*w, *i, *j, *k));
        Isometry3::from_parts(Vector3::new(*x, *y, *z).into(), rotation)
    };
    rows.iter().map(of).collect()
}

#[test]
fn errors_of_a_missing_mesh_name_the_skin() {
    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().join("skins");
    fs::create_dir(&folder).unwrap();
    let skin = folder.join("s.toml");
    fs::write(&skin, "schema = \"skiagraph.skin/1\"\nmesh = \"m.obj\"").unwrap();
    let message = || read_skin(&skin, &Default::default()).unwrap_err().to_string();
    let found = message();
    assert!(found.contains("s.toml: refers to the file `m.obj`, which cannot be read: "), "{found}");
    // a mesh may lie wherever the user may read, and a link may lead there
    #[cfg(unix)]
    {
        fs::write(parent.path().join("own.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
        std::os::unix::fs::symlink("../own.obj", folder.join("m.obj")).unwrap();
        assert!(read_skin(&skin, &Default::default()).is_ok());
    }
}

#[test]
fn linear_blending_agrees_with_numpy_to_a_micrometre() {
    let table: Blended = serde_json::from_str(include_str!("../skin_blend.json")).unwrap();
    let parts = SkinParts {
        name: "random".into(),
        blending: Blending::Linear,
        vertices: table.vertices.iter().map(|v| Point3::from(*v)).collect(),
        triangles: vec![[0, 1, 2]],
        influences: table.influences,
        bind: frames(&table.bind),
    };
    let skin = Skin::from_parts(parts, table.bind.len()).unwrap();
    let mut found = Vec::new();
    skin.deform_into(&LinkFrames(frames(&table.pose)), &mut found);
    for (found, expected) in found.iter().zip(&table.expected) {
        assert!((found - Point3::from(*expected)).norm() < 1e-6, "{found} {expected:?}");
    }
}

/// The actor with a skin, in a pose with bent arms, knees and back.
fn posed(skin: &str) -> (Humanoid, LinkFrames) {
    let body = with_skin(&shipped("actor").unwrap(), &shipped_skin(skin).unwrap()).unwrap();
    let mut pose = body.zero_pose();
    for (angle, value) in [
        ("left_shoulder_abduction", 1.2),
        ("right_shoulder_flexion", 0.9),
        ("right_elbow_flexion", 1.1),
        ("left_hip_flexion", 0.8),
        ("left_knee_flexion", 1.3),
        ("lumbar_flexion", 0.3),
    ] {
        pose.joint_angles[body.find_degree_of_freedom(angle).unwrap()] = value;
    }
    pose.world_from_root = Isometry3::translation(0.1, 0.0, 0.95);
    let frames = body.link_frames(&pose);
    (body, frames)
}

fn camera(width: u32, height: u32) -> Camera {
    let eye = Point3::new(2.3, 1.9, 1.4);
    Camera::look_at("c", eye, Point3::new(0.0, 0.0, 0.9), Vector3::z(), FieldOfView::Vertical(0.75), width, height)
        .unwrap()
}

/// Depth of the nearest triangle along the ray of a pixel: Moeller and Trumbore's method on every triangle.
fn depth_along(vertices: &[Point3<f64>], triangles: &[[u32; 3]], camera: &Camera, [u, v]: [f64; 2]) -> Option<f64> {
    let (x, y) = camera.pinhole.normalised(&Point2::new(u, v));
    let ray = Vector3::new(x, y, 1.0);
    let hit = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(|corner| vertices[corner as usize].coords);
        let (p, q) = (b - a, c - a);
        let across = ray.cross(&q);
        let scale = p.dot(&across);
        let from = -a;
        let s = from.dot(&across) / scale;
        let t = ray.dot(&from.cross(&p)) / scale;
        (s >= 0.0 && t >= 0.0 && s + t <= 1.0).then(|| q.dot(&from.cross(&p)) / scale).filter(|depth| *depth > 0.0)
    };
    triangles.iter().filter_map(hit).min_by(f64::total_cmp)
}

#[test]
fn the_skinned_silhouette_agrees_with_rays_except_within_half_a_pixel_of_the_outline() {
    for (skin, [width, height]) in [("person_coarse", [200, 150]), ("person", [80, 60])] {
        let (body, frames) = posed(skin);
        let camera = camera(width, height);
        let mask = SilhouettePainter::new(&camera).silhouette(&body, &frames);
        let own = body.skin.as_ref().unwrap();
        let mut vertices = Vec::new();
        own.deform_into(&frames, &mut vertices);
        vertices.iter_mut().for_each(|v| *v = camera.camera_from_world * *v);
        let sees = |u: f64, v: f64| depth_along(&vertices, own.triangles(), &camera, [u, v]).is_some();
        let mut differing = 0;
        for y in 0..height {
            for x in 0..width {
                let centre = [f64::from(x) + 0.5, f64::from(y) + 0.5];
                let seen = sees(centre[0], centre[1]);
                if seen != mask.get(x, y) {
                    differing += 1;
                    let near = (0..16).any(|k| {
                        let (sin, cos) = (f64::from(k) * std::f64::consts::TAU / 16.0).sin_cos();
                        sees(centre[0] + 0.5 * cos, centre[1] + 0.5 * sin) != seen
                    });
                    assert!(near, "{skin}: pixel {x}, {y} differs away from the outline");
                }
            }
        }
        assert!(mask.count() > 300 && differing <= 3, "{skin}: {differing} of {}", mask.count());
    }
}

#[test]
fn depth_agrees_with_rays_and_every_large_part_is_seen_with_and_without_a_lens() {
    let (body, frames) = posed("person_coarse");
    let camera = camera(120, 90);
    let image = SilhouettePainter::new(&camera).depth(&body, &frames);
    let own = body.skin.as_ref().unwrap();
    let mut vertices = Vec::new();
    own.deform_into(&frames, &mut vertices);
    vertices.iter_mut().for_each(|v| *v = camera.camera_from_world * *v);
    let mut differing = 0;
    for (index, depth) in image.depth.iter().enumerate() {
        let centre = [(index % 120) as f64 + 0.5, (index / 120) as f64 + 0.5];
        match depth_along(&vertices, own.triangles(), &camera, centre) {
            Some(expected) if depth.is_finite() => assert!((expected - f64::from(*depth)).abs() < 1e-4),
            found => differing += usize::from(found.is_some() != depth.is_finite()),
        }
    }
    assert!(differing <= 2, "{differing}");
    for part in ["pelvis", "thorax", "head", "left_thigh", "right_forearm", "left_shank"] {
        assert!(image.part.contains(&(body.find_link(part).unwrap() as u32 + 1)), "{part}");
    }
    let lens = Camera { distortion: Distortion { k1: -0.1, ..Distortion::default() }, ..camera };
    let mut painter = SilhouettePainter::new(&lens);
    let (mask, image) = (painter.silhouette(&body, &frames), painter.depth(&body, &frames));
    let same = (0..120 * 90_u32).filter(|i| mask.get(i % 120, i / 120) == image.depth[*i as usize].is_finite()).count();
    assert!(same >= 120 * 90 - 2);
}

#[test]
fn a_body_with_a_skin_survives_its_file_bit_for_bit_and_differs_from_the_body_without() {
    let (body, _) = posed("person_coarse");
    let again = body_from_json("body.json", &body_to_json("body.json", &body).unwrap()).unwrap();
    assert_eq!(again, body);
    assert!(!body.is_same_body(&Humanoid { skin: None, ..body.clone() }));
    let reblended = Skin::clone(body.skin.as_ref().unwrap()).with_blending(Blending::DualQuaternion);
    let reblended = Humanoid { skin: Some(Arc::new(reblended)), ..body.clone() };
    assert!(!body.is_same_body(&reblended));
    assert_eq!(body_from_json("b", &body_to_json("b", &reblended).unwrap()).unwrap(), reblended);
}

#[test]
fn a_standing_body_touches_the_ground_with_its_skin_and_grows_with_its_shape() {
    use skiagraph_core::body::{BodyShape, LinkShape};
    let (body, _) = posed("person");
    let frames = body.link_frames(&body.zero_pose());
    let skin = body.skin.as_ref().unwrap();
    let mut vertices = Vec::new();
    skin.deform_into(&frames, &mut vertices);
    let lowest = vertices.iter().map(|v| v.z).fold(f64::MAX, f64::min);
    let links: Vec<usize> = (0..body.links.len()).collect();
    let (link, found) = body.lowest_on_link(&frames, &links).unwrap();
    assert!((found.z - lowest).abs() < 1e-12);
    assert!(body.links[link].name.contains("foot") || body.links[link].name.contains("toes"));
    let tall = body
        .reshaped(&BodyShape { links: vec![LinkShape { length: Vector3::repeat(1.1), girth: 1.1 }; body.links.len()] });
    let mut grown = Vec::new();
    tall.skin.as_ref().unwrap().deform_into(&tall.link_frames(&tall.zero_pose()), &mut grown);
    for (was, is) in vertices.iter().zip(&grown) {
        assert!((is.coords - was.coords * 1.1).norm() < 1e-3, "{was} {is}");
    }
    let pose = Pose { world_from_root: Isometry3::translation(0.0, 0.0, -lowest), ..body.zero_pose() };
    let on_ground = body.lowest_point(&body.link_frames(&pose), &links).unwrap();
    assert!(on_ground.z.abs() < 1e-12);
}

#[test]
fn a_skin_written_to_a_glb_and_read_back_has_the_same_surface_and_bends_the_same() {
    let original = shipped_skin("person_coarse").unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("figure.glb");
    std::fs::write(&path, crate::glb::bytes(&original)).unwrap();
    let read = read_skin(&path, &Default::default()).unwrap();
    assert_eq!((read.name.as_str(), &read.triangles), ("figure", &original.triangles));
    for (a, b) in read.vertices.iter().zip(&original.vertices) {
        assert!((a - b).norm() < 1e-6, "{a} {b}");
    }
    for (name, place) in &read.landmarks {
        // the file has no joint at the top of the head: the landmark is the highest vertex above the head's joint
        let tolerance = if name == "head_top" { 0.15 } else { 1e-6 };
        assert!((place - original.landmarks[name]).norm() < tolerance, "{name}: {place}");
    }
    assert_eq!(read.landmarks.len(), original.landmarks.len());
    let posed = |mesh| {
        let body = with_skin(&shipped("actor").unwrap(), mesh).unwrap();
        let mut pose = body.zero_pose();
        pose.joint_angles[body.find_degree_of_freedom("left_knee_flexion").unwrap()] = 1.0;
        let mut vertices = Vec::new();
        body.skin.as_ref().unwrap().deform_into(&body.link_frames(&pose), &mut vertices);
        vertices
    };
    let mut same = original.clone();
    same.landmarks = read.landmarks.clone();
    for (a, b) in posed(&read).iter().zip(&posed(&same)) {
        assert!((a - b).norm() < 1e-4, "{a} {b}");
    }
}

#[test]
fn a_truncated_glb_is_rejected_wherever_it_is_cut() {
    let whole = crate::glb::bytes(&shipped_skin("person_coarse").unwrap());
    for share in [0.01, 0.1, 0.3, 0.5, 0.9, 0.999] {
        let cut = &whole[..(share * whole.len() as f64) as usize];
        let error = skiagraph_core::body::skin_from_gltf("cut.glb", cut).unwrap_err().to_string();
        assert!(error.starts_with("cut.glb: expected glTF 2.0"), "{error}");
    }
}

#[test]
fn an_animation_of_a_node_that_is_missing_is_rejected() {
    let mut file = crate::glb::bytes(&shipped_skin("person_coarse").unwrap());
    let target = b"\"target\":{\"node\":11";
    let at = file.windows(target.len()).position(|part| part == target).unwrap();
    file[at + target.len() - 2] = b'9';
    let error = skiagraph_core::body::skin_from_gltf("astray.glb", &file).unwrap_err().to_string();
    assert!(error.contains("an animation moves node 91; expected 0 to 22"), "{error}");
}

#[test]
fn calibration_brings_a_wrongly_sized_skin_closer_to_the_actors_and_leaves_a_correct_one_alone() {
    use skiagraph_core::body::BodyShape;
    use skiagraph_core::camera::{CameraRig, RingParameters};
    use skiagraph_core::observation::Observation;
    use skiagraph_track::tracker::{CalibrationTask, CalibrationVerdict, SilhouetteSettings, calibrate};
    let task = CalibrationTask { what: true.into(), has_known_stature: false, has_known_start: true };
    let actor = with_skin(&shipped("tracker25").unwrap(), &shipped_skin("person_coarse").unwrap()).unwrap();
    let rig = CameraRig::ring(&RingParameters { radius: 3.5, ..RingParameters::default() }).unwrap();
    let pose = |frame: usize| {
        let swing = libm::sin(frame as f64 * 1.1);
        let mut pose = actor.zero_pose();
        pose.world_from_root = Isometry3::translation(0.05 * frame as f64, 0.0, 0.93);
        for (side, sign) in [("left", 1.0), ("right", -1.0)] {
            let angles = [
                ("hip_flexion", 0.3 + 0.5 * sign * swing),
                ("knee_flexion", 0.7 - 0.4 * sign * swing),
                ("shoulder_flexion", -0.5 * sign * swing),
                ("shoulder_abduction", 0.5),
                ("elbow_flexion", 0.8),
            ];
            for (name, angle) in angles {
                pose.joint_angles[actor.find_degree_of_freedom(&format!("{side}_{name}")).unwrap()] = angle;
            }
        }
        pose
    };
    let seen: Vec<(Observation, Pose)> = (0..7)
        .map(|frame| {
            let frames = actor.link_frames(&pose(frame));
            let silhouettes =
                rig.cameras.iter().map(|camera| SilhouettePainter::new(camera).silhouette(&actor, &frames));
            (
                Observation { frame, time_s: 0.0, silhouettes: silhouettes.collect(), moment: None, keypoints: None },
                pose(frame),
            )
        })
        .collect();
    let distance_mm = |body: &Humanoid, pose: &Pose| {
        let truth = actor.markers(&actor.link_frames(&seen[0].1));
        let found = body.markers(&body.link_frames(pose));
        let distances: Vec<f64> = truth.iter().zip(&found).map(|(a, b)| (a.unwrap() - b.unwrap()).norm()).collect();
        1000.0 * distances.iter().sum::<f64>() / distances.len() as f64
    };
    let litres = |body: &Humanoid| {
        let frames = body.link_frames(&body.zero_pose());
        1000.0 * body.skin.as_ref().unwrap().volume(&frames).unwrap().0
    };
    for seed in [1, 2] {
        let missized = actor.reshaped(&BodyShape::random_mismatch(&actor, seed, 0.06, 0.15));
        let found = calibrate(&missized, &rig, SilhouetteSettings::default(), task, &seen[0].1, &seen).unwrap();
        assert_eq!(found.report.verdict, CalibrationVerdict::Kept, "{}", found.report.describe());
        let (before, after) = (distance_mm(&missized, &seen[0].1), distance_mm(&found.body, &found.start));
        assert!(after < 0.6 * before, "{before:.1} to {after:.1} mm");
        let off = |body: &Humanoid| (litres(body) - litres(&actor)).abs();
        assert!(off(&found.body) < 0.04 * litres(&actor), "{} to {} litres", off(&missized), off(&found.body));
    }
    let right = calibrate(&actor, &rig, SilhouetteSettings::default(), task, &seen[0].1, &seen).unwrap();
    assert_eq!(right.report.verdict, CalibrationVerdict::NoBetter, "{}", right.report.describe());
    assert!(right.body.is_same_body(&actor));
}

#[test]
fn a_body_in_a_skin_has_the_centre_of_mass_of_the_skins_volume() {
    for (robot, skin) in [("actor", "person"), ("tracker25", "person_coarse")] {
        let dressed = with_skin(&shipped(robot).unwrap(), &shipped_skin(skin).unwrap()).unwrap();
        let body = dressed.with_masses_of_skin();
        assert!((body.total_mass() - dressed.total_mass()).abs() < 1e-9);
        let mut worst: f64 = 0.0;
        for step in 0..9 {
            let turn = 0.15 * f64::from(step);
            let mut pose = body.zero_pose();
            pose.world_from_root = Isometry3::translation(0.3, 0.1, 0.95);
            for (name, share) in
                [("left_hip_flexion", 0.8), ("left_knee_flexion", 1.0), ("right_shoulder_flexion", 0.9)]
            {
                pose.joint_angles[body.find_degree_of_freedom(name).unwrap()] = share * turn;
            }
            let frames = body.link_frames(&pose);
            // the volume's centre from the deformed surface, by the divergence theorem; bent joints lose some volume
            let (_, held) = body.skin.as_ref().unwrap().volume(&frames).unwrap();
            worst = worst.max((body.centre_of_mass(&frames).unwrap() - held).norm());
        }
        assert!(worst < 0.006, "{robot}: {worst}");
    }
}
