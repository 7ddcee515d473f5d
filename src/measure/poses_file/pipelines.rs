//! Pipelines whose files are known: their axes and names. Units are declared in the files, or metres, as in the
//! cameras that `export` writes for them.

use std::collections::BTreeMap;

use skiagraph_eval::AxisOrder;

/// A pipeline that writes files of points, read with `--from`.
#[derive(Debug, PartialEq, Eq)]
pub struct Pipeline {
    /// Its name on the command line.
    pub name: &'static str,
    /// What it writes, in a few words.
    pub what: &'static str,
    files: &'static [&'static str],
    /// The set's axes of its coordinates, if it was given the cameras of an export.
    pub(super) order: AxisOrder,
    /// Its names and the markers there, where they are not this program's.
    names: &'static [(&'static str, &'static str)],
}

/// All pipelines. Pose2Sim writes (y, z, x) of the cameras' world, and the names of its `skeletons.py`.
pub static PIPELINES: [Pipeline; 2] = [
    Pipeline {
        name: "pose2sim",
        what: "TRC or C3D of Pose2Sim: axes y,z,x; names of its skeletons, Hip or CHip for the pelvis",
        files: &["trc", "c3d"],
        order: AxisOrder::BVH,
        names: &[
            ("Hip", "pelvis"),
            ("CHip", "pelvis"),
            ("Neck", "thorax"),
            ("Head", "head_top"),
            ("LShoulder", "left_shoulder"),
            ("RShoulder", "right_shoulder"),
            ("LElbow", "left_elbow"),
            ("RElbow", "right_elbow"),
            ("LWrist", "left_wrist"),
            ("RWrist", "right_wrist"),
            ("LHip", "left_hip"),
            ("RHip", "right_hip"),
            ("LKnee", "left_knee"),
            ("RKnee", "right_knee"),
            ("LAnkle", "left_ankle"),
            ("RAnkle", "right_ankle"),
        ],
    },
    Pipeline {
        name: "anipose",
        what: "CSV of anipose, with fnum, or npz: axes x,y,z; names as exported, hip or mid_hip for the pelvis",
        files: &["csv", "npz"],
        order: AxisOrder::SAME,
        names: &[("hip", "pelvis"), ("mid_hip", "pelvis"), ("neck", "thorax"), ("head", "head_top")],
    },
];

impl Pipeline {
    pub fn named(name: &str) -> Option<&'static Self> {
        PIPELINES.iter().find(|pipeline| pipeline.name == name)
    }

    /// Refuses files that it does not write, by their ending.
    pub(super) fn check_file(&self, extension: &str) -> Result<(), String> {
        if self.files.contains(&extension) {
            return Ok(());
        }
        let (name, files) = (self.name, self.files.join(" or ."));
        Err(format!(
            "--from {name}: it writes no .{extension} but .{files}; leave out --from, and give --axes if needed"
        ))
    }

    pub(super) fn joint_map(&self, names: &[String]) -> BTreeMap<String, String> {
        let is_there = |(theirs, _): &&(&str, &str)| names.iter().any(|name| name == theirs);
        self.names.iter().filter(is_there).map(|(theirs, ours)| ((*theirs).to_owned(), (*ours).to_owned())).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use skiagraph_core::body::LANDMARKS;

    #[test]
    fn a_map_has_the_names_that_are_in_the_file_and_gives_each_marker_one_name_of_a_side() {
        let names = ["CHip", "RKnee", "nose"].map(str::to_owned);
        let map = Pipeline::named("pose2sim").unwrap().joint_map(&names);
        assert_eq!((map.len(), map["CHip"].as_str(), map["RKnee"].as_str()), (2, "pelvis", "right_knee"));
        for (theirs, ours) in PIPELINES.iter().flat_map(|pipeline| pipeline.names) {
            assert!(LANDMARKS.iter().any(|landmark| landmark.name() == *ours), "{ours}");
            assert_eq!(theirs.starts_with('R'), ours.starts_with("right"), "{theirs}");
            assert_eq!(theirs.starts_with('L'), ours.starts_with("left"), "{theirs}");
        }
    }

    #[test]
    fn files_that_a_pipeline_does_not_write_are_refused() {
        let check = |name: &str, extension: &str| Pipeline::named(name).unwrap().check_file(extension);
        for (name, files) in [("pose2sim", ["trc", "c3d"]), ("anipose", ["csv", "npz"])] {
            assert_eq!(files.map(|file| check(name, file)), [Ok(()), Ok(())], "{name}");
            for other in ["mot", "bvh", "csv", "txt", "trc"].into_iter().filter(|file| !files.contains(file)) {
                let message = check(name, other).unwrap_err();
                assert!(message.contains(&format!("it writes no .{other} but .{}", files[0])), "{message}");
            }
        }
    }
}
