//! A recording whose joints have meaningless names is usable, with `joint_map` of `[motion]` and without. (The check
//! against learning from the test once ignored the map.)

use std::fs;
use std::path::Path;

use skiagraph::prepare::PreparedScene;
use skiagraph::scenario::ScenarioFile;

/// Landmarks and the joints of `scenarios/motions/01_01.bvh`, counted from its root.
const MAP: [(&str, &str); 15] = [
    ("pelvis", "j02+j07"),
    ("thorax", "j14"),
    ("head_top", "j16:tip"),
    ("left_shoulder", "j18"),
    ("left_elbow", "j19"),
    ("left_wrist", "j20"),
    ("right_shoulder", "j25"),
    ("right_elbow", "j26"),
    ("right_wrist", "j27"),
    ("left_hip", "j02"),
    ("left_knee", "j03"),
    ("left_ankle", "j04"),
    ("right_hip", "j07"),
    ("right_knee", "j08"),
    ("right_ankle", "j09"),
];

/// The recording with meaningless joint names.
fn renamed() -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/motions/01_01.bvh");
    let text = fs::read_to_string(path).unwrap();
    let mut joints = 0;
    let line = |line: &str| {
        let is_joint = ["ROOT ", "JOINT "].iter().any(|word| line.trim_start().starts_with(word));
        match line.rsplit_once(' ').filter(|_| is_joint) {
            Some((before, _)) => {
                joints += 1;
                format!("{before} j{:02}\n", joints - 1)
            }
            None => format!("{line}\n"),
        }
    };
    text.lines().map(line).collect()
}

fn prepared(folder: &Path, map: &str) -> Result<PreparedScene, String> {
    let overrides = [
        "motion.clip=odd.bvh".to_owned(),
        "motion.first_frame=400".to_owned(),
        "motion.last_frame=520".to_owned(),
        "motion.loop_to_s=1".to_owned(),
        format!("motion.joint_map={{{map}}}"),
    ];
    let path = folder.join("walk.toml");
    fs::write(&path, skiagraph::scenario::DEFAULT_SCENARIO).unwrap();
    let file = ScenarioFile::open(&path, &overrides).map_err(|e| e.to_string())?;
    PreparedScene::new(&file, None).map_err(|e| e.to_string())
}

#[test]
fn meaningless_joint_names_are_no_obstacle() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("odd.bvh"), renamed()).unwrap();
    let map: Vec<String> = MAP.iter().map(|(landmark, joint)| format!("{landmark} = \"{joint}\"")).collect();
    let found = prepared(folder.path(), &map.join(", ")).unwrap();
    assert_eq!(found.frames(), 61);
    // without a map, the same joints are found in the tree
    let searched = prepared(folder.path(), "").unwrap();
    assert_eq!(searched.refitted, found.refitted);
}
