//! `skiagraph export`, and cameras of other tools' files in scenarios.

use crate::sandbox::{Sandbox, TINY};

#[test]
fn exports_go_beside_the_set_or_below_out_and_replace_only_own_output() {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    room.succeed("render tiny.toml --out set");
    room.succeed("export set --to opencv");
    assert!(room.path("set-opencv/cam00.yml").exists() && room.path("set-opencv/README.txt").exists());
    room.succeed("export set --to opencv");
    let answer = room.succeed("export set --to apng,tum --out all --json");
    let said: serde_json::Value = serde_json::from_str(&answer.stdout).unwrap();
    assert_eq!(
        (said["schema"].as_str(), said["exports"][1]["path"].as_str()),
        (Some("skiagraph.export/1"), Some("all/tum"))
    );
    assert!(room.path("all/apng/01-cam01.apng").exists() && room.path("all/tum/root.txt").exists());

    // a single format at a path that has several formats
    let answer = room.skiagraph("export set --to coco --out all".split(' '));
    let said = "all: this folder contains exports (tum, apng); choose --out all/coco to put this one beside them";
    assert!(answer.code == 2 && answer.stderr.contains(said), "{}", answer.stderr);
    room.succeed("export set --to coco --out all/coco");
    assert!(room.path("all/coco").is_dir() && room.path("all/tum/root.txt").exists());

    room.write("all/tum/notes.txt", "mine");
    let answer = room.skiagraph(["export", "set", "--to", "tum", "--out", "all/tum"]);
    assert!(answer.code == 2 && answer.stderr.contains("not an unchanged skiagraph result"), "{}", answer.stderr);
    let answer = room.skiagraph(["export", "set", "--to", "tum", "--out", "set/tum"]);
    assert!(answer.code == 2 && answer.stderr.contains("choose another --out"), "{}", answer.stderr);
    let answer = room.skiagraph(["export", "set", "--to", "coko"]);
    assert!(answer.code == 2 && answer.stderr.contains("coco"), "{}", answer.stderr);
    let answer = room.skiagraph(["export", "tiny.toml", "--to", "coco"]);
    assert!(answer.code == 2 && answer.stderr.lines().count() == 1, "{}", answer.stderr);
    assert!(!room.path("tiny.toml-coco").exists());
    room.write("set/observations/cam01/silhouette/000002.png", "nothing");
    let answer = room.skiagraph(["export", "set", "--to", "coco"]);
    assert!(answer.code == 2 && answer.stderr.contains("000002.png was changed"), "{}", answer.stderr);
    assert!(!room.path("set-coco").exists());
}

#[test]
fn exported_cameras_can_be_the_rig_of_a_scenario() {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    room.succeed("render tiny.toml --out set");
    room.succeed("export set --to opencv,humaneva --out cameras");
    let ring = "[rig.ring]\ncount = 2\nradius_m = 3.5\nsize_px = [80, 60]\n";
    let files = "[[rig.file]]\npath = \"cameras/opencv/cam00.yml\"\n\n[[rig.file]]\n\
        path = \"cameras/humaneva/Calibration_Data/cam01.cal\"\nsize_px = [80, 60]\n";
    assert!(TINY.contains(ring));
    room.write("same.toml", TINY.replace(ring, files));
    room.succeed("render same.toml --out same");
    for camera in 0..2 {
        for frame in 0..5 {
            let mask = format!("observations/cam{camera:02}/silhouette/{frame:06}.png");
            let (a, b) = (room.read(&format!("set/{mask}")), room.read(&format!("same/{mask}")));
            assert_eq!(a, b, "{mask}");
        }
    }
    for (broken, words) in [
        (files.replace("size_px = [80, 60]\n", ""), "lacks the image size"),
        (files.replace("cam00.yml", "cam07.yml"), "cannot be read"),
        (files.replace("cam01.cal", "cam00.cal"), "two cameras are named `cam00`"),
        (files.replace("cam00.yml\"", "cam00.yml\"\nup = \"x\""), "up"),
        (files.replace("cameras/opencv/cam00.yml", "tiny.toml"), "whose name does not end in"),
    ] {
        room.write("broken.toml", TINY.replace(ring, &broken));
        let answer = room.skiagraph(["check", "broken.toml"]);
        assert!(answer.code == 2 && answer.stderr.contains(words), "{words}: {}", answer.stderr);
        assert!(answer.stderr.contains("rig.file"), "{}", answer.stderr);
    }
}
