//! A tracker that calibrates its body: its files, messages, metrics and inputs.

use serde_json::Value;
use skiagraph_set::{BlindSet, Estimates, bodies_from_json};

use super::same_numbers::report;
use crate::sandbox::{Sandbox, TINY};
use skiagraph_track::tracker::CameraCorrection;

/// [`TINY`] with more cameras, frames and pixels, an actor of the tracker's kind but another size, and calibration.
fn scenario() -> String {
    TINY.replace("last_frame = 3", "last_frame = 13")
        .replace("count = 2", "count = 3")
        .replace("[80, 60]", "[160, 120]")
        .replace("seeds = 2", "seeds = 1")
        + "\n[actor]\nrobot = \"tracker25\"\n\n[tracker_body]\ncalibrate = true\n\
           mismatch = { percent = { length = 6.0, girth = 25.0 } }\n"
}

fn json(bytes: &[u8]) -> Value {
    serde_json::from_slice(bytes).unwrap()
}

#[test]
fn calibrated_run_equals_three_steps() {
    let room = Sandbox::new();
    room.write("fit.toml", scenario());
    room.notes("run fit.toml --out whole", &["calibration, seed 0: the calibrated body is used", "energy"]);
    room.succeed("render fit.toml --out set");
    // the ground truth cannot be read
    std::fs::rename(room.path("set/truth"), room.path("truth")).unwrap();
    let said = room.succeed("track set --tracker annealed_particle_filter particles=12 layers=2 --out parts").stderr;
    assert!(said.contains("calibration, seed 0: the calibrated body is used"), "{said}");
    std::fs::rename(room.path("truth"), room.path("set/truth")).unwrap();
    room.succeed("evaluate set parts");
    for file in ["bodies.json", "poses.npz", "search.npz", "per_frame.csv"] {
        assert!(room.read(&format!("whole/{file}")) == room.read(&format!("parts/{file}")), "{file} differs");
    }
    assert!(report(&room, "whole") == report(&room, "parts"), "report.html differs");
    let (whole, track) = (json(&room.read("whole/run.json")), json(&room.read("parts/track.json")));
    assert_eq!(track["calibration"][0]["verdict"], "kept");
    let report = room.text("whole/report.html");
    assert!(report.contains("Calibration of the tracker") && report.contains("thigh length"));

    // evaluated separately: the markers are those of the body stored with the run
    let set = BlindSet::read(&room.path("set")).unwrap();
    let bodies = bodies_from_json("bodies.json", &room.read("whole/bodies.json")).unwrap();
    assert!(!bodies[0].is_same_body(&set.start.body));
    let estimates =
        Estimates::from_bodies("poses.npz", &room.read("whole/poses.npz"), &set.start.body, bodies.clone()).unwrap();
    let sequence = &estimates.sequences[0];
    let markers = bodies[0].markers(&bodies[0].link_frames(sequence.pose(5).unwrap()));
    assert_eq!(sequence.markers[5], markers);
    let frames = whole["frames"].as_u64().unwrap();
    assert_eq!(frames as usize, sequence.frames());

    // without calibration the energy of the estimate is higher, since the body is wrong
    room.succeed("track set --tracker annealed_particle_filter particles=12 layers=2 --calibrate false --out given");
    room.succeed("evaluate set given");
    assert!(!room.path("given/bodies.json").exists());
    let overlap = |run: &str| json(&room.read(run))["metrics"]["silhouette_iou"]["mean"].as_f64().unwrap();
    let (given, fitted) = (overlap("given/run.json"), overlap("whole/run.json"));
    assert!(fitted > given, "{given} {fitted}");
}

#[test]
fn corrected_cameras_are_a_file_that_recordings_read() {
    let room = Sandbox::new();
    room.write("fit.toml", scenario().replace("count = 3", "count = 4"));
    room.succeed("render fit.toml calibration_deg=2 --key default --out set -q");
    let filter = "annealed_particle_filter particles=12 layers=2";
    room.succeed(&format!("track set --tracker {filter} --out run -q"));
    room.write(
        "again.toml",
        "schema = \"skiagraph.recording/1\"\nname = \"again\"\nframes_per_second = 60\n\n[[rig.file]]\npath = \"run/cameras.toml\"\n\n\
         [masks]\npath = \"set/observations\"\n\n[start]\nset = \"set\"\n",
    );
    room.succeed("import again.toml --out again -q");
    let [given, again] = ["set", "again"].map(|set| BlindSet::read(&room.path(set)).unwrap().rig.cameras);
    let track = json(&room.read("run/track.json"));
    let corrections: Vec<CameraCorrection> =
        serde_json::from_value(track["calibration"][0]["cameras"].clone()).unwrap();
    assert_eq!([given.len(), again.len(), corrections.len()], [4; 3]);
    for ((given, again), correction) in given.iter().zip(&again).zip(&corrections) {
        assert_eq!((&again.name, &again.distortion), (&given.name, &given.distortion));
        let [own, back] = [given, again].map(|camera| camera.pinhole);
        assert_eq!([own.width, own.height], [back.width, back.height]);
        let pairs = own.focal.iter().chain(&own.principal_point).zip(back.focal.iter().chain(&back.principal_point));
        assert!(pairs.clone().all(|(own, back)| (own - back).abs() < 1e-9), "{own:?} {back:?}");
        let off = (given.camera_from_world * correction.motion()).inverse() * again.camera_from_world;
        let (metres, angle) = (off.translation.vector.norm(), off.rotation.angle());
        println!("{}: {metres:e} m, {angle:e}", given.name);
        assert!(metres < 1e-9 && angle < 1e-7, "{metres:e} {angle:e}");
    }
    // one file a seed
    room.succeed(&format!("track set --tracker {filter} --calibrate cameras --seeds 2 --out two -q"));
    assert!(!room.path("two/cameras.toml").exists() && room.text("two/cameras-1.toml").contains("[cam_03]"));
    assert_eq!(json(&room.read("two/track.json"))["calibration"][1]["solved"], "cameras");
    room.succeed(&format!("track set --tracker {filter} --calibrate body --out body -q"));
    assert!(!room.path("body/cameras.toml").exists());
    let lens = format!("track set --tracker {filter} --calibrate lens --out lens");
    room.refused(&lens, "expected true, false, \"body\", \"cameras\" or \"both\"");
    room.refused("check fit.toml tracker_body.calibrate=lens", "tracker_body.calibrate");
    room.succeed("check fit.toml tracker_body.calibrate=body");
}

/// And a modified body is refused.
#[test]
fn unused_calibration_is_reported() {
    let room = Sandbox::new();
    room.write("fit.toml", scenario());
    room.succeed("render fit.toml --out set");
    room.notes("check fit.toml rig.ring.count=1", &["tracker_body.calibrate: one camera sees the actor"]);
    let said = room.succeed("track set --tracker frozen --calibrate --out frozen").stderr;
    assert!(said.contains("--calibrate: frozen does not calibrate the body"), "{said}");
    assert!(!room.path("frozen/bodies.json").exists());
    room.succeed("track set --tracker annealed_particle_filter particles=12 layers=2 --out run");
    let text = room.text("run/bodies.json");
    room.write("run/bodies.json", text.replacen("\"bodies\"", "\"corpses\"", 1));
    room.refused("evaluate set run", "");
}
