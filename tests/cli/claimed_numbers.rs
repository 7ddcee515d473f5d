//! Sizes, counts and magnitudes claimed by a file are bounded when they are read, and the message states the limit.
//! Without bounds, these cases would exhaust memory, hang or panic.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;
use std::sync::mpsc;
use std::time::Duration;

use assert_cmd::cargo::cargo_bin;
use sha2::{Digest, Sha256};

const TINY: &str = "schema = \"skiagraph.scenario/1\"\nname = \"tiny\"\n[motion]\nclip = \"embedded:walk\"\nlast_frame = 3\n\
    [rig.ring]\ncount = 2\nradius_m = 3.5\nsize_px = [80, 60]\n[tracker.frozen]\n";

/// Runs the program in `folder`; it must end within a minute, whatever the file claims.
fn skiagraph(folder: &Path, arguments: &[&str]) -> Output {
    let (send, receive) = mpsc::channel();
    let mut command = std::process::Command::new(cargo_bin!("skiagraph"));
    command.args(arguments).current_dir(folder).env_remove("SKIAGRAPH_MOCAP").stdin(std::process::Stdio::null());
    std::thread::spawn(move || send.send(command.output().unwrap()));
    receive.recv_timeout(Duration::from_secs(60)).unwrap_or_else(|_| panic!("{arguments:?} hangs"))
}

/// The program must fail with exit code 2 and one short message that contains all of `words`.
fn assert_refused(folder: &Path, arguments: &[&str], words: &[&str]) {
    let output = skiagraph(folder, arguments);
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {said}");
    assert!(said.starts_with("error: ") && said.len() < 2000, "{arguments:?}: {said}");
    for word in words {
        assert!(said.contains(word), "{arguments:?}: no {word:?} in: {said}");
    }
}

fn shipped(relative: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(relative)
}

/// A folder with a scenario, its set and a run on the set.
fn with_set() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("tiny.toml"), TINY).unwrap();
    for arguments in [
        &["render", "tiny.toml", "--quiet", "--out", "set"][..],
        &["track", "set", "--tracker", "frozen", "--quiet", "--out", "run"],
    ] {
        let output = skiagraph(folder.path(), arguments);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
    folder
}

/// Changes a file of the set and updates its hash, as in a maliciously modified set.
fn forge(folder: &Path, file: &str, change: impl FnOnce(Vec<u8>) -> Vec<u8>) {
    let path = folder.join("set").join(file);
    let hash = |bytes: &[u8]| Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect::<String>();
    let before = fs::read(&path).unwrap_or_default();
    let after = change(before.clone());
    fs::write(&path, &after).unwrap();
    let listing = folder.join("set/files.sha256");
    let mut text = fs::read_to_string(&listing).unwrap();
    match text.contains(&format!("  {file}\n")) {
        true => text = text.replace(&hash(&before), &hash(&after)),
        false => text.push_str(&format!("{}  {file}\n", hash(&after))),
    }
    fs::write(listing, text).unwrap();
}

fn replaced(from: &'static str, to: &'static str) -> impl FnOnce(Vec<u8>) -> Vec<u8> {
    move |bytes| {
        let text = String::from_utf8(bytes).unwrap();
        assert!(text.contains(from), "{from}");
        text.replacen(from, to, 1).into_bytes()
    }
}

#[test]
fn claimed_frames_rates_and_cameras_of_a_set_are_bounded() {
    let folder = with_set();
    let original = fs::read(folder.path().join("set/set.toml")).unwrap();
    for (from, to, words) in [
        ("frames = 5", "frames = 1000000000", "expected 1 to 1000000, found 1000000000"),
        ("frames_per_second = 60.0", "frames_per_second = 1e300", "expected 0.001 to 100000"),
        ("cameras = 2", "cameras = 4000000000", "expected 1 to 999, found 4000000000"),
    ] {
        forge(folder.path(), "set.toml", |_| replaced(from, to)(original.clone()));
        for command in [&["inspect", "set"][..], &["track", "set", "--tracker", "frozen", "--out", "other"]] {
            assert_refused(folder.path(), command, &["set/set.toml: ", words]);
        }
    }
    // within the limit, but there is no file for it
    forge(folder.path(), "set.toml", |_| replaced("frames = 5", "frames = 900000")(original));
    let words = ["set/set.toml: ", "found 900000 frames and no observations/cam00/silhouette/899999.png"];
    assert_refused(folder.path(), &["track", "set", "--tracker", "frozen", "--out", "other"], &words);
    assert_refused(folder.path(), &["inspect", "set"], &["set/truth/truth.npz: 5 frames, set.toml says 900000"]);
}

