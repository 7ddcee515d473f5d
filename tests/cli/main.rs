//! The command line as its users meet it.

mod bad_input;
mod check;
mod contact;
mod inspect;
mod options;
mod props;
mod robots;
mod same_numbers;
mod sandbox;
mod scenarios;
#[path = "../support/mod.rs"]
mod support;
mod train;
mod verify;
