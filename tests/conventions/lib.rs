//! Checks that read source files and pages without building the program, so that they fail within seconds.

#![cfg(test)]

mod interface;
mod layering;
mod text;

use std::path::Path;

fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
}
