//! The root's trajectory in the format of TUM's RGB-D benchmark.

use std::fmt::Write as _;

use super::folder::Folder;
use crate::format::rigid;
use crate::{BenchmarkSet, SetError};

const README: &str = "\
root.txt   a line a frame: time x y z qx qy qz qw, seconds and metres; world_from_root of the actor, the world's Z up.
           evo_traj tum root.txt --plot";

pub(super) fn write(set: &BenchmarkSet, folder: &Folder<'_>) -> Result<(), SetError> {
    folder.readme(&set.blind, README)?;
    let mut text = String::from("# time x y z qx qy qz qw\n");
    for frame in &set.truth.ground_truth.frames {
        let [x, y, z, qw, qx, qy, qz] = rigid::to_row(&frame.pose.world_from_root);
        writeln!(text, "{} {x} {y} {z} {qx} {qy} {qz} {qw}", frame.time_s).ok();
    }
    folder.write("root.txt", text.as_bytes())
}
