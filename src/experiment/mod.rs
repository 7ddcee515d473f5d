//! Runs scenarios: rendering, tracking, measuring, comparing and gating.
//!
//! [`run()`] renders, tracks and measures a scenario; [`render()`], [`track_set`] and [`evaluate_run`] do these steps
//! separately, with a benchmark set on disk, and give the same numbers.
//!
//! ```no_run
//! use skiagraph::artefacts::Destination;
//! use skiagraph::common::NoProgress;
//! use skiagraph::experiment::run;
//! use skiagraph::scenario::ScenarioFile;
//! let walk = ScenarioFile::built_in(&["tracker.annealed_particle_filter.particles=50".to_owned()])?;
//! let done = run(&walk, None, Destination { path: "runs/walk".as_ref(), force: false }, &NoProgress)?;
//! println!("{:.1} mm", done.record.summary.metrics["humaneva_mm"].mean);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! [`draw`] makes the set of a scenario, whose blind side is read for tracking, and whose truth is read for measuring:
//!
//! ```
//! use skiagraph::benchmark_set::{BlindSet, TruthSet};
//! use skiagraph::common::NoProgress;
//! use skiagraph::experiment::draw;
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
mod baseline_history;
mod bound;
mod bound_noise;
mod bound_output;
mod bound_scene;
pub(crate) mod calibrating;
mod check;
mod comparison;
pub(crate) mod cost;
mod export;
mod faults;
mod figure_files;
mod gating;
mod key_source;
mod ladder;
mod made_by;
mod memory;
mod metamorphic;
mod more_seeds;
mod nearest_training_pose;
mod observing;
mod oracle;
mod overlaid_runs;
mod pictures;
mod placement;
pub(crate) mod program_tracking;
mod rendering;
pub(crate) mod run;
mod run_picture;
pub(crate) mod run_reading;
mod same_set;
mod seed_advice;
pub(crate) mod seed_plan;
mod segmenting;
pub(crate) mod set_of_run;
mod set_tracking;
mod tracker_check;
mod tracker_factory;
pub(crate) mod tracking;
pub(crate) mod truth_descent;
pub(crate) mod unfinished_run;
mod unfinished_set;
mod unseen;
mod verification;
mod video;

pub use baseline::{BASELINES, Baseline, Listed, Saved};
pub use baseline_history::baseline_versions;
pub use bound::{BoundOptions, BoundReport, ComparedRun, ErrorBound, FrameBound, JointBound, SourceBound, bound};
pub use bound_output::write_bound;
pub use bound_scene::BoundScene;
pub use check::{CheckReport, check, unusable_files};
pub use comparison::{COMPARISON_FILE, COMPARISON_PAGE, Compared, MethodComparison, MethodRecord, compare};
pub use cost::RunCost;
pub use export::{ExportTo, export_set};
pub use faults::{FaultReport, FaultVerdict, PlantedFault, fault_names};
pub(crate) use faults::{faults_markdown, faults_source, faults_text, plant_faults};
pub use figure_files::{stored_figures, write_figures};
pub use gating::{GATE_FILE, check_metric, gate_run, read_rules};
pub use key_source::KeySource;
pub use ladder::LadderProgress;
pub use made_by::RunPlace;
pub use metamorphic::Relation;
pub use more_seeds::{add_missing_seeds, add_seeds};
pub use overlaid_runs::{figures_of_runs, overlaid_runs};
pub use placement::{Candidates, ChosenCamera, Placement, PlacementOptions, place, write_placement};
pub use rendering::{RenderOptions, draw, render, render_with};
pub use run::{Evaluated, RunOutcome, evaluate_run, run};
pub use run_picture::run_picture;
pub use run_reading::{ComparedSide, SidesToCompare, compare_sides, read_runs};
pub use seed_plan::{NeededSeeds, SeedPlan, SeedPower, plan_seeds};
pub use segmenting::{SEGMENT_FILE, SegmentInput, Segmented, SegmentedFrom, segment};
pub use set_of_run::MoreOf;
pub use set_tracking::{check_program, track_set, track_set_calibrating, track_set_with_program};
pub use tracker_check::{RelationCheck, TrackerCheck, check_tracker};
pub use tracking::track;
pub use verification::verify_set;