#[test]
fn claimed_sizes_of_props_bodies_and_images_are_bounded() {
    let folder = with_set();
    let prop = r#"{"schema": "skiagraph.props/1", "props": [{"name": "sun", "solid": {"box": {"frame":
        {"position": [0, 0, 0], "quaternion_wxyz": [1, 0, 0, 0]}, "half_extents": [1e20, 1e20, 1e20]}}}]}"#;
    forge(folder.path(), "truth/props.json", |_| prop.into());
    assert_refused(
        folder.path(),
        &["evaluate", "set", "run"],
        &["set/truth/props.json: prop \"sun\": a solid of size 1e20 m; expected 0 to 10000 m"],
    );
    forge(folder.path(), "truth/props.json", |_| {
        prop.replace("[0, 0, 0]", "[1e300, 0, 0]").replace("1e20", "1").into()
    });
    assert_refused(folder.path(), &["inspect", "set", "--contacts"], &["set/truth/props.json", "within 1000000 m"]);
    let folder = with_set();
    forge(folder.path(), "start/body.json", replaced("\"radius_a\": ", "\"radius_a\": 1e20, \"was\": "));
    assert_refused(folder.path(), &["inspect", "set"], &["set/start/body.json: "]);
    let folder = with_set();
    forge(folder.path(), "cameras.json", |bytes| {
        let text = String::from_utf8(bytes).unwrap();
        text.replace("\"width\": 80", "\"width\": 16384").replace("\"height\": 60", "\"height\": 16384").into_bytes()
    });
    assert_refused(folder.path(), &["inspect", "set"], &["set/cameras.json: ", "150000000 pixels in total"]);
}

/// An archive of stored entries: names, and the bytes of each; all local headers at `offsets` if there are any.
fn archive(entries: &[(String, &[u8])], share: bool) -> Vec<u8> {
    let (mut bytes, mut directory, mut first) = (Vec::new(), Vec::new(), None);
    for (name, npy) in entries {
        let mut fields = Vec::new();
        [20_u16, 0, 0, 0, 0x21].iter().for_each(|half| fields.extend(half.to_le_bytes()));
        let size = npy.len() as u32;
        [crc32fast::hash(npy), size, size].iter().for_each(|word| fields.extend(word.to_le_bytes()));
        fields.extend((name.len() as u16).to_le_bytes());
        fields.extend([0, 0]);
        let offset = *first.get_or_insert(bytes.len());
        let offset = if share { offset } else { bytes.len() } as u32;
        if !share || bytes.is_empty() {
            bytes.extend(0x0403_4b50_u32.to_le_bytes());
            bytes.extend(&fields);
            bytes.extend(name.as_bytes());
            bytes.extend(*npy);
        }
        directory.extend(0x0201_4b50_u32.to_le_bytes());
        directory.extend(20_u16.to_le_bytes());
        directory.extend(&fields);
        directory.extend([0; 10]);
        directory.extend(offset.to_le_bytes());
        directory.extend(name.as_bytes());
    }
    let (start, length, count) = (bytes.len() as u32, directory.len() as u32, entries.len() as u16);
    bytes.extend(directory);
    bytes.extend(0x0605_4b50_u32.to_le_bytes());
    bytes.extend([0; 4]);
    [count, count].iter().for_each(|count| bytes.extend(count.to_le_bytes()));
    [length, start].iter().for_each(|word| bytes.extend(word.to_le_bytes()));
    bytes.extend([0; 2]);
    bytes
}

fn npy(shape: &str, values: &[f64]) -> Vec<u8> {
    let header = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': ({shape}), }}\n");
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    bytes
}

