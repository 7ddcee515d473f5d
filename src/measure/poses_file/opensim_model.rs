//! Coordinates of an OpenSim model (`.mot`): OpenSim's own Python package computes the positions that follow from them.

use std::path::Path;
use std::process::{Command, Output};

use super::{PointFile, sto_file};
use crate::common::ExperimentError;
use crate::input::plain;

const SCRIPT: &str = include_str!("opensim_model.py");
/// Names of Python, in the order in which they are tried.
const PYTHONS: [&str; 2] = ["python3", "python"];

/// Positions of the model's markers, joints and bodies in every row of a motion.
///
/// # Errors
/// [`ExperimentError::Malformed`] if the model is missing, Python or its package opensim is not installed, or OpenSim
/// refuses model or motion.
pub(super) fn positions(model: &Path, motion: &Path) -> Result<PointFile, ExperimentError> {
    let malformed = |path: &Path, detail: String| ExperimentError::Malformed { path: path.to_owned(), detail };
    if !model.is_file() {
        return Err(malformed(model, "--model: there is no such file".to_owned()));
    }
    let done = run(&[model, motion]).map_err(|detail| malformed(motion, detail))?;
    let said = plain(String::from_utf8_lossy(&done.stderr).trim().lines().last().unwrap_or_default());
    match done.status.success() {
        true => sto_file::parse(&String::from_utf8_lossy(&done.stdout)).map_err(|detail| malformed(motion, detail)),
        false if said.starts_with("no module") => {
            Err(malformed(motion, format!("--model needs OpenSim's package for Python ({said}): {INSTALL}")))
        }
        false => {
            Err(malformed(motion, format!("OpenSim cannot compute positions with {}: {said}", plain(model.display()))))
        }
    }
}

const INSTALL: &str = "pip install opensim, for the python3 that is first on the PATH";

/// Runs the script with the first Python that is installed.
fn run(arguments: &[&Path]) -> Result<Output, String> {
    for python in PYTHONS {
        match Command::new(python).arg("-c").arg(SCRIPT).args(arguments).output() {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {}
            done => return done.map_err(|error| format!("cannot run {python}: {error}")),
        }
    }
    Err(format!("--model needs Python and OpenSim's package for it: {INSTALL}"))
}
