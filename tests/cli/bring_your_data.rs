//! Runs the command of every row of `docs/bring-your-data.md`, on a small file of that kind.

use std::fs;

use skiagraph_core::body::shipped_skin;
use skiagraph_core::npz::{Array, Npz};

use crate::glb;
use crate::sandbox::{Sandbox, shipped};

/// Bones of an Acclaim skeleton in a T-pose: name, parent, and the way from its end, metres, Y up.
const BONES: [(&str, &str, [f64; 3]); 18] = [
    ("lowerback", "root", [0.0, 0.2, 0.0]),
    ("thorax", "lowerback", [0.0, 0.3, 0.0]),
    ("neck", "thorax", [0.0, 0.1, 0.0]),
    ("head", "neck", [0.0, 0.2, 0.0]),
    ("lhipjoint", "root", [0.09, -0.03, 0.0]),
    ("lfemur", "lhipjoint", [0.0, -0.42, 0.0]),
    ("ltibia", "lfemur", [0.0, -0.4, 0.0]),
    ("lfoot", "ltibia", [0.0, -0.05, 0.14]),
    ("rhipjoint", "root", [-0.09, -0.03, 0.0]),
    ("rfemur", "rhipjoint", [0.0, -0.42, 0.0]),
    ("rtibia", "rfemur", [0.0, -0.4, 0.0]),
    ("rfoot", "rtibia", [0.0, -0.05, 0.14]),
    ("lclavicle", "thorax", [0.18, 0.0, 0.0]),
    ("lhumerus", "lclavicle", [0.28, 0.0, 0.0]),
    ("lradius", "lhumerus", [0.25, 0.0, 0.0]),
    ("rclavicle", "thorax", [-0.18, 0.0, 0.0]),
    ("rhumerus", "rclavicle", [-0.28, 0.0, 0.0]),
    ("rradius", "rhumerus", [-0.25, 0.0, 0.0]),
];
/// Length of CMU's unit, metres.
const CMU: f64 = 0.0254 / 0.45;
/// K of a camera of 640 x 480 pixels; it is at (0, -4, 1), looks along Y, and R and t are those of `CAMERA`.
const K: &str = "[600.0, 0, 320, 0, 600, 240, 0, 0, 1]";
const CAMERA: (&str, &str) = ("[[1, 0, 0], [0, 0, -1], [0, 1, 0]]", "[0, 1000, 4000]");

/// Files of recordings that nothing here exports.
fn write_recordings(room: &Sandbox) {
    let mut asf =
        ":units\nlength 0.45\nangle deg\n:root\norder TX TY TZ RX RY RZ\naxis XYZ\nposition 0 0 0\norientation 0 0 0\n\
                   :bonedata\n"
            .to_owned();
    for (name, _, [x, y, z]) in BONES {
        let length = x.hypot(y).hypot(z) / CMU;
        asf +=
            &format!("begin\nname {name}\ndirection {x} {y} {z}\nlength {length}\naxis 0 0 0 XYZ\ndof rx ry rz\nend\n");
    }
    asf += ":hierarchy\nbegin\n";
    BONES.iter().for_each(|(name, parent, _)| asf += &format!("{parent} {name}\n"));
    let mut amc = ":FULLY-SPECIFIED\n:DEGREES\n".to_owned();
    for frame in 1..=40 {
        amc += &format!("{frame}\nroot {} {} 0 0 0 0\n", 0.01 * f64::from(frame), 0.93 / CMU);
        BONES.iter().for_each(|(name, ..)| amc += &format!("{name} 0 0 0\n"));
    }
    room.write("07.asf", asf + "end\n");
    room.write("07_01.amc", amc);
    let mut poses = vec![0.0; 40 * 156];
    poses.iter_mut().step_by(156).for_each(|turn| *turn = std::f64::consts::FRAC_PI_2);
    let places: Vec<f64> = (0..40).flat_map(|frame| [0.01 * f64::from(frame), 0.0, 1.1]).collect();
    let npz = Npz::from_iter([
        ("poses", Array::new(&[40, 156], poses)),
        ("trans", Array::new(&[40, 3], places)),
        ("mocap_framerate", Array::new(&[], vec![60.0])),
    ]);
    fs::write(room.path("walk_poses.npz"), npz.to_bytes("walk_poses.npz").unwrap()).unwrap();
    fs::write(room.path("figure.glb"), glb::bytes(&shipped_skin("person_coarse").unwrap())).unwrap();
    room.write("dance.fbx", "Kaydara FBX Binary");
    fs::copy(shipped("scenarios/motions/humanoid3d_walk.txt"), room.path("humanoid3d_walk.txt")).unwrap();
}

