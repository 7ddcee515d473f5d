//! Motion models: learned from training motions, stored in files, and shared by the trackers of a run.

mod learning;
mod model_file;
mod model_store;
mod model_training;

pub use learning::Models;
pub use model_file::{LearnedFrom, LearnedModel, MODEL_SCHEMA, ModelFacts, RobotFacts};
pub use model_training::{ClipOptions, Trained, TrainingInput, train};
