//! Ground contact of real walks at 120, 60 and 30 Hz: prints the tables of `results/contact.md`, and fails if a walk
//! exceeds its limits.
//!
//! `SKIAGRAPH_MOCAP=DIR cargo run --release --example studies -- contact`, where DIR holds CMU's 49_01, 16_15, 16_17,
//! 16_22, 02_01, 35_02, 35_08 and 35_34, eight other takes that are not regular walks, and their skeletons. Takes some
//! minutes. Without DIR nothing is run.

#[path = "../../tests/support/walks.rs"]
mod walks;

use std::error::Error;
use std::path::PathBuf;

use walks::{OTHERS, RATES, WALKS};

pub(crate) fn study() -> Result<(), Box<dyn Error>> {
    let Some(folder) = std::env::var_os("SKIAGRAPH_MOCAP").map(PathBuf::from) else {
        eprintln!("SKIPPED: set SKIAGRAPH_MOCAP to a folder with CMU's takes and their .asf files");
        return Ok(());
    };
    let mut missed: Vec<String> = Vec::new();
    println!("| clip | stances | 120 and 60 Hz | 120 and 30 Hz | 60 and 30 Hz |\n|---|---|---|---|---|");
    for name in WALKS {
        let found = walks::same_stances(&folder, name);
        println!("{}", found.line);
        missed.extend((!found.is_same).then(|| format!("{name}: stances differ between rates")));
    }
    println!("\nPrinted only: the rule was worked out on walks.\n");
    OTHERS.iter().for_each(|name| println!("{}", walks::same_stances(&folder, name).line));
    println!(
        "\n| clip | Hz | frames | skate mm/s | in the original stances | penetration mm | float mm | joints moved mm | most |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    for (name, fps) in WALKS.into_iter().flat_map(|name| RATES.map(|fps| (name, fps))) {
        let (line, shortcomings) = walks::planted(&folder, name, fps);
        println!("{line}");
        missed.extend(shortcomings);
    }
    if missed.is_empty() { Ok(()) } else { Err(missed.join("\n").into()) }
}
