//! Every parser on thousands of damaged files: a short run in every `cargo test`, a longer one in `.ci/run`.
//!
//! `SKIAGRAPH_FUZZ_SECONDS` is the time for each parser (default 0.3), `SKIAGRAPH_FUZZ_SEED` the random seed (default
//! 0). An input that makes a parser panic is kept in `target/fuzz/`. `fuzz/` holds the same targets for libFuzzer,
//! which is guided by coverage and finds more; `SKIAGRAPH_FUZZ_CORPUS=DIR` writes its initial corpus.

#[path = "../support/c3d.rs"]
#[allow(dead_code, reason = "another test writes the other kinds")]
mod c3d;
#[path = "../support/glb.rs"]
mod glb;
mod mutation;
mod seeds;
#[path = "../support/mod.rs"]
mod support;
#[allow(unreachable_pub, reason = "fuzz/ builds it as a library")]
mod targets;

use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use mutation::{Draw, mutated};
use targets::{TARGETS, Target};

/// The most time for one input of at most 128 KiB, even without optimisation on a busy machine.
const MAX_TIME_PER_INPUT: Duration = Duration::from_secs(20);

fn number(variable: &str, default: f64) -> f64 {
    std::env::var(variable).map_or(default, |text| text.parse().unwrap_or_else(|_| panic!("{variable}={text}")))
}

/// Keeps an input that made a parser fail; its path.
fn keep(target: &str, kind: &str, input: &[u8]) -> PathBuf {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/fuzz");
    fs::create_dir_all(&folder).unwrap();
    let path = folder.join(format!("{target}.{kind}"));
    fs::write(&path, input).unwrap();
    path
}

/// Runs a target on its seeds, then on mutations of them until the time is up.
fn smoke(name: &str) {
    let target: Target = TARGETS.iter().find(|(known, _)| *known == name).unwrap().1;
    let seeds = seeds::seeds_for(name);
    let mut draw = Draw(number("SKIAGRAPH_FUZZ_SEED", 0.0) as u64);
    let seconds = Duration::from_secs_f64(number("SKIAGRAPH_FUZZ_SECONDS", 0.3));
    let begin = Instant::now();
    let (mut runs, mut slowest) = (0_u64, Duration::ZERO);
    while runs < seeds.len() as u64 || begin.elapsed() < seconds {
        let input = seeds.get(runs as usize).cloned().unwrap_or_else(|| mutated(&mut draw, &seeds));
        let before = Instant::now();
        // after an abort or a stack overflow, this is the only trace
        if seconds > Duration::from_secs(5) && runs.is_multiple_of(16) {
            keep(name, "draw", format!("run {runs}, draw {}", draw.0).as_bytes());
        }
        if catch_unwind(AssertUnwindSafe(|| target(&input))).is_err() {
            panic!("{name}: run {runs} panicked; the input is in {}", keep(name, "crash", &input).display());
        }
        slowest = slowest.max(before.elapsed());
        if before.elapsed() > MAX_TIME_PER_INPUT {
            panic!("{name}: run {runs} took {slowest:?}; the input is in {}", keep(name, "slow", &input).display());
        }
        runs += 1;
    }
    eprintln!("{name}: {runs} runs in {:.0} s, slowest {slowest:.2?}", begin.elapsed().as_secs_f64());
}

macro_rules! smoke_tests {
    ($($name:ident)*) => {
        mod every_input_is_read_or_rejected {
            $(#[test] fn $name() { super::smoke(stringify!($name)); })*
        }
        #[test]
        fn every_target_is_run_here_and_has_a_file_in_fuzz() {
            let named = [$(stringify!($name)),*];
            assert_eq!(TARGETS.map(|(name, _)| name), named);
            let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/fuzz_targets");
            if folder.exists() {
                let files = fs::read_dir(folder).unwrap().map(|e| e.unwrap().path().file_stem().unwrap().to_str().unwrap().to_owned());
                let mut files: Vec<String> = files.collect();
                let mut named = named.map(str::to_owned);
                files.sort();
                named.sort();
                assert_eq!(files, named);
            }
        }
    };
}
smoke_tests!(bvh asf amc deepmimic amass c3d trc urdf obj stl collada gltf scenario manifest cameras camera_files body npz poses model);

#[test]
fn seeds_are_accepted_and_written_to_the_requested_folder() {
    let corpus = std::env::var_os("SKIAGRAPH_FUZZ_CORPUS").map(PathBuf::from);
    for (name, target) in TARGETS {
        for (index, seed) in seeds::seeds_for(name).iter().enumerate() {
            target(seed);
            if let Some(corpus) = &corpus {
                fs::create_dir_all(corpus.join(name)).unwrap();
                fs::write(corpus.join(name).join(format!("seed{index:02}")), seed).unwrap();
            }
        }
    }
}
