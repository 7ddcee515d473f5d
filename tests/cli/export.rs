//! `skiagraph export`, and cameras of other tools' files in scenarios.

use std::process::Command;

use assert_cmd::cargo::cargo_bin_cmd;
use skiagraph::benchmark_set::BlindSet;

use crate::sandbox::{Sandbox, TINY};
use crate::support::skip;

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
    // a format that is named twice is written once
    let twice = room.succeed("export set --to opencv,opencv --out twice").stdout;
    assert!(twice.lines().count() == 1 && !room.path("twice/opencv").exists(), "{twice}");
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

#[test]
fn exports_for_programs_that_read_images_have_the_images_of_the_set() {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    room.succeed("render tiny.toml observation.colour_images=\"jpeg\" --out set");
    room.succeed("export set --to coco,webdataset,croissant,bodytrack --out all");
    let seen = room.read("set/observations/colour/cam01/000002.jpg");
    assert_eq!(room.read("all/coco/images/cam01_000002.jpg"), seen);
    let text = |name: &str| String::from_utf8(room.read(name)).unwrap();
    assert!(text("all/coco/annotations.json").contains("\"file_name\":\"cam01_000002.jpg\""));
    assert_eq!(room.read("all/croissant/images/cam01_000002.jpg"), seen);
    assert!(text("all/croissant/frames.csv").contains(",images/cam01_000002.jpg\n"));
    let shard = room.read("all/webdataset/000000.tar");
    let place_of = |bytes: &[u8]| shard.windows(bytes.len()).position(|found| found == bytes);
    // a header of 512 bytes, then the file
    assert_eq!(place_of(b"000002_cam01.colour.jpg\0").map(|header| header + 512), place_of(&seen));
    let (image, mask) = (room.read("all/bodytrack/CAM2/image0002.bmp"), room.read("all/bodytrack/FG2/image0002.bmp"));
    assert!(image.len() == mask.len() && image != mask);
    for readme in ["coco", "webdataset", "croissant"] {
        assert!(text(&format!("all/{readme}/README.txt")).contains("what the camera"), "{readme}");
    }
}

#[test]
fn a_video_shows_every_frame_at_the_rate_of_the_set() {
    if Command::new("ffmpeg").arg("-version").output().is_err() {
        return skip("no ffmpeg (apt-get install ffmpeg)");
    }
    let room = Sandbox::new();
    // an odd width, which yuv420p does not have
    room.write("tiny.toml", TINY.replace("[80, 60]", "[81, 60]"));
    room.succeed("render tiny.toml --out set");
    room.succeed("export set --to video");
    let video = room.path("set-video/01-cam01.mp4");
    let ffmpeg = |arguments: &[&str]| {
        Command::new("ffmpeg").args(["-hide_banner", "-i"]).arg(&video).args(arguments).output().unwrap()
    };
    let described = String::from_utf8(ffmpeg(&[]).stderr).unwrap();
    assert!(described.contains("h264") && described.contains("60 fps") && described.contains("82x60"), "{described}");
    let frames = ffmpeg(&["-f", "rawvideo", "-pix_fmt", "gray", "-"]).stdout;
    let set = BlindSet::read(&room.path("set")).unwrap();
    assert_eq!(frames.len(), set.frame_count * 82 * 60);
    for (frame, picture) in frames.chunks(82 * 60).enumerate() {
        let mask = &set.observation(frame).unwrap().silhouettes[1];
        let differs = |(x, y): &(u32, u32)| (picture[(y * 82 + x) as usize] > 127) != mask.get(*x, *y);
        let pixels = (0..60).flat_map(|y| (0..81).map(move |x| (x, y)));
        let wrong = pixels.filter(differs).count();
        assert!(wrong < 50 && mask.count() > 100, "frame {frame}: {wrong} of 4860 pixels differ");
    }
}

#[test]
fn a_video_needs_ffmpeg_and_leaves_nothing_without_it() {
    let room = Sandbox::new();
    room.write("tiny.toml", TINY);
    room.succeed("render tiny.toml --out set");
    let export = || {
        let mut command = cargo_bin_cmd!("skiagraph");
        command.args(["export", "set", "--to", "video"]).current_dir(room.path(".")).env("PATH", room.path("."));
        let output = command.output().unwrap();
        (output.status.code(), String::from_utf8(output.stderr).unwrap())
    };
    let before = room.entries();
    let (code, said) = export();
    assert!(code == Some(2) && said.contains("install ffmpeg") && said.lines().count() == 1, "{said}");
    assert_eq!(room.entries(), before);
    // one that cannot encode: its message is passed on
    let fake = room
        .write("ffmpeg", "#!/bin/sh\n[ \"$1\" = -version ] || echo Unknown encoder >&2\nexec test \"$1\" = -version\n");
    #[cfg(unix)]
    std::fs::set_permissions(fake, std::os::unix::fs::PermissionsExt::from_mode(0o755)).unwrap();
    let before = room.entries();
    let (code, said) = export();
    assert!(code == Some(2) && said.contains("Unknown encoder") && said.lines().count() == 1, "{said}");
    assert_eq!(room.entries(), before);
    // one that ends without an error and without a video
    room.write("ffmpeg", "#!/bin/sh\n[ \"$1\" = -version ] || while read -r line; do :; done\nexit 0\n");
    let (code, said) = export();
    assert!(code == Some(2) && said.contains("wrote no video") && said.lines().count() == 1, "{said}");
    assert_eq!(room.entries(), before);
}
