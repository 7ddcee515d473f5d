//! The command line, as users run it.

mod blindfold;
mod bring_your_data;
mod browser;
mod calibration;
mod check;
mod colour;
mod compare;
mod contact;
mod corruption;
mod distractors;
mod documentation;
mod drawn_bodies;
mod existing_outputs;
mod explain;
mod export;
mod external_estimates;
mod faults;
mod figures;
mod filming;
mod footage;
#[cfg(unix)]
mod forgery;
mod gate;
#[path = "../support/glb.rs"]
mod glb;
mod hints;
mod keypoints;
mod keys;
mod marker_files;
mod memory;
mod options;
mod outputs;
mod own_bodies;
mod poses;
#[cfg(unix)]
mod program;
#[cfg(unix)]
mod programs;
mod props;
mod public_sets;
mod resume;
#[cfg(unix)]
mod resume_run;
mod rig;
mod robots;
#[cfg(unix)]
mod run_program;
mod same_numbers;
mod sandbox;
mod scenarios;
mod scene_images;
mod segment;
#[cfg(target_os = "linux")]
mod sessions;
mod set_formats;
mod set_page;
#[path = "../support/mod.rs"]
mod support;
mod sweep;
mod train;
mod twin;
mod units;
mod verdicts;
