//! Every message names the file with the error, quotes little of it and no control characters; paths need not be UTF-8.

use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::cargo::cargo_bin_cmd;
use sha2::{Digest, Sha256};

const TINY: &str = "schema = \"skiagraph.scenario/1\"\nname = \"tiny\"\n[motion]\nclip = \"embedded:walk\"\nlast_frame = 3\n\
    [rig.ring]\ncount = 2\nradius_m = 3.5\nsize_px = [80, 60]\n[tracker.frozen]\n";

/// An empty folder to run the program in.
struct Sandbox(tempfile::TempDir);

impl Sandbox {
    fn new() -> Self {
        let room = Self(tempfile::tempdir().unwrap());
        room.write("tiny.toml", TINY);
        room
    }

    fn path(&self, name: impl AsRef<Path>) -> PathBuf {
        self.0.path().join(name)
    }

    fn write(&self, name: impl AsRef<Path>, bytes: impl AsRef<[u8]>) {
        fs::write(self.path(name), bytes).unwrap();
    }

    /// Exit code, standard output and standard error.
    fn run<I: AsRef<OsStr>>(&self, arguments: impl IntoIterator<Item = I>) -> (i32, String, String) {
        let mut command = cargo_bin_cmd!("skiagraph");
        let output = command.args(arguments).current_dir(self.0.path()).env_remove("SKIAGRAPH_MOCAP").output().unwrap();
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
        (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
    }

    fn succeed<I: AsRef<OsStr>>(&self, arguments: impl IntoIterator<Item = I>) -> String {
        let (code, stdout, stderr) = self.run(arguments);
        assert_eq!(code, 0, "{stderr}");
        stdout
    }

    /// The command must fail with exit code 2 and one message that names `file`.
    fn blames(&self, command: &str, file: &str) -> String {
        let (code, _, said) = self.run(command.split_whitespace());
        assert_eq!(code, 2, "{command}: {said}");
        let error =
            said.lines().find(|line| line.starts_with("error: ")).unwrap_or_else(|| panic!("{command}: {said}"));
        assert!(error.contains(file), "{command}: does not name {file}: {said}");
        assert!(!said.contains("panicked") && !said.contains("This is a bug"), "{command}: {said}");
        said
    }

    /// Like [`Self::blames`], for every command, with `file` in place of FILE.
    fn all_blame(&self, commands: &[&str], file: &str) {
        commands.iter().for_each(|command| drop(self.blames(&command.replace("FILE", file), file)));
    }
}

fn shipped(relative: &str) -> String {
    fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(relative)).unwrap()
}

/// Commands that read a recording.
const OF_RECORDINGS: [&str; 6] = [
    "inspect FILE",
    "inspect FILE --contacts",
    "train FILE --model gpdm --out new.model",
    "check tiny.toml motion.clip=FILE",
    "run tiny.toml motion.clip=FILE",
    "render tiny.toml motion.clip=FILE --out set",
];

/// Commands that read a robot.
const OF_ROBOTS: [&str; 4] = [
    "inspect FILE",
    "check tiny.toml actor.robot=FILE",
    "render tiny.toml tracker_body.robot=FILE --out set",
    "train embedded:walk --robot FILE --model gpdm --out new.model",
];

