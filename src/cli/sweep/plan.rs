//! `skiagraph sweep plan`.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use serde_json::json;

use super::super::{CommandError, output};
use super::definition::Definition;
use crate::sweep::Planned;

/// Plan a sweep: write its cells into a directory
#[derive(Args, Debug)]
#[command(
    after_help = "Examples:\n  skiagraph sweep plan scenarios/sweeps/particles-layers.toml --out sweeps/mine\n  \
                        skiagraph sweep plan scenarios/walk.toml particles=50,100 --seeds 10 --out sweeps/mine --extend\n\n\
                        DIR then has plan.json and cells.jsonl. Run it with `skiagraph sweep run DIR`, cell by cell with\n\
                        `skiagraph sweep cell DIR --index N`, or on a cluster."
)]
pub(super) struct Arguments {
    #[command(flatten)]
    definition: Definition,

    /// Directory of the sweep
    #[arg(long, value_name = "DIR")]
    out: PathBuf,

    /// Replace another plan in DIR and keep the results of cells that both have
    #[arg(long)]
    extend: bool,

    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<ExitCode, CommandError> {
    let draft = arguments.definition.draft()?;
    let planned = draft.freeze(&arguments.out, arguments.extend)?;
    let record = draft.record();
    if arguments.json {
        output::print_json(&json!({
            "schema": "skiagraph.sweep_planned/1",
            "out": arguments.out,
            "cells": record.cells,
            "settings": record.settings,
            "seeds": record.seeds,
            "sets": record.sets,
            "new": planned != Planned::Same,
        }))?;
        return Ok(ExitCode::SUCCESS);
    }
    let out = arguments.out.display();
    let what = match planned {
        Planned::New => "planned",
        Planned::Same => "was planned before",
        Planned::Replaced => "planned again; results of unchanged cells are kept",
    };
    output::print(&format!(
        "{out}: {} ({} x {}) on {}, {what}\n  run it: skiagraph sweep run {out}",
        output::counted(record.cells, "cell"),
        output::counted(record.settings, "setting"),
        output::counted(record.seeds.len(), "seed"),
        output::counted(record.sets, "set"),
    ))?;
    Ok(ExitCode::SUCCESS)
}