/// Camera files that nothing here exports.
fn write_cameras(room: &Sandbox) {
    let (r, t) = CAMERA;
    let in_metres = "[0, 1, 4]";
    let matrix = |key: &str, rows: usize, numbers: &str| {
        let columns = numbers.split(',').count() / rows;
        format!("{key}: !!opencv-matrix\n   rows: {rows}\n   cols: {columns}\n   dt: d\n   data: {numbers}\n")
    };
    let flat = r.replace("], [", ", ").replace("[[", "[").replace("]]", "]");
    let of_names = |rest: String| format!("%YAML:1.0\n---\nnames:\n  - \"01\"\n{rest}");
    let lens = "W_01: 640\nH_01: 480\n".to_owned() + &matrix("K_01", 3, K) + &matrix("dist_01", 1, "[0, 0, 0, 0, 0]");
    room.write("easymocap/intri.yml", of_names(lens));
    room.write("easymocap/extri.yml", of_names(matrix("Rot_01", 3, &flat) + &matrix("T_01", 3, in_metres)));
    let jarvis = "intrinsicMatrix: [[600, 0, 0], [0, 600, 0], [320, 240, 1]]\nR: [[1, 0, 0], [0, 0, 1], [0, -1, 0]]\n";
    room.write("jarvis.yaml", format!("{jarvis}T: {t}\n"));
    let human = "{\"1\": {\"R\": RRR, \"t\": TTT, \"f\": [600, 600], \"c\": [320, 240]}}";
    room.write("human36m.json", human.replace("RRR", r).replace("TTT", t));
    let lens = "[0, 0, 0, 0, 0]";
    let lenses = [("M1", 3, K), ("D1", 1, lens), ("M2", 3, K), ("D2", 1, lens)];
    room.write("stereo/intrinsics.yml", lenses.map(|(key, rows, numbers)| matrix(key, rows, numbers)).concat());
    let identity = "[1, 0, 0, 0, 1, 0, 0, 0, 1]";
    room.write("stereo/extrinsics.yml", matrix("R", 3, identity) + &matrix("T", 3, "[-0.3, 0, 0]"));
    room.write(
        "qualisys.xml",
        "<calibration><cameras><camera serial=\"7\" viewrotation=\"0\"><fov_video left=\"0\" right=\"639\" top=\"0\" bottom=\"479\"/>\
         <transform r11=\"1\" r12=\"0\" r13=\"0\" r21=\"0\" r22=\"0\" r23=\"1\" r31=\"0\" r32=\"-1\" r33=\"0\" x=\"0\" y=\"-4000\" \
         z=\"1000\"/><intrinsic focalLengthU=\"38400\" focalLengthV=\"38400\" centerPointU=\"20448\" centerPointV=\"15328\" skew=\"0\" \
         radialDistortion1=\"0\" radialDistortion2=\"0\" radialDistortion3=\"0\" tangentalDistortion1=\"0\" \
         tangentalDistortion2=\"0\"/></camera></cameras></calibration>",
    );
}

/// The commands of the page, and the words with which they are refused.
fn commands() -> Vec<(String, Option<String>)> {
    let page = fs::read_to_string(shipped("docs/bring-your-data.md")).unwrap();
    let rows = page.lines().filter(|line| line.starts_with("| ") && !line.contains("| command |"));
    rows.map(|row| {
        let cell = row.trim_end_matches('|').rsplit(" | ").next().unwrap().trim();
        let mut quoted = cell.split('`').skip(1).step_by(2).map(str::to_owned);
        let command = quoted.next().unwrap_or_else(|| panic!("a row without a command: {row}"));
        (command.strip_prefix("skiagraph ").unwrap().to_owned(), quoted.next())
    })
    .collect()
}

#[test]
fn every_source_is_read_as_the_table_says() {
    let room = Sandbox::new();
    let scenario = "schema = \"skiagraph.scenario/1\"\nname = \"a\"\n[motion]\nclip = \"embedded:walk\"\n";
    room.write(
        "set.toml",
        format!(
            "{scenario}[rig.ring]\ncount = 2\nsize_px = [160, 120]\n[observation.keypoints]\nlayout = \"body25\"\n"
        ),
    );
    room.write("cameras.toml", format!("{scenario}last_frame = 12\n"));
    room.succeed("render set.toml --out set -q");
    room.succeed("export set --to bvh,c3d,trc,opencv,humaneva,pose2sim,anipose,caliscope,colmap --out files -q");
    for file in ["actor.urdf", "skins/person.toml", "skins/person.obj", "skins/person.weights.json"] {
        room.write(&format!("robots/{file}"), fs::read_to_string(shipped(&format!("robots/{file}"))).unwrap());
    }
    write_recordings(&room);
    write_cameras(&room);
    room.says("inspect figure.glb", &["triangles", "recording of 16 frames at 30 Hz"]);
    room.refused("inspect robots/actor.urdf --subject wave", "--subject: is only valid for recordings");
    let commands = commands();
    assert!(commands.len() > 20, "only {} rows were found", commands.len());
    for (command, refusal) in commands {
        let answer = room.ask(&command);
        let (said, code) = (format!("{}{}", answer.stdout, answer.stderr), if refusal.is_some() { 2 } else { 0 });
        assert_eq!(answer.code, code, "skiagraph {command}\n{said}");
        assert!(said.contains(refusal.as_deref().unwrap_or_default()), "skiagraph {command}\n{said}");
        assert!(!said.contains("it cannot be retargeted"), "skiagraph {command}\n{said}");
    }
}