#[test]
fn every_error_in_a_recording_names_the_recording() {
    let room = Sandbox::new();
    let bvh = shipped("scenarios/motions/01_01.bvh");
    let head: Vec<&str> = bvh.lines().take(190).collect();
    let short = head.join("\n").replace("Frames: 2752", "Frames: 3");
    assert_eq!(short.lines().count(), 190);
    let cases: [(&str, Vec<u8>); 12] = [
        ("none.bvh", Vec::new()),
        ("cut.bvh", bvh.as_bytes()[..9000].to_vec()),
        ("bytes.bvh", vec![0xff, 0, 0x80, 0x1b]),
        ("none.txt", Vec::new()),
        ("short.txt", b"{\"Loop\": \"wrap\", \"Frames\": [[1, 2]]}".to_vec()),
        ("deep.txt", b"{\"Loop\": \"wrap\", \"Frames\": [[1], [[2]]]}".to_vec()),
        ("none.amc", Vec::new()),
        ("lone.bvh", bvh.lines().take(184).collect::<Vec<_>>().join("\n").into_bytes()),
        ("nan.bvh", short.replacen("0.0", "nan", 1).into_bytes()),
        ("no-such-file.bvh", Vec::new()),
        ("odd.bvh", short.replace("Zrotation", "Wrotation").into_bytes()),
        ("zeros.bvh", short.replace("Frame Time: ", "Frame Time: 0 ").into_bytes()),
    ];
    for (name, bytes) in cases {
        if name != "no-such-file.bvh" {
            room.write(name, bytes);
        }
        if name != "zeros.bvh" {
            room.all_blame(&OF_RECORDINGS, name);
        }
    }
    // a valid file, but not a human skeleton
    let nobody = "HIERARCHY\nROOT pole\n{\n OFFSET 0 0 0\n CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n \
        JOINT flag\n {\n OFFSET 0 1.7 0\n CHANNELS 3 Zrotation Xrotation Yrotation\n End Site\n {\n OFFSET 0 0.1 0\n }\n }\n}\n\
        MOTION\nFrames: 3\nFrame Time: 0.01\n0 0 0 0 0 0 0 0 0\n0 0 1 0 0 0 0 0 0\n0 0 2 0 0 0 0 0 0\n";
    room.write("pole.bvh", nobody);
    room.all_blame(&OF_RECORDINGS[1..], "pole.bvh");
    room.blames("train embedded:walk --first-frame 39 --last-frame 39 --model gpdm --out m", "embedded:walk");
    room.blames("train embedded:walk --last-frame 4000 --model gpdm --out m", "embedded:walk");
    room.blames("train embedded:walk --last-frame 3 --model gpdm-graph --out m", "embedded:walk");
    room.blames("train embedded:walk --fps 1e9 --model gpdm --out m", "embedded:walk");
}

#[test]
fn every_error_in_a_robot_names_the_robot() {
    let room = Sandbox::new();
    let urdf = shipped("robots/tracker25.urdf");
    let cases = [
        ("none.urdf", String::new()),
        ("cut.urdf", urdf[..urdf.len() / 2].to_owned()),
        ("number.urdf", urdf.replacen("xyz=\"", "xyz=\"nan ", 1)),
        ("twice.urdf", urdf.replace("</robot>", "<link name=\"pelvis\"/></robot>")),
        ("mesh.urdf", urdf.replacen("<sphere radius=", "<mesh filename=\"gone.stl\" was=", 1)),
        ("other.urdf", "<html/>".to_owned()),
    ];
    for (name, text) in cases {
        room.write(name, text);
        room.all_blame(&OF_ROBOTS, name);
    }
    room.write("bare.urdf", "<robot name=\"bare\"><link name=\"a\"/></robot>");
    room.all_blame(&OF_ROBOTS[1..2], "bare.urdf");
    room.blames(&OF_ROBOTS[3].replace("FILE", "bare.urdf"), "bare.urdf");
    // a mismatch between scenario and robot is reported for the scenario
    let ball = "<robot name=\"ball\"><link name=\"a\"><visual><geometry><sphere radius=\"0.1\"/></geometry></visual></link></robot>";
    room.write("ball.urdf", ball);
    room.blames("check tiny.toml actor.robot=ball.urdf actor.contact=fix", "ball.urdf");
    room.write("fix.toml", TINY.replace("[rig.ring]", "[actor]\nrobot = \"ball.urdf\"\ncontact = \"fix\"\n[rig.ring]"));
    room.blames("check fix.toml", "fix.toml:7: actor.robot: ball.urdf");
}

#[test]
fn every_error_in_a_scenario_or_override_names_it() {
    let room = Sandbox::new();
    let commands = ["check FILE", "run FILE", "render FILE --out set", "train FILE --model gpdm --out new.model"];
    for (name, text) in [
        ("none.toml", String::new()),
        ("cut.toml", TINY[..40].to_owned()),
        ("bytes.toml", "\u{0}\u{1b}".to_owned()),
        ("type.toml", TINY.replace("count = 2", "count = \"two\"")),
        ("unseen.toml", TINY.replace("radius_m = 3.5", "radius_m = 3.5\nlook_at_m = [900, 0, 1]")),
        ("untrained.toml", TINY.replace("[tracker.frozen]", "[tracker.gpdm]")),
    ] {
        room.write(name, text);
        room.all_blame(&commands, name);
    }
    fs::write(room.path("latin1.toml"), b"# caf\xe9\n").unwrap();
    room.all_blame(&commands, "latin1.toml");
    room.all_blame(&commands, "missing.toml");
    room.blames("check tiny.toml seeds=none", "override seeds=none");
    room.blames("run tiny.toml tracker.gpdm.model_file=gone.model", "gone.model");
    room.blames("run tiny.toml --mocap-dir nowhere motion.clip=gone.bvh", "gone.bvh");
}

