//! Scenarios and what is done with them: this room knows every other but `sweep` and `cli`, which use it.
//!
//! [`run()`] renders, tracks and measures a scenario; [`render()`], [`track_set`] and [`evaluate_run`] do the three
//! apart, by way of a benchmark set on disk, with the same numbers.
//!
//! ```no_run
//! use skiagraph::artefacts::Destination;
//! use skiagraph::experiment::{NoProgress, run};
//! use skiagraph::scenario::ScenarioFile;
//! let walk = ScenarioFile::built_in(&["tracker.annealed_particle_filter.particles=50".to_owned()])?;
//! let done = run(&walk, None, Destination { path: "runs/walk".as_ref(), force: false }, &NoProgress)?;
//! println!("{:.1} mm", done.record.summary.metrics["humaneva_mm"].mean);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! [`draw`] makes a set of a scenario, which is read as trackers read it, and as those who measure do:
//!
//! ```
//! use skiagraph::benchmark_set::{BlindSet, TruthSet};
//! use skiagraph::experiment::{NoProgress, draw};
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

mod baseline;
mod body_contacts;
mod calibrating;
mod check;
mod clip_file;
mod comparison;
mod contact_facts;
pub(crate) mod cost;
mod distractors;
pub(crate) mod error;
mod export;
mod external;
mod figure_files;
mod gating;
mod hints;
mod inspect;
mod key_source;
mod ladder;
mod learning;
mod made_by;
pub(crate) mod measuring;
mod memory;
mod mismatch_seed;
mod missing_values;
mod model_file;
mod model_store;
mod model_training;
mod more_seeds;
mod nearest_training_pose;
mod observing;
mod oracle;
mod part_rotations;
mod people;
mod per_frame;
mod pictures;
mod placement;
mod playback;
mod poses_file;
mod progress;
mod rendering;
pub(crate) mod results;
mod retargeted_motion;
mod retargeting;
mod rig;
mod robots;
pub(crate) mod run;
mod run_picture;
pub(crate) mod run_reading;
mod same_set;
pub(crate) mod scenario_copy;
mod scene_check;
pub(crate) mod scene_hash;
mod scene_preparation;
mod search_file;
mod seed_advice;
mod segmenting;
mod set_tracking;
mod skins;
mod start_check;
mod track_timing;
mod tracker_factory;
pub(crate) mod tracking;
mod training;
mod unfinished_run;
mod unfinished_set;
mod verification;

pub use baseline::{BASELINES, Baseline, Listed, Saved};
pub use check::{CheckReport, check, unusable_files};
pub use clip_file::EMBEDDED_CLIPS;
pub use comparison::{COMPARISON_FILE, COMPARISON_PAGE, Compared, MethodComparison, MethodRecord, compare};
pub use cost::RunCost;
pub use error::ExperimentError;
pub use export::{ExportTo, export_set};
pub use external::{
    AnswerCount, Conformance, ExternalRecord, Incident, LeftBehind, LeftFile, ProgramOptions, ProgramSandbox,
    ProgramSettings, Programmed, ProtocolCheck, SeedEnding, dry_run, track_with_program,
};
pub use figure_files::{stored_figures, write_figures};
pub use gating::{GATE_FILE, check_metric, gate_run, read_rules};
pub use hints::Hint;
pub use inspect::{
    Against, CameraSummary, ClipSummary, ContactSummary, EditedContact, EditedSummary, Facts, FastestAngle, FitSummary,
    GraphModelFacts, InspectOptions, Inspected, MeanAndMost, ModelSummary, RobotSummary, SeamSummary, SetSummary,
    SkinSummary, StanceSummary, WorstContact, inspect, inspect_contacts, inspect_scenario, is_skin_file,
};
pub use key_source::KeySource;
pub use ladder::LadderProgress;
pub use learning::Models;
pub use made_by::RunPlace;
pub use measuring::{Measures, SeedMeasures};
pub use model_file::{LearnedFrom, LearnedModel, MODEL_SCHEMA, ModelFacts, RobotFacts};
pub use model_training::{ClipOptions, Trained, TrainingInput, train};
pub use more_seeds::{MoreOf, add_missing_seeds, add_seeds};
pub use poses_file::{PosesDeclared, ReadAs, UNITS_OF_LENGTH};
pub use progress::{NoProgress, Progress, Stage};
pub use rendering::{RenderOptions, draw, render, render_with};
pub use results::{CONTACT_SHEET_FILE, PER_FRAME_FILE, REPORT_FILE, RUN_FILE, RunRecord, RunResults};
pub use run::{Evaluated, RunOutcome, evaluate_run, run};
pub use run_picture::run_picture;
pub use run_reading::{ComparedSide, SidesToCompare, compare_sides, read_runs};
pub use scene_check::{ActorPath, CameraView};
pub use scene_preparation::PreparedScene;
pub use search_file::SearchRecord;
pub use segmenting::{SEGMENT_FILE, SegmentInput, Segmented, SegmentedFrom, segment};
pub use set_tracking::{check_program, track_set, track_set_calibrating, track_set_with_program};
pub use track_timing::TrackTiming;
pub use tracking::{TrackRecord, Tracked, track};
pub use verification::verify_set;

/// Named bytes, in the order in which they are written.
pub type NamedFiles = Vec<(&'static str, Vec<u8>)>;

/// A JSON file's bytes, ending in a newline.
pub(crate) fn to_json(value: &impl serde::Serialize) -> Result<Vec<u8>, ExperimentError> {
    let mut bytes = serde_json::to_vec_pretty(value)
        .map_err(|e| ExperimentError::Malformed { path: "JSON".into(), detail: e.to_string() })?;
    bytes.push(b'\n');
    Ok(bytes)
}