#[test]
fn claimed_sizes_of_archives_are_bounded() {
    let folder = with_set();
    let one = npy("1000, ", &[0.5; 1000]);
    let named = |count: usize| (0..count).map(|i| (format!("a{i}.npy"), one.as_slice())).collect::<Vec<_>>();
    let small = npy("", &[1.0]);
    let names = (0..60_000).map(|i| (format!("a{i}.npy"), small.as_slice())).collect::<Vec<_>>();
    let empty = npy("1000000000000, 0", &[]);
    for (bytes, words) in [
        (archive(&named(900), true), "two entries overlap"),
        (archive(&names, false), "60000 entries; expected at most 1000"),
        (archive(&[("x".repeat(30_000), &one)], false), "the name of an entry has 30000 bytes; expected at most 200"),
        (archive(&[("energy.npy".to_owned(), &empty)], false), "the shape is too large"),
    ] {
        fs::write(folder.path().join("run/poses.npz"), &bytes).unwrap();
        assert_refused(folder.path(), &["evaluate", "set", "run"], &["run/poses.npz: ", words]);
        fs::write(folder.path().join("a.model"), &bytes).unwrap();
        assert_refused(folder.path(), &["inspect", "a.model"], &["a.model: ", words]);
    }
    // a large valid archive without shared bytes is still read
    fs::write(folder.path().join("run/poses.npz"), archive(&named(900), false)).unwrap();
    assert_refused(folder.path(), &["evaluate", "set", "run"], &["run/poses.npz: has no array \"fps\""]);
}

#[cfg(unix)]
#[test]
fn repeated_meshes_and_attributes_of_robots_are_bounded() {
    let folder = tempfile::tempdir().unwrap();
    let side = 60; // 2 x 60 x 60 triangles
    let vertex = |i: usize| format!("v {} {} 0\n", i % (side + 1), i / (side + 1));
    let mut obj: String = (0..(side + 1) * (side + 1)).map(vertex).collect();
    for (x, y) in (0..side).flat_map(|y| (0..side).map(move |x| (x, y))) {
        let at = y * (side + 1) + x + 1;
        obj.push_str(&format!("f {at} {} {}\nf {at} {} {}\n", at + 1, at + side + 2, at + side + 2, at + side + 1));
    }
    fs::write(folder.path().join("m.obj"), obj).unwrap();
    std::os::unix::fs::symlink("/dev/zero", folder.path().join("zero.stl")).unwrap();
    let visual = "<visual><geometry><mesh filename=\"m.obj\"/></geometry></visual>";
    let robot = |inside: &str| format!("<robot name=\"r\">\n<link name=\"a\">{inside}</link></robot>");
    let ball = "<visual><geometry><sphere radius=\"0.1\"/></geometry></visual>";
    let links: String = (0..1001).map(|i| format!("<link name=\"l{i}\"/>")).collect();
    let attributes: String = (0..100_000).map(|i| format!(" a{i}=\"1\"")).collect();
    for (text, words) in [
        (robot(&visual.repeat(3000)), "mesh `m.obj`: with it the meshes have more than 5000000 triangles"),
        (robot(&ball.repeat(5001)), "more than 5000 solids"),
        (format!("<robot name=\"r\">{links}</robot>"), "more than 1000 links"),
        (robot(&format!("<visual{attributes}/>")), "r.urdf:2: not well-formed XML: an element has 100000 attributes"),
        (robot(&"<x/>".repeat(200_001)), "more than 200000 elements"),
        (robot(&"<x>".repeat(100_000)), "r.urdf:2: "),
        (
            robot("").replace("\"a\"", &format!("\"{}\"", "a".repeat(100_000))),
            "`name` has 100000 characters; expected at most 200",
        ),
        (robot("<visual><geometry><mesh filename=\"zero.stl\"/></geometry></visual>"), "leads out of"),
    ] {
        fs::write(folder.path().join("r.urdf"), text).unwrap();
        assert_refused(folder.path(), &["inspect", "r.urdf"], &["r.urdf:", words]);
    }
}

