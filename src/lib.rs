//! Skiagraph makes the truth for markerless human motion trackers, and measures them against it.

pub mod benchmark_set;
pub mod body;
pub mod camera;
pub mod cli;
pub mod evaluation;
pub mod experiment;
pub mod mocap;
pub mod motion_model;
pub mod observation;
pub mod raster;
pub mod report;
pub mod rng;
pub mod scene;
#[cfg(test)]
mod test_data;
pub mod tracker;
