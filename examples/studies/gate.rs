//! The reliability of the regression gate: regenerates `results/gate.md` and `results/gate.json`.
//!
//! `cargo run --release --example studies -- gate`. The first part draws runs whose true difference is known
//! (`simulated.rs`, and with errors that are skewed or a mixture `shapes.rs`), the second gates real runs of the
//! default tracker with known defects (`real.rs`). `SKIAGRAPH_GATE=simulated` or `=real` runs only that part and takes
//! the other from `results/gate.json`; `=page` only writes the page again.

mod page;
mod real;
mod shapes;
mod simulated;

use std::error::Error;
use std::path::Path;

use serde::{Deserialize, Serialize};

#[derive(Serialize, Deserialize)]
pub(crate) struct Study {
    pub(crate) simulated: simulated::Simulated,
    pub(crate) shapes: Option<shapes::Shapes>,
    pub(crate) real: Option<real::Real>,
}

/// Runs both parts.
pub(crate) fn study() -> Result<(), Box<dyn Error>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("results");
    let json = folder.join("gate.json");
    let wanted = std::env::var("SKIAGRAPH_GATE").unwrap_or_default();
    let is_skipped = |part: &str| !wanted.is_empty() && wanted != part;
    let old: Option<Study> = if is_skipped("simulated") || is_skipped("real") {
        Some(serde_json::from_slice(&std::fs::read(&json)?)?)
    } else {
        None
    };
    let (old_simulated, old_shapes, old_real) =
        old.map_or((None, None, None), |old| (Some(old.simulated), old.shapes, old.real));
    let simulated = old_simulated.filter(|_| is_skipped("simulated")).unwrap_or_else(simulated::run);
    let shapes = if is_skipped("simulated") { old_shapes } else { Some(shapes::run()) };
    let real = if is_skipped("real") { old_real } else { Some(real::run()?) };
    let study = Study { simulated, shapes, real };
    std::fs::write(&json, serde_json::to_string_pretty(&study)? + "\n")?;
    std::fs::write(folder.join("gate.md"), page::render(&study))?;
    Ok(())
}
