//! How far the regression gate can be trusted: regenerates `results/gate.md` and `results/gate.json`.
//!
//! `cargo run --release --example studies -- gate`. The first part draws runs whose true difference is known
//! (`simulated.rs`), the second gates real runs of the default tracker with known defects (`real.rs`);
//! `SKIAGRAPH_GATE=simulated` leaves the second part as `results/gate.json` has it.

mod page;
mod real;
mod simulated;

use std::error::Error;
use std::path::Path;

use serde::{Deserialize, Serialize};

#[derive(Serialize, Deserialize)]
pub(crate) struct Study {
    pub(crate) simulated: simulated::Simulated,
    pub(crate) real: Option<real::Real>,
}

/// Both parts.
pub(crate) fn study() -> Result<(), Box<dyn Error>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("results");
    let json = folder.join("gate.json");
    let simulated = simulated::run();
    let real = match std::env::var("SKIAGRAPH_GATE").as_deref() {
        Ok("simulated") => std::fs::read(&json)
            .ok()
            .and_then(|bytes| serde_json::from_slice(&bytes).ok())
            .and_then(|old: Study| old.real),
        _ => Some(real::run()?),
    };
    let study = Study { simulated, real };
    std::fs::write(&json, serde_json::to_string_pretty(&study)? + "\n")?;
    std::fs::write(folder.join("gate.md"), page::render(&study))?;
    Ok(())
}
