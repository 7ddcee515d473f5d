//! Skiagraph makes the truth for markerless human motion trackers, and measures them against it.

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

pub mod benchmark_set;
pub mod body;
pub mod camera;
pub mod cli;
pub mod contact;
pub mod evaluation;
pub mod experiment;
mod input;
pub mod mocap;
pub mod motion_model;
pub mod npz;
pub mod observation;
mod parallel;
pub mod physics;
pub mod raster;
pub mod report;
pub mod retarget;
pub mod rng;
pub mod scenario;
pub mod scene;
mod simd;
#[cfg(test)]
mod test_data;
pub mod tracker;
