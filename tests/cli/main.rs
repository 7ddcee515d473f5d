//! The command line as its users meet it.

mod bad_input;
mod browser;
mod calibration;
mod check;
mod colour;
mod compare;
mod contact;
mod corruption;
mod distractors;
mod edited;
mod export;
mod filming;
mod gate;
mod inspect;
mod options;
mod poses;
mod program;
mod props;
mod public_sets;
mod resume;
mod robots;
mod same_numbers;
mod sandbox;
mod scenarios;
mod segment;
mod skins;
#[path = "../support/mod.rs"]
mod support;
mod sweep;
mod train;
mod units;
mod verify;
