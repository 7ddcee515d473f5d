//! The command line, as users run it.

mod bad_input;
mod baseline_history;
mod blindfold;
mod browser;
mod calibration;
mod check;
mod claimed_numbers;
mod clear_errors;
mod colour;
mod compare;
mod contact;
mod corruption;
mod distractors;
mod documentation;
mod drawn_bodies;
mod edited;
mod existing_outputs;
mod explain;
mod export;
mod external_estimates;
mod faults;
mod figures;
mod filming;
mod forged_sets;
#[cfg(unix)]
mod forgery;
mod gate;
mod hints;
mod inspect;
mod keypoints;
mod keys;
mod memory;
mod messages;
mod options;
mod outputs;
mod own_bodies;
mod poses;
mod program;
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
mod set_formats;
mod set_page;
mod skins;
mod strangers;
#[path = "../support/mod.rs"]
mod support;
mod sweep;
mod train;
mod units;
mod units_of_recordings;
mod verdicts;
mod verify;