/// Writes a file of a set and lists its hash.
fn forge(room: &Sandbox, set: &str, file: &str, bytes: &[u8]) {
    let path = room.path(set).join(file);
    let hash = |bytes: &[u8]| Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect::<String>();
    let before = hash(&fs::read(&path).unwrap());
    fs::write(&path, bytes).unwrap();
    let listing = room.path(set).join("files.sha256");
    let text = fs::read_to_string(&listing).unwrap().replace(&before, &hash(bytes));
    fs::write(listing, text).unwrap();
}

#[test]
fn files_of_sets_and_runs_are_named_with_their_path() {
    let room = Sandbox::new();
    room.succeed("render tiny.toml --quiet --out sets/tiny".split(' '));
    room.succeed("track sets/tiny --tracker frozen --quiet --out run".split(' '));
    let blind = ["track sets/tiny --tracker frozen --out other", "inspect sets/tiny", "evaluate sets/tiny run"];
    let files = [
        ("set.toml", &blind[..]),
        ("cameras.json", &blind),
        ("start/start.json", &blind),
        ("start/body.json", &blind),
        ("start/spread.npz", &blind),
        ("truth/truth.npz", &blind[1..]),
        ("truth/actor.json", &blind[1..]),
        ("observations/cam01/silhouette/000001.png", &blind[..1]),
    ];
    for (file, commands) in files {
        let named = format!("sets/tiny/{file}");
        let sound = fs::read(room.path(&named)).unwrap();
        let truncated = &sound[..sound.len() / 2];
        for broken in [&b""[..], b"\0\xff\x1b[2J", truncated] {
            // with a wrong hash
            fs::write(room.path(&named), broken).unwrap();
            commands.iter().for_each(|command| drop(room.blames(command, &named)));
            // with a correct hash but an invalid format
            fs::write(room.path(&named), &sound).unwrap();
            forge(&room, "sets/tiny", file, broken);
            for command in commands {
                let said = room.blames(command, &named);
                assert!(!said.contains("was changed"), "{said}");
            }
            forge(&room, "sets/tiny", file, &sound);
        }
        fs::remove_file(room.path(&named)).unwrap();
        commands.iter().for_each(|command| drop(room.blames(command, &named)));
        fs::write(room.path(&named), &sound).unwrap();
    }
    room.succeed(blind[2].split(' '));
    // a run without track.json and search.npz is measured as the estimate of another program
    {
        let file = "run/poses.npz";
        let sound = fs::read(room.path(file)).unwrap();
        for broken in [&b""[..], b"\0\xff\x1b[2J", &sound[..sound.len() / 2]] {
            fs::write(room.path(file), broken).unwrap();
            room.blames(blind[2], file);
        }
        fs::write(room.path(file), &sound).unwrap();
    }
    let poses = fs::read(room.path("run/poses.npz")).unwrap();
    for broken in [&b""[..], b"PK", &poses[..99], &poses] {
        fs::write(room.path("a.model"), broken).unwrap();
        room.blames("inspect a.model", "a.model");
        room.blames("run tiny.toml tracker.gpdm.model_file=a.model", "a.model");
    }
    room.blames("inspect sets", "sets");
    room.blames("evaluate sets/tiny nowhere", "nowhere");
}

/// The message must be short, quote at most 200 of the X's and contain no control characters.
fn assert_tame(said: &str) {
    assert!(said.len() < 3000, "{} bytes: {}...", said.len(), &said.chars().take(300).collect::<String>());
    assert!(said.lines().all(|line| line.split(|c| c != 'X').all(|run| run.len() <= 200)), "{said}");
    let steers = |c: char| (c.is_control() && c != '\n') || ('\u{202a}'..='\u{202e}').contains(&c);
    assert!(!said.contains(steers), "{said:?}");
}

