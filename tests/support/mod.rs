//! What several integration tests share.
#![allow(dead_code, unused_imports, reason = "each test binary uses its own part")]

use std::path::PathBuf;
use std::process::Command;

#[path = "../../src/test_data.rs"]
mod data;

pub(crate) use data::{path as test_data, skip};

/// A Python with NumPy, or `None` (said as [`skip`] does) where there is none: `$SKIAGRAPH_TEST_PYTHON`, else
/// `python3`.
pub(crate) fn python_with_numpy() -> Option<PathBuf> {
    let python = std::env::var_os("SKIAGRAPH_TEST_PYTHON").map_or_else(|| PathBuf::from("python3"), PathBuf::from);
    let has_numpy = Command::new(&python).args(["-c", "import numpy"]).output().is_ok_and(|o| o.status.success());
    if !has_numpy {
        skip(&format!("no NumPy for {} (pip install numpy, or set SKIAGRAPH_TEST_PYTHON)", python.display()));
    }
    has_numpy.then_some(python)
}
