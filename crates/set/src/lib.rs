//! A benchmark set: cameras, observations and a start for trackers; ground truth for their evaluation.
//!
//! A [`BenchmarkSet`] is a number of named files, in memory or in a directory: [`BlindSet`] reads the side that
//! trackers may see, [`TruthSet`] the other. Files are identified by their SHA-256; a changed file is refused by name,
//! and the whole set has a hash of what is tested and one of every file. In every set,
//! `README.txt` (`format/readme.txt`) lists the files, and `FORMATS.txt` (`format/formats.txt`) says what they contain.
//!
//! [`verify`] makes everything that a set says of its truth again and compares; [`export`] writes the formats of other
//! tools. [`Estimates`] are what a tracker says. Sets are drawn by the application (`skiagraph::rendering`).
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
mod changed;
mod error;
mod estimates;
mod export;
mod files;
#[cfg(test)]
mod fixture;
mod footage;
mod format;
#[doc(hidden)]
pub mod fuzzing;
mod identity;
// test support, shared with the application's tests, names this crate as they do
#[cfg(test)]
extern crate self as skiagraph_set;
#[cfg(test)]
#[path = "../../test_support/made_up_set.rs"]
pub mod made_up_set;
mod public_side;
mod set;
mod set_drawing;
mod set_writer;
#[cfg(test)]
#[path = "../../test_support/bodies.rs"]
pub mod test_bodies;
#[cfg(test)]
#[path = "../../test_support/cameras.rs"]
pub mod test_cameras;
mod truth_image_drawing;
mod verify;

pub use blind::BlindSet;
pub use error::SetError;
pub use estimates::{Articulation, EstimatedSequence, Estimates};
pub use export::{CroissantTable, ExportFormat, ExportWatch, export};
pub use format::manifest::TruthFacts;
pub use format::start_file::Start;
pub use set::{BenchmarkSet, TruthSet};
pub use verify::{Verification, VerifyOptions, verify};

// Parts of sets' files, for the application, tests and fuzzing: `docs/sets.md` describes the files to users.
#[doc(hidden)]
pub use self::{
    changed::BlindChange,
    estimates::FARTHEST_M,
    estimates::{with_seed_axis, zeros_as_missing},
    export::{EXPORT_FORMATS, EXPORT_README, bvh_text, cameras_to_toml, export_blind, export_readme},
    files::holds_only_a_set,
    footage::{FootageParts, is_footage},
    format::body_file::{bodies_from_json, bodies_to_json, from_json as body_from_json, to_json as body_to_json},
    format::contact_facts::{ContactFacts, PushFacts, SimulationFacts},
    format::exr_layers::{TruthImage, layer_channels},
    format::keypoints_file::{KeypointSource, SetKeypoints},
    format::listing::KEY_FILE,
    format::moments_file::RigMoments,
    format::recording_file::{
        SourceRecording, push_fingerprints, read_fingerprints, recordings_from_npz, recordings_to_npz,
    },
    format::retarget_facts::RetargetFacts,
    format::silhouette_png::encode as silhouette_to_png,
    format::spread_file::StepSpread,
    format::training_file::{Training, TrainingMotions},
    identity::{FULL_HASH_COVERS, SET_HASH_COVERS},
    public_side::{SetPlace, is_public},
    set::{SetParts, is_set, verify_hashes},
    set_drawing::SetDrawing,
    truth_image_drawing::TRUTH_IMAGE_MEMORY_BYTES,
    verify::{CHECKS, Checked, Fault, verify_place},
};
