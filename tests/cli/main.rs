//! The command line as its users meet it.

mod bad_input;
mod calibration;
mod check;
mod contact;
mod corruption;
mod inspect;
mod options;
mod props;
mod robots;
mod same_numbers;
mod sandbox;
mod scenarios;
mod segment;
#[path = "../support/mod.rs"]
mod support;
mod sweep;
mod train;
mod verify;
