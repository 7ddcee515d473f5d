//! Small forged changes, with every hash corrected afterwards.

use serde_json::Value;
use skiagraph::camera::{CameraRig, TimedRig};
use skiagraph::npz::Values;
use skiagraph::observation::ObservationSettings;

use super::{CORRUPTED, Copy, FILMED, HEIGHT, LAYERS, SEGMENTED, WIDTH, cameras, filming, motion, number};

fn floats(values: Values, change: impl Fn(usize, f64) -> f64) -> Values {
    match values {
        Values::F64(v) => Values::F64(v.into_iter().enumerate().map(|(i, x)| change(i, x)).collect()),
        other => panic!("{other:?}"),
    }
}

fn swapped(values: Values, a: usize, b: usize) -> Values {
    let Values::Text(mut names) = values else { panic!() };
    names.swap(a, b);
    Values::Text(names)
}

/// Enlarges every radius of the first link with a capsule by 5 %.
fn fatten(body: &mut Value) {
    let links = body["links"].as_array_mut().unwrap();
    let capsules =
        |link: &&mut Value| link["solids"].as_array().unwrap().iter().any(|s| s["tapered_capsule"].is_object());
    let link = links.iter_mut().find(capsules).unwrap();
    for solid in link["solids"].as_array_mut().unwrap() {
        for radius in ["radius_a", "radius_b"] {
            let capsule = &mut solid["tapered_capsule"];
            capsule[radius] = (1.05 * number(&capsule[radius])).into();
        }
    }
}

#[test]
fn a_start_that_is_5_millimetres_or_half_a_degree_off_is_found() {
    for base in [&LAYERS, &CORRUPTED, &FILMED] {
        let set = Copy::of(base);
        set.json("start/start.json", |json| {
            json["root"]["position"][0] = (0.005 + number(&json["root"]["position"][0])).into();
        });
        set.found_in_spite_of_good_hashes("start", "start/start.json", &["root", "5.00 mm"]);
        let set = Copy::of(base);
        set.json("start/start.json", |json| {
            json["angles"][4] = (0.5_f64.to_radians() + number(&json["angles"][4])).into()
        });
        set.found_in_spite_of_good_hashes("start", "start/start.json", &["0.5000 degrees"]);
    }
}

#[test]
fn errors_of_start_and_cameras_must_match_the_seed() {
    let settings = "silhouette = \"corrupted\"\nseed = 5\ncorruption = { start_mm = 20.0, start_deg = 2.0, calibration_mm = 9.0, \
                    calibration_px = 2.0 }";
    let settings: ObservationSettings = toml::from_str(settings).unwrap();
    for (filming, is_filmed) in
        [(TimedRig::from(&CameraRig { cameras: cameras([WIDTH, HEIGHT]) }), false), (filming(), true)]
    {
        let set = Copy(tempfile::tempdir().unwrap());
        crate::made_up_set::assemble_filmed("told", &filming, &motion(), &settings).write(set.0.path()).unwrap();
        let found = set.verified();
        assert!(found.is_sound(), "{:#?}", found.faults().collect::<Vec<_>>());
        let changed = |change: &dyn Fn(&Copy)| {
            let changed = Copy::of(&set.0);
            change(&changed);
            changed
        };
        changed(&|set| set.text("set.toml", |text| text.replace("start_mm = 20.0", "start_mm = 30.0")))
            .found_in_spite_of_good_hashes("start", "start/start.json", &["root"]);
        changed(&|set| {
            set.text("truth/facts.toml", |text| text.replace("observation_seed = 5", "observation_seed = 6"))
        })
        .found_in_spite_of_good_hashes("start", "cameras.json", &["front"]);
        changed(&|set| {
            set.json("cameras.json", |json| {
                let k = &mut json["cameras"][1]["K"];
                k[0][0] = (0.5 + number(&k[0][0])).into();
                k[1][1] = (0.5 + number(&k[1][1])).into();
            });
        })
        .found_in_spite_of_good_hashes("start", "cameras.json", &["lens", "focal"]);
        if is_filmed {
            changed(&|set| {
                set.array("cameras.npz", "camera_from_world", |v| floats(v, |i, x| if i == 21 { x + 0.004 } else { x }))
            })
            .found_in_spite_of_good_hashes("cameras", "cameras.npz", &["lens", "1 of 5"]);
        }
    }
}

