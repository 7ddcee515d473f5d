//! `skiagraph export`, and cameras of other tools' files in scenarios.

use std::process::Command;

use skiagraph_set::BlindSet;

use crate::sandbox::{Sandbox, TINY};
use crate::support::skip;

#[test]
fn exported_cameras_make_a_rig() {
    let room = Sandbox::with_set();
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
    // as of a file in millimetres, of which metres are the default: alone, it sees nothing
    let far = files.replace("cam00.yml\"", "cam00.yml\"\nmetres_per_unit = 1e3");
    let alone = far.split("\n\n").next().unwrap();
    // the second camera is `cam01` without a name, which is that of the first
    let unnamed = "[[rig.file]]\npath = \"cameras/opencv/cam01.yml\"\n\n[[rig.camera]]\nsize_px = [80, 60]\n\
        matrix = [[80.0, 0.0, 40.0], [0.0, 80.0, 30.0], [0.0, 0.0, 1.0]]\ntranslation_m = [0.0, 1.0, 5.0]\n\
        rotation = [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]\n";
    let unit = "set metres_per_unit = 0.001 in its [[rig.file]]";
    for (cameras, words) in
        [(&far[..], unit), (alone, unit), (unnamed, "without a name has that of its place in the rig")]
    {
        room.write("far.toml", TINY.replace(ring, &format!("{cameras}\n")));
        let answer = room.ask("check far.toml");
        let printed = answer.stdout + &answer.stderr;
        assert!(printed.contains(words), "{printed}");
    }
}

#[test]
fn exports_have_the_images() {
    let room = Sandbox::tiny();
    room.succeed("render tiny.toml observation.colour_images=\"jpeg\" --out set");
    room.succeed("export set --to coco,webdataset,croissant --out all");
    let seen = room.read("set/observations/colour/cam01/000002.jpg");
    assert_eq!(room.read("all/coco/images/cam01_000002.jpg"), seen);
    assert!(room.text("all/coco/annotations.json").contains("\"file_name\":\"cam01_000002.jpg\""));
    assert_eq!(room.read("all/croissant/images/cam01_000002.jpg"), seen);
    assert!(room.text("all/croissant/frames.csv").contains(",images/cam01_000002.jpg\n"));
    let shard = room.read("all/webdataset/000000.tar");
    let place_of = |bytes: &[u8]| shard.windows(bytes.len()).position(|found| found == bytes);
    // a header of 512 bytes, then the file
    assert_eq!(place_of(b"000002_cam01.colour.jpg\0").map(|header| header + 512), place_of(&seen));
    for readme in ["coco", "webdataset", "croissant"] {
        assert!(room.text(&format!("all/{readme}/README.txt")).contains("what the camera"), "{readme}");
    }
}

#[test]
fn video_shows_every_frame() {
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