#[test]
fn messages_quote_little_and_contain_no_control_characters() {
    let room = Sandbox::new();
    let long = format!("\u{1b}]0;owned\u{7}\u{9b}2J\u{202e}{}", "X".repeat(60_000));
    let word: String = long.chars().filter(|c| !c.is_whitespace()).collect();
    let bvh = format!("HIERARCHY\nROOT {word}\n{{\n OFFSET 0 0 0\n CHANNELS 1 {word}\n");
    let asf = format!(":units\n length {word}\n");
    let xml = "X".repeat(60_000);
    let robot = |inside: &str| format!("<robot name=\"r\">{inside}</robot>");
    let files: Vec<(&str, String)> = vec![
        ("a.bvh", bvh),
        ("b.bvh", format!("{word} {word}")),
        ("a.txt", format!("{{\"Loop\": \"{xml}\", \"Frames\": \"{xml}\"}}")),
        ("b.txt", format!("{{\"{xml}\": 1}}")),
        ("a.asf", asf),
        ("a.amc", "1\nroot 0 0 0\n".to_owned()),
        ("a.urdf", robot(&format!("<link name=\"a\"/><joint name=\"j\" type=\"{xml}\"/>"))),
        ("b.urdf", robot(&format!("<link name=\"{xml}\"/><link name=\"{xml}\"/>"))),
        ("c.urdf", robot(&format!("<link name=\"a\"><visual><origin xyz=\"{xml}\"/></visual></link>"))),
        (
            "d.urdf",
            robot(&format!("<link name=\"a\"><visual><geometry><mesh filename=\"{xml}\"/></geometry></visual></link>")),
        ),
        ("e.urdf", robot(&format!("<{xml}></b>"))),
        ("f.urdf", robot(&format!("<link name=\"a\" {xml}=\"1\" {xml}=\"1\"/>"))),
    ];
    for (name, text) in files {
        room.write(name, text);
        if name != "a.asf" {
            assert_tame(&room.blames(&format!("inspect {name}"), if name == "a.amc" { "a.asf" } else { name }));
        }
    }
    for (name, text) in [
        ("a.toml", format!("{TINY}{xml} = 1\n")),
        ("b.toml", TINY.replace("\"tiny\"", &format!("\"{xml}\""))),
        ("c.toml", TINY.replace("embedded:walk", &format!("embedded:{xml}"))),
        ("d.toml", TINY.replace("count = 2", &format!("count = \"{xml}\""))),
        ("e.toml", format!("{TINY}{long}")),
        ("f.toml", TINY.replace("tracker.frozen", &format!("tracker.{xml}"))),
        ("g.toml", TINY.replace("embedded:walk", &xml)),
        ("h.toml", TINY.replace("embedded:walk", &format!("{xml}.bvh\"\nsource = \"{xml}"))),
        ("i.toml", TINY.replace("[rig.ring]", &format!("[actor]\nrobot = \"{xml}\"\n[rig.ring]"))),
        ("j.toml", TINY.replace("schema = \"", &format!("schema = \"{xml}"))),
        ("k.toml", TINY.replace("[tracker.frozen]", &format!("[methods.\"{xml}\".frozen]"))),
        ("l.toml", TINY.replace("size_px = [", &format!("size_px = [\"{xml}\", "))),
    ] {
        room.write(name, text);
        assert_tame(&room.blames(&format!("check {name}"), name));
    }
    for change in [format!("{xml}=1"), format!("name={xml}"), format!("seeds=\"{xml}\""), format!("tracker.{xml}={{}}")]
    {
        assert_tame(&room.blames(&format!("check tiny.toml {change}"), "override"));
        assert_tame(&room.blames(&format!("track . --tracker frozen {change} --out x"), "override"));
    }
    assert_tame(&room.run(["inspect", &format!("\u{1b}[2J{}", "X".repeat(100))]).2);
    room.succeed("render tiny.toml --quiet --out set".split(' '));
    let sound = |file: &str| fs::read_to_string(room.path("set").join(file)).unwrap();
    let (manifest, cameras, start) = (sound("set.toml"), sound("cameras.json"), sound("start/start.json"));
    for (file, text, broken) in [
        ("set.toml", &manifest, manifest.replace("skiagraph.set/1", &xml)),
        ("set.toml", &manifest, format!("{xml} = {xml}")),
        ("set.toml", &manifest, manifest.replace("name = \"tiny\"", &format!("name = \"{xml}\""))),
        ("cameras.json", &cameras, cameras.replace("skiagraph.cameras/1", &xml)),
        ("cameras.json", &cameras, cameras.replacen("\"near\"", &format!("\"{xml}\""), 1)),
        (
            "cameras.json",
            &cameras,
            cameras.replace("cam00\",", &format!("{xml}\",")).replacen("\"width\": 80", "\"width\": 0", 1),
        ),
        ("start/start.json", &start, start.replacen("\"frame\"", &format!("\"{xml}\""), 1)),
    ] {
        forge(&room, "set", file, broken.as_bytes());
        assert_tame(&room.blames("inspect set", &format!("set/{file}")));
        forge(&room, "set", file, text.as_bytes());
    }
    room.succeed("inspect set".split(' '));
}

