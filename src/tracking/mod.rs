//! Trackers on a set, seed by seed: built, calibrated and run; also other programs, and the trackers that know the
//! truth.

pub(crate) mod calibrating;
mod nearest_training_pose;
mod oracle;
pub(crate) mod program;
pub(crate) mod track;
mod tracker_factory;
pub(crate) mod truth_descent;
pub(crate) mod unfinished_run;

pub use track::track;
