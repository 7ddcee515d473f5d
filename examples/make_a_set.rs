//! Makes a benchmark set: the silhouettes of a walk in two cameras, and the exact truth.
//!
//! ```sh
//! cargo run --release --example make_a_set -- sets/walk
//! ```
//!
//! Without a folder the set is only made in memory. The program prints a summary of the set.

use std::error::Error;
use std::path::Path;

use skiagraph::{Destination, ScenarioFile, render};

/// The built-in walk, seen by two small cameras.
const SCENARIO: &str = r#"
schema = "skiagraph.scenario/1"
name = "two-cameras"

[motion]
clip = "embedded:walk"
last_frame = 24

[rig.ring]
count = 2
radius_m = 3.5
size_px = [160, 120]

[tracker.frozen]
"#;

fn main() -> Result<(), Box<dyn Error>> {
    let scenario = ScenarioFile::parse(SCENARIO, "in this example", ".".into(), &[])?;
    let folder = std::env::args_os().nth(1);
    let to = folder.as_ref().map(|folder| Destination { path: Path::new(folder), force: false });
    let (set, notes) = render(&scenario, to)?;
    notes.iter().for_each(|note| println!("note: {note}"));
    println!("{} frames of {} cameras", set.blind.frame_count, set.blind.rig.cameras.len());

    // input of a tracker: silhouettes, one mask per camera
    let first = set.blind.observation(0)?;
    for (camera, mask) in set.blind.rig.cameras.iter().zip(&first.silhouettes) {
        println!("{}: {} pixels of the body in frame 0", camera.name, mask.count());
    }
    // input of the evaluation only
    let truth = &set.truth.ground_truth.frames[0];
    println!("the root is at {:.3?} m", truth.pose.world_from_root.translation.vector.as_slice());
    Ok(())
}