#[test]
fn nesting_of_overrides_and_scenarios_is_bounded() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("tiny.toml"), TINY).unwrap();
    let deep = format!("{}=1", vec!["a"; 20_001].join("."));
    assert_refused(
        folder.path(),
        &["check", "tiny.toml", &deep],
        &["override a.a.a.", "at most 16 parts between dots"],
    );
    let deep = format!("{}=1", vec!["a"; 20_001].join("."));
    assert_refused(
        folder.path(),
        &["track", ".", "--tracker", "frozen", &deep, "--out", "run"],
        &["at most 16 parts between dots"],
    );
    let nested = format!("name={}1{}", "[".repeat(60_000), "]".repeat(60_000));
    assert_refused(folder.path(), &["check", "tiny.toml", &nested], &["override name=[[["]);
    for text in [
        format!("{TINY}{} = 1\n", vec!["a"; 20_001].join(".")),
        format!("{TINY}x = {}{}\n", "[".repeat(50_000), "]".repeat(50_000)),
        format!("{TINY}x = {}1{}\n", "{a=".repeat(50_000), "}".repeat(50_000)),
        format!("{TINY}[{}]\n", vec!["a"; 20_001].join(".")),
    ] {
        fs::write(folder.path().join("deep.toml"), text).unwrap();
        assert_refused(folder.path(), &["check", "deep.toml"], &["deep.toml:"]);
    }
    fs::write(folder.path().join("deep.txt"), format!("{{\"x\": {}", "[".repeat(1_000_000))).unwrap();
    assert_refused(folder.path(), &["inspect", "deep.txt"], &["deep.txt:1: expected a DeepMimic clip"]);
}

#[test]
fn numbers_in_a_scenario_are_bounded() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("tiny.toml"), TINY).unwrap();
    let props: String = (0..1001)
        .map(|i| format!("{{ name = \"p{i}\", shape = {{ sphere = {{ radius_m = 1.0 }} }}, place_m = [0, 0, 0] }},"))
        .collect();
    let camera = |numbers: &str| {
        format!(
            "rig.camera=[{{size_px=[80, 60], matrix=[[{numbers}, 0, 40], [0, 60, 30], [0, 0, 1]], \
             rotation=[[1, 0, 0], [0, 0, -1], [0, 1, 0]], translation_m=[0, 1, 3]}}]"
        )
    };
    for (change, words) in [
        ("seeds=4000000000".to_owned(), "seeds: expected 1 to 100000"),
        ("motion.loop_to_s=1e9".to_owned(), "motion.loop_to_s: expected 0.01 to 3600"),
        ("motion.frames_per_second=1e9".to_owned(), "motion.frames_per_second: expected 1 to 1000"),
        ("rig.ring.count=4000000000".to_owned(), "rig.ring.count: expected 1 to 64"),
        ("rig.ring.size_px=[4000000000, 4000000000]".to_owned(), "sides of 1 to 8192 px"),
        ("rig.ring.size_px=[8192, 8192]".to_owned(), ""),
        ("tracker.annealed_particle_filter.particles=1000000000000".to_owned(), "expected 1 to 1000000"),
        ("tracker.annealed_particle_filter.layers=1000000000000".to_owned(), "expected 1 to 1000"),
        (format!("prop=[{props}]"), "prop: expected at most 1000 props, found 1001"),
        (
            "prop=[{ name = \"p\", shape = { sphere = { radius_m = 1e20 } }, place_m = [0, 0, 0] }]".to_owned(),
            "0.001 to 1000",
        ),
        (
            "prop=[{ name = \"p\", shape = { sphere = { radius_m = 1.0 } }, place_m = [1e20, 0, 0] }]".to_owned(),
            "-10000 to 10000",
        ),
        (camera("1e200"), "numbers of at most 10000000 px"),
    ] {
        if words.is_empty() {
            // two such images are within the limit, four are not
            let four = [&change, "rig.ring.count=4"];
            assert_refused(folder.path(), &["check", "tiny.toml", four[0], four[1]], &["rig: ", "150000000 pixels"]);
            continue;
        }
        assert_refused(folder.path(), &["check", "tiny.toml", &change], &[words]);
    }
}

