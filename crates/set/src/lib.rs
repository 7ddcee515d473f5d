//! A benchmark set: cameras, observations and a start for trackers; ground truth for their evaluation.
//!
//! A [`BenchmarkSet`] is a number of named files, in memory or in a directory: [`BlindSet`] reads the side that
//! trackers may see, [`TruthSet`] the other. Files are identified by their SHA-256; a changed file is refused by name,
//! and the whole set has a hash of what is tested and one of every file. In every set,
//! `README.txt` (`readme.txt`) lists the files, and `FORMATS.txt` (`formats.txt`) says what they contain.
//!
//! [`verify`] makes everything that a set says of its truth again and compares; [`export`] writes the formats of other
//! tools. [`Estimates`] are what a tracker says. Sets are drawn by the application (`skiagraph::experiment`).
//!
//! ```
//! use skiagraph_core::body::shipped;
//! use skiagraph_set::{body_from_json, body_to_json};
//! // bodies lie in sets as JSON, to the bit
//! let body = shipped("tracker25")?;
//! let bytes = body_to_json("body.json", &body)?;
//! assert_eq!(body_from_json("body.json", &bytes)?, body);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![cfg_attr(
    not(test),
    warn(
        clippy::unwrap_used,
        clippy::expect_used,
        clippy::panic,
        clippy::todo,
        clippy::unimplemented,
        clippy::dbg_macro,
        clippy::print_stdout,
        clippy::print_stderr
    )
)]

mod blind;
mod body_file;
mod bodytrack_body;
mod cameras_file;
mod changed;
mod colour_files;
mod contact_facts;
mod contact_file;
mod depth_png;
mod distractors_file;
mod error;
mod estimates;
mod estimates_reader;
mod export;
mod exr_layers;
mod files;
mod filming_file;
#[cfg(test)]
mod fixture;
#[doc(hidden)]
pub mod fuzzing;
mod grey_png;
mod identity;
mod json;
mod key_file;
mod keypoints_file;
mod layer_drawing;
mod layer_files;
mod leaks;
mod listing;
mod manifest;
mod moments_file;
mod packed_files;
mod props_file;
mod public_side;
mod recording_file;
mod retarget_facts;
mod rigid;
mod samples;
mod set;
mod set_drawing;
mod set_writer;
mod shard_plan;
mod shards;
mod shown_rows;
mod silhouette_png;
mod spread_file;
mod start_file;
#[cfg(test)]
#[path = "../../test_support/bodies.rs"]
pub mod test_bodies;
#[cfg(test)]
#[path = "../../test_support/cameras.rs"]
pub mod test_cameras;
mod training_file;
mod truth_file;
mod verify;
mod views_file;

pub use blind::BlindSet;
pub use error::SetError;
pub use estimates::{Articulation, EstimatedSequence, Estimates};
pub use export::{ExportFormat, ExportWatch, export};
pub use manifest::TruthFacts;
pub use set::{BenchmarkSet, TruthSet};
pub use start_file::Start;
pub use verify::{Verification, VerifyOptions, verify};

// Parts of sets' files, for the application, tests and fuzzing: `docs/sets.md` describes the files to users.
#[doc(hidden)]
pub use self::{
    body_file::{bodies_from_json, bodies_to_json, from_json as body_from_json, to_json as body_to_json},
    bodytrack_body::{BODYTRACK_NUMBERS, BodytrackBody},
    changed::BlindChange,
    contact_facts::{ContactFacts, PushFacts, SimulationFacts},
    estimates::FARTHEST_M,
    estimates_reader::with_seed_axis,
    export::{EXPORT_FORMATS, EXPORT_README, export_blind, export_readme},
    exr_layers::{Layer, layer_channels},
    identity::{FULL_HASH_COVERS, SET_HASH_COVERS},
    keypoints_file::{KeypointSource, SetKeypoints},
    layer_drawing::LAYERS_MEMORY_BYTES,
    layer_files::{LayerFiles, LayerValues},
    leaks::{Leak, find_leaks},
    listing::KEY_FILE,
    manifest::AGAINST_ROBOT,
    moments_file::RigMoments,
    public_side::{SetPlace, is_public},
    recording_file::{SourceRecording, push_fingerprints, read_fingerprints, recordings_from_npz, recordings_to_npz},
    retarget_facts::RetargetFacts,
    set::{SET_ENTRIES, SetParts, holds_only_a_set, is_set, listed_files, verify_hashes},
    set_drawing::SetDrawing,
    silhouette_png::to_png as silhouette_to_png,
    spread_file::StepSpread,
    training_file::{Training, TrainingMotions},
    verify::{CHECKS, Checked, Fault, verify_place},
};

use skiagraph_core::{body, camera, contact, dynamics, input, npz, observation, parallel, raster, rng};
use skiagraph_truth::{observing, retarget, scene};
