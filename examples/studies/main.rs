//! Coverage of the intervals of a mean over seeds: regenerates `results/intervals.md` and `results/intervals.json`.
//!
//! ```sh
//! cargo run --release --example studies -- intervals
//! ```
//!
//! A test of the program reads the numbers of this study. Those behind the other pages of `results/` are in the commits
//! that the pages name.

mod error_shapes;
mod interval_rules;
mod intervals;

use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    match std::env::args().nth(1).as_deref() {
        Some("intervals") => intervals::study(),
        Some(other) => Err(format!("there is no study `{other}`, only intervals").into()),
        None => {
            println!("intervals: coverage of 95 % intervals, results/intervals.md");
            Ok(())
        }
    }
}