#[cfg(unix)]
#[test]
fn devices_pipes_directories_and_endless_files_are_refused_as_input() {
    let folder = with_set();
    let path = |name: &str| folder.path().join(name);
    let inputs = ["walk.bvh", "walk.amc", "walk.txt", "robot.urdf", "scenario.toml", "a.model", "nothing"];
    let hole = |name: &str| fs::File::create(path(name)).unwrap().set_len(5 << 30).unwrap();
    let pipe = |name: &str| assert!(std::process::Command::new("mkfifo").arg(path(name)).status().unwrap().success());
    let zero = |name: &str| std::os::unix::fs::symlink("/dev/zero", path(name)).unwrap();
    fs::copy(shipped("scenarios/motions/01_01.bvh"), path("ours.bvh")).unwrap();
    fs::write(path("walk.asf"), ":units\n length 0.45\n:root\n order TX TY TZ RX RY RZ\n:bonedata\n:hierarchy\n")
        .unwrap();
    for (make, words) in
        [(&hole as &dyn Fn(&str), "larger than"), (&pipe, "expected a regular file"), (&zero, "regular file")]
    {
        for input in inputs {
            make(input);
            let commands: &[&[&str]] = match input {
                "scenario.toml" => &[&["check", input], &["train", input, "--model", "gpdm", "--out", "new.model"]],
                "robot.urdf" => &[&["inspect", input], &["check", "tiny.toml", "actor.robot=robot.urdf"]],
                "a.model" | "nothing" => &[&["inspect", input]],
                _ => &[&["inspect", input], &["train", input, "--model", "gpdm", "--out", "new.model"]],
            };
            commands.iter().for_each(|command| assert_refused(folder.path(), command, &[input, words]));
            fs::remove_file(path(input)).unwrap();
        }
        for file in
            ["set/set.toml", "set/cameras.json", "set/start/body.json", "set/truth/truth.npz", "set/files.sha256"]
        {
            let kept = fs::read(path(file)).unwrap();
            fs::remove_file(path(file)).unwrap();
            make(file);
            assert_refused(folder.path(), &["evaluate", "set", "run"], &[file, words]);
            fs::remove_file(path(file)).unwrap();
            fs::write(path(file), kept).unwrap();
        }
        {
            let file = "run/poses.npz";
            let kept = fs::read(path(file)).unwrap();
            fs::remove_file(path(file)).unwrap();
            make(file);
            assert_refused(folder.path(), &["evaluate", "set", "run"], &[file, words]);
            fs::remove_file(path(file)).unwrap();
            fs::write(path(file), kept).unwrap();
        }
    }
    fs::create_dir(path("walk.bvh")).unwrap();
    assert_refused(folder.path(), &["train", "walk.bvh", "--model", "gpdm", "--out", "new.model"], &["walk.bvh"]);
}

#[test]
fn an_impossible_frame_rate_of_the_truth_is_refused() {
    let folder = with_set();
    {
        let file = "truth/truth.npz";
        let sound = fs::read(folder.path().join("set").join(file)).unwrap();
        for rate in [1e300, -60.0, f64::NAN] {
            // `fps` is the archive's first array; its checksum is in the local header and in the directory
            forge(folder.path(), file, |bytes| with_first_array(&bytes, &npy("", &[rate])));
            let named = format!("set/{file}: fps: expected 0.001 to 100000 frames a second");
            assert_refused(folder.path(), &["inspect", "set", "--contacts"], &[&named]);
        }
        forge(folder.path(), file, |_| sound);
    }
}

/// A valid archive with the bytes of its first array replaced.
fn with_first_array(bytes: &[u8], first: &[u8]) -> Vec<u8> {
    let half = |at: usize| u16::from_le_bytes(*bytes[at..].first_chunk().unwrap()) as usize;
    let word = |at: usize| u32::from_le_bytes(*bytes[at..].first_chunk().unwrap()) as usize;
    let (mut entries, mut at) = (Vec::new(), 0);
    while word(at) == 0x0403_4b50 {
        let start = at + 30 + half(at + 26);
        let name = String::from_utf8(bytes[at + 30..start].to_vec()).unwrap();
        at = start + word(at + 18);
        entries.push((name, &bytes[start..at]));
    }
    entries[0].1 = first;
    archive(&entries, false)
}
