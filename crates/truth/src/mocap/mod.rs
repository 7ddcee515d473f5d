//! Readers of motion recordings: BVH, ASF/AMC, DeepMimic, AMASS, glTF animations, and C3D or TRC markers are all read
//! into a [`Clip`].
//!
//! A `Clip` is always in metres, Z up, right-handed, with rotations as unit quaternions of continuous sign.
//! [`Clip::notes`] lists everything a reader guessed or repaired.
//!
//! ```no_run
//! use skiagraph_truth::mocap::{ReadOptions, read};
//! let walk = read("walk.bvh".as_ref(), &ReadOptions::default())?.crop(0..480)?.resampled(60.0)?;
//! println!("{} frames at {} Hz", walk.frames.len(), walk.frames_per_second);
//! # Ok::<(), skiagraph_truth::mocap::MocapError>(())
//! ```

mod amass;
mod amc;
mod asf;
mod body_length;
mod bvh;
mod bvh_hierarchy;
mod clip;
mod deepmimic;
mod editing;
mod error;
mod gltf;
mod looping;
mod mirror;
mod options;
mod points;
mod read;
mod recording;
mod repeats;
mod rest_pose;
mod rotation;
mod stature;
mod text_cursor;

pub(crate) use body_length::PosedTree;
pub use clip::Clip;
pub use error::MocapError;
pub use options::{ReadOptions, UpAxis};
pub use read::read;

// Parsers of single formats, for tests and fuzzing: `read` chooses among them.
#[doc(hidden)]
pub use self::{
    amass::parse_amass,
    amc::parse_amc,
    asf::{AcclaimSkeleton, parse_asf},
    bvh::parse_bvh,
    clip::{Skeleton, SkeletonJoint},
    deepmimic::parse_deepmimic,
    gltf::parse_gltf,
    options::{SidesInFile, UpSource},
    points::{IN_VIEW, MOST_POINTS, PointFile, parse_c3d, parse_markers, parse_trc},
};

/// Compares the messages about a file, each time with one text replaced, with those of `broken_recordings.jsonl` that
/// begin with its name: what is replaced, by what, and the message.
#[cfg(test)]
fn check_broken(file: &str, whole: &str, message: impl Fn(&str) -> String) {
    let cases = include_str!("broken_recordings.jsonl").lines();
    let cases = cases.map(|line| serde_json::from_str(line).unwrap());
    let cases: Vec<[String; 3]> = cases.filter(|case: &[String; 3]| case[2].starts_with(file)).collect();
    assert!(!cases.is_empty());
    for [from, to, expected] in cases {
        let broken = whole.replacen(&from, &to, 1);
        assert_ne!(broken, whole, "{from}");
        assert_eq!(message(&broken), expected);
    }
}
