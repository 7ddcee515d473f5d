//! Pipelines whose files are known: their axes and names. Units are declared in the files, or metres, as in the
//! cameras that `export` writes for them.

use std::collections::BTreeMap;

use crate::evaluation::AxisOrder;

/// A pipeline that writes files of points, read with `--from`.
#[derive(Debug, PartialEq, Eq)]
pub struct Pipeline {
    /// Its name on the command line.
    pub name: &'static str,
    /// What it writes, in a few words.
    pub what: &'static str,
    /// The set's axes of its coordinates, if it was given the cameras of an export.
    pub(super) order: AxisOrder,
    /// Its names and the markers there, where they are not those of a keypoint layout.
    names: &'static [(&'static str, &'static str)],
}

/// All pipelines. Pose2Sim writes (y, z, x) of the cameras' world, and the names of its `skeletons.py`.
pub static PIPELINES: [Pipeline; 2] = [
    Pipeline {
        name: "pose2sim",
        what: "TRC or C3D of Pose2Sim: axes y,z,x; names of its skeletons, Hip or CHip for the pelvis",
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
        what: "CSV of anipose, with fnum: axes x,y,z; names of keypoint layouts",
        order: AxisOrder::SAME,
        names: &[],
    },
];

impl Pipeline {
    /// The pipeline of this name.
    pub fn named(name: &str) -> Option<&'static Self> {
        PIPELINES.iter().find(|pipeline| pipeline.name == name)
    }

    /// The joint map of a file with these names.
    pub(super) fn joint_map(&self, names: &[String]) -> BTreeMap<String, String> {
        let is_there = |(theirs, _): &&(&str, &str)| names.iter().any(|name| name == theirs);
        self.names.iter().filter(is_there).map(|(theirs, ours)| ((*theirs).to_owned(), (*ours).to_owned())).collect()
    }
}