#[test]
fn refitted_poses_that_are_a_degree_or_a_millimetre_off_are_found() {
    let set = Copy::of(&LAYERS);
    set.array("truth/truth.npz", "refitted_angles", |v| {
        floats(v, |i, x| if i == 50 { x + 1_f64.to_radians() } else { x })
    });
    set.found_in_spite_of_good_hashes("poses", "truth/truth.npz", &["refitted_angles", "1.0000 degrees"]);
    let set = Copy::of(&LAYERS);
    set.array("truth/truth.npz", "refitted_root", |v| floats(v, |i, x| if i == 15 { x + 0.001 } else { x }));
    set.found_in_spite_of_good_hashes("poses", "truth/truth.npz", &["refitted_root", "frame 2", "1.00 mm"]);
}

#[test]
fn swapped_names_and_parents_are_found_in_every_file() {
    for (check, file, array) in [
        ("visibility", "truth/views.npz", "camera_names"),
        ("visibility", "truth/views.npz", "joint_names"),
        ("visibility", "truth/views.npz", "marker_names"),
        ("visibility", "truth/views.npz", "sight_names"),
        ("formats", "truth/truth.npz", "refitted_angle_names"),
        ("start", "start/spread.npz", "names"),
    ] {
        let set = Copy::new();
        set.array(file, array, |values| swapped(values, 0, 1));
        set.found_in_spite_of_good_hashes(check, file, &[array, "[0]"]);
    }
    let set = Copy::new();
    set.array("truth/truth.npz", "parents", |values| {
        let Values::I64(mut parents) = values else { panic!() };
        parents.swap(2, 9);
        Values::I64(parents)
    });
    set.found_in_spite_of_good_hashes("formats", "truth/truth.npz", &["parents[2]"]);
}

#[test]
fn a_body_that_is_5_percent_thicker_is_found_for_tracker_and_actor() {
    let set = Copy::new();
    set.json("start/body.json", fatten);
    set.found_in_spite_of_good_hashes("start", "start/body.json", &["the actor's own body, but it differs"]);
    let set = Copy::new();
    set.json("truth/actor.json", fatten);
    set.sign();
    assert!(set.verified().faults().any(|(check, _)| check == "silhouettes"));
}

#[test]
fn two_changed_pixels_of_a_mask_are_found_for_every_kind_of_silhouette() {
    for base in [&LAYERS, &SEGMENTED, &CORRUPTED, &FILMED] {
        let set = Copy::of(base);
        let size = if std::ptr::eq(base, &LAYERS) { [64, 48] } else { [WIDTH, HEIGHT] };
        let two = [(size[0] / 2, size[1] / 2), (size[0] / 2 + 1, size[1] / 2)];
        set.repaint_sized(1, 2, size, |old, x, y| if two.contains(&(x, y)) { 255 - old(x, y) } else { old(x, y) });
        set.found_in_spite_of_good_hashes("silhouettes", &Copy::mask(1, 2), &["2 of its"]);
    }
}

#[test]
fn slightly_wrong_flow_coverage_normals_and_depth_are_found() {
    let set = Copy::of(&LAYERS);
    let flow = set.floats(0, 1, "forward", |c| 1.01 * c);
    let coverage = set.floats(1, 1, "A", |share| if share > 0.0 && share < 1.0 { share + 0.0625 } else { share });
    let depth = set.floats(0, 2, "depth.Z", |z| z + 0.00005);
    let normal = set.floats(1, 2, "normal.X", |c| if c == 0.0 { c } else { c + 0.0005 });
    let png = "truth/layers/cam00/000003-depth.png".to_owned();
    set.repaint_wide(&png, |mm| if mm == 0 { 0 } else { mm + 1 });
    set.found_in_spite_of_good_hashes("layers", &flow, &["forward"]);
    for (file, words) in [(coverage, "A:"), (depth, "depth.Z"), (normal, "normal"), (png, "1 mm too far")] {
        set.found("layers", &file, &[words]);
    }
}

#[test]
fn a_few_pixels_that_differ_by_rounding_are_not_a_fault() {
    // the principal point is moved by a tiny distance, so that only pixels on an outline can differ
    let directory = tempfile::tempdir().unwrap();
    let mut seen = cameras([WIDTH, HEIGHT]);
    seen.iter_mut().for_each(|camera| camera.pinhole.principal_point[0] += 3e-5);
    crate::made_up_set::assemble("rounded", seen, &motion()).write(directory.path()).unwrap();
    let set = Copy::of(&directory);
    set.json("cameras.json", |json| {
        for camera in 0..2 {
            let k = &mut json["cameras"][camera]["K"];
            k[0][2] = (number(&k[0][2]) - 3e-5).into();
        }
    });
    set.sign();
    let found = set.verified();
    assert!(found.faults().all(|(check, _)| check != "silhouettes"), "{:#?}", found.faults().collect::<Vec<_>>());
}