#[test]
fn output_about_a_valid_file_contains_no_control_characters() {
    let room = Sandbox::new();
    let bvh = "HIERARCHY\nROOT \u{1b}[31mhip\u{7}\n{\n OFFSET 0 0 0\n CHANNELS 3 Xposition Yposition Zposition\n \
        End Site\n {\n OFFSET 0 1.75 0\n }\n}\nMOTION\nFrames: 2\nFrame Time: 0.01\n0 0 0\n0 0 0.01\n";
    room.write("red.bvh", bvh);
    let (code, stdout, stderr) = room.run(["inspect", "red.bvh"]);
    assert_eq!(code, 0, "{stderr}");
    assert!(stdout.contains("hip") && !stdout.contains(|c: char| c.is_control() && c != '\n'), "{stdout:?}");
}

#[cfg(unix)]
#[test]
fn paths_need_not_be_utf_8() {
    use std::ffi::OsString;
    use std::os::unix::ffi::OsStringExt;
    let odd = |name: &str| OsString::from_vec(name.bytes().map(|b| if b == b'@' { 0xe9 } else { b }).collect());
    let line = |arguments: &str| arguments.split(' ').map(odd).collect::<Vec<_>>();
    let room = Sandbox::new();
    let folder = room.path(odd("d@"));
    fs::create_dir(&folder).unwrap();
    fs::write(room.path(odd("d@/w@.toml")), TINY).unwrap();
    fs::write(room.path(odd("d@/m@.toml")), TINY.replace("embedded:walk", "walk.txt")).unwrap();
    fs::create_dir(room.path(odd("d@/mocap@"))).unwrap();
    let walk = shipped("scenarios/motions/humanoid3d_walk.txt");
    fs::write(room.path(odd("d@/mocap@/walk.txt")), &walk).unwrap();
    fs::write(room.path(odd("w@.txt")), &walk).unwrap();
    fs::write(room.path(odd("r@.urdf")), shipped("robots/tracker25.urdf")).unwrap();
    fs::write(room.path(odd("@@_01.amc")), ":DEGREES\n1\nroot 0 18 0 0 0 0\n2\nroot 0 18 0 0 0 1\n").unwrap();
    let skeleton = ":units\nlength 0.45\n:root\norder TX TY TZ RX RY RZ\n:bonedata\nbegin\nid 1\nname up\ndirection 0 1 0\nlength 31\naxis 0 0 0 XYZ\nend\n:hierarchy\nbegin\nroot up\nend\n";
    fs::write(room.path(odd("@@.asf")), skeleton).unwrap();
    fs::write(room.path("other.asf"), "broken").unwrap();
    for arguments in [
        "check d@/w@.toml",
        "check d@/m@.toml --mocap-dir d@/mocap@",
        "render d@/w@.toml --quiet --out s@",
        "render d@/w@.toml --quiet --json --out t@",
        "track s@ --tracker frozen --quiet --out r@",
        "evaluate s@ r@ --json",
        "evaluate s@ r@",
        "run d@/w@.toml --quiet --out u@",
        "inspect s@",
        "inspect w@.txt",
        "inspect w@.txt --contacts --out c@.svg",
        "inspect r@.urdf",
        "inspect @@_01.amc",
        "train w@.txt --robot r@.urdf --last-frame 25 --model gpdm --json --quiet --out m@.model",
        "inspect m@.model --out p@.html",
        "inspect m@.model --against m@.model",
    ] {
        room.succeed(line(arguments));
    }
    for name in ["s@/set.toml", "r@/run.json", "u@/run.json", "c@.svg", "m@.model", "p@.html"] {
        assert!(room.path(odd(name)).is_file(), "{name}");
    }
    let said = room.run(line("check d@/missing@.toml")).2;
    assert!(said.contains("missing\u{fffd}.toml: cannot read the scenario"), "{said}");
}
