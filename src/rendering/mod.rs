//! Sets of scenarios: drawn in memory or on disk, and resumed after an interruption.
//!
//! [`draw`] makes the set of a scenario, whose blind side is read for tracking, and whose truth is read for measuring:
//!
//! ```
//! use skiagraph_set::{BlindSet, TruthSet};
//! use skiagraph::common::NoProgress;
//! use skiagraph::rendering::draw;
//! use skiagraph::scenario::ScenarioFile;
//! # let folder = std::env::temp_dir().join(format!("skiagraph-set-{}", std::process::id()));
//! # std::fs::create_dir(&folder)?;
//! let small = ["motion.loop_to_s=1.0", "rig.ring.size_px=[80, 60]"].map(str::to_owned);
//! let (set, _notes) = draw(&ScenarioFile::built_in(&small)?, None, &NoProgress)?;
//! set.write(&folder)?;
//! let blind = BlindSet::read(&folder)?;
//! assert_eq!(blind.observation(0)?.silhouettes.len(), blind.rig.cameras.len());
//! assert_eq!(TruthSet::read(&folder)?.ground_truth.frames.len(), blind.frame_count);
//! # std::fs::remove_dir_all(&folder)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod key_source;
pub(crate) mod memory;
pub(crate) mod observer;
mod render;
mod same_set;
mod unfinished_set;

pub use key_source::KeySource;
pub(crate) use key_source::{fresh_key, has_secrets};
pub use render::{RenderOptions, draw, render};
