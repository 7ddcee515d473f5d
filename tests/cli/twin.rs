//! Twins of recordings. A synthetic set with known errors stands for the recording, and its true poses for the tracked
//! ones, so what should be measured is known.

use skiagraph_core::npz::Npz;

use crate::sandbox::Sandbox;

const FRAMES: usize = 40;

/// A recording of a walk with errors of its masks and keypoints, its set `set`, and the true poses in `exact`.
fn recorded(draw: u32) -> Sandbox {
    let room = Sandbox::tiny();
    let scene = "actor.robot=tracker40 actor.skin=person_coarse tracker_body.robot=tracker40 tracker_body.skin=person_coarse \
                 tracker_body.mismatch=none rig.ring.size_px=[240,180] motion.last_frame=39 motion.frames=40 \
                 rig.ring.field_of_view_deg=45 observation.silhouette=corrupted observation.corruption.boundary_px=1.5 \
                 observation.corruption.boundary_s=0.2 observation.corruption.holes=0.05 \
                 observation.keypoints.layout=halpe26 observation.keypoints.white_percent=0.6 \
                 observation.keypoints.slow_percent=1.2 observation.keypoints.missing=0.05 observation.keypoints.gross=0.04";
    room.succeed(&format!("render tiny.toml {scene} --key default observation.seed={draw} --out truth -q"));
    room.succeed("export truth --to opencv,openpose --out other -q");
    room.write(
        "walk.toml",
        "schema = \"skiagraph.recording/1\"\nname = \"walk\"\nframes_per_second = 60\n\n[[rig.file]]\npath = \
         \"other/opencv\"\n\n[masks]\npath = \"truth/observations\"\n\n[keypoints]\npath = \"other/openpose\"\n\n[start]\nset = \
         \"truth\"\n",
    );
    room.succeed("import walk.toml --out set -q");
    room.succeed("track truth --tracker oracle --out exact -q");
    room
}

fn number(text: &str, key: &str) -> f64 {
    let line =
        text.lines().find_map(|line| line.strip_prefix(key)?.strip_prefix(" = ")).unwrap_or_else(|| panic!("{key}"));
    line.parse().unwrap()
}

#[test]
fn twin_has_the_errors_and_the_motion_of_the_recording() {
    let draws = [0, 1, 2, 3, 4].map(recorded);
    let texts = draws.each_ref().map(|room| {
        room.says("twin set exact/poses.npz --out twin", &["run it: skiagraph run twin/twin.toml"]);
        room.text("twin/twin.toml")
    });
    let (room, text) = (&draws[0], &texts[0]);
    // measured against exact poses: chance remains, and holes that touch an outline; forty frames have few stretches of
    // missing and gross points, so the mean of five draws counts
    for (key, given, share) in [
        ("boundary_px", 1.5, 0.25),
        ("boundary_s", 0.2, 0.3),
        ("holes", 0.05, 0.2),
        ("white_percent", 0.6, 0.15),
        ("slow_percent", 1.2, 0.35),
        ("missing", 0.05, 0.5),
        ("gross", 0.04, 0.8),
    ] {
        let all = texts.each_ref().map(|text| number(text, key));
        let measured = all.iter().sum::<f64>() / all.len() as f64;
        println!("{key}: {measured} of {given}: {all:?}");
        assert!((measured - given).abs() < share * given, "{key}: {measured} of {given}\n{text}");
    }
    assert!(number(text, "blobs") < 0.005 && number(text, "calibration_mm") == 0.0, "{text}");
    assert!(number(text, "bias_mm") < 15.0, "{text}");
    room.succeed("render twin/twin.toml --out again -q");
    let markers = |set: &str| {
        let npz = Npz::from_bytes("truth", &room.read(&format!("{set}/truth/truth.npz"))).unwrap();
        npz.numbers("truth", "markers", &[Some(FRAMES), Some(15), Some(3)]).unwrap()
    };
    let pairs = markers("truth").into_iter().zip(markers("again"));
    let off = pairs.map(|(own, twin)| (own - twin).abs()).sum::<f64>() / (3 * 15 * FRAMES) as f64;
    assert!(off < 0.003, "{off}");
    // a twin is a scene like others: it can be tracked and judged
    room.succeed(
        "run twin/twin.toml annealed_particle_filter.particles=20 annealed_particle_filter.layers=2 --out run -q",
    );
}

#[test]
fn only_recordings_have_twins() {
    let room = recorded(0);
    room.refused(
        "twin truth exact --out twin",
        "expected the set of a recording, made by skiagraph import, found truth",
    );
    room.refused("twin set exact --out twin", "does not fit set");
    room.succeed("track set --tracker frozen --out still -q");
    let told = room.succeed("twin set still --out twin");
    room.refused("twin set exact/poses.npz --out twin", "estimate: was");
    assert!(told.stderr.contains("measured against the tracked body"), "{}", told.stderr);
    room.refused("twin set walk.toml --out twin2", "walk.toml");
}
