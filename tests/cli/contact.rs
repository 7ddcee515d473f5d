//! Ground contact from the scenario to the report.

use serde_json::Value;

use crate::sandbox::{Sandbox, assert_contains, shipped};

fn run(room: &Sandbox, contact: &str) -> (Value, String) {
    let scenario = shipped("scenarios/smoke/contact.toml");
    let answer = room.succeed(&format!("run {} actor.contact={contact} --out {contact}", scenario.display()));
    let record: Value = room.json(&format!("{contact}/run.json"));
    (record, answer.stderr)
}

#[test]
fn contact_is_measured_or_corrected() {
    let room = Sandbox::new();
    let (measured, notes) = run(&room, "measure");
    assert!(notes.contains("contact: standing feet skate"), "{notes}");
    let (settled, notes) = run(&room, "fix");
    assert!(notes.contains("fixed: standing feet skate") && notes.contains("joints moved by"), "{notes}");
    // the recorded motion skates and sinks, the corrected one does not, and the corrected one is tracked
    assert!(room.mean("measure", "truth_foot_skate_mm_per_s") > 2.0 * room.mean("fix", "truth_foot_skate_mm_per_s"));
    assert!(room.mean("fix", "truth_ground_penetration_mm") <= 2.0);
    assert_ne!(measured["set_hash"], settled["set_hash"]);
    for run in ["measure", "fix"] {
        assert!(room.mean(run, "foot_skate_mm_per_s") > 0.0);
        assert!((0.0..=1.0).contains(&room.mean(run, "contact_f1")));
    }
    let page = room.text("fix/report.html");
    assert!(page.contains("Stances of each foot") && page.contains("left foot, estimate"));
}

/// Everywhere except for the tracker.
#[test]
fn simulated_truth_is_marked() {
    let room = Sandbox::new();
    // about 8 m/s sideways: the body falls
    let scenario = "schema = \"skiagraph.scenario/1\"\nname = \"pushed\"\n[motion]\nclip = \"embedded:walk\"\n\
                    loop_to_s = 1.2\nframes_per_second = 30\n[actor]\ncontact = \"simulate\"\nfriction = 0.6\nroot_wrench = 0.1\n\
                    [actor.push]\nat = 0.1\nlink = \"thorax\"\nimpulse_ns = 600\n[rig.ring]\nsize_px = [80, 60]\n[tracker.frozen]\n";
    room.write("pushed.toml", scenario);
    room.succeed("render pushed.toml --out set");
    let manifest: toml::Table = toml::from_slice(&room.read("set/truth/facts.toml")).unwrap();
    let contact = manifest["truth"]["contact"].as_table().unwrap();
    let simulation = contact["simulation"].as_table().unwrap();
    assert_eq!((contact["mode"].as_str(), simulation["friction"].as_float()), (Some("simulate"), Some(0.6)));
    assert_eq!(simulation["root_wrench"].as_float(), Some(0.1));
    let [mean, most] = [0, 1].map(|i| simulation["root_wrench_used"][i].as_float().unwrap());
    assert!(0.0 < mean && mean <= most && most <= 0.1 + 1e-9, "{mean} {most}");
    let push = &simulation["pushes"][0];
    assert_eq!((push["link"].as_str(), push["impulse_ns"].as_float()), (Some("thorax"), Some(600.0)));
    let fell = simulation["fell_at_s"].as_float().unwrap();
    assert!(fell > 0.1 && fell < 1.2, "{fell}");
    let outcome = format!("the body FELL after {fell:.2} s of 1.2");
    room.says("inspect set", &["mode: simulate", "push: 600 N s on thorax at 0.1 s", &outcome]);
    room.succeed("track set --tracker frozen --out tracked");
    for file in std::fs::read_dir(room.path("tracked")).unwrap() {
        let bytes = std::fs::read(file.unwrap().path()).unwrap();
        assert!(!String::from_utf8_lossy(&bytes).contains("simulat"), "the tracker was told");
    }
    room.succeed("evaluate set tracked");
    let record: Value = room.json("tracked/run.json");
    assert_eq!(record["contact"]["mode"], "simulate");
    assert_eq!(record["contact"]["simulation"]["fell_at_s"].as_f64(), Some(fell));
    assert!(room.text("tracked/report.html").contains(&outcome));
}

/// The shipped actor without solids on its feet.
fn barefoot(room: &Sandbox) {
    let urdf = std::fs::read_to_string(shipped("robots/actor.urdf")).unwrap();
    let mut text = String::new();
    let mut in_foot = false;
    for line in urdf.lines() {
        if line.contains("<link name=\"") {
            in_foot = line.contains("_foot\"") || line.contains("_toes\"");
        }
        if !(in_foot && line.trim_start().starts_with("<visual")) {
            text += line;
            text.push('\n');
        }
    }
    room.write("barefoot.urdf", text);
}

#[test]
fn robot_without_feet_has_no_contacts() {
    let room = Sandbox::new();
    barefoot(&room);
    let scenario = "schema = \"skiagraph.scenario/1\"\nname = \"bare\"\n[motion]\nclip = \"embedded:walk\"\nlast_frame = 11\n\
                    [actor]\nrobot = \"barefoot.urdf\"\n[rig.ring]\nsize_px = [80, 60]\n[tracker.frozen]\n";
    room.write("bare.toml", scenario);
    let answer = room.succeed("run bare.toml --out bare");
    assert_contains(&answer.stderr, &["actor.robot: \"actor\" has no left foot", "contact is not measured"]);
    let record: Value = room.json("bare/run.json");
    assert!(record["metrics"]["foot_skate_mm_per_s"].is_null());
    room.refused("run bare.toml actor.contact=fix --out none", "actor.contact: \"actor\" has no left foot");
    assert!(!room.path("none").exists());
}
